# SPDX-License-Identifier: BSD-3-Clause
"""From a parsed message definition to the layout of the message's bytes."""
from __future__ import annotations

from typing import Dict, List

from process_visualizer.messages.message_definition import (
    PRIMITIVE_SIZES,
    STRING,
    DefinitionError,
    Definitions,
    Field,
)
from process_visualizer.messages.message_layout import Blob, Fixed, Layout, Record, Repeated

MAX_DEPTH = 40  # of messages in messages
MAX_STAMPS = 10_000  # in a part of fixed size


class LayoutCompiler:
    """Builds the layouts of the types of one definition, each type once."""

    def __init__(self, definitions: Definitions) -> None:
        """Take the fields of all types."""
        self._definitions = definitions
        self._layouts: Dict[str, Layout] = {}
        self._open: List[str] = []  # the types being built, outermost first

    def message(self, type_name: str) -> Layout:
        """Return the layout of a message type ('package/Type').

        Raises:
            DefinitionError: a type is missing, contains itself, or is nested or repeated absurdly.
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
    """Return whether a field says when its message was true: a single `time` named `stamp`.

    This is what std_msgs/Header has, and what types without a header call it (velodyne_msgs,
    actionlib_msgs/GoalID). Other times are data: a map's load time, a GPS receiver's reference,
    the simulated /clock, a duration.
    """
    return field.type_name == 'time' and field.name == 'stamp' and not field.is_array


def times(element: Fixed, count: int) -> Fixed:
    """Return a part of fixed size, repeated."""
    if count * len(element.offsets) > MAX_STAMPS:
        raise DefinitionError(f'more than {MAX_STAMPS} stamps in arrays of fixed length')
    offsets = () if not element.offsets else tuple(
        index * element.min_size + offset for index in range(count) for offset in element.offsets)
    return Fixed(count * element.min_size, offsets)


def joined(parts: List[Layout]) -> Layout:
    """Return parts one behind the other as one; neighbours of fixed size become one part."""
    merged: List[Layout] = []
    for part in flattened(parts):
        if isinstance(part, Fixed) and merged and isinstance(merged[-1], Fixed):
            part = behind(merged.pop(), part)
        merged.append(part)
    if not merged:
        return Fixed(0)
    return merged[0] if len(merged) == 1 else Record(merged)


def flattened(parts: List[Layout]) -> List[Layout]:
    """Return the parts with those of small messages, such as a header, in the place of these."""
    found: List[Layout] = []
    for part in parts:
        small = isinstance(part, Record) and len(part.parts) <= 4
        found.extend(part.parts if small and isinstance(part, Record) else [part])
    return found


def behind(first: Layout, second: Fixed) -> Fixed:
    """Return two parts of fixed size as one."""
    assert isinstance(first, Fixed)
    if len(first.offsets) + len(second.offsets) > MAX_STAMPS:
        raise DefinitionError(f'more than {MAX_STAMPS} stamps in a part of fixed size')
    moved = tuple(first.min_size + offset for offset in second.offsets)
    return Fixed(first.min_size + second.min_size, first.offsets + moved)


def until_last_stamp(layout: Layout) -> Layout:
    """Return the layout without the parts that follow the last stamp: no need to walk these."""
    if not isinstance(layout, Record):
        return layout
    parts = list(layout.parts)
    while parts and not parts[-1].has_stamps:
        parts.pop()
    return joined(parts[:-1] + [until_last_stamp(part) for part in parts[-1:]])
