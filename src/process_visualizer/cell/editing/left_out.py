# SPDX-License-Identifier: BSD-3-Clause
"""Takes elements and attributes out of a configuration file; comments say what stood there."""
from __future__ import annotations

import re
from typing import Dict, List, NamedTuple, Sequence, Tuple
from xml.parsers import expat

from process_visualizer.cell.confinement import Removal
from process_visualizer.cell.editing.start_tags import (
    StartTag,
    encoding_of,
    start_tags,
    tag_text,
)

_LONGEST = 200


class _Cut(NamedTuple):
    begin: int
    end: int
    text: bytes


def without(data: bytes, removals: Sequence[Removal]) -> bytes:
    """Return the bytes of a file without some elements and attributes of it.

    Raises:
        ValueError: they cannot be found in the bytes.
    """
    tags = {tag.offset: tag for tag in start_tags(data)}
    ends = _ends(data)
    cuts: List[_Cut] = []
    for removal in removals:
        tag = tags.get(removal.offset)
        if tag is None:
            raise ValueError('an element cannot be found in the file')
        cuts.append(_attribute(data, tag, removal.attribute) if removal.attribute
                    else _element(data, tag, ends[tag.offset]))
    for cut in sorted(cuts, reverse=True):
        data = data[:cut.begin] + cut.text + data[cut.end:]
    return data


def _ends(data: bytes) -> Dict[int, int]:
    """Return the begin of each element's end tag, or an empty element's end, by its begin."""
    parser = expat.ParserCreate()
    begun: List[int] = []
    ends: Dict[int, int] = {}
    parser.StartElementHandler = lambda *_: begun.append(parser.CurrentByteIndex)
    parser.EndElementHandler = lambda _: ends.update({begun.pop(): parser.CurrentByteIndex})
    parser.Parse(data, True)
    return ends


def _parts(data: bytes, tag: StartTag) -> Tuple[str, str]:
    """The start tag up to its last attribute, and what follows it."""
    if not data[tag.offset:].startswith(b'<'):
        raise ValueError('its encoding has other bytes than ASCII')
    text = tag_text(data, tag)
    return text.text[:text.end], text.text[text.end:]


def _element(data: bytes, tag: StartTag, end: int) -> _Cut:
    start, rest = _parts(data, tag)
    if not rest.lstrip().startswith('/>'):
        end = data.index(b'>', end) + 1
    shown = re.sub('-(?=-)|-$', '- ', ' '.join(start.split())[:_LONGEST])
    comment = f'<!-- left out, as it was in a recording: {shown}> -->'
    return _Cut(tag.offset, end, comment.encode(encoding_of(data), 'replace'))


def _attribute(data: bytes, tag: StartTag, name: str) -> _Cut:
    text = tag_text(data, tag)
    encoding = encoding_of(data)
    begin, end = text.values[name]
    before = re.sub(rf'\s+{re.escape(name)}\s*=\s*["\']\Z', '', text.text[:begin])
    start = tag.offset + len(before.encode(encoding))
    return _Cut(start, tag.offset + len(text.text[:end + 1].encode(encoding)), b'')
