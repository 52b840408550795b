# SPDX-License-Identifier: BSD-3-Clause
"""Reads the values of a message of any type, using the definition sent by its publisher."""
from __future__ import annotations

import struct
from typing import Any, Dict, List, NamedTuple

from process_visualizer.bagio.message_definition import (
    MAX_DEPTH,
    PRIMITIVE_FORMATS,
    PRIMITIVE_SIZES,
    STRING,
    DefinitionError,
    Definitions,
    Field,
)
from process_visualizer.bagio.message_layout import (
    Data,
    MessageDamaged,
    ValueBudget,
    checked_end,
    read_length,
    read_text,
)

MAX_VALUES = 256
"""Maximum length of an array that is read; a longer one (an image) yields only its length."""
_MAX_ELEMENTS = 10_000  # limit of messages in an array


class LongArray(NamedTuple):
    """An array whose numbers were not read."""

    length: int


class MessageTime(NamedTuple):
    """A time or a duration."""

    seconds: int
    nanoseconds: int


Values = Dict[str, Any]
"""Values by field name: numbers, strings, `MessageTime`, `LongArray`, lists, or nested values."""


def message_values(type_name: str, definitions: Definitions, data: Data) -> Values:
    """Return the values of a message.

    Args:
        type_name: its type, package/Type.
        definitions: the result of ``parse_definitions`` for that type.
        data: its bytes.

    Raises:
        MessageDamaged: the bytes do not fit the definition.
        DefinitionError: a type in the definition is unknown, or contains itself.
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
        self._budget = ValueBudget(data)

    def message(self, type_name: str, depth: int) -> Values:
        fields = self._definitions.get(type_name)
        if fields is None or depth > MAX_DEPTH:
            reason = 'is not known' if fields is None else 'contains itself'
            raise DefinitionError(f'the type {type_name} {reason}')
        self._budget.spend(1 + len(fields))
        return {field.name: self._field(field, depth) for field in fields}

    def _field(self, field: Field, depth: int) -> Any:
        if not field.is_array:
            return self._value(field.type_name, depth)
        count = field.length
        if count is None:
            count, self.position = read_length(self._data, self.position)
        if field.type_name in PRIMITIVE_SIZES:
            return self._numbers(field.type_name, count)
        if count > _MAX_ELEMENTS:
            raise MessageDamaged(f'an array of {count} messages is too long')
        return [self._value(field.type_name, depth) for _ in range(count)]

    def _value(self, type_name: str, depth: int) -> Any:
        if type_name == STRING:
            text, self.position = read_text(self._data, self.position)
            return text.decode('utf-8', 'replace')
        if type_name in PRIMITIVE_SIZES:
            return self._numbers(type_name, 1)[0]
        return self.message(type_name, depth + 1)

    def _numbers(self, type_name: str, count: int) -> Any:
        begin = self.position
        self.position = checked_end(self._data, begin, count * PRIMITIVE_SIZES[type_name])
        if count > MAX_VALUES:
            return LongArray(count)
        part = memoryview(self._data)[begin:self.position]
        found: List[Any] = list(struct.iter_unpack(PRIMITIVE_FORMATS[type_name], part))
        return [MessageTime(*it) if len(it) == 2 else it[0] for it in found]
