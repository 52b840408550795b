# SPDX-License-Identifier: BSD-3-Clause
"""Random configurations, built from the table of the language (hypothesis strategies)."""
from __future__ import annotations

from typing import Dict, List, Optional, Tuple
from xml.sax.saxutils import escape, quoteattr

from hypothesis import strategies as st

from process_visualizer.cell.elements import CONDITIONS, DISPLAY_TYPES, ROOT, TAGS, Attribute, Tag

_NUMBER = st.one_of(st.floats(-1e9, 1e9).map(repr), st.sampled_from(['0', '+1.', '-.5', ' 2e-3']))
_POSITIVE = st.sampled_from(['1', '0.001', '+1e3', ' .5 '])
_NAME = st.from_regex(r'[A-Za-z][A-Za-z0-9_]{3,12}', fullmatch=True)


def _triple(item: 'st.SearchStrategy[str]') -> 'st.SearchStrategy[str]':
    return st.lists(item, min_size=3, max_size=3).map(' '.join)


VALUES: Dict[str, 'st.SearchStrategy[str]'] = {
    'number': _NUMBER,
    'positive': _POSITIVE,
    'noise': st.one_of(st.sampled_from(['kinect', 'tof']), _POSITIVE),
    'length': st.one_of(_POSITIVE, st.just('0')),
    'integer': st.integers(0, 65535).map(str),
    'vector': _triple(_NUMBER),
    'size': _triple(_POSITIVE),
    'axis': st.one_of(st.sampled_from(['x', '-y', 'z']), _triple(_POSITIVE)),
    'color': st.one_of(st.sampled_from(['red', '#00ffAA']),
                       _triple(st.floats(0, 1).map(repr))),
    'boolean': st.sampled_from(['True', 'false', 'TRUE', '0', '1']),
    'text': st.text(st.characters(whitelist_categories=('L', 'N', 'P', 'Zs'),
                                  blacklist_characters='$'), max_size=12),
    'command_line': st.sampled_from(['', '-a  b', '$(optenv NOT_SET_HERE c)', "'d  e'"]),
    'path': st.sampled_from(['a.urdf', 'a b/c.xacro', '$(optenv NOT_SET_HERE d).urdf']),
    'name': _NAME,
    'namespace': st.one_of(st.sampled_from(['', '/', 'a/b/', '/a']), _NAME),
    'topic': st.builds('{}{}'.format, st.sampled_from(['', '/', 'a/']), _NAME),
    'resource': st.builds('{}{}'.format, st.sampled_from(['', '/', '~', 'a/']), _NAME),
    'frame': st.builds('{}{}'.format, st.sampled_from(['', '/', 'a/', 'a-', '0']), _NAME),
    'package': _NAME,
    'executable': st.sampled_from(['a', 'a.py', 'ä-b']),
    'environment': _NAME,
    'message': st.just('std_msgs/Float32'),
    'field': st.sampled_from(['data', 'data[0]', 'a.b[12].c']),
}

_UNUSED: Dict[str, Tuple[str, ...]] = {
    'node': ('machine', 'respawn'), 'topic': ('type',), 'param': ('type',),
    'rosparam': ('command', 'file'), 'arrow': ('min',), 'rviz': ('topic',),
}
"""Attributes with values that depend on others; the tests of bad input cover them."""


@st.composite
def configurations(draw: st.DrawFn) -> str:
    """A configuration that the parser accepts, apart from accidents such as equal names."""
    devices = draw(st.lists(_element('device', TAGS['device']), min_size=1, max_size=3))
    others = draw(st.lists(st.one_of(_element('arg', TAGS['arg']),
                                     _element('machine', TAGS['machine'])), max_size=2))
    attributes = draw(_attributes(ROOT, TAGS[ROOT]))
    children = draw(st.permutations(devices + others))
    return _text(ROOT, attributes, ''.join(children))


@st.composite
def _element(draw: st.DrawFn, name: str, tag: Tag, depth: int = 0) -> str:
    attributes = draw(_attributes(name, tag))
    inner = 'a: 1' if tag.text else ''
    if tag.children and depth < 3:
        inner = ''.join(draw(_children(name, tag, attributes, depth)))
    if name == 'property' and '<' not in inner:
        attributes.setdefault('value', '1')
    return _text(name, attributes, inner)


@st.composite
def _attributes(draw: st.DrawFn, name: str, tag: Tag) -> Dict[str, str]:
    wanted = draw(st.sets(st.sampled_from(sorted(tag.attributes)))) if tag.attributes else set()
    one = draw(st.sampled_from(tag.alternatives)) if tag.alternatives else ''
    if name == 'arg' and 'default' in tag.attributes:
        one = 'default'
    condition = draw(st.sampled_from(CONDITIONS))
    chosen = {}
    for key, attribute in tag.attributes.items():
        excluded = (key in tag.alternatives and key != one
                    or key in CONDITIONS and key != condition
                    or key in _UNUSED.get(name, ()))
        needed = attribute.required or key == one and (tag.needs_alternative or name == 'arg')
        if needed or key in wanted and not excluded:
            chosen[key] = draw(_value(attribute))
    if name == 'rviz':
        _complete_display(chosen)
    return chosen


def _complete_display(attributes: Dict[str, str]) -> None:
    if DISPLAY_TYPES[attributes['type']].topic_key is not None:
        attributes['topic'] = '/some/topic'


def _value(attribute: Attribute) -> 'st.SearchStrategy[str]':
    if attribute.choices:
        return st.sampled_from(attribute.choices)
    return VALUES[attribute.kind]


@st.composite
def _children(draw: st.DrawFn, name: str, tag: Tag, attributes: Dict[str, str],
              depth: int) -> List[str]:
    names = draw(st.lists(st.sampled_from(tag.children), max_size=4))
    names = [child for child in names if _belongs(child, name, attributes)]
    kept: List[str] = []
    for child in names:
        if child not in kept or child not in tag.single and child != 'arrow':
            kept.append(child)
    elements = [draw(_element(child, tag.child(child), depth + 1)) for child in kept]
    if 'roi' in kept:
        elements.append('<topic name="cloud" type="pointcloud"/>')
    return elements


def _belongs(child: str, parent: str, attributes: Dict[str, str]) -> bool:
    kind: Optional[str] = {'force': 'robot', 'arrow': 'robot', 'roi': 'depth_sensor'}.get(child)
    if child == 'fusion':  # refers to other devices
        return False
    if parent == 'rviz' and child == 'rviz':
        return attributes['type'] == 'Group'
    return kind is None or attributes.get('type') == kind


def _text(name: str, attributes: Dict[str, str], inner: str) -> str:
    words = ' '.join([name, *(f'{key}={quoteattr(value)}' for key, value in attributes.items())])
    return f'<{words}>{inner if "<" in inner else escape(inner)}</{name}>'
