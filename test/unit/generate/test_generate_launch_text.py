# SPDX-License-Identifier: BSD-3-Clause
"""Any text of a configuration is kept in its launch file."""
from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Dict
from xml.sax.saxutils import escape

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from launch_cells import HERE, cell_of, launch_text, loaded, one_node
from launch_loading import node_names, parameters

from process_visualizer.cell.errors import Location
from process_visualizer.cell.model import (
    Cell,
    Device,
    DeviceType,
    LaunchFile,
    Node,
    RoslaunchElement,
    Variable,
)

XML_CHARACTERS = st.characters(blacklist_categories=('Cs', 'Cc', 'Cn'))
TEXTS = st.text(st.one_of(XML_CHARACTERS, st.sampled_from('<>&"\'\n\t -\x85\u2028:#{}[]%@')),
                max_size=40).filter(lambda text: '$' not in text)


@pytest.mark.parametrize('name', ['a--b', 'a---b', '----', 'a-', '-', '-->', '<!--', '&amp;'])
def test_comments_with_hyphens(name: str) -> None:
    cell = Cell(f'/{name}/cell.xml', 'world', (Device(DeviceType.OTHER, 'd',
                                                      Location(name, 1)),))
    assert node_names(loaded(cell)) == ['/cell_frames', '/scene_watch', '/view_relay']


@settings(max_examples=50)
@given(st.text('-> <!', max_size=12))
def test_comments_of_any_kind(name: str) -> None:
    loaded(Cell(f'/{name}', 'world', (Device(DeviceType.OTHER, 'd', Location(name, 1)),)))


@settings(max_examples=50)
@given(TEXTS)
def test_any_text_survives_in_attributes(text: str) -> None:
    """roslaunch strips whitespace from both ends of a parameter's value."""
    parameter = RoslaunchElement('param', {'name': 'p', 'value': text, 'type': 'str'}, '', HERE)
    environment = RoslaunchElement('env', {'name': 'E', 'value': text}, '', HERE)
    node = Node('a', 'b', 'n', 'd', None, {'args': text, 'launch-prefix': text}, (environment,),
                HERE)
    config = loaded(cell_of(Device(DeviceType.OTHER, 'd', HERE, nodes=(node,),
                                   parameters=(parameter,))))
    found = one_node(config)
    assert found.args == text
    assert found.launch_prefix == text or found.launch_prefix is None and not text
    assert [tuple(pair) for pair in found.env_args] == [('E', text)]
    assert config.params['/d/p'].value == text.strip()


@settings(max_examples=50)
@given(TEXTS.filter(lambda text: ':=' not in text))
def test_any_text_survives_as_argument_of_a_launch_file(text: str) -> None:
    launch_file = LaunchFile('p', 'f.launch', None, (('a', text),), HERE)
    cell = cell_of(Device(DeviceType.OTHER, 'd', HERE, launch_files=(launch_file,)))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, 'f.launch')
        path.write_text('<launch><arg name="a"/><param name="p" type="str" value="$(arg a)"/>'
                        '</launch>')
        found = loaded(cell, included={launch_file: str(path)})
    assert found.params['/p'].value == text.strip()


LABELS = st.one_of(TEXTS, st.sampled_from([
    'deg(90)', 'rad(1)', 'rad(x)', 'yes', '1', '~', '- a', 'a: b', '$(arg x)', '%', '\r', ' ',
    '12:30', '!!int 1', '\x85', '\u2028a', 'a\x85 b', '\ufeff', '0x1', '1e3', '.inf']))


@settings(max_examples=50)
@given(LABELS, LABELS, st.floats(allow_nan=False, allow_infinity=False))
def test_any_text_and_number_survives_in_parameters(label: str, unit: str, scale: float) -> None:
    variable = Variable('/t', 'data', 'f', (1.0, 0.0, -0.5), (0.1, 1.0, 0.0), unit, scale, 1e-300,
                        label, HERE)
    config = loaded(cell_of(Device(DeviceType.OTHER, 'd', HERE, variables=(variable,))))
    assert parameters(config, '/d/variable_proc') == {'variables': [
        {'topic': '/t', 'field': 'data', 'frame': 'f', 'axis': [1.0, 0.0, -0.5],
         'color': [0.1, 1.0, 0.0], 'unit': unit, 'scale': scale, 'offset': 1e-300,
         'label': label}]}


def test_rosparam_text_is_data_not_xml() -> None:
    found: Dict[str, object] = {}
    text = 'a: "<b/> & ]]> -->"'
    element = RoslaunchElement('rosparam', {}, text, HERE)
    found.update(parameters(loaded(cell_of(Device(DeviceType.OTHER, 'd', HERE,
                                                  parameters=(element,)))), '/d'))
    assert found == {'a': '<b/> & ]]> -->'}
    assert escape(text) in launch_text(cell_of(Device(DeviceType.OTHER, 'd', HERE,
                                                      parameters=(element,))))
