# SPDX-License-Identifier: BSD-3-Clause
"""Displays of the devices, in RViz's terms."""
from __future__ import annotations

from typing import Any, Callable, Dict, List, NamedTuple, Optional

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from process_visualizer.cell.elements import DISPLAY_TYPES
from process_visualizer.cell.errors import Location
from process_visualizer.cell.model import Cell, Device, DeviceType, Display, Property
from process_visualizer.rviz.displays import device_displays, property_value

Displays = Callable[[str], List[Dict[str, Any]]]
Parse = Callable[[str], Cell]
HERE = Location('cell.xml', 1)


class Fact(NamedTuple):
    """Facts about a display type from the sources of RViz 1.14."""

    topic_key: Optional[str]
    message_type: Optional[str]
    others: Dict[str, Any]


STREAMED = {
    'AccelStamped': 'geometry_msgs/AccelStamped', 'Effort': 'sensor_msgs/JointState',
    'FluidPressure': 'sensor_msgs/FluidPressure', 'GridCells': 'nav_msgs/GridCells',
    'Illuminance': 'sensor_msgs/Illuminance', 'LaserScan': 'sensor_msgs/LaserScan',
    'Odometry': 'nav_msgs/Odometry', 'Path': 'nav_msgs/Path',
    'PointCloud': 'sensor_msgs/PointCloud', 'PointCloud2': 'sensor_msgs/PointCloud2',
    'PointStamped': 'geometry_msgs/PointStamped', 'Polygon': 'geometry_msgs/PolygonStamped',
    'Pose': 'geometry_msgs/PoseStamped', 'PoseArray': 'geometry_msgs/PoseArray',
    'PoseWithCovariance': 'geometry_msgs/PoseWithCovarianceStamped', 'Range': 'sensor_msgs/Range',
    'RelativeHumidity': 'sensor_msgs/RelativeHumidity', 'Temperature': 'sensor_msgs/Temperature',
    'TwistStamped': 'geometry_msgs/TwistStamped', 'WrenchStamped': 'geometry_msgs/WrenchStamped',
}
_IMAGE = {'Transport Hint': 'raw', 'Queue Size': 2}
FACTS: Dict[str, Fact] = {
    **{name: Fact('Topic', message, {'Unreliable': False, 'Queue Size': 10})
       for name, message in STREAMED.items()},
    'Effort': Fact('Topic', 'sensor_msgs/JointState',
                   {'Value': True, 'Robot Description': '/d/robot_description'}),
    'Map': Fact('Topic', 'nav_msgs/OccupancyGrid', {}),
    'Marker': Fact('Marker Topic', 'visualization_msgs/Marker',
                   {'Queue Size': 100, 'Namespaces': {}}),
    'MarkerArray': Fact('Marker Topic', 'visualization_msgs/MarkerArray',
                        {'Queue Size': 100, 'Namespaces': {}}),
    'InteractiveMarkers': Fact('Update Topic', 'visualization_msgs/InteractiveMarkerUpdate', {}),
    'Image': Fact('Image Topic', 'sensor_msgs/Image', _IMAGE),
    'Camera': Fact('Image Topic', 'sensor_msgs/Image', _IMAGE),
    'DepthCloud': Fact('Depth Map Topic', 'sensor_msgs/Image',
                       {'Depth Map Transport Hint': 'raw', 'Color Transport Hint': 'raw',
                        'Queue Size': 5}),
    'RobotModel': Fact('Robot Description', None, {}),
    'TF': Fact(None, None, {'Frames': {'All Enabled': True}}),
    'Axes': Fact(None, None, {}),
    'Grid': Fact(None, None, {}),
    'Group': Fact(None, None, {}),
}
DEFAULT_TOPICS = {'RobotModel': '/d/robot_description', 'MarkerArray': '/d/marker_array',
                  'Marker': '/d/marker', 'PointCloud2': '/d/points'}


@pytest.fixture
def displays(parse: Parse) -> Displays:
    """The displays of a device "d" of type other with the elements."""
    def make(elements: str) -> List[Dict[str, Any]]:
        return device_displays(parse(f'<device type="other" name="d">{elements}</device>')
                               .devices[0])
    return make


def classes(found: List[Dict[str, Any]]) -> List[str]:
    return [display['Class'] for display in found]


def test_all_types_of_rviz_are_known() -> None:
    assert set(DISPLAY_TYPES) == set(FACTS)


def class_of(name: str) -> str:
    own = name in ('MarkerArray', 'RobotModel')
    return f'{"process_visualizer" if own else "rviz"}/{name}'


@pytest.mark.parametrize('name', FACTS)
def test_every_type(name: str, displays: Displays) -> None:
    fact = FACTS[name]
    topic = '' if fact.topic_key is None else 'topic="a/b"'
    (found,) = displays(f'<rviz type="{name}" name="Shown" {topic}/>')
    assert found['Class'] == class_of(name)
    assert found['Name'] == 'Shown'
    assert found['Enabled'] is True
    assert DISPLAY_TYPES[name].message_type == fact.message_type
    assert {key: found[key] for key in fact.others} == fact.others
    keys = {other.topic_key for other in FACTS.values()} - {None, *fact.others}
    assert {key: found[key] for key in keys if key in found} == (
        {} if fact.topic_key is None else {fact.topic_key: '/a/b'})


def test_map_has_no_queue(displays: Displays) -> None:
    assert 'Queue Size' not in displays('<rviz type="Map" topic="a"/>')[0]


def test_frames_of_tf_have_states_that_rviz_reads(displays: Displays) -> None:
    (found,) = displays("""<rviz type="TF"><property name="Frames">
        <property name="shown" value="true"/><property name="hidden" value="false"/>
        <property name="as_rviz"><property name="Value" value="true"/></property>
    </property></rviz>""")
    assert found['Frames'] == {'shown': {'Value': True}, 'hidden': {'Value': False},
                               'as_rviz': {'Value': True}}


@pytest.mark.parametrize('name', DEFAULT_TOPICS)
def test_default_topic(name: str, displays: Displays) -> None:
    (found,) = displays(f'<rviz type="{name}"/>')
    key = FACTS[name].topic_key
    assert key is not None and found[key] == DEFAULT_TOPICS[name]


@pytest.mark.parametrize('text, value', [
    ('0', 0), ('-12', -12), ('0.50', 0.5), ('-1.25', -1.25), ('true', True), ('False', False),
    ('10; 20; 255', '10; 20; 255'), ('', ''), ('<Fixed Frame>', '<Fixed Frame>'),
    ('Flat Squares', 'Flat Squares'),
    # YAML would change these values
    ('yes', 'yes'), ('010', '010'), ('12:30', '12:30'), ('0x1F', '0x1F'), ('1_0', '1_0'),
    ('null', 'null'), ('#fff', '#fff'), ('5 # c', '5 # c'), ('[1, 2]', '[1, 2]'), ('"q"', '"q"'),
    # YAML refuses these, not always with an error of its own
    ('2020-13-45', '2020-13-45'), ('!!int x', '!!int x'), ('!!bool x', '!!bool x'), ('=', '='),
    ('a: b: c', 'a: b: c'), ('[' * 2000, '[' * 2000), ('9' * 5000, '9' * 5000)])
def test_type_of_a_property(text: str, value: object) -> None:
    found = property_value(Property('p', text))
    assert found == value and type(found) is type(value)


@given(st.text(max_size=30))
def test_any_text_can_be_a_property(text: str) -> None:
    value = property_value(Property('p', text))
    assert yaml.safe_load(yaml.safe_dump({'p': value})) == {'p': value}
    if isinstance(value, str):
        assert value == text


def test_nested_properties(displays: Displays) -> None:
    (grid,) = displays('<rviz type="Grid"><property name="Line Style" value="Lines">'
                       '<property name="Line Width" value="0.03"/></property>'
                       '<property name="Offset"><property name="Z" value="-1"/></property></rviz>')
    assert grid['Line Style'] == {'Value': 'Lines', 'Line Width': 0.03}
    assert grid['Offset'] == {'Z': -1}


def test_property_replaces_a_default(displays: Displays) -> None:
    (cloud,) = displays('<rviz type="PointCloud2" topic="p">'
                        '<property name="Style" value="Boxes"/>'
                        '<property name="Enabled" value="false"/></rviz>')
    assert cloud['Style'] == 'Boxes'
    assert cloud['Enabled'] is False
    assert cloud['Color Transformer'] == 'RGB8'


@pytest.mark.parametrize('name', ['Class', 'Name', 'Displays'])
def test_property_cannot_change_what_a_display_is(name: str, displays: Displays) -> None:
    (group,) = displays(f'<rviz type="Group" name="g"><property name="{name}" value="5"/></rviz>')
    assert (group['Class'], group['Name'], group['Displays']) == ('rviz/Group', 'g', [])


@pytest.mark.parametrize('kind, elements, expected', [
    ('robot', '', ['MarkerArray']),
    ('robot', '<model pkg="a" path="a.urdf"/>', ['RobotModel', 'MarkerArray']),
    ('depth_sensor', '', ['PointCloud2']),
    ('other', '', []),
    ('other', '<model pkg="a" path="a.urdf"/>', ['RobotModel']),
    ('other', '<variable topic="t" frame="f"/>', ['MarkerArray']),
    ('other', '<variable topic="t" frame="f" shown="False"/>', [])])
def test_default_displays(kind: str, elements: str, expected: List[str], parse: Parse) -> None:
    device = parse(f'<device type="{kind}" name="d">{elements}</device>').devices[0]
    found = device_displays(device)
    assert classes(found) == [class_of(name) for name in expected]
    assert all(display['Enabled'] is True for display in found)


def robot(parse: Parse, elements: str) -> List[Dict[str, Any]]:
    return device_displays(parse('<device type="robot" name="d"><model pkg="a" path="a.urdf"/>'
                                 f'{elements}</device>').devices[0])


@pytest.mark.parametrize('topics', [
    '<topic name="c" type="pointcloud"/>',
    '<topic name="d" type="depth_image"/><topic name="c" type="color_image"/>'
    '<topic name="i" type="camera_info"/>'])
def test_region_of_interest_is_drawn(topics: str, parse: Parse) -> None:
    cell = parse(f'<device type="depth_sensor" name="k">{topics}<roi size="1 1 1"/></device>')
    points, region = device_displays(cell.devices[0])
    assert (points['Class'], points['Topic']) == ('rviz/PointCloud2', '/k/points')
    assert (region['Class'], region['Name'], region['Marker Topic']) == (
        'rviz/Marker', 'Region of interest', '/k/roi_filter/outline')


def test_explicit_display_replaces_the_default_like_it(parse: Parse) -> None:
    found = robot(parse, '<rviz type="RobotModel" name="Mine">'
                         '<property name="Alpha" value="0.5"/></rviz>')
    assert classes(found) == ['process_visualizer/MarkerArray', 'process_visualizer/RobotModel']
    assert (found[1]['Name'], found[1]['Alpha']) == ('Mine', 0.5)


def test_display_of_another_topic_stands_beside_the_default(parse: Parse) -> None:
    found = robot(parse, '<rviz type="MarkerArray" topic="/other"/>')
    assert [display.get('Marker Topic') for display in found] == [None, '/d/marker_array', '/other']


def test_names_are_unique(displays: Displays) -> None:
    found = displays('<rviz type="Axes"/><rviz type="Axes" name="Axes 2"/><rviz type="Axes"/>'
                     '<rviz type="Axes"/>')
    assert [display['Name'] for display in found] == ['Axes', 'Axes 2', 'Axes 3', 'Axes 4']


@given(st.lists(st.sampled_from(['A', 'A 2', 'A 2 2', 'A 3', 'B']), max_size=12))
def test_names_are_always_unique(names: List[str]) -> None:
    shown = tuple(Display('Axes', name, None, (), (), HERE) for name in names)
    found = device_displays(Device(DeviceType.OTHER, 'd', HERE, displays=shown))
    assert len({display['Name'] for display in found}) == len(names)


def test_group_holds_its_displays(displays: Displays) -> None:
    (group,) = displays('<rviz type="Group" name="g"><rviz type="Axes"/><rviz type="Axes"/>'
                        '<rviz type="Group"><rviz type="Marker"/></rviz></rviz>')
    assert [display['Name'] for display in group['Displays']] == ['Axes', 'Axes 2', 'Group']
    assert group['Displays'][2]['Displays'][0]['Marker Topic'] == '/d/marker'


def test_displays_share_no_values(parse: Parse) -> None:
    """A shared value would appear as an alias in the file."""
    found = robot(parse, '<rviz type="MarkerArray" topic="/a"/><rviz type="MarkerArray" '
                         'topic="/b"/>')
    assert '*' not in yaml.safe_dump(found)
