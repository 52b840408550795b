# SPDX-License-Identifier: BSD-3-Clause
"""Periodic calls in an event loop, which continue when the computer's clock is set.

tornado's PeriodicCallback uses the time of day: if that is set back by an hour, it waits an hour.
"""
from __future__ import annotations

import time
from typing import Any, Callable

from tornado.ioloop import IOLoop


class Ticks:
    """Calls a function in a loop once in a period, from ``start`` to ``stop``."""

    def __init__(self, loop: IOLoop, act: Callable[[], None], period_s: float) -> None:
        """Exceptions raised by ``act`` are logged by the loop, and do not end the calls."""
        self._loop, self._act, self._period_s = loop, act, period_s
        self._next_s = 0.0
        self._handle: Any = None

    def start(self) -> None:
        """Begin to call."""
        self._next_s = time.monotonic()
        self._wait()

    def stop(self) -> None:
        """End the calls."""
        if self._handle is not None:
            self._loop.remove_timeout(self._handle)
        self._handle = None

    def _wait(self) -> None:
        now_s = time.monotonic()
        self._next_s = max(self._next_s + self._period_s, now_s)  # late calls are not made up for
        self._handle = self._loop.call_later(self._next_s - now_s, self._call)

    def _call(self) -> None:
        self._wait()
        self._act()
