"""What was given to the output before it is due, so that it can be taken back."""
from __future__ import annotations

from collections import deque
from typing import Deque, NamedTuple

from process_visualizer.bags.playback_event import PlaybackEvent


class Scheduled(NamedTuple):
    """An event that was given to the output before it is due."""

    event: PlaybackEvent
    position: int
    step: int  # FORWARD or BACKWARD
    due_ns: int  # monotonic
    stamps: int  # StampMapping.remembered before it


class Schedule:
    """Events in the order in which they are due."""

    def __init__(self) -> None:
        self._events: Deque[Scheduled] = deque()
        self._bytes = 0

    @property
    def bytes(self) -> int:
        """How much memory the messages take, roughly."""
        return self._bytes

    def add(self, scheduled: Scheduled) -> None:
        """Add what is due next."""
        self._events.append(scheduled)
        self._bytes += scheduled.event.size

    def forget_due(self, now_ns: int) -> None:
        """Forget what has been due before a monotonic time [ns]: it cannot be taken back."""
        while self._events and self._events[0].due_ns < now_ns:
            self._bytes -= self._events.popleft().event.size

    def pop(self) -> Scheduled:
        """Take back what was added last."""
        scheduled = self._events.pop()
        self._bytes -= scheduled.event.size
        return scheduled
