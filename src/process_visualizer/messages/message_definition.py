# SPDX-License-Identifier: BSD-3-Clause
"""The text of a message definition, as a bag's connection carries it, parsed as data."""
from __future__ import annotations

import re
from typing import Dict, List, NamedTuple, Optional

MAX_CHARACTERS = 1 << 20
MAX_FIELDS = 10_000

PRIMITIVE_SIZES: Dict[str, int] = {  # bytes on the wire
    'bool': 1, 'int8': 1, 'uint8': 1, 'byte': 1, 'char': 1, 'int16': 2, 'uint16': 2,
    'int32': 4, 'uint32': 4, 'int64': 8, 'uint64': 8, 'float32': 4, 'float64': 8,
    'time': 8, 'duration': 8,
}
STRING = 'string'

_SEPARATOR = re.compile(r'^={20,}\s*$', re.MULTILINE)
_TYPE = re.compile(r'([A-Za-z]\w*(?:/[A-Za-z]\w*){0,2})(\[([0-9]{0,9})\])?', re.ASCII)
_NAME = re.compile(r'[A-Za-z]\w*', re.ASCII)


class DefinitionError(Exception):
    """A message definition that cannot be understood; the text says what is wrong."""


class Field(NamedTuple):
    """A field: its name, its full type, and what it is an array of that type of, if it is one."""

    name: str
    type_name: str  # a primitive, 'string', or 'package/Type'
    is_array: bool
    length: Optional[int]  # of an array of fixed length


Definitions = Dict[str, List[Field]]  # by full type name

HEADER = 'std_msgs/Header'
_HEADER_FIELDS = [Field('seq', 'uint32', False, None), Field('stamp', 'time', False, None),
                  Field('frame_id', STRING, False, None)]


def parse_definitions(type_name: str, text: str) -> Definitions:
    """Return the fields of a message type and of all types that its definition carries.

    The text is the definition of the type, followed by those of the types it uses, each behind
    a line of '=' and a line 'MSG: package/Type'. Constants and comments are left out.

    Raises:
        DefinitionError: a line is no field, or the text is too large.
    """
    definitions = {name: _parse_fields(name, body)
                   for name, body in definition_bodies(type_name, text).items()}
    definitions.setdefault(HEADER, _HEADER_FIELDS)
    return definitions


def definition_bodies(type_name: str, text: str) -> Dict[str, str]:
    """Return the text of each type of a definition by its full name.

    Raises:
        DefinitionError: the name of one is missing, or the text is too large.
    """
    if len(text) > MAX_CHARACTERS:
        raise DefinitionError(f'{type_name}: a definition of {len(text)} characters is too large')
    main, *others = _SEPARATOR.split(text.replace('\r\n', '\n'))
    bodies: Dict[str, str] = {}
    for block in others:
        heading, _, body = block.strip().partition('\n')
        if not heading.startswith('MSG:'):
            raise DefinitionError(f'{type_name}: "MSG: package/Type" is missing: {heading[:60]!r}')
        bodies.setdefault(short_name(heading[len('MSG:'):].strip()), body)
    return {**bodies, short_name(type_name): main}


def short_name(type_name: str) -> str:
    """Return 'package/Type' of 'package/Type' or of 'package/msg/Type'.

    The header is always std_msgs/Header, which was roslib/Header once.
    """
    name = type_name.replace('/msg/', '/')
    return HEADER if name in ('Header', 'roslib/Header') else name


def _parse_fields(owner: str, text: str) -> List[Field]:
    lines = (line.partition('#')[0].strip() for line in text.split('\n'))
    # A line with '=' is a constant: it takes no place in a message.
    fields = [_parse_field(owner, line) for line in lines if line and '=' not in line]
    if len(fields) > MAX_FIELDS:
        raise DefinitionError(f'{owner}: {len(fields)} fields are too many')
    return fields


def _parse_field(owner: str, line: str) -> Field:
    words = line.split()
    matched = _TYPE.fullmatch(words[0])
    if len(words) != 2 or not matched or not _NAME.fullmatch(words[1]):
        raise DefinitionError(f'{owner}: this is no field: {line[:60]!r}')
    base, array, length = matched.groups()
    return Field(words[1], _full_name(owner, base), array is not None,
                 int(length) if length else None)


def _full_name(owner: str, base: str) -> str:
    if base in PRIMITIVE_SIZES or base == STRING:
        return base
    if '/' in base or base == 'Header':
        return short_name(base)
    return f'{owner.rpartition("/")[0]}/{base}'
