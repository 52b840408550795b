# SPDX-License-Identifier: BSD-3-Clause
"""Writes the element <tool> of a robot into the text of a configuration."""
from __future__ import annotations

import re
from typing import List
from xml.sax.saxutils import quoteattr

from process_visualizer.cell.editing.number_text import number_text
from process_visualizer.cell.editing.start_tags import StartTag, encoding_of, start_tags, tag_text
from process_visualizer.cell.model import Pose

_TAG_END = re.compile(r'\s*>')
_REST_OF_LINE = re.compile(r'[ \t]*(<!--(?:(?!-->)[^\n])*-->)?[ \t]*(?=\r?\n)')
_INDENT = re.compile(r'(\r?\n)([ \t]*)$')
_CHILD = re.compile(r'\n([ \t]*)<')


def tool_element(frame: str, pose: Pose) -> str:
    """Return the element as it is written."""
    parts = [f'frame={quoteattr(frame)}']
    for name, vector in (('xyz', pose.xyz), ('ypr', pose.ypr)):
        numbers = [number_text(value) for value in vector]
        if numbers != ['0', '0', '0']:
            parts.append(f'{name}="{" ".join(numbers)}"')
    return f'<tool {" ".join(parts)} />'


def with_tool(data: bytes, device: StartTag, frame: str, pose: Pose) -> bytes:
    """Return a document with a <tool> as the first element of a device that has none.

    Raises:
        ValueError: it cannot be written there; the text says why.
    """
    element, encoding = tool_element(frame, pose), encoding_of(data)
    written = tag_text(data, device)
    end = _TAG_END.match(written.text, written.end)
    if end is None:
        raise ValueError('the start tag of the device is not followed by elements; write '
                         f'{element} by hand')
    rest = _REST_OF_LINE.match(written.text, end.end())
    place = end.end() if rest is None else rest.end()
    before = data[:device.offset].decode(encoding)
    new = element if rest is None else _own_line(before, written.text[place:], element)
    text = written.text[:place] + new + written.text[place:]
    result = data[:device.offset] + text.encode(encoding)
    _check(start_tags(data), start_tags(result), device, frame)
    return result


def _own_line(before: str, after: str, element: str) -> str:
    """Return the element on a separate line, indented like the next one."""
    indent, child = _INDENT.search(before), _CHILD.match(after)
    if indent is None:
        return element
    line_end, own = indent.group(1), indent.group(2)
    inner = own + '  ' if child is None or len(child.group(1)) <= len(own) else child.group(1)
    return f'{line_end}{inner}{element}'


def _check(before: List[StartTag], after: List[StartTag], device: StartTag, frame: str) -> None:
    """Make sure that only the element is new, whatever the file looks like."""
    index = [it.offset for it in before].index(device.offset) + 1
    added, others = after[index], [*after[:index], *after[index + 1:]]
    if (added.tag, added.attributes.get('frame'), added.parent) != ('tool', frame,
                                                                     device.attributes) \
            or [(it.tag, it.attributes) for it in others] != [
                (it.tag, it.attributes) for it in before]:
        raise ValueError('it cannot be changed without other changes; edit it by hand')
