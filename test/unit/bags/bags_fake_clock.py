# SPDX-License-Identifier: BSD-3-Clause
"""Fake clock for tests: it advances only on command or during a wait."""
import threading
from collections import deque
from typing import Callable, Deque

from process_visualizer.playback.timeline import Clock

WALL_NS = 1_800_000_000_000_000_000


class FakeClock(Clock):
    """Clock whose waits take exactly the requested time or run the next scripted interruption."""

    def __init__(self) -> None:
        self.now_ns = 5_000_000_000
        self.wall_offset_ns = WALL_NS
        self.waits = 0
        self.interruptions: Deque[Callable[[], object]] = deque()

    def monotonic_ns(self) -> int:
        return self.now_ns

    def wall_ns(self) -> int:
        return self.now_ns + self.wall_offset_ns

    def wait(self, condition: threading.Condition, timeout_ns: int) -> None:
        self.waits += 1
        if self.interruptions:
            self.interruptions.popleft()()
        else:
            self.now_ns += timeout_ns
