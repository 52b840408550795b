# SPDX-License-Identifier: BSD-3-Clause
"""Loading of messages with the offsets of their stamps, so that they are ready to be sent."""
from __future__ import annotations

import threading
from collections import Counter
from struct import Struct
from typing import Dict, List, NamedTuple, Optional, Set, Tuple

from process_visualizer.bagio.bag_errors import BagDamaged
from process_visualizer.bagio.message_definition import (
    Connection,
    DefinitionError,
    definition_checksum,
)
from process_visualizer.bagio.message_layout import NS_PER_S, Data, MessageDamaged, StampLocator
from process_visualizer.bagio.message_parts import named_meshes
from process_visualizer.bagio.recording import Recording
from process_visualizer.robot.mesh_files import mesh_problem

STAMP_BYTES = 8
_STAMP = Struct('<II')  # seconds, nanoseconds
_MAX_PROBLEMS = 100


class LoadedMessage(NamedTuple):
    """A message: its connection, time of recording [bag ns], bytes, offsets of its stamps.

    A ``withdrawn`` message is not published; it ends the latching of earlier messages from its
    connection's source.
    """

    connection: int
    time_ns: int
    data: Data
    stamp_offsets: Tuple[int, ...] = ()
    withdrawn: bool = False


class MessageLoader:
    """Loads messages by their position in the index. May be used by several threads.

    Messages that cannot be read, or do not fit their definition, are left out and reported once by
    ``problems``. Messages whose definition cannot be parsed keep their stamps.
    """

    def __init__(self, recording: Recording) -> None:
        """Initialize with a recording."""
        self._recording = recording
        self._index = recording.index
        self._lock = threading.Lock()
        self._locators: Dict[int, Optional[StampLocator]] = {}
        self._problems: Dict[str, None] = {}
        self._left_out: Set[int] = set()  # positions

    @property
    def problems(self) -> Tuple[str, ...]:
        """Return the problems of playback so far, each as a text for the user."""
        with self._lock:
            return tuple(str(gap) for gap in self._index.gaps) + tuple(self._problems)

    @property
    def left_out(self) -> Dict[str, int]:
        """Return the number of messages of each topic that could not be played so far."""
        with self._lock:
            return dict(Counter(map(self._topic, self._left_out)))

    def connection(self, position: int) -> int:
        """Return the connection of the message at a position."""
        return int(self._index.connection[position])

    def load(self, position: int) -> Optional[LoadedMessage]:
        """Return the message at a position of the index; None if it cannot be played."""
        try:
            data = self._recording.message(position)
            meshes = named_meshes(self._index.connections[self.connection(position)], data)
            problem = next(filter(None, map(mesh_problem, meshes)), '')
            if not problem:
                return self.located(position, data)
            self._note(f'{self._topic(position)}: markers are left out: {problem}', position)
        except BagDamaged as error:
            self._note(str(error), position)
        except MessageDamaged as error:
            self.note_damaged(position, error)
        return None

    def located(self, position: int, data: Data) -> LoadedMessage:
        """Return a message with given data for a position, with the offsets of its stamps.

        Raises:
            MessageDamaged: the data does not fit the definition.
        """
        connection = self.connection(position)
        offsets = self._offsets(connection, data)
        return LoadedMessage(connection, int(self._index.time_ns[position]), data, tuple(offsets))

    def _offsets(self, number: int, data: Data) -> List[int]:
        """Return the offsets of the stamps; none if the definition turns out to be wrong."""
        locator = self._locator(number)
        try:
            return locator.checked_offsets(data) if locator else []
        except MessageDamaged:
            connection = self._index.connections[number]
            if _is_whole(connection):
                raise
            self._note(f'{connection.topic}: its stamps stay as they were recorded, as the bag '
                       f'does not have the whole definition of {connection.type}')
            with self._lock:
                self._locators[number] = None
            return []

    def note_damaged(self, position: int, error: MessageDamaged) -> None:
        """Note that the message at a position does not fit its definition."""
        seconds = (int(self._index.time_ns[position]) - self._index.begin_ns) * 1e-9
        self._note(f'{self._topic(position)}: the message at {seconds:.3f} s does not fit its '
                   f'definition and is left out: {error}', position)

    def load_all(self, positions: List[int]) -> List[LoadedMessage]:
        """Return the playable messages at some positions, in their order."""
        return [message for message in map(self.load, positions) if message is not None]

    def _locator(self, number: int) -> Optional[StampLocator]:
        with self._lock:
            if number in self._locators:
                return self._locators[number]
        connection = self._index.connections[number]
        locator = None
        try:
            locator = StampLocator(connection.type, connection.message_definition)
        except DefinitionError as error:
            self._note(f'{connection.topic}: its stamps stay as they were recorded, as the '
                       f'definition of {connection.type} cannot be understood: {error}')
        with self._lock:
            self._locators[number] = locator
        return locator

    def _topic(self, position: int) -> str:
        return self._index.connections[self.connection(position)].topic

    def _note(self, problem: str, left_out: Optional[int] = None) -> None:
        with self._lock:
            if left_out is not None:
                self._left_out.add(left_out)
            if len(self._problems) < _MAX_PROBLEMS:
                self._problems[problem] = None


def _is_whole(connection: Connection) -> bool:
    """Return whether a connection's definition matches the checksum of its messages."""
    try:
        found = definition_checksum(connection.type, connection.message_definition)
    except DefinitionError:
        return False
    return found == connection.md5sum


def first_stamp(message: LoadedMessage) -> Tuple[bytes, ...]:
    """Return the first stamp in a message as its eight bytes; empty if it is missing or zero."""
    for offset in message.stamp_offsets[:1]:
        stamp = bytes(memoryview(message.data)[offset:offset + STAMP_BYTES])
        return (stamp,) if any(stamp) else ()
    return ()


def first_stamp_ns(message: LoadedMessage) -> Optional[int]:
    """Return the first stamp in a message [bag ns]; None if it is missing or zero."""
    for stamp in first_stamp(message):
        seconds, nanoseconds = _STAMP.unpack(stamp)
        return int(seconds) * NS_PER_S + int(nanoseconds)
    return None
