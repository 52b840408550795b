# SPDX-License-Identifier: BSD-3-Clause
"""The values of a message of any type, read by the definition that its publisher sends along."""
from __future__ import annotations

import struct
from typing import Any, Dict, List, NamedTuple

from process_visualizer.bagio.message_definition import (
    PRIMITIVE_SIZES,
    STRING,
    DefinitionError,
    Definitions,
    Field,
)
from process_visualizer.bagio.message_layout import Data, MessageDamaged, checked_end, read_length

MAX_VALUES = 256
"""Numbers of an array that are read; of a longer one (an image) only the length is."""
_MAX_ELEMENTS = 10_000  # messages in an array
_DEEPEST = 40  # messages within messages
_FORMATS: Dict[str, str] = {
    'bool': '?', 'int8': 'b', 'uint8': 'B', 'byte': 'b', 'char': 'B', 'int16': 'h', 'uint16': 'H',
    'int32': 'i', 'uint32': 'I', 'int64': 'q', 'uint64': 'Q', 'float32': 'f', 'float64': 'd',
    'time': 'II', 'duration': 'ii'}


class LongArray(NamedTuple):
    """An array whose numbers were not read."""

    length: int


class MessageTime(NamedTuple):
    """A time or a duration."""

    seconds: int
    nanoseconds: int


Values = Dict[str, Any]
"""By the names of the fields: numbers, texts, `MessageTime`, `LongArray`, lists, or values."""


def message_values(type_name: str, definitions: Definitions, data: Data) -> Values:
    """Return the values of a message.

    Args:
        type_name: its type, package/Type.
        definitions: as ``parse_definitions`` returns them for that type.
        data: its bytes.

    Raises:
        MessageDamaged: the bytes do not fit the definition.
        DefinitionError: a type in it is not known, or contains itself.
    """
    reader = _Reader(definitions, data)
    values = reader.message(type_name, 0)
    if reader.position != len(data):
        raise MessageDamaged(f'{len(data) - reader.position} bytes are too many')
    return values


class _Reader:
    """Walks over the bytes of a message."""

    def __init__(self, definitions: Definitions, data: Data) -> None:
        self.position = 0
        self._definitions, self._data = definitions, data

    def message(self, type_name: str, depth: int) -> Values:
        fields = self._definitions.get(type_name)
        if fields is None or depth > _DEEPEST:
            reason = 'is not known' if fields is None else 'contains itself'
            raise DefinitionError(f'the type {type_name} {reason}')
        return {field.name: self._field(field, depth) for field in fields}

    def _field(self, field: Field, depth: int) -> Any:
        if not field.is_array:
            return self._value(field.type_name, depth)
        count = self._length() if field.length is None else field.length
        if field.type_name in PRIMITIVE_SIZES:
            return self._numbers(field.type_name, count)
        if count > _MAX_ELEMENTS:
            raise MessageDamaged(f'an array of {count} messages is too long')
        return [self._value(field.type_name, depth) for _ in range(count)]

    def _value(self, type_name: str, depth: int) -> Any:
        if type_name == STRING:
            return bytes(self._take(self._length())).decode('utf-8', 'replace')
        if type_name in PRIMITIVE_SIZES:
            return self._numbers(type_name, 1)[0]
        return self.message(type_name, depth + 1)

    def _numbers(self, type_name: str, count: int) -> Any:
        part = self._take(count * PRIMITIVE_SIZES[type_name])
        if count > MAX_VALUES:
            return LongArray(count)
        found: List[Any] = list(struct.iter_unpack(f'<{_FORMATS[type_name]}', part))
        return [MessageTime(*it) if len(it) == 2 else it[0] for it in found]

    def _length(self) -> int:
        length, self.position = read_length(self._data, self.position)
        return length

    def _take(self, size: int) -> memoryview:
        begin, self.position = self.position, checked_end(self._data, self.position, size)
        return memoryview(self._data)[begin:self.position]
