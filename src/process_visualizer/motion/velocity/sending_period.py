# SPDX-License-Identifier: BSD-3-Clause
"""The period of a driver, from the times at which its messages arrive."""
from __future__ import annotations

from collections import deque
from typing import Deque

BLOCK = 20  # messages: intervals over so many are even, although some came late or in bunches
_MEMORY = 16 * BLOCK
_LEAST = 10 * BLOCK
_LATELY = 8 * BLOCK
_MOST_SPREAD = 0.2  # from short blocks to the middle one; more is no period


class SendingPeriod:
    """Watches arrival times; messages that came late do not disturb it, nor do a few lost ones."""

    def __init__(self) -> None:
        self._times: Deque[float] = deque(maxlen=_MEMORY + 1)
        self._countdown = BLOCK
        self._period_s = 0.0

    @property
    def period_s(self) -> float:
        """The period [s]; 0 while there is none that can be relied on."""
        return self._period_s

    def reset(self) -> None:
        """Forget the times, but not the period: the driver is the same."""
        self._times.clear()

    def add(self, time_s: float) -> None:
        """Add an arrival."""
        self._times.append(time_s)
        self._countdown -= 1
        if self._countdown <= 0 and len(self._times) >= _LEAST:
            self._countdown = BLOCK
            self._update()

    def _update(self) -> None:
        times = list(self._times)
        lately_s = abs(times[-1] - times[-1 - _LATELY]) / _LATELY
        if lately_s < 0.75 * self._period_s:  # longer than any bunch: the driver is faster now
            self._times.clear()
            self._period_s = 0.0
            return
        blocks = sorted(abs(later - sooner) / BLOCK
                        for sooner, later in zip(times, times[BLOCK:]))
        # Short ones: where messages are lost, a block is longer.
        short, middle = blocks[len(blocks) // 10], blocks[len(blocks) // 2]
        self._period_s = short if middle - short <= _MOST_SPREAD * short else 0.0
