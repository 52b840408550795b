# SPDX-License-Identifier: BSD-3-Clause
"""Finds the place of an element of xacro in the files, which xacro itself does not know."""
from __future__ import annotations

from typing import Any, Dict, List, NamedTuple, Optional, Sequence
from xml.dom import minidom
from xml.parsers import expat


class XacroPlace(NamedTuple):
    """A file, and the line in it if known, otherwise 0."""

    file: str
    line: int


class _StartTag(NamedTuple):
    name: str
    attributes: Dict[str, str]
    line: int


def place_in_files(element: Optional[minidom.Element], files: Sequence[str],
                   default: str) -> XacroPlace:
    """Return the place of an element, in the first of some files that has just one like it.

    xacro replaces expressions by values; so an attribute matches any expression in a file.
    If there is no such place, return the ``default`` file.
    """
    if element is not None:
        for file in files:
            lines = [tag.line for tag in _start_tags(file) if _is_like(element, tag)]
            if len(lines) == 1:
                return XacroPlace(file, lines[0])
    return XacroPlace(default, 0)


def _is_like(element: minidom.Element, tag: _StartTag) -> bool:
    attributes: Any = element.attributes  # has no types
    here = dict(attributes.items())
    there = {name: value for name, value in tag.attributes.items()
             if not name.startswith(('xmlns', 'xacro:'))}
    return element.tagName == tag.name and all(
        name in there and (there[name] == value or '$' in there[name])
        for name, value in here.items() if not name.startswith(('xmlns', 'xacro:')))


def _start_tags(file: str) -> List[_StartTag]:
    """Return the start tags of a file; if it cannot be read, those up to the error."""
    tags: List[_StartTag] = []
    parser = expat.ParserCreate()

    def note(name: str, attributes: Dict[str, str]) -> None:
        tags.append(_StartTag(name, attributes, parser.CurrentLineNumber))

    parser.StartElementHandler = note
    try:
        with open(file, 'rb') as stream:
            parser.ParseFile(stream)
    except (OSError, expat.ExpatError):
        return tags
    return tags
