# SPDX-License-Identifier: BSD-3-Clause
"""The MD5 sum of a message definition, by which ROS tells whether two are the same."""
from __future__ import annotations

import hashlib
from typing import Dict, List

from process_visualizer.messages.message_definition import (
    PRIMITIVE_SIZES,
    STRING,
    DefinitionError,
    Definitions,
    Field,
    definition_bodies,
    parse_definitions,
    short_name,
)

_MAX_DEPTH = 40  # of messages in messages


def definition_checksum(type_name: str, text: str) -> str:
    """Return the MD5 sum of a message type with this definition, as genmsg computes it.

    Raises:
        DefinitionError: the definition cannot be understood.
    """
    checksums = _Checksums(parse_definitions(type_name, text), definition_bodies(type_name, text))
    return checksums.of(short_name(type_name), 0)


class _Checksums:
    """The MD5 sums of the types of one definition, each found once."""

    def __init__(self, definitions: Definitions, bodies: Dict[str, str]) -> None:
        self._definitions, self._bodies = definitions, bodies
        self._found: Dict[str, str] = {}

    def of(self, type_name: str, depth: int) -> str:
        if type_name not in self._found:
            if type_name not in self._definitions or depth > _MAX_DEPTH:
                raise DefinitionError(f'{type_name} is missing, or nested too deeply')
            lines = _constants(self._bodies.get(type_name, ''))
            lines += [self._line(field, depth) for field in self._definitions[type_name]]
            self._found[type_name] = hashlib.md5('\n'.join(lines).strip().encode()).hexdigest()
        return self._found[type_name]

    def _line(self, field: Field, depth: int) -> str:
        if field.type_name not in PRIMITIVE_SIZES and field.type_name != STRING:
            return f'{self.of(field.type_name, depth + 1)} {field.name}'
        length = '' if field.length is None else field.length
        return f'{field.type_name}{f"[{length}]" if field.is_array else ""} {field.name}'


def _constants(body: str) -> List[str]:
    """The lines of constants as they count: type name=value; a text goes to the end of its line."""
    found = []
    for line in body.split('\n'):
        kind, _, rest = line.partition('#')[0].strip().partition(' ')
        if '=' in rest:
            if kind == STRING:
                rest = line.strip().partition(' ')[2]
            name, _, value = rest.partition('=')
            found.append(f'{kind} {name.strip()}={value.strip()}')
    return found
