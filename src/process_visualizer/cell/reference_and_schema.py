# SPDX-License-Identifier: BSD-3-Clause
"""The reference and the XML schema of the configuration, generated from the table ``elements``."""
from __future__ import annotations

import re
from typing import Dict, Iterator, List, Mapping, Tuple
from xml.sax.saxutils import escape, quoteattr

from process_visualizer.cell.elements import (
    CONDITIONS,
    DISPLAY_TYPES,
    MESSAGE_TYPES,
    ROOT,
    TAGS,
    Attribute,
    Tag,
)
from process_visualizer.cell.values import AXES, COLORS, PATTERNS, SENSOR_NOISES

# The tables of the reference in the documentation.

_BLOCK = re.compile(r'(<!-- begin (\w+) -->\n).*?(<!-- end \2 -->)', re.DOTALL)

_KINDS: Dict[str, str] = {
    'axis': 'direction', 'boolean': 'True or False', 'color': 'color', 'command_line': 'text',
    'environment': 'name', 'executable': 'file name', 'field': 'field', 'frame': 'frame',
    'integer': 'whole number', 'length': 'number ≥ 0', 'message': 'message type', 'name': 'name',
    'names': 'names', 'namespace': 'ROS name', 'noise': 'sensor, or number > 0',
    'number': 'number', 'package': 'package',
    'path': 'path',
    'positive': 'number > 0', 'resource': 'ROS name', 'size': 'three numbers > 0',
    'text': 'text', 'topic': 'ROS name', 'vector': 'three numbers',
}


def updated_reference(text: str) -> str:
    """Return the text with every block between ``<!-- begin X -->`` and ``<!-- end X -->`` updated.

    ``X`` is a tag, ``display_types`` or ``message_types``; KeyError for any other name.
    """
    return _BLOCK.sub(lambda match: match[1] + block(match[2]) + match[3], text)


def block(name: str) -> str:
    """Return one block in Markdown, ending with a newline."""
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


# The configuration language as an XML schema (XSD 1.0), for editors and validators.
#
# The schema accepts whatever the parser accepts, except for invalid content of an element that
# ``if`` or ``unless`` drops. It rejects less than the parser because it cannot check other files,
# the values of ``$(…)``, or relations between elements.

_HEADER = '''<?xml version="1.0" encoding="utf-8"?>
<!-- Generated from src/process_visualizer/cell/elements.py by scripts/make_reference.py -->
<xs:schema xmlns:xs="http://www.w3.org/2001/XMLSchema">
'''
_MAX_DOUBLE = '1.7976931348623157E308'
_SUBSTITUTION = r'[\s\S]*$\([\s\S]*'
_ANY_TEXT = ('text', 'command_line')
_NUMBERS: Mapping[str, Tuple[str, ...]] = {
    'plain_number': (f'minInclusive value="-{_MAX_DOUBLE}"', f'maxInclusive value="{_MAX_DOUBLE}"'),
    'plain_positive': ('minExclusive value="0"', f'maxInclusive value="{_MAX_DOUBLE}"'),
    'plain_length': ('minInclusive value="0"', f'maxInclusive value="{_MAX_DOUBLE}"'),
    'plain_fraction': ('minInclusive value="0"', 'maxInclusive value="1"'),
}
_TRIPLES = {'plain_vector': 'plain_number', 'plain_size': 'plain_positive',
            'plain_rgb': 'plain_fraction'}


def schema_text() -> str:
    """Return the whole schema, ending with a newline."""
    parts = [*_value_types(), *_element_types(), _root()]
    return _HEADER + '\n'.join(parts) + '\n</xs:schema>\n'


def _value_types() -> Iterator[str]:
    """Yield a simple type for each kind of attribute; every value may also be a ``$(…)``."""
    yield _pattern_type('substitution', _SUBSTITUTION)
    yield ('  <xs:simpleType name="nothing">\n    <xs:restriction base="xs:token">\n'
           '      <xs:length value="0"/>\n    </xs:restriction>\n  </xs:simpleType>')
    # Validators disagree on what a double is: libxml2 accepts 0E.
    pattern = f'pattern value={quoteattr(PATTERNS["number"])}'
    for name, facets in _NUMBERS.items():
        lines = ''.join(f'      <xs:{facet}/>\n' for facet in (pattern, *facets))
        yield (f'  <xs:simpleType name="{name}">\n    <xs:restriction base="xs:double">\n{lines}'
               '    </xs:restriction>\n  </xs:simpleType>')
    for name, item in _TRIPLES.items():
        yield (f'  <xs:simpleType name="{name}">\n    <xs:restriction>\n      <xs:simpleType>\n'
               f'        <xs:list itemType="{item}"/>\n      </xs:simpleType>\n'
               '      <xs:length value="3"/>\n    </xs:restriction>\n  </xs:simpleType>')
    for kind, pattern in {**PATTERNS, 'path': r'[^/][\s\S]*'}.items():
        if kind != 'number':
            yield _pattern_type(f'plain_{kind}', pattern)
    yield _choice_type('plain_axis_name', AXES)
    yield _choice_type('plain_color_name', COLORS)
    yield _choice_type('plain_sensor', SENSOR_NOISES)
    for kind, members in _unions().items():
        yield (f'  <xs:simpleType name="{kind}">\n'
               f'    <xs:union memberTypes="{" ".join(members)} substitution"/>\n'
               '  </xs:simpleType>')


def _unions() -> Dict[str, List[str]]:
    unions = {
        'axis': ['plain_axis_name', 'plain_vector'],
        'color': ['plain_color_name', 'plain_hex_color', 'plain_rgb'],
        'noise': ['plain_sensor', 'plain_positive'],
    }
    used = {attribute.kind for tag in _tags().values() for attribute in tag.attributes.values()}
    for kind in sorted(used - set(_ANY_TEXT) - {'choice'} - set(unions)):
        unions[kind] = [f'plain_{kind}']
    return unions


def _pattern_type(name: str, pattern: str) -> str:
    return (f'  <xs:simpleType name="{name}">\n    <xs:restriction base="xs:string">\n'
            f'      <xs:pattern value={quoteattr(pattern)}/>\n'
            '    </xs:restriction>\n  </xs:simpleType>')


def _choice_type(name: str, choices: Mapping[str, object]) -> str:
    values = ''.join(f'      <xs:enumeration value="{choice}"/>\n' for choice in choices)
    return (f'  <xs:simpleType name="{name}">\n    <xs:restriction base="xs:string">\n{values}'
            '    </xs:restriction>\n  </xs:simpleType>')


def _tags() -> Dict[str, Tag]:
    """Return the description of every element, by the name of its type in the schema."""
    tags = dict(TAGS)
    for parent, tag in TAGS.items():
        for child, variant in tag.variants.items():
            tags[f'{parent}_{child}'] = variant
    return tags


def _element_types() -> Iterator[str]:
    for name, tag in _tags().items():
        yield f'  <xs:complexType name="{name}_element">\n{_documentation(tag.help, 4)}'
        content = 'xs:string' if tag.text else 'nothing'
        if tag.children:
            yield from _children(name, tag)
            yield from _attributes(tag, 4)
        else:
            yield f'    <xs:simpleContent>\n      <xs:extension base="{content}">'
            yield from _attributes(tag, 8)
            yield '      </xs:extension>\n    </xs:simpleContent>'
        yield '  </xs:complexType>'


def _children(name: str, tag: Tag) -> Iterator[str]:
    yield '    <xs:choice minOccurs="0" maxOccurs="unbounded">'
    for child in tag.children:
        variant = f'{name}_{child}' if child in tag.variants else child
        yield from _child(child, f'{variant}_element')
    yield '    </xs:choice>'


def _child(name: str, type_name: str) -> Iterator[str]:
    unique = _single_children(TAGS[name])
    start = f'      <xs:element name="{name}" type="{type_name}"'
    yield start + ('>\n' + unique + '      </xs:element>' if unique else '/>')


def _single_children(tag: Tag) -> str:
    """Return constraints that allow at most one child of a kind.

    XSD 1.0 cannot count children in arbitrary order, but it can require their text to be unique,
    and children without elements all have the same (empty) text. A second child of another kind is
    found only by the parser.
    """
    return ''.join(f'        <xs:unique name="single_{child}">\n'
                   f'          <xs:selector xpath="{child}"/>\n'
                   '          <xs:field xpath="."/>\n        </xs:unique>\n'
                   for child in tag.single if not TAGS[child].children)


def _attributes(tag: Tag, indent: int) -> Iterator[str]:
    for name, attribute in tag.attributes.items():
        yield _attribute(name, attribute, indent)


def _attribute(name: str, attribute: Attribute, indent: int) -> str:
    space = ' ' * indent
    start = f'{space}<xs:attribute name="{name}"'
    if attribute.required:
        start += ' use="required"'
    if attribute.kind == 'choice':
        return (f'{start}>\n{_documentation(attribute.help, indent + 2)}'
                f'{_choices(attribute, space)}{space}</xs:attribute>')
    kind = 'xs:string' if attribute.kind in _ANY_TEXT else attribute.kind
    return (f'{start} type="{kind}">\n{_documentation(_help(attribute), indent + 2)}'
            f'{space}</xs:attribute>')


def _choices(attribute: Attribute, space: str) -> str:
    values = ''.join(f'{space}        <xs:enumeration value="{choice}"/>\n'
                     for choice in attribute.choices)
    return (f'{space}  <xs:simpleType>\n{space}    <xs:union memberTypes="substitution">\n'
            f'{space}      <xs:simpleType>\n'
            f'{space}        <xs:restriction base="xs:string">\n{values}'
            f'{space}        </xs:restriction>\n{space}      </xs:simpleType>\n'
            f'{space}    </xs:union>\n{space}  </xs:simpleType>\n')


def _help(attribute: Attribute) -> str:
    return attribute.help + (f' (default: {attribute.default})' if attribute.default else '')


def _documentation(text: str, indent: int) -> str:
    space = ' ' * indent
    return (f'{space}<xs:annotation>\n{space}  <xs:documentation>'
            f'{escape(text.replace("`", ""))}</xs:documentation>\n{space}</xs:annotation>\n')


def _root() -> str:
    return f'  <xs:element name="{ROOT}" type="{ROOT}_element"/>'
