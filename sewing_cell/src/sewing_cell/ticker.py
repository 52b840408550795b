# SPDX-License-Identifier: BSD-3-Clause
"""A thread that acts at absolute deadlines of the monotonic clock."""

from __future__ import annotations

import threading
import time
from typing import Callable, Optional


class Ticker:
    """Calls ``action(tick, late_s)`` at ``start_s + tick / rate_hz`` (``time.monotonic``).

    ``tick`` is 0, 1, ..., and ``late_s`` says how long ago it was due.  Ticks that are over when
    their turn comes are skipped, and ``on_skip(count)`` is told.  An exception ends the thread and
    is given to ``on_failure``.
    """

    def __init__(
        self,
        name: str,
        rate_hz: float,
        action: Callable[[int, float], None],
        on_skip: Callable[[int], None],
        on_failure: Callable[[Exception], None],
    ) -> None:
        self._rate_hz, self._start_s = rate_hz, 0.0
        self._action, self._on_skip, self._on_failure = action, on_skip, on_failure
        self._stopped = False
        self._condition = threading.Condition()
        self._thread = threading.Thread(target=self._run, name=name, daemon=True)

    def start(self, start_s: float) -> None:
        """Begin ticking; tick 0 is due at ``start_s`` of the monotonic clock."""
        self._start_s = start_s
        self._thread.start()

    def stop(self, timeout_s: Optional[float] = 0.3) -> None:
        """Stop at once, and wait until an action that is under way is over, but no longer."""
        with self._condition:
            self._stopped = True
            self._condition.notify_all()
        if self._thread.is_alive() and self._thread is not threading.current_thread():
            self._thread.join(timeout_s)

    def _run(self) -> None:
        try:
            tick = 0
            while self._wait_until(self._start_s + tick / self._rate_hz):
                tick = self._without_missed(tick)
                self._action(tick, time.monotonic() - self._start_s - tick / self._rate_hz)
                tick += 1
        except Exception as error:
            self._on_failure(error)

    def _wait_until(self, deadline_s: float) -> bool:
        """Wait for the deadline; False when the ticker has been stopped."""
        with self._condition:
            return not self._condition.wait_for(
                lambda: self._stopped, max(0.0, deadline_s - time.monotonic())
            )

    def _without_missed(self, tick: int) -> int:
        newest = int((time.monotonic() - self._start_s) * self._rate_hz)
        if newest > tick:
            self._on_skip(newest - tick)
            return newest
        return tick
