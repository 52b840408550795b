# SPDX-License-Identifier: BSD-3-Clause
"""The clocks that playback runs by; tests put one of their own in its place."""
from __future__ import annotations

import threading
import time
from concurrent.futures import Future
from typing import TypeVar

Result = TypeVar('Result')

LONGEST_WAIT_S = 3600.0  # threading refuses what does not fit its own time type


class Clock:
    """The computer's clocks."""

    def monotonic_ns(self) -> int:
        """Return a time [ns] that only ever grows, evenly."""
        return time.monotonic_ns()

    def wall_ns(self) -> int:
        """Return the time of day [ns since 1970], which may be set."""
        return time.time_ns()

    def wait(self, condition: threading.Condition, timeout_ns: int) -> None:
        """Wait for a notification, at most for a time [ns]; the condition's lock is held."""
        condition.wait(min(timeout_ns * 1e-9, LONGEST_WAIT_S))

    def result(self, answer: Future[Result], timeout_s: float) -> Result:
        """Wait for the answer of another thread, at most for a time [s]; return or raise it.

        Raises:
            concurrent.futures.TimeoutError: it has not come.
        """
        return answer.result(timeout_s)
