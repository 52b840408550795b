# SPDX-License-Identifier: BSD-3-Clause
"""The achieved rate: time that went into playing, and time lost to slips."""
from __future__ import annotations

from collections import deque
from typing import Deque, Tuple

WINDOW_NS = 1_000_000_000


class AchievedRate:
    """The share of the rate that was kept within a short window up to now."""

    def __init__(self, now_ns: int) -> None:
        """Begin at a monotonic time [ns]."""
        self.restart(now_ns)

    def restart(self, now_ns: int) -> None:
        """Forget what was, as a command has changed it."""
        self._begin_ns = now_ns
        self._losses: Deque[Tuple[int, int]] = deque()  # when lost [ns], how long up to then [ns]

    def lose(self, now_ns: int, late_ns: int) -> None:
        """Note that play slipped by a time [ns], just now."""
        self._losses.append((now_ns, late_ns))
        self._forget(now_ns)

    def share(self, now_ns: int) -> float:
        """Return the share (0 to 1) of the window that was not lost."""
        self._forget(now_ns)
        begin_ns = max(self._begin_ns, now_ns - WINDOW_NS)
        if now_ns <= begin_ns:
            return 1.0
        lost_ns = sum(min(late_ns, lost_at_ns - begin_ns) for lost_at_ns, late_ns in self._losses)
        return max(0.0, 1.0 - lost_ns / (now_ns - begin_ns))

    def _forget(self, now_ns: int) -> None:
        while self._losses and self._losses[0][0] <= now_ns - WINDOW_NS:
            self._losses.popleft()
