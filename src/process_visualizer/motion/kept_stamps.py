# SPDX-License-Identifier: BSD-3-Clause
"""Stamps of a sensor on this computer's clock: when the data was taken, not when it arrived."""
from __future__ import annotations

MAX_AGE_NS = 1_000_000_000
"""Of a stamp when its message arrives; tf2 forgets after 10 s. Older ones are of another clock."""


class KeptStamps:
    """Keeps the stamps of one topic, or moves them by a common shift if their clock is another one.

    With a shift the differences between stamps are still those of the sensor; the message that took
    the shortest way counts as having taken no time. No stamp is later than its arrival, and none
    earlier by more than ``MAX_AGE_NS``, so RViz and tf2 accept all of them.
    """

    def __init__(self) -> None:
        self._shift_ns = 0

    def stamp(self, stamp_ns: int, arrival_ns: int) -> int:
        """Return the stamp [ns] to use for a message with a stamp; 0 stands for no stamp."""
        if stamp_ns == 0:
            return arrival_ns
        if not _is_plausible(stamp_ns + self._shift_ns, arrival_ns):
            is_same_clock = _is_plausible(stamp_ns, arrival_ns)
            self._shift_ns = 0 if is_same_clock else arrival_ns - stamp_ns
        return stamp_ns + self._shift_ns


def _is_plausible(stamp_ns: int, arrival_ns: int) -> bool:
    return 0 <= arrival_ns - stamp_ns <= MAX_AGE_NS
