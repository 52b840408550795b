# SPDX-License-Identifier: BSD-3-Clause
"""The elapsed time of a recording between two states of the recorder."""
from __future__ import annotations

from typing import Callable

_LONGEST_S = 1.5
"""The recorder tells its state every half second; a clock that runs on without it would lie."""


class RecordingClock:
    """Goes on from the last state; within a recording it never goes back."""

    def __init__(self, now_s: Callable[[], float]) -> None:
        """Take a monotonic clock [s]."""
        self._now_s = now_s
        self._taken_s = now_s()
        self._duration_s = 0.0
        self._is_running = False
        self._shown_s = 0.0

    def restart(self) -> None:
        """A recording begins now."""
        self._shown_s = 0.0
        self.take(0.0, True)

    def take(self, duration_s: float, is_running: bool) -> None:
        """Take the duration that the recorder tells, and whether it grows."""
        if not is_running:
            self._shown_s = duration_s
        self._duration_s, self._is_running = duration_s, is_running
        self._taken_s = self._now_s()

    def elapsed_s(self) -> float:
        """The elapsed time now."""
        passed_s = min(self._now_s() - self._taken_s, _LONGEST_S) if self._is_running else 0.0
        self._shown_s = max(self._shown_s, self._duration_s + passed_s)
        return self._shown_s
