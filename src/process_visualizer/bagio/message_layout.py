# SPDX-License-Identifier: BSD-3-Clause
"""The ROS wire format: reads lengths and strings, and finds and changes the stamps in a message.

A layout walks over the bytes of a message and collects the offsets of the stamps. A part of known
size is skipped in one step; nothing is deserialized.
"""
from __future__ import annotations

from abc import ABC, abstractmethod
from struct import Struct
from typing import Callable, Dict, List, Optional, Sequence, Tuple, Union

from process_visualizer.bagio.message_definition import (
    MAX_DEPTH,
    PRIMITIVE_SIZES,
    STRING,
    DefinitionError,
    Definitions,
    Field,
    parse_definitions,
    short_name,
)

Data = Union[bytes, bytearray, memoryview]

_LENGTH = Struct('<I')
_read_length = _LENGTH.unpack_from


class MessageDamaged(Exception):
    """Raised if the bytes of a message do not fit its definition; the text says where."""


class Layout(ABC):
    """A part of a message; ``min_size`` is its minimum size [bytes]."""

    min_size: int
    has_stamps: bool

    @abstractmethod
    def walk(self, data: Data, position: int, stamps: List[int]) -> int:
        """Collect the stamps of the part at a position; return the position after the part.

        Raises:
            MessageDamaged: the part does not fit into the data.
        """


class Fixed(Layout):
    """A part of fixed size, with its stamps at fixed offsets."""

    def __init__(self, size: int, offsets: Tuple[int, ...] = ()) -> None:
        """Initialize with the size [bytes] and the offsets of the stamps."""
        self.min_size = size
        self.offsets = offsets
        self.has_stamps = bool(offsets)

    def walk(self, data: Data, position: int, stamps: List[int]) -> int:
        """See Layout."""
        end = checked_end(data, position, self.min_size)
        for offset in self.offsets:
            stamps.append(position + offset)
        return end


class Blob(Layout):
    """A length and that many elements of fixed size without stamps: strings, images, joints."""

    has_stamps = False

    def __init__(self, element_size: int) -> None:
        """Initialize with the size [bytes] of an element."""
        self.min_size = _LENGTH.size
        self._element_size = element_size

    def walk(self, data: Data, position: int, stamps: List[int]) -> int:
        """See Layout."""
        count, position = read_length(data, position)
        return checked_end(data, position, count * self._element_size)


class Repeated(Layout):
    """An array: a fixed number of elements, or (None) a number given by a preceding length."""

    def __init__(self, element: Layout, count: Optional[int]) -> None:
        """Initialize with the layout of an element and the number of elements."""
        self._element = element
        self._count = count
        self.min_size = _LENGTH.size if count is None else count * element.min_size
        self.has_stamps = element.has_stamps

    def walk(self, data: Data, position: int, stamps: List[int]) -> int:
        """See Layout; the work is bounded, as every element takes at least one byte."""
        count = self._count
        if count is None:
            count, position = read_length(data, position)
        checked_end(data, position, count * self._element.min_size)
        walk = self._element.walk
        for _ in range(count):
            position = walk(data, position, stamps)
        return position


class RecordLayout(Layout):
    """Consecutive parts: a message."""

    def __init__(self, parts: Sequence[Layout]) -> None:
        """Initialize with the parts in order."""
        self.parts = list(parts)
        self.min_size = sum(part.min_size for part in parts)
        self.has_stamps = any(part.has_stamps for part in parts)

    def walk(self, data: Data, position: int, stamps: List[int]) -> int:
        """See Layout."""
        for part in self.parts:
            position = part.walk(data, position, stamps)
        return position


def checked_end(data: Data, position: int, size: int) -> int:
    """Return position + size.

    Raises:
        MessageDamaged: the sum is beyond the end of the data.
    """
    end = position + size
    if end > len(data):
        raise MessageDamaged(
            f'{size} bytes are expected at byte {position}, but the message ends at {len(data)}')
    return end


def read_length(data: Data, position: int) -> Tuple[int, int]:
    """Return the length of an array or string at a position, and the position after the length."""
    end = position + 4
    if end > len(data):
        checked_end(data, position, 4)
    return _read_length(data, position)[0], end


def read_text(data: Data, position: int) -> Tuple[bytes, int]:
    """Return the bytes of the string at a position, and the position after it."""
    length, begin = read_length(data, position)
    end = begin + length
    if end > len(data):
        checked_end(data, begin, length)
    return bytes(data[begin:end]), end


_VALUES_PER_BYTE, _FREE_VALUES = 4, 1000


class ValueBudget:
    """Limits the work on a message whose values are visited one by one.

    Messages without fields and arrays of the fixed length 0 take no bytes: a few nested arrays can
    hold more of them than any program can visit.
    """

    def __init__(self, data: Data) -> None:
        """Initialize with the bytes of the message."""
        self._left = _FREE_VALUES + _VALUES_PER_BYTE * len(data)

    def spend(self, count: int) -> None:
        """Count further values, or nested messages, that are visited.

        Raises:
            MessageDamaged: there are more of them than a valid message can have.
        """
        self._left -= count
        if self._left < 0:
            raise MessageDamaged('it has far more values than bytes')


MAX_STAMPS = 10_000  # limit for a part of fixed size


class LayoutCompiler:
    """Builds the layouts of the types in one definition, each type once."""

    def __init__(self, definitions: Definitions) -> None:
        """Initialize with the fields of all types."""
        self._definitions = definitions
        self._layouts: Dict[str, Layout] = {}
        self._open: List[str] = []  # the types being built, outermost first

    def message(self, type_name: str) -> Layout:
        """Return the layout of a message type ('package/Type').

        Raises:
            DefinitionError: a type is missing, contains itself, or is nested or repeated too often.
        """
        if type_name not in self._layouts:
            if type_name in self._open:
                raise DefinitionError(f'{type_name} contains itself')
            if type_name not in self._definitions:
                raise DefinitionError(f'the definition of {type_name} is missing')
            if len(self._open) >= MAX_DEPTH:
                raise DefinitionError(f'{type_name} is nested more than {MAX_DEPTH} deep')
            self._open.append(type_name)
            parts = [self._field(field) for field in self._definitions[type_name]]
            self._layouts[type_name] = joined(parts)
            self._open.pop()
        return self._layouts[type_name]

    def _field(self, field: Field) -> Layout:
        if field.type_name == STRING:
            element: Layout = Blob(1)
        elif field.type_name in PRIMITIVE_SIZES:
            element = Fixed(PRIMITIVE_SIZES[field.type_name], (0,) if is_stamp(field) else ())
        else:
            element = self.message(field.type_name)
        if not field.is_array:
            return element
        if field.length == 0:
            return Fixed(0)
        if not isinstance(element, Fixed) or (element.has_stamps and field.length is None):
            return Repeated(element, field.length)
        return Blob(element.min_size) if field.length is None else times(element, field.length)


def is_stamp(field: Field) -> bool:
    """Return whether a field is the time of its message's content: a single `time` named `stamp`.

    std_msgs/Header has such a field, and types without a header use the same name (velodyne_msgs,
    actionlib_msgs/GoalID). Other times are data: a map's load time, a GPS receiver's reference,
    the simulated /clock, a duration.
    """
    return field.type_name == 'time' and field.name == 'stamp' and not field.is_array


def times(element: Fixed, count: int) -> Fixed:
    """Return a part of fixed size, repeated ``count`` times."""
    if count * len(element.offsets) > MAX_STAMPS:
        raise DefinitionError(f'more than {MAX_STAMPS} stamps in arrays of fixed length')
    offsets = () if not element.offsets else tuple(
        index * element.min_size + offset for index in range(count) for offset in element.offsets)
    return Fixed(count * element.min_size, offsets)


def joined(parts: List[Layout]) -> Layout:
    """Return consecutive parts as one layout, with neighbors of fixed size merged."""
    merged: List[Layout] = []
    for part in flattened(parts):
        if isinstance(part, Fixed) and merged and isinstance(merged[-1], Fixed):
            part = behind(merged.pop(), part)
        merged.append(part)
    if not merged:
        return Fixed(0)
    return merged[0] if len(merged) == 1 else RecordLayout(merged)


def flattened(parts: List[Layout]) -> List[Layout]:
    """Return the parts, with small messages such as a header replaced by their own parts."""
    found: List[Layout] = []
    for part in parts:
        small = isinstance(part, RecordLayout) and len(part.parts) <= 4
        found.extend(part.parts if small and isinstance(part, RecordLayout) else [part])
    return found


def behind(first: Layout, second: Fixed) -> Fixed:
    """Return two consecutive parts of fixed size as one part."""
    assert isinstance(first, Fixed)
    if len(first.offsets) + len(second.offsets) > MAX_STAMPS:
        raise DefinitionError(f'more than {MAX_STAMPS} stamps in a part of fixed size')
    moved = tuple(first.min_size + offset for offset in second.offsets)
    return Fixed(first.min_size + second.min_size, first.offsets + moved)


def until_last_stamp(layout: Layout) -> Layout:
    """Return the layout without the parts after the last stamp, which need not be walked over."""
    if not isinstance(layout, RecordLayout):
        return layout
    parts = list(layout.parts)
    while parts and not parts[-1].has_stamps:
        parts.pop()
    return joined(parts[:-1] + [until_last_stamp(part) for part in parts[-1:]])


NS_PER_S = 1_000_000_000
_STAMP = Struct('<II')  # seconds, nanoseconds
_MAX_STAMP_NS = (1 << 32) * NS_PER_S - 1


class StampLocator:
    """Finds the stamps of one message type in the bytes of its messages.

    A stamp is a single field `time stamp`, in a std_msgs/Header or any other message, at any depth
    and also in arrays (see `is_stamp`). The definition is data: it is parsed with limits and never
    becomes code.
    """

    def __init__(self, type_name: str, definition: str) -> None:
        """Initialize with the message type and its definition, as in the bag's connection.

        Raises:
            DefinitionError: the definition is invalid.
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
        """Return the positions [bytes] of the stamps, ascending, without checking the rest.

        Raises:
            MessageDamaged: the bytes do not fit the definition.
        """
        found: List[int] = []
        self._stamped.walk(data, 0, found)
        return found

    def check(self, data: Data) -> None:
        """Check the whole message; see ``checked_offsets``."""
        self.checked_offsets(data)

    def checked_offsets(self, data: Data) -> List[int]:
        """Return the positions [bytes] of the stamps, ascending, after checking the whole message.

        Raises:
            MessageDamaged: the bytes do not fit the definition, or some are left over.
        """
        found: List[int] = []
        end = self._layout.walk(data, 0, found)
        if end != len(data):
            raise MessageDamaged(f'the message should end at byte {end}, not at {len(data)}')
        return found

    def moved(self, data: Data, mapping: Callable[[int], int]) -> Data:
        """Return the message with the mapping applied to every stamp [ns].

        Stamps of zero stay: they mean "the latest available". The data itself is not changed; it
        is returned as it is if it has no stamp to move.

        Raises:
            MessageDamaged: the bytes do not fit the definition.
            ValueError: the mapping returns an invalid ROS time (below zero, or after 2106).
        """
        pieces = with_stamps_moved(data, self.offsets(data), mapping)
        return data if len(pieces) == 1 else b''.join(pieces)


def with_stamps_moved(data: Data, offsets: Sequence[int],
                      mapping: Callable[[int], int]) -> List[Data]:
    """Return a message in pieces, uncopied, with the stamps [ns] at some offsets replaced.

    Stamps of zero stay: they mean "the latest available".

    Raises:
        ValueError: the mapping returns an invalid ROS time (below zero, or after 2106).
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
    """Return a time [ns] as ROS serializes it.

    Raises:
        ValueError: the time is outside the range of ROS times.
    """
    if not 0 <= stamp_ns <= _MAX_STAMP_NS:
        raise ValueError(f'{stamp_ns} ns is not a ROS time')
    return _STAMP.pack(*divmod(stamp_ns, NS_PER_S))
