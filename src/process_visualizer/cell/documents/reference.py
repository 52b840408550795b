# SPDX-License-Identifier: BSD-3-Clause
"""The tables of the reference in the documentation, made from the table ``elements``."""
from __future__ import annotations

import re
from typing import Dict, List, Tuple

from process_visualizer.cell.displays import DISPLAY_TYPES
from process_visualizer.cell.elements import CONDITIONS, MESSAGE_TYPES, TAGS, Attribute, Tag

_BLOCK = re.compile(r'(<!-- begin (\w+) -->\n).*?(<!-- end \2 -->)', re.DOTALL)

_KINDS: Dict[str, str] = {
    'axis': 'direction', 'boolean': 'True or False', 'color': 'colour', 'command_line': 'text',
    'environment': 'name', 'executable': 'file name', 'field': 'field', 'frame': 'frame',
    'integer': 'whole number', 'length': 'number ≥ 0', 'message': 'message type', 'name': 'name',
    'names': 'names', 'namespace': 'ROS name', 'number': 'number', 'package': 'package',
    'path': 'path',
    'positive': 'number > 0', 'resource': 'ROS name', 'size': 'three numbers > 0',
    'text': 'text', 'topic': 'ROS name', 'vector': 'three numbers',
}


def updated_reference(text: str) -> str:
    """The text with every block between ``<!-- begin X -->`` and ``<!-- end X -->`` replaced.

    ``X`` is a tag, ``display_types`` or ``message_types``; raises KeyError for another.
    """
    return _BLOCK.sub(lambda match: match[1] + block(match[2]) + match[3], text)


def block(name: str) -> str:
    """One block in Markdown, ending with a newline."""
    if name == 'display_types':
        return _display_types()
    if name == 'message_types':
        return _table(('`type` of the topic', 'possible message types'),
                      [(f'`{function}`', ', '.join(f'`{it}`' for it in types))
                       for function, types in MESSAGE_TYPES.items()])
    parts = [_tag(name, TAGS[name])]
    parts += [f'\n`<{child}>` in `<{name}>`: {_tag(child, variant)}'
              for child, variant in TAGS[name].variants.items()]
    return ''.join(parts)


def _tag(name: str, tag: Tag) -> str:
    lines = f'{tag.help}\n\n'
    lines += _table(('attribute', 'value', 'default', 'meaning'),
                    [(f'`{attribute_name}`', _value(attribute), _default(attribute),
                      attribute.help)
                     for attribute_name, attribute in tag.attributes.items()
                     if attribute_name not in CONDITIONS])
    if CONDITIONS[0] in tag.attributes:
        lines += '\nAlso `if` and `unless`.\n'
    if tag.children:
        children = [f'`<{child}>`' + (' (once)' if child in tag.single else '')
                    for child in tag.children]
        lines += '\nElements: ' + ', '.join(children) + '.\n'
    return lines


def _value(attribute: Attribute) -> str:
    if attribute.choices == tuple(sorted(DISPLAY_TYPES)):
        return 'display type'
    if attribute.choices:
        return ', '.join(f'`{choice}`' for choice in attribute.choices)
    return _KINDS[attribute.kind]


def _default(attribute: Attribute) -> str:
    if attribute.required:
        return '**required**'
    return f'`{attribute.default}`' if attribute.default else ''


def _display_types() -> str:
    rows: List[Tuple[str, ...]] = []
    for name, display in DISPLAY_TYPES.items():
        default = '' if display.default_topic is None else f'`NAME/{display.default_topic}`'
        shows = f'`{display.message_type}`' if display.message_type else ''
        rows.append((f'`{name}`', shows, '**required**' if display.needs_topic else default))
    return _table(('type', 'message', 'topic'), rows)


def _table(head: Tuple[str, ...], rows: List[Tuple[str, ...]]) -> str:
    lines = [head, tuple('---' for _ in head), *rows]
    return ''.join('| ' + ' | '.join(line) + ' |\n' for line in lines)
