# SPDX-License-Identifier: BSD-3-Clause
"""Messages to publish when the position passes a message, in either direction."""
from __future__ import annotations

import threading
from collections import deque
from typing import Deque, Dict, FrozenSet, Iterable, Iterator, List, NamedTuple, Optional, Tuple

from process_visualizer.bagio.bag_index import BagIndex
from process_visualizer.bagio.message_definition import Connection
from process_visualizer.bagio.message_parts import (
    can_be_emptied,
    emptied,
    lasts,
    shows_markers,
)
from process_visualizer.playback.message_loader import LoadedMessage, MessageLoader, first_stamp
from process_visualizer.playback.scene import PartialMessages, Scene, SensorTimes, StaticScene

MOMENT_NS = 200_000_000
"""Time after the beginning; first messages within it count as present from the beginning on."""
_PARTNERS = 2  # earlier messages per topic that may belong to the last messages of other topics


class PlaybackEvent(NamedTuple):
    """Messages that become visible together at a bag time [ns], in the order of publishing."""

    time_ns: int
    messages: Tuple[LoadedMessage, ...]

    @property
    def published(self) -> int:
        """Return the number of messages that are published."""
        return sum(not message.withdrawn for message in self.messages)

    @property
    def size(self) -> int:
        """Return the approximate memory [bytes] used by the event."""
        return 300 + sum(300 + len(message.data) for message in self.messages)


class EventMaker:
    """Makes the events of a recording; the published messages are always the scene at the position.

    Forward, a message becomes visible when its time is reached. Backward, the message that it had
    replaced becomes visible again: the scene is as before. Topics without a message at a position
    are emptied if their type allows that.
    """

    def __init__(self, index: BagIndex, loader: MessageLoader, begin_ns: int) -> None:
        """Initialize with the index and the loader of a recording, and its beginning [bag ns]."""
        self._index = index
        self._loader = loader
        self._scene = Scene(index)
        self._partial = PartialMessages(index, loader, self._scene)
        self._sensors = SensorTimes(index, loader)
        self._moment = index.count_until(begin_ns + MOMENT_NS)
        self._static = {topic: StaticScene(loader, positions)
                        for topic, positions in self._scene.static_topics.items()}
        self._emptied_topics: Dict[str, List[LoadedMessage]] = {}
        self._marker_topics = [topic for topic in self._scene.topics
                               if shows_markers(self._connection_of(self._scene.first_of(topic)))]

    @property
    def sensors(self) -> FrozenSet[int]:
        """Return the connections of sensors."""
        return self._sensors.connections

    def forward(self, position: int) -> PlaybackEvent:
        """Return the event of passing the message at a position forward."""
        static = self._static.get(self._connection_of(position).topic)
        messages = (self._loader.load_all([position]) if static is None
                    else static.messages(position + 1))
        return PlaybackEvent(int(self._index.time_ns[position]), tuple(messages))

    def backward(self, position: int) -> PlaybackEvent:
        """Return the event of passing the message at a position backward.

        The event is just before the message's time, at which the message is still visible. The
        message that a sensor's message had replaced may become visible later (see SensorTimes).
        """
        passed = self._sensors.passed_with(position)
        messages = [message for again in passed for message in self._again(again)]
        return PlaybackEvent(int(self._index.time_ns[position]) - 1, tuple(messages))

    def scene(self, count: int, begins: bool = False) -> PlaybackEvent:
        """Return the event of jumping to the scene after ``count`` messages from any position.

        When playback only ``begins``, nothing has been published that would have to disappear.
        """
        time_ns = int(self._index.time_ns[count - 1]) if count else self._index.begin_ns
        moment = 0 if begins else self._moment
        positions = self._scene.positions(count, moment)
        positions = sorted({*positions, *self._partial.beside(positions, time_ns)})
        absent = [] if begins else self._scene.absent_topics(count, moment)
        messages = self._emptied(dict.fromkeys([*self._marker_topics, *absent]))
        messages += self._withdrawals(self._scene.latched_sources(without=positions))
        for topic in self._static:
            messages += self._static_messages(topic, max(count, moment))
        return PlaybackEvent(time_ns, tuple(messages + self._with_partners(positions)))

    def not_begun(self, bag_ns: int) -> List[str]:
        """Return the topics without a message up to a bag time [ns] that cannot be emptied."""
        absent = self._scene.absent_topics(self._index.count_until(bag_ns), self._moment)
        return [topic for topic in absent
                if not can_be_emptied(self._connection_of(self._scene.first_of(topic)))]

    def held(self, topic: str, bag_ns: int) -> List[int]:
        """Return the positions (ascending) of each joint's newest messages before a bag time [ns].

        The list is empty for a topic without joints.
        """
        if topic not in self._scene.topics:
            return []
        shown = [it for it in self._scene.positions_of(topic, self._index.count_before(bag_ns))
                 if lasts(self._connection_of(it))]
        return sorted({*shown, *self._partial.beside(shown, bag_ns)})

    def _again(self, position: int) -> List[LoadedMessage]:
        """Return the messages to show again in place of the message at a position."""
        topic = self._connection_of(position).topic
        if topic in self._static:
            return self._static_messages(topic, max(position, self._moment))
        return self._before(topic, position)

    def _before(self, topic: str, position: int) -> List[LoadedMessage]:
        """Return the messages that restore a topic as it was before the message at a position."""
        shown = self._scene.positions_of(topic, position, self._moment)
        with_markers = topic in self._marker_topics
        messages = self._emptied([topic]) if with_markers or not shown else []
        if self._connection_of(position).latching:
            gone = set(self._scene.latched_sources(without=shown))
            messages += self._withdrawals(gone.intersection([self._scene.source_of(position)]))
        return messages + self._loader.load_all(self._replaced(position, shown, with_markers))

    def _replaced(self, position: int, shown: List[int], with_markers: bool) -> List[int]:
        """Return the positions (ascending) to publish in place of the message at a position."""
        if with_markers:
            time_ns = int(self._index.time_ns[position]) - 1
            return sorted({*shown, *self._partial.beside(shown, time_ns)})
        return self._partial.replaced(position) or self._scene.shown_again(position)

    def _with_partners(self, positions: List[int]) -> List[LoadedMessage]:
        """Return the messages at some positions, and earlier ones that share a stamp with them.

        A camera's info precedes its image, so the newest of both often do not belong together;
        receivers that match them by their stamps would have nothing to show.
        """
        loaded = {position: message for position in positions
                  for message in [self._loader.load(position)] if message is not None}
        stamps = {stamp for message in loaded.values() for stamp in first_stamp(message)}
        for position, message in list(loaded.items()):
            for earlier in self._earlier(position) if message.stamp_offsets else ():
                partner = self._loader.load(earlier)
                if partner is not None and stamps.intersection(first_stamp(partner)):
                    loaded[earlier] = partner
        return [loaded[position] for position in sorted(loaded)]

    def _earlier(self, position: int) -> Iterator[int]:
        """Yield the positions of earlier messages on the same topic, the nearest first."""
        for _ in range(_PARTNERS):
            replaced = self._scene.replaced(position)
            if replaced is None:
                return
            position = replaced
            yield position

    def _static_messages(self, topic: str, count: int) -> List[LoadedMessage]:
        """Return the static transforms of a topic as one message; its withdrawal without any."""
        static = self._static[topic]
        return static.messages(count) or self._withdrawals([static.connection])

    def _emptied(self, topics: Iterable[str]) -> List[LoadedMessage]:
        """Return messages that clear the display of some topics."""
        return [message for topic in topics for message in self._emptied_one(topic)]

    def _emptied_one(self, topic: str) -> List[LoadedMessage]:
        if topic not in self._emptied_topics:
            first = self._scene.first_of(topic)
            connection = self._connection_of(first)
            example = self._loader.load(first) if can_be_emptied(connection) else None
            self._emptied_topics[topic] = [] if example is None else [
                example._replace(data=emptied(connection, example.data), stamp_offsets=())]
        return self._emptied_topics[topic]

    def _withdrawals(self, connections: Iterable[int]) -> List[LoadedMessage]:
        """Return messages that withdraw the latched messages of sources, given as connections."""
        return [LoadedMessage(number, self._index.begin_ns, b'', withdrawn=True)
                for number in connections]

    def _connection_of(self, position: int) -> Connection:
        return self._index.connections[int(self._index.connection[position])]


FORWARD = 1
BACKWARD = -1


class ReadAhead:
    """The events from a position onward, in one direction, made by a separate thread.

    Reading begins with the first ``take``, and restarts if ``take`` asks for another event than the
    next one.
    """

    def __init__(self, events: EventMaker, count: int, limit_bytes: int = 32 << 20) -> None:
        """Initialize with the maker of events and the number of messages."""
        self._events = events
        self._count = count
        self._limit_bytes = limit_bytes
        self._changed = threading.Condition()
        self._ready: Deque[PlaybackEvent] = deque()
        self._ready_bytes = 0
        self._first = self._next = -1  # positions: of the first ready event, and the next to read
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
        """Return the size of the events that are ready and not taken yet."""
        return self._ready_bytes

    def take(self, position: int, step: int) -> PlaybackEvent:
        """Return the event of passing the message at a position FORWARD or BACKWARD.

        An exception that ended the thread is raised here.
        """
        with self._changed:
            if self._failure is not None:
                raise self._failure
            if self._ready and (position, step) == (self._first, self._step):
                return self._pop()
            self._restart(position + step, step)
        return self._make(position, step)

    def put_back(self, position: int, step: int, event: PlaybackEvent) -> None:
        """Put back the event that was taken last, to be taken again."""
        with self._changed:
            if (position + step, step) == (self._first, self._step):
                self._ready.appendleft(event)
                self._ready_bytes += event.size
                self._first = position

    def begin(self, position: int, step: int) -> None:
        """Begin to read at a position, where the next ``take`` will continue."""
        with self._changed:
            self._restart(position, step)

    def _pop(self) -> PlaybackEvent:
        event = self._ready.popleft()
        self._ready_bytes -= event.size
        self._first += self._step
        self._changed.notify_all()  # continue reading now, before the next message is due
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
        except Exception as error:  # ``take`` raises any exception
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
