# SPDX-License-Identifier: BSD-3-Clause
"""Reads an XML file into elements with their lines.

Only data is read: a document type declaration, and with it every entity that a file could
define, is refused, so that neither a local file nor the network nor an expanding entity
("billion laughs") is ever touched. Size and depth are limited, far above anything that a cell
needs, so that no file can exhaust the program.
"""
from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Dict, List
from xml.parsers import expat

from process_visualizer.cell.errors import ConfigurationError, Location, Problem
from process_visualizer.cell.suggestions import missing_file

_LARGEST_FILE_BYTES = 10_000_000
_DEEPEST = 50
_SCHEMA_ATTRIBUTES = ('xmlns:xsi', 'xsi:noNamespaceSchemaLocation')
"""Editors find the schema with these; they say nothing about the cell."""


@dataclass
class Element:
    """An XML element: ``attributes`` in file order, ``text`` without the text of its children.

    ``offset`` is the byte of the file at which it begins.
    """

    tag: str
    attributes: Dict[str, str]
    location: Location
    text: str = ''
    children: List['Element'] = field(default_factory=list)
    offset: int = 0


class _RefusedError(Exception):
    """The file has well-formed XML that is not allowed."""


class _TreeBuilder:
    """Handlers of an expat parser that build the tree of elements."""

    def __init__(self, file: str) -> None:
        self._file = file
        self._parser = expat.ParserCreate()
        self._parser.buffer_text = True
        self._parser.StartElementHandler = self._start
        self._parser.EndElementHandler = self._end
        self._parser.CharacterDataHandler = self._characters
        self._parser.StartDoctypeDeclHandler = self._doctype
        self._open: List[Element] = []
        self._roots: List[Element] = []

    def build(self, data: bytes) -> Element:
        self._parser.Parse(data, True)
        return self._roots[0]

    @property
    def location(self) -> Location:
        return Location(self._file, self._parser.CurrentLineNumber)

    def _start(self, tag: str, attributes: Dict[str, str]) -> None:
        if len(self._open) == _DEEPEST:
            raise _RefusedError(f'elements are nested more than {_DEEPEST} deep')
        own = {name: text for name, text in attributes.items() if name not in _SCHEMA_ATTRIBUTES}
        element = Element(tag, own, self.location, offset=self._parser.CurrentByteIndex)
        siblings = self._open[-1].children if self._open else self._roots
        siblings.append(element)
        self._open.append(element)

    def _end(self, _tag: str) -> None:
        self._open.pop()

    def _characters(self, text: str) -> None:
        self._open[-1].text += text

    def _doctype(self, *_declaration: object) -> None:
        raise _RefusedError('a DOCTYPE declaration and its entities are not allowed; remove it')


def read_xml(path: str) -> Element:
    """The root element of the file.

    Raises:
        ConfigurationError: the file cannot be read, is not well-formed XML, or has a
            document type declaration.
    """
    data = _read_bytes(path)
    if not data.strip():
        raise _error(Location(path, 1), 'the file is empty; a configuration begins with '
                                        '<visualizer>')
    builder = _TreeBuilder(path)
    try:
        return builder.build(data)
    except expat.ExpatError as error:
        reason = expat.ErrorString(error.code)
        raise _error(Location(path, error.lineno),
                     f'not well-formed XML: {reason} (column {error.offset + 1})') from error
    except _RefusedError as error:
        raise _error(builder.location, str(error)) from error
    except (LookupError, ValueError) as error:
        raise _error(builder.location, f'unusable encoding: {error}; save the file as UTF-8'
                     ) from error


def _read_bytes(path: str) -> bytes:
    file = Path(path)
    try:
        if file.is_dir():
            raise _error(Location(path, 1), 'is a folder; name a file in it')
        if file.exists() and not file.is_file():
            raise _error(Location(path, 1), 'is not a regular file; name an XML file')
        if file.exists() and file.stat().st_size > _LARGEST_FILE_BYTES:
            raise _error(Location(path, 1), 'is larger than 10 MB; this is not a configuration')
        return file.read_bytes()
    except FileNotFoundError:
        raise _error(Location(path, 1), missing_file(path)) from None
    except OSError as error:
        raise _error(Location(path, 1), f'cannot be read: {error.strerror}') from error


def _error(location: Location, message: str) -> ConfigurationError:
    return ConfigurationError([Problem(location, '', message)])
