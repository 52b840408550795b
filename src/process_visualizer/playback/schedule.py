# SPDX-License-Identifier: BSD-3-Clause
"""Messages given to the output before they are due, so that they can be taken back."""
from __future__ import annotations

from collections import deque
from typing import Deque, Iterator, NamedTuple

from process_visualizer.playback.scene.playback_event import PlaybackEvent


class Scheduled(NamedTuple):
    """An event that was given to the output before it is due."""

    event: PlaybackEvent
    position: int
    step: int  # FORWARD or BACKWARD
    due_ns: int  # monotonic
    given: int  # how many messages the output was given before
    stamps: int  # StampMapping.remembered before it


class Schedule:
    """Events in the order in which they were given, as the output will send them."""

    def __init__(self) -> None:
        self._events: Deque[Scheduled] = deque()
        self._bytes = 0

    @property
    def bytes(self) -> int:
        """Return how much memory the messages take, roughly."""
        return self._bytes

    def add(self, scheduled: Scheduled) -> None:
        """Add what was given last; it is not sent before what was given earlier."""
        if self._events and scheduled.due_ns < self._events[-1].due_ns:
            scheduled = scheduled._replace(due_ns=self._events[-1].due_ns)
        self._events.append(scheduled)
        self._bytes += scheduled.event.size

    def forget_due(self, now_ns: int) -> None:
        """Forget what has been due before a monotonic time [ns]: it cannot be taken back."""
        while self._events and self._events[0].due_ns < now_ns:
            self._bytes -= self._events.popleft().event.size

    def taken_back(self, given: int) -> Iterator[Scheduled]:
        """Take back what was given after so many messages, the last first."""
        while self._events and self._events[-1].given >= given:
            scheduled = self._events.pop()
            self._bytes -= scheduled.event.size
            yield scheduled
