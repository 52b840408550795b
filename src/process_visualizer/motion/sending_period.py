"""The period of a driver, from the times at which its messages arrive."""
from __future__ import annotations

from collections import deque
from typing import Deque

BLOCK = 16  # messages: intervals over so many are even, although some came late or in bunches
_MEMORY = 8 * BLOCK
_MOST_SPREAD = 0.2  # of the middle half of the blocks; more is no period


class SendingPeriod:
    """Watches arrival times; messages that came late do not disturb it, nor do a few lost ones."""

    def __init__(self) -> None:
        self._times: Deque[float] = deque(maxlen=_MEMORY + 1)
        self._countdown = BLOCK
        self._period_s = 0.0

    def reset(self) -> None:
        """Forget the times, but not the period: the driver is the same."""
        self._times.clear()

    def add(self, time_s: float) -> float:
        """Add an arrival; return the period [s], 0 while there is none that can be relied on."""
        self._times.append(time_s)
        self._countdown -= 1
        if self._countdown <= 0 and len(self._times) >= 4 * BLOCK:
            self._countdown = BLOCK
            self._update()
        return self._period_s

    def _update(self) -> None:
        times = list(self._times)
        blocks = sorted(abs(later - sooner) / BLOCK
                        for sooner, later in zip(times, times[BLOCK:]))
        median = blocks[len(blocks) // 2]
        spread = blocks[3 * len(blocks) // 4] - blocks[len(blocks) // 4]
        self._period_s = median if spread <= _MOST_SPREAD * median else 0.0
