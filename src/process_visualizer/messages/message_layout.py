# SPDX-License-Identifier: BSD-3-Clause
"""Places of a message's parts in its bytes: the wire format of ROS, without its values.

A layout walks over the bytes of a message, noting where the
stamps are. Whatever is of a known size is skipped at once, however long.
"""
from __future__ import annotations

from abc import ABC, abstractmethod
from struct import Struct
from typing import List, Optional, Sequence, Tuple, Union

Data = Union[bytes, bytearray, memoryview]

_LENGTH = Struct('<I')


class MessageDamaged(Exception):
    """The bytes of a message do not fit its definition; the text says where."""


class Layout(ABC):
    """A part of a message; min_size is the fewest bytes [bytes] that it takes."""

    min_size: int
    has_stamps: bool

    @abstractmethod
    def walk(self, data: Data, position: int, stamps: List[int]) -> int:
        """Return the position behind the part that begins at a position; note its stamps.

        Raises:
            MessageDamaged: the part does not fit into the data.
        """


class Fixed(Layout):
    """A part that always takes the same bytes; its stamps are at the same offsets."""

    def __init__(self, size: int, offsets: Tuple[int, ...] = ()) -> None:
        """Take the size [bytes] and the offsets of the stamps."""
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
        """Take the size [bytes] of an element."""
        self.min_size = _LENGTH.size
        self._element_size = element_size

    def walk(self, data: Data, position: int, stamps: List[int]) -> int:
        """See Layout."""
        count, position = read_length(data, position)
        return checked_end(data, position, count * self._element_size)


class Repeated(Layout):
    """An array: a fixed number of elements, or (None) as many as the length before them says."""

    def __init__(self, element: Layout, count: Optional[int]) -> None:
        """Take the layout of an element and the number of them."""
        self._element = element
        self._count = count
        self.min_size = _LENGTH.size if count is None else count * element.min_size
        self.has_stamps = element.has_stamps

    def walk(self, data: Data, position: int, stamps: List[int]) -> int:
        """See Layout; the work is bounded, as every element takes bytes."""
        count = self._count
        if count is None:
            count, position = read_length(data, position)
        checked_end(data, position, count * self._element.min_size)
        walk = self._element.walk
        for _ in range(count):
            position = walk(data, position, stamps)
        return position


class Record(Layout):
    """Parts one behind the other: a message."""

    def __init__(self, parts: Sequence[Layout]) -> None:
        """Take the parts in their order."""
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
        MessageDamaged: that is behind the end of the data.
    """
    end = position + size
    if end > len(data):
        raise MessageDamaged(
            f'{size} bytes are expected at byte {position}, but the message ends at {len(data)}')
    return end


def read_length(data: Data, position: int) -> Tuple[int, int]:
    """Return the length of an array or string at a position, and the position behind it."""
    end = checked_end(data, position, _LENGTH.size)
    return _LENGTH.unpack_from(data, position)[0], end
