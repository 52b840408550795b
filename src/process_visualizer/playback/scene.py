# SPDX-License-Identifier: BSD-3-Clause
"""The newest message of every topic at a time: the scene that a seek restores."""
from __future__ import annotations

import threading
from bisect import bisect_left
from functools import lru_cache
from typing import (
    Dict,
    FrozenSet,
    Iterable,
    Iterator,
    List,
    NamedTuple,
    Optional,
    Sequence,
    Set,
    Tuple,
)

import numpy as np

from process_visualizer.bagio.bag_index import BagIndex
from process_visualizer.bagio.message_definition import Connection
from process_visualizer.bagio.message_layout import MessageDamaged
from process_visualizer.bagio.message_parts import (
    CLEARS,
    Parts,
    PartsReader,
    expires,
    joined,
    lasts,
    parts_reader,
    split,
)
from process_visualizer.playback.message_loader import LoadedMessage, MessageLoader, first_stamp_ns
from process_visualizer.ros_names import SENSOR_TYPES, STATIC_TF_TOPIC, TF_TYPES


class Scene:
    """The scene after any number of messages of a recording.

    The scene has the last message of each topic. If each publisher of a topic has a state of its
    own, it has the last message of each publisher (a source): on latched topics, and for
    transforms, which several nodes publish on /tf. A receiver that keeps only one message has that
    of the newest source. The scene has every message on /tf_static, because these messages add up.

    A time is given as the number of messages before it. With ``moment``, another such number, a
    topic without a message so far has its first one, if it is among the first ``moment`` messages.
    """

    def __init__(self, index: BagIndex) -> None:
        """Initialize with an index."""
        self._index = index
        self._sources = sources(index.connections)
        self._numbers: Dict[int, List[int]] = {}  # connections by their source
        self._topics: Dict[str, List[int]] = {}  # sources by their topic
        self._static: Dict[str, List[int]] = {}
        for number, connection in enumerate(index.connections):
            if len(index.positions(number)):
                self._add(number, connection)

    @property
    def topics(self) -> Tuple[str, ...]:
        """The topics with messages, without static transforms."""
        return tuple(self._topics)

    @property
    def static_topics(self) -> Dict[str, np.ndarray]:
        """The topics of static transforms, with the positions (ascending) of all their messages."""
        return {topic: self._index.positions_of(numbers)
                for topic, numbers in self._static.items()}

    def positions(self, count: int, moment: int = 0) -> List[int]:
        """Return the positions (ascending) of the messages in the scene after ``count`` messages.

        Static transforms are not included.
        """
        return sorted(position for topic in self._topics
                      for position in self.positions_of(topic, count, moment))

    def positions_of(self, topic: str, count: int, moment: int = 0) -> List[int]:
        """Return the positions in the scene for one topic; see ``positions``."""
        newest = {source: self._last(source, count) for source in self._topics[topic]}
        found = [last for last in newest.values() if last is not None]
        absent = [source for source, last in newest.items() if last is None]
        firsts = [self.first(source) for source in absent]
        if not self._has_transforms(topic):
            firsts = [] if found else [min(firsts)]
        return sorted([*found, *(first for first in firsts if first < moment)])

    def shown_again(self, position: int) -> List[int]:
        """Return the positions (ascending) of messages to show again in place of a message.

        These are the message that it had replaced, and the topic's newest message before it.
        """
        topic = self._index.connections[int(self._index.connection[position])].topic
        replaced, newest = self.replaced(position), self.positions_of(topic, position)[-1:]
        if replaced is None:
            return [] if self._has_transforms(topic) else newest
        return [replaced] if self._has_transforms(topic) else sorted({replaced, *newest})

    def replaced(self, position: int) -> Optional[int]:
        """Return the position of the message that the message at a position replaces."""
        return self._last(self.source_of(position), position)

    def latched_sources(self, without: Iterable[int] = ()) -> List[int]:
        """Return the latched sources, except those of the messages at some positions."""
        others = {self.source_of(position) for position in without}
        return [source for group in self._topics.values() for source in group
                if source not in others and self._index.connections[source].latching]

    def absent_topics(self, count: int, moment: int = 0) -> List[str]:
        """Return the topics without a message in the scene."""
        return [topic for topic in self._topics if not self.positions_of(topic, count, moment)]

    def first_of(self, topic: str) -> int:
        """Return the position of a topic's first message."""
        return min(map(self.first, self._topics[topic]))

    def first(self, source: int) -> int:
        """Return the position of a source's first message."""
        return min(int(self._index.positions(number)[0]) for number in self._numbers[source])

    def messages_of(self, source: int) -> np.ndarray:
        """Return the positions (ascending) of a source's messages."""
        return self._index.positions_of(self._numbers[source])

    def messages_by_connection(self, source: int) -> List[np.ndarray]:
        """Return ``messages_of`` separately for each connection of the source with messages."""
        return [self._index.positions(number) for number in self._numbers[source]]

    def source_of(self, position: int) -> int:
        """Return the source of the message at a position."""
        return self._sources[int(self._index.connection[position])]

    def _add(self, number: int, connection: Connection) -> None:
        if is_static(connection):
            self._static.setdefault(connection.topic, []).append(number)
            return
        source = self._sources[number]
        self._numbers.setdefault(source, []).append(number)
        topic = self._topics.setdefault(connection.topic, [])
        if source not in topic:
            topic.append(source)

    def _has_transforms(self, topic: str) -> bool:
        return self._index.connections[self._topics[topic][0]].type in TF_TYPES

    def _last(self, source: int, count: int) -> Optional[int]:
        newest = [self._index.last_before(count, number) for number in self._numbers[source]]
        return max((last for last in newest if last is not None), default=None)


def is_static(connection: Connection) -> bool:
    """Return whether a connection has static transforms, which hold forever beside all others."""
    is_named = f'/{connection.topic}'.endswith(STATIC_TF_TOPIC)  # whatever its namespace
    return is_named and connection.type in TF_TYPES


def sources(connections: Sequence[Connection]) -> List[int]:
    """Return, for each connection, the first of the connections that replace each other's messages.

    A node restarted under the same name replaces its earlier messages.
    """
    firsts: Dict[Tuple[str, ...], int] = {}
    return [firsts.setdefault(_group(connection), number)
            for number, connection in enumerate(connections)]


def _group(connection: Connection) -> Tuple[str, ...]:
    of_its_own = connection.latching or connection.type in TF_TYPES
    if of_its_own and not is_static(connection):
        return connection.topic, connection.caller_id
    return connection.topic,


MAX_AGE_NS = 3_000_000_000
"""Maximum age of transforms that still hold, relative to the newest message."""
MAX_SEARCHED = 200  # maximum number of messages to search
MIN_SEARCHED = 20  # messages to search even if all known keys of the source have been found
SAMPLES = 60
"""Messages of each publisher, half of them the first, that show whether joints come in groups."""

Groups = Dict[FrozenSet[bytes], np.ndarray]
"""The positions (ascending) of a source's messages, by the keys of their parts."""


class PartialMessages:
    """The messages that complete a source's newest message, which may contain only some parts.

    Most publishers put all parts in one message; only a few of their messages are read. The known
    parts of a source are searched among its last messages. The position of a joint holds no matter
    how long ago it was sent: all messages of a source that sends its joints in groups are read,
    once.
    """

    def __init__(self, index: BagIndex, loader: MessageLoader, scene: Scene) -> None:
        """Initialize with the index and the loader of a recording, and its scene."""
        self._index = index
        self._loader = loader
        self._scene = scene
        self._readers: List[Optional[PartsReader]] = [
            parts_reader(connection) for connection in index.connections]
        self._known: Dict[int, Set[bytes]] = {}  # keys, by source
        self._groups: Dict[int, Groups] = {}  # of sources whose parts do not expire

    def beside(self, positions: Iterable[int], time_ns: int) -> List[int]:
        """Return the positions of earlier messages that still hold at a bag time [ns].

        The ``positions`` are those of newest messages.
        """
        return [earlier for position in positions if self._reader(position) is not None
                for earlier in self._beside(position, time_ns)]

    def replaced(self, position: int) -> List[int]:
        """Return the positions (ascending) of messages that restore what a message replaced."""
        if self._reader(position) is None:
            return []
        missing = self._keys(self._parts(position))
        walked: List[Tuple[int, Set[bytes]]] = []
        wanted: Set[int] = set()
        for earlier in self._earlier(position):
            walked.append((earlier, self._keys(self._parts(earlier))))
            if missing & walked[-1][1]:
                wanted.add(earlier)
            missing -= walked[-1][1]
            if not missing:
                break
        return self._with_later(walked[::-1], wanted)

    @staticmethod
    def _with_later(messages: Iterable[Tuple[int, Set[bytes]]], wanted: Set[int]) -> List[int]:
        """Return the wanted messages (ascending), and those that update their parts."""
        chosen: List[int] = []
        covered: Set[bytes] = set()
        for position, keys in messages:
            if position in wanted or covered & keys:
                chosen.append(position)
                covered |= keys
        return chosen

    def _beside(self, position: int, time_ns: int) -> Iterator[int]:
        parts = self._parts(position)
        found = self._keys(parts)
        known = self._known.setdefault(self._scene.source_of(position), set())
        looks_for_all = not known
        for count, earlier in enumerate(self._earlier(position)):
            if CLEARS in parts or (count >= MIN_SEARCHED and not looks_for_all and known <= found):
                break
            parts = self._parts(earlier)
            age_ns = time_ns - int(self._index.time_ns[earlier])
            if any(part.key not in found and part != CLEARS
                   and not 0 < part.lifetime_ns < age_ns for part in parts):
                yield earlier
            found |= self._keys(parts)
        known |= found

    def _earlier(self, position: int) -> Iterator[int]:
        """Yield the positions of the source's messages before a message, the nearest first.

        If the source sends lasting parts in groups, only the last message of each group is used.
        """
        groups = self._groups_of(position)
        if len(groups) > 1:
            counts = {keys: int(it.searchsorted(position)) for keys, it in groups.items()}
            yield from sorted((int(groups[keys][count - 1]) for keys, count in counts.items()
                               if count), reverse=True)
            return
        connection = self._index.connections[int(self._index.connection[position])]
        farthest_ns = int(self._index.time_ns[position]) - MAX_AGE_NS if expires(connection) else 0
        for _ in range(MAX_SEARCHED):
            replaced = self._scene.replaced(position)
            if replaced is None or self._index.time_ns[replaced] < farthest_ns:
                return
            position = replaced
            yield position

    def _groups_of(self, position: int) -> Groups:
        """Return the groups in which a message's source sends lasting parts, if it does."""
        source = self._scene.source_of(position)
        if source not in self._groups:  # stored only when complete: other threads may read it
            groups: Groups = {}
            if lasts(self._index.connections[int(self._index.connection[position])]):
                samples = [_samples(it) for it in self._scene.messages_by_connection(source)]
                if len(self._grouped(np.concatenate(samples))) > 1:
                    groups = self._grouped(self._scene.messages_of(source))
            self._groups[source] = groups
        return self._groups[source]

    def _grouped(self, positions: np.ndarray) -> Groups:
        groups: Dict[FrozenSet[bytes], List[int]] = {}
        for position in positions.tolist():
            groups.setdefault(frozenset(self._keys(self._parts(position))), []).append(position)
        return {keys: np.array(it) for keys, it in groups.items()}

    def _parts(self, position: int) -> Parts:
        """Return the parts of a message; none if it is unreadable, also for its receivers."""
        reader, message = self._reader(position), self._loader.load(position)
        if reader is None or message is None:
            return ()
        try:
            return reader(bytes(message.data))
        except MessageDamaged:
            return ()

    def _reader(self, position: int) -> Optional[PartsReader]:
        return self._readers[int(self._index.connection[position])]

    @staticmethod
    def _keys(parts: Parts) -> Set[bytes]:
        return {part.key for part in parts if part != CLEARS}


def _samples(positions: np.ndarray) -> np.ndarray:
    """Return some positions of messages: the first ones, and others spread over all."""
    spread = np.linspace(0, len(positions) - 1, SAMPLES // 2).astype(int)
    return np.union1d(positions[:SAMPLES // 2], positions[spread])


class _Versions(NamedTuple):
    """Versions of one frame: positions of messages (ascending), and the bytes in them."""

    positions: List[int]
    transforms: List[bytes]


class StaticScene:
    """The static transforms after any number of messages; each message is read once.

    A new subscriber gets only the last message of a latched topic. Therefore every message is
    published with all transforms that hold at its time, as messages of one source (that of
    ``connection``). May be used by several threads.
    """

    def __init__(self, loader: MessageLoader, positions: np.ndarray) -> None:
        """Initialize with the loader and the positions (ascending) of the topic's messages."""
        self._loader = loader
        self._positions = positions.tolist()
        self.connection = loader.connection(self._positions[0])
        self._lock = threading.Lock()
        self._read = 0  # number of messages read
        self._frames: Dict[bytes, _Versions] = {}

    def messages(self, count: int) -> List[LoadedMessage]:
        """Return the message for the scene after ``count`` messages of the recording, if any."""
        known = bisect_left(self._positions, count)
        if not known:
            return []
        with self._lock:
            self._read_until(known)
            data = joined(self._transforms(count))
        last = self._positions[known - 1]
        return [self._loader.located(last, data)]

    def _transforms(self, count: int) -> List[bytes]:
        counts = ((bisect_left(it.positions, count), it.transforms) for it in self._frames.values())
        return [transforms[number - 1] for number, transforms in counts if number]

    def _read_until(self, known: int) -> None:
        while self._read < known:
            position = self._positions[self._read]
            message = self._loader.load(position)
            self._read += 1
            if message is not None:
                self._add(position, message)

    def _add(self, position: int, message: LoadedMessage) -> None:
        try:
            transforms = dict(split(bytes(message.data)))
        except MessageDamaged as error:
            self._loader.note_damaged(position, error)
            return
        for child, transform in transforms.items():
            versions = self._frames.setdefault(child, _Versions([], []))
            if versions.transforms[-1:] != [transform]:
                versions.positions.append(position)
                versions.transforms.append(transform)


MAX_DELAY_NS = 200_000_000
"""Maximum delay [bag ns] of passing a message; older stamps are ignored."""
_NEAR_NS = 25_000_000  # a message this close before a moment represents it, else the next one
_BLOCK = 128  # messages whose times are computed together
_STAMPS_KEPT = 4096


class SensorTimes:
    """Times at which messages of sensors are passed backward.

    When a message is passed backward, the message before it becomes visible again. That one was
    measured earlier, and the robot matches it only when the position reaches its stamp. Until then
    the stamp would be in the future, which is not allowed. Therefore the later message is passed
    only when that stamp is reached. May be used by several threads.

    ``connections`` are the connections of sensors.
    """

    def __init__(self, index: BagIndex, loader: MessageLoader) -> None:
        """Initialize with the index and the loader of a recording."""
        self._index = index
        self._loader = loader
        self._sensors: List[np.ndarray] = []
        self._of_connection: Dict[int, np.ndarray] = {}
        for numbers in _sensors(index).values():
            self._sensors.append(index.positions_of(numbers))
            self._of_connection.update(dict.fromkeys(numbers, self._sensors[-1]))
        self.connections = frozenset(self._of_connection)
        self._stamp_ns = lru_cache(maxsize=_STAMPS_KEPT)(self._read_stamp_ns)
        self._block = lru_cache(maxsize=4)(self._read_block)

    def passed_with(self, position: int) -> List[int]:
        """Return the positions (descending) of the messages passed with the message at a position.

        A sensor's message is passed with itself or an earlier message, any other with itself.
        """
        found = self._block(position // _BLOCK).get(position, [])
        is_sensors = int(self._index.connection[position]) in self._of_connection
        return found if is_sensors else [*found, position]

    def _read_block(self, number: int) -> Dict[int, List[int]]:
        begin, end = number * _BLOCK, min((number + 1) * _BLOCK, len(self._index))
        found: Dict[int, List[int]] = {}
        for position, place in self._places(begin, int(self._index.time_ns[end - 1])):
            if begin <= place < end:
                found.setdefault(place, []).append(position)
        return found

    def _places(self, begin: int, until_ns: int) -> Iterator[Tuple[int, int]]:
        """Yield the positions of sensors' messages, falling, each with the one it is passed with.

        The positions begin at ``begin``. All messages are included that are passed with a message
        up to a bag time [ns].
        """
        end = self._index.count_until(until_ns + MAX_DELAY_NS + _NEAR_NS)
        for positions in self._sensors:
            place, found = end, _between(positions, begin, end)
            visible = [_before(positions, begin), *found]
            for position, before in zip(found[::-1], visible[-2::-1]):
                place = min(place, self._place(position, before))
                yield position, place

    def _place(self, position: int, visible: int) -> int:
        """Return the position where a message passed backward makes ``visible`` the newest one."""
        stamp_ns, time_ns = self._stamp_ns(visible), self._index.time_ns
        latest_ns = int(time_ns[position]) - 1
        if stamp_ns is None or stamp_ns >= latest_ns:
            return position
        moment_ns = max(stamp_ns, latest_ns - MAX_DELAY_NS)
        after = self._index.count_until(moment_ns)  # is passed just before the moment
        is_near = after > 0 and moment_ns - int(time_ns[after - 1]) <= _NEAR_NS
        return after - 1 if is_near else after

    def _read_stamp_ns(self, position: int) -> Optional[int]:
        """Return the stamp of a message; None if it is not the time of measurement."""
        message = self._loader.load(position)
        stamp_ns = None if message is None else first_stamp_ns(message)
        too_old_ns = int(self._index.time_ns[position]) - MAX_DELAY_NS
        return None if stamp_ns is None or stamp_ns < too_old_ns else stamp_ns


def _between(positions: np.ndarray, begin: int, end: int) -> List[int]:
    """Return the positions (ascending) that lie in [begin, end)."""
    # numbers of another type would make numpy convert all positions first
    first, behind = positions.searchsorted(np.array([begin, end], positions.dtype))
    return [int(position) for position in positions[first:behind]]


def _before(positions: np.ndarray, position: int) -> int:
    """Return the last of ``positions`` (ascending) before a position, or else the first one."""
    return int(positions[max(int(positions.searchsorted(positions.dtype.type(position))) - 1, 0)])


def _sensors(index: BagIndex) -> Dict[str, List[int]]:
    """Return the sensors' connections by topic."""
    found: Dict[str, List[int]] = {}
    for number, connection in enumerate(index.connections):
        is_sensors = connection.type in SENSOR_TYPES and not connection.latching
        if is_sensors and len(index.positions(number)):
            found.setdefault(connection.topic, []).append(number)
    return found
