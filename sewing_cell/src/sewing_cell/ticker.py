# SPDX-License-Identifier: BSD-3-Clause
"""Acts at absolute deadlines of the monotonic clock, in a thread."""

from __future__ import annotations

import threading
from typing import Callable, Optional

from process_visualizer.nodes.common.node_handle import NodeHandle


class Ticker:
    """Calls ``action(tick, late_s)`` at ``start_s + tick / rate_hz`` of the node's monotonic clock.

    ``tick`` is 0, 1, ..., and ``late_s`` says how long ago it was due.  Ticks that are over when
    their turn comes are skipped, and ``on_skip(count)`` is told.  An exception ends the ticking and
    is given to ``on_failure``.
    """

    def __init__(
        self,
        node: NodeHandle,
        name: str,
        rate_hz: float,
        action: Callable[[int, float], None],
        on_skip: Callable[[int], None],
        on_failure: Callable[[Exception], None],
    ) -> None:
        self._node, self._rate_hz, self._start_s = node, rate_hz, 0.0
        self._action, self._on_skip, self._on_failure = action, on_skip, on_failure
        self._tick, self._stopped = 0, False
        self._acting = threading.RLock()  # an action may stop its own ticker
        self._worker = node.worker(self._step, name)

    def start(self, start_s: float) -> None:
        """Begin ticking; tick 0 is due at ``start_s`` of the monotonic clock."""
        self._start_s = start_s
        self._worker.wake()

    def stop(self, timeout_s: float = 0.3) -> None:
        """Stop at once, and wait until an action that is under way is over, but no longer."""
        self._stopped = True
        if self._acting.acquire(timeout=timeout_s):
            self._acting.release()

    def _step(self) -> Optional[float]:
        """Act if it is time; return how long to wait [s], None for ever."""
        with self._acting:
            if self._stopped:
                return None
            now_s = self._node.monotonic_s()
            if now_s >= self._due_s():
                try:
                    self._act(now_s)
                except Exception as error:
                    self._stopped = True
                    self._on_failure(error)
            return max(0.0, self._due_s() - self._node.monotonic_s())

    def _act(self, now_s: float) -> None:
        newest = int((now_s - self._start_s) * self._rate_hz)
        if newest > self._tick:
            self._on_skip(newest - self._tick)
            self._tick = newest
        self._action(self._tick, now_s - self._due_s())
        self._tick += 1

    def _due_s(self) -> float:
        return self._start_s + self._tick / self._rate_hz
