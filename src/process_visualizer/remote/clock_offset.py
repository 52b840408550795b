# SPDX-License-Identifier: BSD-3-Clause
"""The offset of another computer's clock, by its quickest answers."""
from __future__ import annotations

from collections import deque
from typing import Deque, Tuple

_LATEST = 30
_NS_PER_S = 1e9


class ClockOffset:
    """Takes answers; of the latest ones the quickest counts, as it says most."""

    def __init__(self) -> None:
        """Nothing is known."""
        self._answers: Deque[Tuple[float, float]] = deque(maxlen=_LATEST)

    def take(self, asked_ns: int, there_ns: int, answered_ns: int) -> None:
        """Take an answer: when it was asked for and came here, the time there [ns]."""
        if answered_ns < asked_ns:  # the clock was set back meanwhile
            return
        between_ns = (asked_ns + answered_ns) // 2
        self._answers.append(((answered_ns - asked_ns) / _NS_PER_S,
                              (there_ns - between_ns) / _NS_PER_S))

    @property
    def is_known(self) -> bool:
        """Return whether there is an answer."""
        return bool(self._answers)

    @property
    def answer_s(self) -> float:
        """Return how long the quickest answer took [s]; 0 if there is none."""
        return min(self._answers)[0] if self._answers else 0.0

    @property
    def ahead_s(self) -> float:
        """Return how far the other clock is ahead of this one [s]; 0 if nothing is known."""
        return min(self._answers)[1] if self._answers else 0.0
