# SPDX-License-Identifier: BSD-3-Clause
"""The XML of launch files: readable, and well-formed with any content."""
from __future__ import annotations

from xml.etree import ElementTree

import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from process_visualizer.generate.launch_writer import LaunchTag, write_document


def test_document() -> None:
    root = LaunchTag('launch')
    root.comment('what follows')
    group = root.add('group', {'ns': 'd'})
    node = group.add('node', {'name': 'n', 'args': '<"a" & b>'})
    node.parameters({'rate': 5.0, 'names': ['a', 'b'], 'poses': [{'xyz': [0.0, 1.0, 2.0]}]})
    root.include('/a/b.launch', [('x', '1')])
    assert write_document(root) == '''<?xml version="1.0"?>
<launch>

  <!-- what follows -->
  <group ns="d">
    <node name="n" args='&lt;"a" &amp; b&gt;'>
      <rosparam>
        rate: 5.0
        names: [a, b]
        poses:
        - xyz: [0.0, 1.0, 2.0]
      </rosparam>
    </node>
  </group>
  <include file="/a/b.launch">
    <arg name="x" value="1"/>
  </include>
</launch>
'''


def test_no_parameters_make_no_element() -> None:
    tag = LaunchTag('node')
    tag.parameters({})
    assert tag.children == []


def test_text_keeps_its_relative_indentation() -> None:
    tag = LaunchTag('group')
    tag.add('rosparam', {}, '\n\n      a:\n        b: 1\n      c: 2\n  ')
    text = ElementTree.fromstring(write_document(tag))[0].text
    assert yaml.safe_load(text or '') == {'a': {'b': 1}, 'c': 2}


VALUES = st.recursive(
    st.one_of(st.booleans(), st.integers(-10**12, 10**12), st.text(max_size=20),
              st.floats(allow_nan=False)),
    lambda inner: st.one_of(st.lists(inner, max_size=4),
                            st.dictionaries(st.sampled_from('abcd'), inner, max_size=4)),
    max_leaves=12)


@settings(max_examples=50)
@given(st.dictionaries(st.sampled_from(['one', 'two', 'three']), VALUES, min_size=1))
def test_parameters_come_back(values: 'dict[str, object]') -> None:
    root = LaunchTag('launch')
    root.parameters(values)
    text = ElementTree.fromstring(write_document(root))[0].text
    assert yaml.safe_load(text or '') == values


@given(st.text(st.sampled_from('->< !&'), max_size=20))
def test_any_comment_is_well_formed(text: str) -> None:
    root = LaunchTag('launch')
    root.comment(text)
    root.add('node', {})
    assert [child.tag for child in ElementTree.fromstring(write_document(root))] == ['node']
