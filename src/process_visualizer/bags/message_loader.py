"""Reads messages and finds the stamps in them, so that they can be sent without further work."""
from __future__ import annotations

import threading
from typing import Dict, List, NamedTuple, Optional, Tuple

from process_visualizer.bags.bag_errors import BagDamaged
from process_visualizer.bags.message_definition import DefinitionError
from process_visualizer.bags.message_layout import Data, MessageDamaged
from process_visualizer.bags.recording import Recording
from process_visualizer.bags.stamps import StampLocator

STAMP_BYTES = 8
_MAX_PROBLEMS = 100


class LoadedMessage(NamedTuple):
    """A message: its connection, when it was recorded [bag ns], bytes, offsets of its stamps."""

    connection: int
    time_ns: int
    data: Data
    stamp_offsets: Tuple[int, ...] = ()


class MessageLoader:
    """Loads messages by their position in the index. May be used by several threads.

    What cannot be read, or does not fit its definition, is left out and told once by
    ``problems``. Messages whose definition cannot be understood keep their stamps.
    """

    def __init__(self, recording: Recording) -> None:
        """Take a recording."""
        self._recording = recording
        self._index = recording.index
        self._lock = threading.Lock()
        self._locators: Dict[int, Optional[StampLocator]] = {}
        self._problems: Dict[str, None] = {}

    @property
    def problems(self) -> Tuple[str, ...]:
        """What could not be played as it should be, so far, each as a text for the user."""
        with self._lock:
            return tuple(str(gap) for gap in self._index.gaps) + tuple(self._problems)

    def load(self, position: int) -> Optional[LoadedMessage]:
        """Return the message at a position of the index; None if it cannot be played."""
        connection = int(self._index.connection[position])
        time_ns = int(self._index.time_ns[position])
        try:
            return self.located(connection, time_ns, self._recording.message(position))
        except BagDamaged as error:
            self._note(str(error))
        except MessageDamaged as error:
            seconds = (time_ns - self._index.begin_ns) * 1e-9
            self._note(f'{self._topic(connection)}: the message at {seconds:.3f} s does not fit '
                       f'its definition and is left out: {error}')
        return None

    def located(self, connection: int, time_ns: int, data: Data) -> LoadedMessage:
        """Return a message of a connection with the places of its stamps.

        Raises:
            MessageDamaged: it does not fit its definition.
        """
        locator = self._locator(connection)
        offsets = locator.checked_offsets(data) if locator else []
        return LoadedMessage(connection, time_ns, data, tuple(offsets))

    def load_all(self, positions: List[int]) -> List[LoadedMessage]:
        """Return those messages that can be played, in their order."""
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

    def _topic(self, number: int) -> str:
        return self._index.connections[number].topic

    def _note(self, problem: str) -> None:
        with self._lock:
            if len(self._problems) < _MAX_PROBLEMS:
                self._problems[problem] = None


def first_stamp(message: LoadedMessage) -> Tuple[bytes, ...]:
    """Return the first stamp in a message as its eight bytes, if it has one that is not zero."""
    for offset in message.stamp_offsets[:1]:
        stamp = bytes(memoryview(message.data)[offset:offset + STAMP_BYTES])
        return (stamp,) if any(stamp) else ()
    return ()
