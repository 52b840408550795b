# SPDX-License-Identifier: BSD-3-Clause
"""Checks XML elements against the language and turns their attributes into values."""
from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Dict, List, Optional
from xml.parsers import expat

from process_visualizer.cell.elements import CONDITIONS, TAGS, Attribute, Tag
from process_visualizer.cell.errors import (
    ConfigurationError,
    Location,
    Problem,
    ProblemList,
    advice,
    missing_file,
    quoted,
)
from process_visualizer.cell.substitution import Arguments, UnresolvedArgumentError, substitute
from process_visualizer.cell.values import CONVERTERS

# Reads an XML file into elements with their lines.
#
# Only data is read. A document type declaration is refused, and with it every entity that a file
# could define: no local file is read, no network is accessed, and no entity ("billion laughs") is
# expanded. Size and depth have limits far above the needs of any cell, so that no file can exhaust
# the program.

_MAX_FILE_BYTES = 10_000_000
_DEEPEST = 50
_SCHEMA_ATTRIBUTES = ('xmlns:xsi', 'xsi:noNamespaceSchemaLocation')
"""Attributes by which editors find the schema; they do not concern the cell."""


@dataclass
class Element:
    """An XML element: ``attributes`` in file order, ``text`` without the text of its children.

    ``offset`` is the byte of the file at which the element begins.
    """

    tag: str
    attributes: Dict[str, str]
    location: Location
    text: str = ''
    children: List['Element'] = field(default_factory=list)
    offset: int = 0


class _RefusedError(Exception):
    """Raised for well-formed XML that is not allowed."""


class _TreeBuilder:
    """Builds the tree of elements in the handlers of an expat parser."""

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
    """Return the root element of the file.

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
        if file.exists() and file.stat().st_size > _MAX_FILE_BYTES:
            raise _error(Location(path, 1), 'is larger than 10 MB; this is not a configuration')
        return file.read_bytes()
    except FileNotFoundError:
        raise _error(Location(path, 1), missing_file(path)) from None
    except OSError as error:
        raise _error(Location(path, 1), f'cannot be read: {error.strerror}') from error


def _error(location: Location, message: str) -> ConfigurationError:
    return ConfigurationError([Problem(location, '', message)])


@dataclass
class Parsed:
    """An element with its typed values.

    ``readable`` is False if the element's own attributes are wrong; ``sound`` is also False if
    anything below it is wrong. ``values`` has every attribute of the tag; a wrong one has its
    default, or None if there is no default. An element is ``complete`` if no required value is
    missing, so that the search for further problems can continue. ``given`` has the substituted
    text of the attributes in the file, ``wrong`` the names of those without a valid value.
    """

    tag: str
    location: Location
    values: Dict[str, Any] = field(default_factory=dict)
    given: Dict[str, str] = field(default_factory=dict)
    wrong: List[str] = field(default_factory=list)
    text: str = ''
    children: List['Parsed'] = field(default_factory=list)
    readable: bool = True
    sound: bool = True
    complete: bool = True

    def all(self, tag: str) -> List['Parsed']:
        """Return the complete children with this tag, in file order."""
        return [child for child in self.children if child.tag == tag and child.complete]

    def first(self, tag: str) -> Optional['Parsed']:
        """Return the first complete child with this tag."""
        return next(iter(self.all(tag)), None)


class ElementReader:
    """Reads elements of one file, using the values of its ``<arg>`` elements."""

    def __init__(self, arguments: Arguments, problems: ProblemList) -> None:
        self._arguments = arguments
        self._problems = problems

    def read(self, element: Element, tag: Optional[Tag] = None) -> Optional[Parsed]:
        """Return the element with its descendants, or None if its condition (if, unless) drops it.

        ``tag`` is its description; the default is the description for its name.
        """
        before = len(self._problems)
        tag = tag or TAGS[element.tag]
        parsed = Parsed(element.tag, element.location)
        self._read_attributes(element, tag, parsed)
        parsed.readable = parsed.readable and len(self._problems) == before
        parsed.complete = _is_complete(parsed, tag)
        if parsed.values.get('if') is False or parsed.values.get('unless') is True:
            return None
        self._read_text(element, tag, parsed)
        self._read_children(element, tag, parsed)
        parsed.sound = (parsed.readable and len(self._problems) == before
                        and all(child.sound for child in parsed.children))
        return parsed

    def _read_attributes(self, element: Element, tag: Tag, parsed: Parsed) -> None:
        for name in element.attributes:
            if name not in tag.attributes:
                self._problem(element, f'unknown attribute {quoted(name)}; '
                              + advice(name, tag.attributes))
        for name, attribute in tag.attributes.items():
            text = element.attributes.get(name)
            if text is None and attribute.required:
                self._problem(element, f'the attribute "{name}" is missing ({attribute.help})')
            parsed.values[name] = self._value(element, name, attribute, text, parsed)
        self._check_alternatives(element, tag)

    def _check_alternatives(self, element: Element, tag: Tag) -> None:
        for names in (tag.alternatives, CONDITIONS):
            given = [name for name in names if name in element.attributes]
            if len(given) > 1:
                self._problem(element, f'has both "{given[0]}" and "{given[1]}"; keep one')
        if tag.needs_alternative and not any(name in element.attributes
                                             for name in tag.alternatives):
            one_of = ' or '.join(f'"{name}"' for name in tag.alternatives)
            self._problem(element, f'the attribute {one_of} is missing')

    def _value(self, element: Element, name: str, attribute: Attribute, text: Optional[str],
               parsed: Parsed) -> Any:
        try:
            if text is not None:
                text = substitute(text, self._arguments, element.location.file)
                parsed.given[name] = text
                return _convert(attribute, text)
        except UnresolvedArgumentError:  # reported where the argument is declared
            parsed.readable = False
        except ValueError as error:
            parsed.wrong.append(name)
            self._problem(element, f'attribute "{name}": {error}')
        return None if attribute.default is None else _convert(attribute, attribute.default)

    def _read_text(self, element: Element, tag: Tag, parsed: Parsed) -> None:
        parsed.text = element.text
        if not tag.text and element.text.strip():
            self._problem(element, f'unexpected text {quoted(element.text)}; write values as '
                                   'attributes')
        elif tag.text and parsed.values.get('subst_value'):
            self._resolve_text(element, parsed)

    def _resolve_text(self, element: Element, parsed: Parsed) -> None:
        try:
            parsed.text = substitute(element.text, self._arguments, element.location.file)
        except UnresolvedArgumentError:
            parsed.readable = False
        except ValueError as error:
            self._problem(element, str(error))

    def _read_children(self, element: Element, tag: Tag, parsed: Parsed) -> None:
        for child in element.children:
            if child.tag not in tag.children:
                self._unknown_child(child, element, tag)
                continue
            read = self.read(child, tag.child(child.tag))
            if read is None:
                continue
            if child.tag in tag.single and any(it.tag == child.tag for it in parsed.children):
                self._problem(child, f'occurs more than once in <{element.tag}>; keep one')
            parsed.children.append(read)

    def _unknown_child(self, child: Element, parent: Element, tag: Tag) -> None:
        if not tag.children:
            self._problem(child, f'<{parent.tag}> cannot contain elements; remove it')
        elif child.tag in TAGS:
            self._problem(child, f'is not allowed in <{parent.tag}>; '
                          + 'expected one of: ' + ', '.join(sorted(tag.children)))
        else:
            self._problem(child, f'unknown element in <{parent.tag}>; '
                          + advice(child.tag, tag.children))

    def _problem(self, element: Element, message: str) -> None:
        self._problems.add(element.location, element.tag, message)


def _is_complete(parsed: Parsed, tag: Tag) -> bool:
    needed = [name for name, attribute in tag.attributes.items() if attribute.required]
    return (all(parsed.values[name] is not None for name in needed)
            and (not tag.needs_alternative
                 or any(parsed.values[name] is not None for name in tag.alternatives)))


def _convert(attribute: Attribute, text: str) -> Any:
    value = CONVERTERS[attribute.kind](text)
    if attribute.choices and value not in attribute.choices:
        raise ValueError(f'{quoted(text)} is not a valid value; '
                         + advice(str(value), attribute.choices))
    return value
