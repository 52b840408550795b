# SPDX-License-Identifier: BSD-3-Clause
"""The elapsed time of a recording between two states of the recorder."""
from __future__ import annotations

from typing import NamedTuple

_LONGEST_S = 1.5
"""The recorder tells its state every half second; a clock that runs on without it would lie."""


class RecordingClock(NamedTuple):
    """Goes on from the last state; within a recording it never goes back.

    ``duration_s`` was told at the time ``taken_s`` of a monotonic clock; while the clock runs,
    ``shown_s`` is the least that it may show.
    """

    duration_s: float = 0.0
    is_running: bool = False
    taken_s: float = 0.0
    shown_s: float = 0.0

    def updated(self, duration_s: float, is_running: bool, now_s: float) -> 'RecordingClock':
        """Return the clock after the recorder told a duration, and whether it grows."""
        shown_s = self.elapsed_s(now_s) if is_running else duration_s
        return RecordingClock(duration_s, is_running, now_s, shown_s)

    def elapsed_s(self, now_s: float) -> float:
        """Return the elapsed time."""
        passed_s = min(now_s - self.taken_s, _LONGEST_S) if self.is_running else 0.0
        return max(self.shown_s, self.duration_s + passed_s)
