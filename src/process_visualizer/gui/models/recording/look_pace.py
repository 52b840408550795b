# SPDX-License-Identifier: BSD-3-Clause
"""The pace of live curves: drawn as often as a small share of a core allows."""
from __future__ import annotations

MOST_SHARE = 0.08
"""Of a core, for reading and drawing; many curves on a slow computer come less often."""
_CALM_SHARE = 0.75 * MOST_SHARE  # below this it may be faster again
_STEP = 1.2
LONGEST_MS = 500


class LookPace:
    """Lengthens the period while looks cost more than their share, and shortens it again."""

    def __init__(self) -> None:
        self._factor = 1.0

    def period_ms(self, wanted_ms: int, spent_s: float, elapsed_s: float) -> int:
        """Return how long to wait until the next look.

        ``spent_s`` is the processor time of the last look and its picture, ``elapsed_s`` the time
        from that look to this one.
        """
        share = spent_s / elapsed_s if elapsed_s > 0.0 else 0.0
        if share > MOST_SHARE:
            self._factor *= _STEP
        elif share < _CALM_SHARE:
            self._factor /= _STEP
        self._factor = min(max(self._factor, 1.0), max(LONGEST_MS / wanted_ms, 1.0))
        return round(wanted_ms * self._factor)
