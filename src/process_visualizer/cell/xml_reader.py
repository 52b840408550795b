"""Reads an XML file into elements that know their line.

Only data is read: a document type declaration, and with it every entity that a file could
define, is refused, so that neither a local file nor the network nor an expanding entity
("billion laughs") is ever touched.
"""
from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Dict, List
from xml.parsers import expat

from process_visualizer.cell.errors import ConfigurationError, Location, Problem


@dataclass
class Element:
    """An XML element: ``attributes`` in file order, ``text`` without the text of its children."""

    tag: str
    attributes: Dict[str, str]
    location: Location
    text: str = ''
    children: List['Element'] = field(default_factory=list)


class _DoctypeError(Exception):
    """The file has a document type declaration."""


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
        element = Element(tag, attributes, self.location)
        siblings = self._open[-1].children if self._open else self._roots
        siblings.append(element)
        self._open.append(element)

    def _end(self, _tag: str) -> None:
        self._open.pop()

    def _characters(self, text: str) -> None:
        self._open[-1].text += text

    def _doctype(self, *_declaration: object) -> None:
        raise _DoctypeError


def read_xml(path: str) -> Element:
    """The root element of the file.

    Raises ConfigurationError when the file cannot be read, is not well-formed XML, or has a
    document type declaration.
    """
    try:
        data = Path(path).read_bytes()
    except OSError as error:
        raise _error(Location(path, 1), f'cannot be read: {error.strerror}') from error
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
    except _DoctypeError as error:
        raise _error(builder.location, 'a DOCTYPE declaration and its entities are not allowed; '
                                       'remove it') from error
    except (LookupError, ValueError) as error:
        raise _error(builder.location, f'unusable encoding: {error}; save the file as UTF-8'
                     ) from error


def _error(location: Location, message: str) -> ConfigurationError:
    return ConfigurationError([Problem(location, '', message)])
