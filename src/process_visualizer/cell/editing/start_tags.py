# SPDX-License-Identifier: BSD-3-Clause
"""Finds start tags and their attributes in the bytes of an XML file."""
from __future__ import annotations

import codecs
import re
from typing import Dict, List, NamedTuple, Optional, Tuple
from xml.parsers import expat

_BYTE_ORDER_MARKS = ((codecs.BOM_UTF8, 'utf-8'), (codecs.BOM_UTF16_LE, 'utf-16-le'),
                     (codecs.BOM_UTF16_BE, 'utf-16-be'))
_NAME = re.compile(r'<[^\s/>]+')
_ATTRIBUTE = re.compile(r'\s+([^\s=/>]+)\s*=\s*("[^"]*"|\'[^\']*\')')


class StartTag(NamedTuple):
    """A start tag: its values as XML has them, its line (from 1), and the byte it begins at.

    ``parent`` are the attributes of the enclosing element.
    """

    tag: str
    attributes: Dict[str, str]
    line: int
    offset: int
    parent: Dict[str, str]


class TagText(NamedTuple):
    """The text from a start tag on, with begin and end of each value between its quotes.

    ``end`` is the place after the last attribute, where another one can be written.
    """

    text: str
    values: Dict[str, Tuple[int, int]]
    end: int


def start_tags(data: bytes) -> List[StartTag]:
    """Return all start tags of a document in their order.

    Raises:
        ValueError: it is not well-formed.
    """
    parser = expat.ParserCreate()
    found: List[StartTag] = []
    around: List[Dict[str, str]] = [{}]

    def start(tag: str, attributes: Dict[str, str]) -> None:
        found.append(StartTag(tag, attributes, parser.CurrentLineNumber, parser.CurrentByteIndex,
                              around[-1]))
        around.append(attributes)

    parser.StartElementHandler = start
    parser.EndElementHandler = lambda _tag: around.pop()
    try:
        parser.Parse(data, True)
    except (expat.ExpatError, LookupError) as error:
        raise ValueError(f'it is not well-formed: {error}') from error
    return found


def encoding_of(data: bytes) -> str:
    """Return the name of the encoding of a document that is well-formed."""
    for mark, name in _BYTE_ORDER_MARKS:
        if data.startswith(mark):
            return name
    declared: List[Optional[str]] = []
    parser = expat.ParserCreate()
    parser.XmlDeclHandler = lambda _version, encoding, _standalone: declared.append(encoding)
    parser.Parse(data, True)
    return (declared[0] if declared else None) or 'utf-8'


def tag_text(data: bytes, tag: StartTag) -> TagText:
    """Return a start tag as it is written.

    Raises:
        ValueError: its parts cannot be found in the bytes.
    """
    text = data[tag.offset:].decode(encoding_of(data))
    name = _NAME.match(text)
    if name is None:
        raise ValueError('there is no start tag where one is expected')
    values: Dict[str, Tuple[int, int]] = {}
    end = name.end()
    attribute = _ATTRIBUTE.match(text, end)
    while attribute:
        begin, end = attribute.span(2)
        values[attribute.group(1)] = begin + 1, end - 1
        attribute = _ATTRIBUTE.match(text, end)
    if values.keys() != tag.attributes.keys():
        raise ValueError('its attributes cannot be distinguished')
    return TagText(text, values, end)
