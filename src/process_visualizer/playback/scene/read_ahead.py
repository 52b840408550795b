# SPDX-License-Identifier: BSD-3-Clause
"""Reads what will be played next before it is due, up to a number of bytes."""
from __future__ import annotations

import threading
from collections import deque
from typing import Deque, Optional

from process_visualizer.playback.scene.playback_event import EventMaker, PlaybackEvent

FORWARD = 1
BACKWARD = -1


class ReadAhead:
    """The events from a position onwards, in one direction, made by a thread of its own.

    It begins with the first ``take``, and again where that is not for the next event in line.
    """

    def __init__(self, events: EventMaker, count: int, limit_bytes: int = 32 << 20) -> None:
        """Take the maker of events and how many messages there are."""
        self._events = events
        self._count = count
        self._limit_bytes = limit_bytes
        self._changed = threading.Condition()
        self._ready: Deque[PlaybackEvent] = deque()
        self._ready_bytes = 0
        self._first = self._next = -1  # positions: of the first ready event, and to be read next
        self._step = FORWARD
        self._run = 0  # grows at each restart
        self._closed = False
        self._failure: Optional[Exception] = None
        self._thread = threading.Thread(target=self._read, name='read ahead', daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End the thread."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()
        self._thread.join()

    @property
    def ready_bytes(self) -> int:
        """Return how much has been read and not been taken yet."""
        return self._ready_bytes

    def take(self, position: int, step: int) -> PlaybackEvent:
        """Return the event of passing the message at a position FORWARD or BACKWARD.

        What has ended the thread is raised here.
        """
        with self._changed:
            if self._failure is not None:
                raise self._failure
            if self._ready and (position, step) == (self._first, self._step):
                return self._pop()
            self._restart(position + step, step)
        return self._make(position, step)

    def put_back(self, position: int, step: int, event: PlaybackEvent) -> None:
        """Give back the event that was taken last, to be taken again."""
        with self._changed:
            if (position + step, step) == (self._first, self._step):
                self._ready.appendleft(event)
                self._ready_bytes += event.size
                self._first = position

    def begin(self, position: int, step: int) -> None:
        """Begin to read at a position, as that is where ``take`` will go on."""
        with self._changed:
            self._restart(position, step)

    def _pop(self) -> PlaybackEvent:
        event = self._ready.popleft()
        self._ready_bytes -= event.size
        self._first += self._step
        self._changed.notify_all()  # read on now, when the next message is not due yet
        return event

    def _restart(self, position: int, step: int) -> None:
        self._ready.clear()
        self._ready_bytes = 0
        self._first = self._next = position
        self._step = step
        self._run += 1
        self._changed.notify_all()

    def _make(self, position: int, step: int) -> PlaybackEvent:
        make = self._events.forward if step == FORWARD else self._events.backward
        return make(position)

    def _has_room(self) -> bool:
        within = 0 <= self._next < self._count
        return self._closed or (within and self._ready_bytes < self._limit_bytes)

    def _read(self) -> None:
        try:
            self._read_until_closed()
        except Exception as error:  # whatever it is: ``take`` raises it
            self._failure = error

    def _read_until_closed(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(self._has_room)
                if self._closed:
                    return
                position, step, run = self._next, self._step, self._run
            event = self._make(position, step)
            with self._changed:
                if run == self._run:
                    self._ready.append(event)
                    self._ready_bytes += event.size
                    self._next += step
