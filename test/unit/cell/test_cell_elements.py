# SPDX-License-Identifier: BSD-3-Clause
"""Defaults of section 5.2.1 of the thesis, and all extensions of the language."""
from pathlib import Path
from typing import Callable, Tuple

import pytest

from process_visualizer.cell.elements import DISPLAY_TYPES, TAGS
from process_visualizer.cell.model import (
    Cell,
    ColorScale,
    Device,
    Mode,
    Pose,
    Property,
    WarningLimits,
)
from process_visualizer.cell.xml_parser import XmlParser

Parse = Callable[..., Cell]


@pytest.fixture
def device(parse: Parse) -> Callable[..., Device]:
    """The only device, by default a robot called "arm", with these elements."""
    def parse_device(elements: str, kind: str = 'robot', before: str = '',
                     **arguments: str) -> Device:
        return parse(f'<visualizer>{before}<device type="{kind}" name="arm">{elements}</device>'
                     '</visualizer>', **arguments).devices[0]
    return parse_device


def test_a_device_needs_nothing_but_type_and_name(device: Callable[..., Device]) -> None:
    empty = device('')
    assert (empty.base, empty.model, empty.force, empty.roi) == (None, None, None, None)
    assert empty.nodes == empty.topics == empty.displays == empty.launch_files == ()


def test_defaults_of_the_base(device: Callable[..., Device]) -> None:
    base = device('<base frame="a"/>').base
    assert base is not None and base.pose == Pose((0, 0, 0), (0, 0, 0))


def test_rpy_is_yaw_pitch_roll_and_ypr_another_name(device: Callable[..., Device]) -> None:
    named_rpy = device('<base frame="a" rpy="1 2 3"/>').base
    named_ypr = device('<base frame="a" ypr="1 2 3"/>').base
    assert named_rpy is not None and named_rpy.pose.ypr == (1, 2, 3)
    assert named_ypr is not None and named_ypr.pose == named_rpy.pose


def test_zero_given_as_ypr_is_taken(device: Callable[..., Device]) -> None:
    base = device('<base frame="a" ypr="0 0 0"/>').base
    assert base is not None and base.pose.ypr == (0, 0, 0)


@pytest.mark.parametrize('written', ['/a/b', 'a/b', '//a/b'])
def test_leading_slashes_of_frames_are_stripped(device: Callable[..., Device],
                                                written: str) -> None:
    got = device(f'<base frame="{written}"/><force parentframe="{written}" frame="{written}c" '
                 'xyz="0 0 1" rpy="0 0 0"/>'
                 f'<variable topic="t" frame="{written}"/>')
    assert got.base is not None and got.base.frame == 'a/b'
    assert got.force is not None
    assert (got.force.parent_frame, got.force.frame) == ('a/b', 'a/bc')
    assert got.variables[0].frame == 'a/b'


def test_defaults_of_a_node(device: Callable[..., Device]) -> None:
    node = device('<node pkg="p" type="t" name="n"/>').nodes[0]
    assert (node.namespace, node.mode, node.attributes) == ('arm', None, {'output': 'screen'})


@pytest.mark.parametrize('written, expected', [('x', 'x'), ('', ''), ('/', ''), ('/x/y/', '/x/y')])
def test_namespace_of_a_node(device: Callable[..., Device], written: str, expected: str) -> None:
    node = device(f'<node pkg="p" type="t" name="n" ns="{written}"/>').nodes[0]
    assert node.namespace == expected


def test_all_of_roslaunchs_attributes_of_a_node(device: Callable[..., Device]) -> None:
    attributes = {'args': 'a b', 'machine': 'm', 'respawn': 'true', 'respawn_delay': '2.5',
                  'required': 'false', 'launch-prefix': 'nice -n 5', 'clear_params': '1',
                  'cwd': 'node', 'output': 'log'}
    text = ' '.join(f'{name}="{value}"' for name, value in attributes.items())
    node = device(f'<node pkg="p" type="t" name="n" {text}/>',
                  before='<machine name="m" address="10.0.0.2"/>').nodes[0]
    assert node.attributes == attributes


def test_lines_in_args_become_one(device: Callable[..., Device]) -> None:
    node = device('<node pkg="p" type="t" name="n" args="a\n      b"/>').nodes[0]
    assert node.attributes['args'] == 'a b'


def test_quoted_args_stay(device: Callable[..., Device]) -> None:
    node = device("""<node pkg="p" type="t" name="n" args="a 'b  c'"/>""").nodes[0]
    assert node.attributes['args'] == "a 'b  c'"


def test_children_of_a_node(device: Callable[..., Device]) -> None:
    node = device('<node pkg="p" type="t" name="n"><param name="~a" value=" 1  2 "/>'
                  '<rosparam>b: [1, 2]</rosparam><remap from="c" to="/d"/>'
                  '<env name="E" value="$(arg e)"/></node>',
                  before='<arg name="e" default="f"/>').nodes[0]
    assert [(child.tag, dict(child.attributes), child.text) for child in node.children] == [
        ('param', {'name': '~a', 'value': ' 1  2 '}, ''), ('rosparam', {}, 'b: [1, 2]'),
        ('remap', {'from': 'c', 'to': '/d'}, ''), ('env', {'name': 'E', 'value': 'f'}, '')]


def test_parameters_of_a_device(device: Callable[..., Device]) -> None:
    parameters = device('<param name="a" value="1" type="int" if="1"/>'
                        '<rosparam param="b" subst_value="true">$(arg x)</rosparam>',
                        before='<arg name="x" default="7"/>').parameters
    assert parameters[0].attributes == {'name': 'a', 'value': '1', 'type': 'int'}
    assert parameters[1].text == '7'


def test_modes(device: Callable[..., Device]) -> None:
    got = device('<node pkg="p" type="t" name="n" ifstate="playback"/>'
                 '<node pkg="p" type="t" name="n" ifstate="realtime"/>'
                 '<launch pkg="p" type="a.launch" ifstate="realtime"/>'
                 '<launch pkg="p" type="a.launch"/>')
    assert [node.mode for node in got.nodes] == [Mode.PLAYBACK, Mode.REALTIME]
    assert [file.mode for file in got.launch_files] == [Mode.REALTIME, None]


def test_arguments_of_a_launch_file(device: Callable[..., Device]) -> None:
    file = device('<launch pkg="p" type="a.launch"><arg name="x" value=""/>'
                  '<arg name="y" value="2"/></launch>').launch_files[0]
    assert file.arguments == (('x', ''), ('y', '2'))


@pytest.mark.parametrize('attributes, name', [
    ('name="a"', '/a'), ('name="a" ns=""', '/a'), ('name="a" ns="/b/c/"', '/b/c/a')])
def test_names_of_topics(device: Callable[..., Device], attributes: str, name: str) -> None:
    topic = device(f'<topic {attributes}/>').topics[0]
    assert (topic.name, topic.function, topic.message_type, topic.record) == (
        name, None, None, True)


@pytest.mark.parametrize('written, expected', [
    ('True', True), ('true', True), ('1', True), ('False', False), ('FALSE', False), ('0', False)])
def test_record(device: Callable[..., Device], written: str, expected: bool) -> None:
    assert device(f'<topic name="a" record="{written}"/>').topics[0].record is expected


@pytest.mark.parametrize('function, message', [
    ('joint_states', 'std_msgs/Float32MultiArray'), ('joint_states', 'sensor_msgs/JointState'),
    ('tool_center_frame', 'std_msgs/Float32MultiArray'),
    ('tool_center_frame', 'geometry_msgs/PoseStamped'),
    ('tool_center_frame', 'tf2_msgs/TFMessage'),
    ('force_sensor', 'std_msgs/Float32MultiArray'),
    ('force_sensor', 'geometry_msgs/WrenchStamped')])
def test_message_types(device: Callable[..., Device], function: str, message: str) -> None:
    topic = device(f'<topic name="a" type="{function}" msg="{message}"/>').topics[0]
    assert topic.message_type == message


def test_arrows(device: Callable[..., Device]) -> None:
    force, velocity = device(
        '<arrow quantity="force" scale="0.01" min="0" max="0.5" color="#ff8000"/>'
        '<arrow quantity="velocity"/>').arrows
    assert (force.scale, force.minimum_m, force.maximum_m) == (0.01, 0, 0.5)
    assert force.color == pytest.approx((1, 128 / 255, 0))
    assert (velocity.scale, velocity.minimum_m, velocity.maximum_m, velocity.color) == (
        None, None, None, None)


def test_defaults_of_a_variable(device: Callable[..., Device]) -> None:
    variable = device('<variable topic="a/b" frame="f"/>', 'other').variables[0]
    assert (variable.topic, variable.field, variable.axis, variable.unit, variable.scale,
            variable.offset, variable.label) == ('/a/b', 'data', (1, 0, 0), '', 1, 0, 'b')
    assert variable.color == (1.0, 0.55, 0.1)


def test_everything_of_a_variable(device: Callable[..., Device]) -> None:
    variable = device('<variable topic="t" field="pose.position[2].x" frame="f" axis="0 3 -4" '
                      'color="0 0.5 1" unit="mm/s" scale="-2e-1" offset="255" label=""/>',
                      'other').variables[0]
    assert variable.axis == pytest.approx((0, 0.6, -0.8))
    assert (variable.field, variable.color, variable.unit, variable.scale, variable.offset,
            variable.label) == ('pose.position[2].x', (0, 0.5, 1), 'mm/s', -0.2, 255, '')


def test_a_variable_that_is_not_shown(device: Callable[..., Device]) -> None:
    variable = device('<variable topic="t" frame="f" low="1" shown="False"/>',
                      'other').variables[0]
    assert not variable.is_shown
    assert variable.limits is not None
    assert (variable.limits.low, variable.limits.high) == (1.0, None)


def test_colors_and_live_offset_of_a_variable(device: Callable[..., Device]) -> None:
    variable = device('<variable topic="t" frame="f" high="90" warning_color="#ff0000" '
                      'color_begin="20" color_end="60" end_color="0 1 0" '
                      'offset_param="setpoint"/>', 'other').variables[0]
    assert variable.offset_param == 'setpoint'
    assert variable.limits == WarningLimits(None, 90, (1, 0, 0))
    assert variable.color_scale == ColorScale(20, 60, (0, 1, 0))


def test_tool(device: Callable[..., Device]) -> None:
    tool = device('<tool frame="/tip" xyz="0 0 1" rpy="1 2 3"/>', 'robot').tool
    assert tool is not None
    assert (tool.frame, tool.pose) == ('tip', Pose((0, 0, 1), (1, 2, 3)))


def test_tool_frame_in_tf(device: Callable[..., Device]) -> None:
    topic = device('<topic name="tf" type="tool_center_frame" msg="tf2_msgs/TFMessage" '
                   'frame="/tool0"/>', 'robot').topics[0]
    assert (topic.name, topic.message_type, topic.frame) == ('/tf', 'tf2_msgs/TFMessage', 'tool0')


@pytest.mark.parametrize('attributes, frame, center', [
    ('', 'map', (0, 0, 0)), ('frame="/f" xyz="1 2 3"', 'f', (1, 2, 3))])
def test_region_of_interest(parse: Parse, attributes: str, frame: str,
                            center: Tuple[float, float, float]) -> None:
    cell = parse('<visualizer frame="/map"><device type="depth_sensor" name="d">'
                 f'<topic name="p" type="pointcloud"/><roi {attributes} size="1 2 0.5"/></device>'
                 '</visualizer>')
    roi = cell.devices[0].roi
    assert roi is not None
    assert (roi.frame, roi.center, roi.size) == (frame, center, (1, 2, 0.5))


@pytest.mark.parametrize('name', sorted(DISPLAY_TYPES))
def test_every_display_type(device: Callable[..., Device], name: str) -> None:
    topic = 'topic="t/u"' if DISPLAY_TYPES[name].topic_key else ''
    display = device(f'<rviz type="{name}" {topic} name="my name"/>').displays[0]
    assert (display.type, display.name) == (name, 'my name')
    assert display.topic == ('/t/u' if topic else None)


@pytest.mark.parametrize('name', ['RobotModel', 'MarkerArray', 'Marker', 'PointCloud2'])
def test_displays_of_the_thesis_need_no_topic(device: Callable[..., Device], name: str) -> None:
    assert device(f'<rviz type="{name}"/>').displays[0].topic is None


def test_default_topics_of_displays() -> None:
    defaults = {name: display.default_topic for name, display in DISPLAY_TYPES.items()
                if display.default_topic}
    assert defaults == {'RobotModel': 'robot_description', 'MarkerArray': 'marker_array',
                        'Marker': 'marker', 'PointCloud2': 'points'}


def test_properties_and_groups(device: Callable[..., Device]) -> None:
    group = device('<rviz type="Group"><rviz type="Grid"><property name="Color" value="1; 2; 3"/>'
                   '<property name="Offset"><property name="X" value="1"/></property></rviz>'
                   '</rviz>').displays[0]
    assert group.children[0].properties == (
        Property('Color', '1; 2; 3'), Property('Offset', None, (Property('X', '1'),)))


def test_machines(parse: Parse) -> None:
    cell = parse('<visualizer><machine name="m" address="host" user="u" timeout="5" '
                 'ssh-port="2222" default="never"/><device type="other" name="d"/></visualizer>')
    assert cell.machines[0].attributes == {'name': 'm', 'address': 'host', 'user': 'u',
                                           'timeout': '5', 'ssh-port': '2222', 'default': 'never'}


def test_the_global_frame(parse: Parse) -> None:
    device = '<device type="other" name="d"/>'
    assert parse(f'<visualizer>{device}</visualizer>').frame == 'world'
    assert parse(f'<visualizer frame="/map">{device}</visualizer>').frame == 'map'


def test_substitution_arguments(parse: Parse, tmp_path: Path,
                                monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv('CELL_TEST', 'seen')
    cell = parse(
        '<visualizer><arg name="x" default="a"/><arg name="y" value="$(arg x)_b"/>'
        '<device type="other" name="$(arg y)"><node pkg="p" type="t" name="n" args="'
        '$(env CELL_TEST)|$(optenv CELL_TEST no)|$(optenv CELL_NOT_SET one two)|$(dirname)|'
        '$(find roslaunch)"/></device></visualizer>', x='given')
    device = cell.devices[0]
    assert device.name == 'given_b'
    words = device.nodes[0].attributes['args'].split('|')
    assert words[:4] == ['seen', 'seen', 'one two', str(tmp_path)]
    assert words[4].endswith('roslaunch')


def test_conditions(parse: Parse) -> None:
    cell = parse('<visualizer><arg name="x" default="false"/>'
                 '<device type="other" name="a" if="$(arg x)"><nonsense/></device>'
                 '<device type="other" name="a" unless="$(arg x)"><topic name="t"/></device>'
                 '</visualizer>')
    assert [len(device.topics) for device in cell.devices] == [1]


def test_a_dropped_include_is_not_read(parse: Parse) -> None:
    assert parse('<visualizer><include file="no.xml" unless="true"/>'
                 '<device type="other" name="a"/></visualizer>').devices[0].name == 'a'


def test_includes(parse: Parse, tmp_path: Path) -> None:
    folder = tmp_path / 'more'
    folder.mkdir()
    (folder / 'camera.xml').write_text(
        '<visualizer frame="map"><arg name="n"/><include file="deeper.xml" if="$(arg n)"/>'
        '<machine name="m$(arg n)" address="h"/>'
        '<device type="depth_sensor" name="camera$(arg n)"/></visualizer>')
    (folder / 'deeper.xml').write_text('<visualizer><device type="other" name="deep"/>'
                                       '</visualizer>')
    cell = parse('<visualizer><device type="other" name="first"/>'
                 '<include file="more/camera.xml"><arg name="n" value="1"/></include>'
                 '<include file="$(dirname)/more/camera.xml"><arg name="n" value="0"/></include>'
                 '<device type="other" name="last"/></visualizer>')
    assert [device.name for device in cell.devices] == [
        'first', 'deep', 'camera1', 'camera0', 'last']
    assert cell.frame == 'map'
    assert len(cell.machines) == 2


def test_paths_of_includes_are_relative_to_the_file(tmp_path: Path,
                                                    monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / 'sub').mkdir()
    (tmp_path / 'sub' / 'a.xml').write_text('<visualizer><include file="b.xml"/></visualizer>')
    (tmp_path / 'sub' / 'b.xml').write_text('<visualizer><device type="other" name="b"/>'
                                              '</visualizer>')
    monkeypatch.chdir(tmp_path)
    cell = XmlParser().parse('sub/a.xml')
    assert (cell.file, cell.devices[0].name) == (str(tmp_path / 'sub' / 'a.xml'), 'b')


@pytest.mark.parametrize('encoding', ['utf-8-sig', 'utf-16'])
def test_encodings(tmp_path: Path, encoding: str) -> None:
    path = tmp_path / 'a.xml'
    path.write_bytes('<visualizer><device type="other" name="a"><variable topic="t" frame="f" '
                     'unit="°"/></device></visualizer>'.encode(encoding))
    assert XmlParser().parse(str(path)).devices[0].variables[0].unit == '°'


def test_attributes_that_name_the_schema_are_allowed(parse: Parse) -> None:
    assert parse('<visualizer xmlns:xsi="http://www.w3.org/2001/XMLSchema-instance" '
                 'xsi:noNamespaceSchemaLocation="devices.xsd"><device type="other" name="a"/>'
                 '</visualizer>').devices


def test_the_table_is_closed() -> None:
    """Every child is a tag; single children are children, without text (the schema needs this)."""
    for tag in TAGS.values():
        assert set(tag.children) <= set(TAGS)
        assert set(tag.single) <= set(tag.children)
        assert set(tag.alternatives) <= set(tag.attributes)
        for child in tag.single:
            assert not TAGS[child].text
