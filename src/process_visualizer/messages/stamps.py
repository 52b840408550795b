# SPDX-License-Identifier: BSD-3-Clause
"""The stamps inside a recorded message: found by its definition, moved without deserialising it."""
from __future__ import annotations

from struct import Struct
from typing import Callable, List, Sequence

from process_visualizer.messages.layout_compiler import LayoutCompiler, until_last_stamp
from process_visualizer.messages.message_definition import parse_definitions, short_name
from process_visualizer.messages.message_layout import Data, MessageDamaged

NS_PER_S = 1_000_000_000
_STAMP = Struct('<II')  # seconds, nanoseconds
_MAX_STAMP_NS = (1 << 32) * NS_PER_S - 1


class StampLocator:
    """Finds the stamps of one message type in the bytes of its messages.

    A stamp is a single field `time stamp`, of a std_msgs/Header or of any other message, at any
    depth, in arrays too (see layout_compiler.is_stamp). The definition is data: it is parsed
    with limits and never becomes code.
    """

    def __init__(self, type_name: str, definition: str) -> None:
        """Take the message type and its definition, as the bag's connection carries them.

        Raises:
            DefinitionError: the definition cannot be understood.
        """
        self.type_name = short_name(type_name)
        definitions = parse_definitions(self.type_name, definition)
        self._layout = LayoutCompiler(definitions).message(self.type_name)
        self._stamped = until_last_stamp(self._layout)

    @property
    def has_stamps(self) -> bool:
        """Return whether messages of this type can have stamps at all."""
        return self._layout.has_stamps

    def offsets(self, data: Data) -> List[int]:
        """Return where [bytes] the stamps are, ascending; what follows the last is not looked at.

        Raises:
            MessageDamaged: the bytes do not fit the definition.
        """
        found: List[int] = []
        self._stamped.walk(data, 0, found)
        return found

    def check(self, data: Data) -> None:
        """Look at the whole message; see ``checked_offsets``."""
        self.checked_offsets(data)

    def checked_offsets(self, data: Data) -> List[int]:
        """Return where [bytes] the stamps are, ascending, after a look at the whole message.

        Raises:
            MessageDamaged: the bytes do not fit the definition, or there are more than it has.
        """
        found: List[int] = []
        end = self._layout.walk(data, 0, found)
        if end != len(data):
            raise MessageDamaged(f'the message should end at byte {end}, not at {len(data)}')
        return found

    def moved(self, data: Data, mapping: Callable[[int], int]) -> Data:
        """Return the message with every stamp [ns] replaced by what the mapping makes of it.

        Stamps of zero stay: they mean "the latest there is". The data itself is not changed; it
        is returned where nothing moves.

        Raises:
            MessageDamaged: the bytes do not fit the definition.
            ValueError: the mapping's result is no ROS time (below zero, or after the year 2106).
        """
        pieces = with_stamps_moved(data, self.offsets(data), mapping)
        return data if len(pieces) == 1 else b''.join(pieces)


def with_stamps_moved(data: Data, offsets: Sequence[int],
                      mapping: Callable[[int], int]) -> List[Data]:
    """Return a message in pieces, with the stamps [ns] at some offsets replaced, without a copy.

    Stamps of zero stay: they mean "the latest there is".

    Raises:
        ValueError: the mapping's result is no ROS time (below zero, or after the year 2106).
    """
    view = memoryview(data)
    pieces: List[Data] = []
    position = 0
    for offset in offsets:
        seconds, nanoseconds = _STAMP.unpack_from(view, offset)
        if seconds or nanoseconds:
            pieces += (view[position:offset],
                       packed(mapping(seconds * NS_PER_S + nanoseconds)))
            position = offset + _STAMP.size
    return [*pieces, view[position:]]


def packed(stamp_ns: int) -> bytes:
    """Return a time [ns] as ROS serialises it.

    Raises:
        ValueError: ROS has no such time.
    """
    if not 0 <= stamp_ns <= _MAX_STAMP_NS:
        raise ValueError(f'{stamp_ns} ns is no ROS time')
    return _STAMP.pack(*divmod(stamp_ns, NS_PER_S))
