"""What has to be published when the position passes a message, in either direction."""
from __future__ import annotations

from typing import Iterable, Iterator, List, NamedTuple, Optional, Tuple

from process_visualizer.bags.bag_index import BagIndex
from process_visualizer.bags.marker_removal import marker_removal, shows_markers
from process_visualizer.bags.message_layout import MessageDamaged
from process_visualizer.bags.message_loader import LoadedMessage, MessageLoader, first_stamp
from process_visualizer.bags.scene import STATIC_TOPIC, Scene
from process_visualizer.bags.static_transforms import merged

_PARTNERS = 2  # how many messages of a topic before its last may belong to others' last ones


class PlaybackEvent(NamedTuple):
    """Messages that become visible together at a bag time [ns], in the order of publishing."""

    time_ns: int
    messages: Tuple[LoadedMessage, ...]

    @property
    def size(self) -> int:
        """How much memory it takes, roughly [bytes]."""
        return 300 + sum(300 + len(message.data) for message in self.messages)


class EventMaker:
    """Makes the events of a recording; what was published is always the scene at the position.

    Forward, a message becomes visible when its time is reached. Backwards, the message that it
    had taken the place of becomes visible again: the scene is what it was before.
    """

    def __init__(self, index: BagIndex, loader: MessageLoader) -> None:
        """Take the index and the loader of a recording."""
        self._index = index
        self._loader = loader
        self._scene = Scene(index)
        self._static_count, self._merged = 0, []  # type: int, List[LoadedMessage]
        self._marker_connections = [number for number, connection in enumerate(index.connections)
                                    if shows_markers(connection)]

    def forward(self, position: int) -> PlaybackEvent:
        """Return the event of passing the message at a position forwards."""
        return PlaybackEvent(int(self._index.time_ns[position]),
                             tuple(self._loader.load_all([position])))

    def backward(self, position: int) -> PlaybackEvent:
        """Return the event of passing the message at a position backwards.

        It comes just before the message's time, at which the message is still visible.
        """
        number = int(self._index.connection[position])
        if self._index.connections[number].topic == STATIC_TOPIC:
            messages = self._static(position)
        else:
            replaced = self._scene.replaced(position)
            messages = self._removals([number]) if number in self._marker_connections else []
            messages += self._loader.load_all([] if replaced is None else [replaced])
        return PlaybackEvent(int(self._index.time_ns[position]) - 1, tuple(messages))

    def scene(self, count: int) -> PlaybackEvent:
        """Return the event of coming to the scene after ``count`` messages from anywhere."""
        time_ns = int(self._index.time_ns[count - 1]) if count else self._index.begin_ns
        messages = self._static(count) + self._removals(self._marker_connections)
        messages += self._with_partners(self._scene.positions(count))
        return PlaybackEvent(time_ns, tuple(messages))

    def _with_partners(self, positions: List[int]) -> List[LoadedMessage]:
        """The messages at some positions, and earlier ones with the same stamp as one of these.

        A camera's info comes before its image, so that the newest ones often do not belong
        together; receivers that match them by their stamps would have nothing to show.
        """
        found = {it: message for it in positions
                 for message in [self._loader.load(it)] if message is not None}
        stamps = {stamp for message in found.values() for stamp in first_stamp(message)}
        for position, message in list(found.items()):
            for earlier in self._earlier(position) if message.stamp_offsets else ():
                partner = self._loader.load(earlier)
                if partner is not None and stamps.intersection(first_stamp(partner)):
                    found[earlier] = partner
        return [found[position] for position in sorted(found)]

    def _earlier(self, position: int) -> Iterator[int]:
        """The positions of the messages before one on its topic, the nearest first."""
        for _ in range(_PARTNERS):
            replaced = self._scene.replaced(position)
            if replaced is None:
                return
            position = replaced
            yield position

    def _static(self, count: int) -> List[LoadedMessage]:
        """All of /tf_static as one message: later subscribers get only the last one."""
        positions = self._scene.static_positions(count)
        if len(positions) != self._static_count:
            self._merged = self._merge(self._loader.load_all(positions))
            self._static_count = len(positions)
        return list(self._merged)

    def _merge(self, known: List[LoadedMessage]) -> List[LoadedMessage]:
        try:
            data = merged(message.data for message in known)
            return [self._loader.located(*known[-1][:2], data)] if known else []
        except MessageDamaged:  # another type by the name of /tf_static
            return known

    def _removals(self, connections: Iterable[int]) -> List[LoadedMessage]:
        """Messages that remove all markers: what is not in the scene must not stay in sight."""
        removals = []
        for number in connections:
            first = self._first_of(number)
            if first is not None:
                data = marker_removal(self._index.connections[number], first.data)
                removals.append(LoadedMessage(number, first.time_ns, data))
        return removals

    def _first_of(self, number: int) -> Optional[LoadedMessage]:
        positions = self._index.positions(number)
        return self._loader.load(int(positions[0])) if len(positions) else None
