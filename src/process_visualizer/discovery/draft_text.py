# SPDX-License-Identifier: BSD-3-Clause
"""A draft of a configuration as the text of its file."""
from __future__ import annotations

import textwrap
from typing import Iterator, List, Sequence
from xml.sax.saxutils import quoteattr

from process_visualizer.cell.elements import DEFAULT_FRAME
from process_visualizer.discovery.draft import Draft, DraftDevice, DraftElement

_WIDTH = 96


def draft_text(draft: Draft) -> str:
    """Return the file's text."""
    frame = '' if draft.frame == DEFAULT_FRAME else f' frame={quoteattr(draft.frame)}'
    head = [f'Made by "cell new" from {draft.where}. Remove what is not wanted, and look at each '
            'comment.', *draft.remarks]
    lines = ['<?xml version="1.0" encoding="utf-8"?>', *comment_lines(head, ''),
             f'<visualizer{frame}>']
    for device in draft.devices:
        lines += _device(device)
    return '\n'.join([*lines, '</visualizer>', ''])


def _device(device: DraftDevice) -> Iterator[str]:
    yield from comment_lines(device.comments, '  ')
    opening = f'  <device type="{device.type}" name={quoteattr(device.name)}'
    if not device.elements:
        yield f'{opening} />'
        return
    yield f'{opening}>'
    for element in device.elements:
        yield from comment_lines([element.comment] if element.comment else [], '    ')
        if element.active:
            yield from _element(element, '    ')
        else:
            yield from (f'    <!-- {_safe(line)} -->' for line in _element(element, ''))
    yield '  </device>'


def _element(element: DraftElement, indent: str) -> Iterator[str]:
    words = ' '.join([element.tag, *(f'{name}={quoteattr(value)}'
                                     for name, value in element.attributes.items())])
    if not element.children:
        yield f'{indent}<{words} />'
        return
    yield f'{indent}<{words}>'
    for child in element.children:
        yield from _element(child, f'{indent}  ')
    yield f'{indent}</{element.tag}>'


def comment_lines(paragraphs: Sequence[str], indent: str) -> List[str]:
    """Return paragraphs as the lines of a comment; nothing without any."""
    lines = [line for it in paragraphs
             for line in textwrap.wrap(_safe(it), _WIDTH, break_long_words=False)]
    if len(lines) < 2:
        return [f'{indent}<!-- {line} -->' for line in lines]
    return [f'{indent}<!--', *(f'{indent}  {line}' for line in lines), f'{indent}-->']


def _safe(text: str) -> str:
    """The text as it may stand in a comment: without two hyphens, or what XML has no sign for."""
    shown = ''.join(it if it.isprintable() and it not in '\ufffe\uffff' else '?' for it in text)
    return shown.replace('--', '-\u2010').rstrip('-')
