# SPDX-License-Identifier: BSD-3-Clause
"""Message definitions: parsing their text as data, their checksums, and installed definitions."""
from __future__ import annotations

import ast
import hashlib
import re
import struct
import sys
from functools import lru_cache
from pathlib import Path
from typing import Dict, List, NamedTuple, Optional

MAX_CHARACTERS = 1 << 20
MAX_FIELDS = 10_000

MAX_DEPTH = 40  # of messages in messages

PRIMITIVE_FORMATS: Dict[str, str] = {  # little-endian, in the notation of struct and numpy
    'bool': '<?', 'int8': '<b', 'uint8': '<B', 'byte': '<b', 'char': '<B', 'int16': '<h',
    'uint16': '<H', 'int32': '<i', 'uint32': '<I', 'int64': '<q', 'uint64': '<Q',
    'float32': '<f', 'float64': '<d', 'time': '<II', 'duration': '<ii'}
PRIMITIVE_SIZES: Dict[str, int] = {  # bytes on the wire
    name: struct.calcsize(code) for name, code in PRIMITIVE_FORMATS.items()}
STRING = 'string'

_SEPARATOR = re.compile(r'^={20,}\s*$', re.MULTILINE)
_TYPE = re.compile(r'([A-Za-z]\w*(?:/[A-Za-z]\w*){0,2})(\[([0-9]{0,9})\])?', re.ASCII)
_NAME = re.compile(r'[A-Za-z]\w*', re.ASCII)


class DefinitionError(Exception):
    """Raised for an invalid message definition; the text says what is wrong."""


class Field(NamedTuple):
    """A field: its name, its full type, and whether it is an array of that type."""

    name: str
    type_name: str  # a primitive, 'string', or 'package/Type'
    is_array: bool
    length: Optional[int]  # for an array of fixed length


Definitions = Dict[str, List[Field]]  # by full type name

HEADER = 'std_msgs/Header'
_HEADER_FIELDS = [Field('seq', 'uint32', False, None), Field('stamp', 'time', False, None),
                  Field('frame_id', STRING, False, None)]


def parse_definitions(type_name: str, text: str) -> Definitions:
    """Return the fields of a message type and of all types in its definition.

    The text is the definition of the type, followed by the definitions of the types it uses, each
    after a line of '=' and a line 'MSG: package/Type'. Constants and comments are left out.

    Raises:
        DefinitionError: a line is not a field, or the text is too large.
    """
    definitions = {name: _parse_fields(name, body)
                   for name, body in definition_bodies(type_name, text).items()}
    definitions.setdefault(HEADER, _HEADER_FIELDS)
    return definitions


def definition_bodies(type_name: str, text: str) -> Dict[str, str]:
    """Return the text of each type in a definition, by its full name.

    Raises:
        DefinitionError: the name of a type is missing, or the text is too large.
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
    """Return 'package/Type' for 'package/Type' or 'package/msg/Type'.

    The header is always std_msgs/Header, also under its old name roslib/Header.
    """
    name = type_name.replace('/msg/', '/')
    return HEADER if name in ('Header', 'roslib/Header') else name


def _parse_fields(owner: str, text: str) -> List[Field]:
    lines = (line.partition('#')[0].strip() for line in text.split('\n'))
    # A line with '=' is a constant, which takes no space in a message.
    fields = [_parse_field(owner, line) for line in lines if line and '=' not in line]
    if len(fields) > MAX_FIELDS:
        raise DefinitionError(f'{owner}: {len(fields)} fields are too many')
    return fields


def _parse_field(owner: str, line: str) -> Field:
    words = line.split()
    matched = _TYPE.fullmatch(words[0])
    if len(words) != 2 or not matched or not _NAME.fullmatch(words[1]):
        raise DefinitionError(f'{owner}: this is not a field: {line[:60]!r}')
    base, array, length = matched.groups()
    return Field(words[1], _full_name(owner, base), array is not None,
                 int(length) if length else None)


def _full_name(owner: str, base: str) -> str:
    if base in PRIMITIVE_SIZES or base == STRING:
        return base
    if '/' in base or base == 'Header':
        return short_name(base)
    return f'{owner.rpartition("/")[0]}/{base}'


class Connection(NamedTuple):
    """A publisher's description of a topic; ``type`` is `package/Type`, as in the bag."""

    topic: str
    type: str
    md5sum: str
    message_definition: str
    latching: bool
    caller_id: str



def definition_checksum(type_name: str, text: str) -> str:
    """Return the MD5 sum of a message type with this definition, as genmsg computes it.

    Raises:
        DefinitionError: the definition is invalid.
    """
    checksums = _Checksums(parse_definitions(type_name, text), definition_bodies(type_name, text))
    return checksums.of(short_name(type_name), 0)


class _Checksums:
    """Computes the MD5 sums of the types in one definition, each once."""

    def __init__(self, definitions: Definitions, bodies: Dict[str, str]) -> None:
        self._definitions, self._bodies = definitions, bodies
        self._found: Dict[str, str] = {}

    def of(self, type_name: str, depth: int) -> str:
        if type_name not in self._found:
            if type_name not in self._definitions or depth > MAX_DEPTH:
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
    """Return the constants as hashed: type name=value; a string extends to the end of its line."""
    found = []
    for line in body.split('\n'):
        kind, _, rest = line.partition('#')[0].strip().partition(' ')
        if '=' in rest:
            if kind == STRING:
                rest = line.strip().partition(' ')[2]
            name, _, value = rest.partition('=')
            found.append(f'{kind} {name.strip()}={value.strip()}')
    return found


# Installed message definitions, for publishers that do not send their own.
#
# rosjava, goroslib, rosbridge and others send an empty definition, or one without the types that it
# uses. The definition of an installed package replaces it if it has the same MD5 sum. It is read
# from the package's Python module for the type, without importing it: a bag must not run code.

_FULL_TYPE = re.compile(r'([A-Za-z]\w*)/([A-Za-z]\w*)', re.ASCII)
_MAX_BYTES = 4 << 20  # size of a module
_TEXT = '_full_text'


def with_definition(connection: Connection) -> Connection:
    """Return a connection with the installed definition if only that one fits its checksum."""
    if _checksum(connection.type, connection.message_definition) == connection.md5sum:
        return connection
    text = _installed(short_name(connection.type))
    if text is None or _checksum(connection.type, text) != connection.md5sum:
        return connection
    return connection._replace(message_definition=text)


def installed_connection(topic: str, type_name: str) -> Optional[Connection]:
    """Return the connection of a publisher of an installed type; None if it is not installed."""
    text = _installed(short_name(type_name))
    checksum = '' if text is None else _checksum(type_name, text)
    return Connection(topic, type_name, checksum, text or '', False, '') if checksum else None


def definition_problem(connection: Connection) -> str:
    """Return why the messages of a connection cannot be decoded; '' if they can."""
    sent = connection.message_definition.strip()
    found = _checksum(connection.type, connection.message_definition)
    if found and sent:
        return ''
    kind = short_name(connection.type)
    package, installed = kind.partition('/')[0], _installed(kind)
    if found == connection.md5sum and not installed:  # the definition of std_msgs/Empty is empty
        return ''
    if installed is not None:
        why = (f'the one that is installed has the MD5 sum {_checksum(kind, installed)} instead of '
               f'{connection.md5sum}; install the version of {package} that was used then')
    else:
        why = f'the type is not installed here either; install the package {package}'
    return (f'{connection.topic}: its messages cannot be understood: they came with '
            f'{"a part of the" if sent else "no"} definition of {kind}, and {why}')


@lru_cache(maxsize=512)
def _checksum(type_name: str, text: str) -> str:
    """Return the MD5 sum of a definition; '' if it is invalid or lacks a type."""
    try:
        return definition_checksum(type_name, text)
    except DefinitionError:
        return ''


@lru_cache(maxsize=512)
def _installed(type_name: str) -> Optional[str]:
    """Return the whole definition of package/Type; None if it is not installed."""
    matched = _FULL_TYPE.fullmatch(type_name)
    if matched is None:
        return None
    package, name = matched.groups()
    for folder in sys.path:
        text = _text_in(Path(folder, package, 'msg', f'_{name}.py'))
        if text is not None:
            return text
    return None


def _text_in(module: Path) -> Optional[str]:
    """Return the definition in a module generated by genpy; None for any other file."""
    try:
        if not module.is_file() or module.stat().st_size > _MAX_BYTES:
            return None
        tree = ast.parse(module.read_text(encoding='utf-8'))
    except (OSError, ValueError, SyntaxError):
        return None
    assigned = [statement for kind in tree.body if isinstance(kind, ast.ClassDef)
                for statement in kind.body if isinstance(statement, ast.Assign)]
    texts = [statement.value.value for statement in assigned
             if isinstance(statement.targets[0], ast.Name) and statement.targets[0].id == _TEXT
             and isinstance(statement.value, ast.Constant)]
    return texts[0] if texts and isinstance(texts[0], str) else None
