# SPDX-License-Identifier: BSD-3-Clause
"""The nodelet that finds unmodeled objects, as the launch file starts it."""
from __future__ import annotations

from typing import Callable, Dict, Optional

from process_visualizer.cell.model import Cell, Mode
from process_visualizer.generate.choice import Choice
from process_visualizer.generate.drivers import Manager
from process_visualizer.generate.processor_nodes import ProcessorNode, object_finder_nodes
from process_visualizer.robot.description import RobotDescription
from process_visualizer.rviz.displays import device_displays

Parse = Callable[[str], Cell]
MODEL = RobotDescription('<robot/>', ('base',), {}, {})
CELL = ('<device type="robot" name="arm"/><device type="robot" name="bare"/>'
        '<device type="other" name="oven"/>'
        '<device type="depth_sensor" name="k"><topic ns="a" name="c" type="pointcloud"/>{}'
        '</device>')
MODELS: Dict[str, RobotDescription] = {'arm': MODEL, 'oven': MODEL}


def finder(parse: Parse, elements: str, manager: Optional[Manager] = None) -> ProcessorNode:
    cell = parse(CELL.format(elements))
    (node,) = object_finder_nodes(Choice(cell, Mode.REALTIME, cell.devices), cell.devices[-1],
                                  MODELS, manager)
    return node


def test_without_the_element_there_is_none(parse: Parse) -> None:
    cell = parse(CELL.format(''))
    assert not object_finder_nodes(Choice(cell, Mode.REALTIME, cell.devices), cell.devices[-1],
                                   MODELS)


def test_defaults(parse: Parse) -> None:
    node = finder(parse, '<objects/>')
    assert (node.name, node.args) == ('object_finder', 'standalone process_visualizer/ObjectFinder')
    assert node.remaps == {'~input': '/a/c', '~objects': '/k/objects',
                           '~markers': '/k/objects_markers', '~unknown': '/k/unknown_points'}
    assert node.parameters == {
        'frame': 'world', 'robots': ['arm'], 'others': ['oven'], 'warn': 0.5, 'stop': 0.2,
        'padding': 0.03, 'surface': 0.5, 'region': [], 'expected': []}


def test_everything_given(parse: Parse) -> None:
    node = finder(parse, '<objects warn="1" stop="0.1" padding="0.05" surface="2" topic="b/d" '
                         'xyz="1 2 3" size="4 5 6"><expected frame="/oven" size="1 1 1"/>'
                         '</objects>', Manager('/m'))
    assert node.args == 'load process_visualizer/ObjectFinder /m --no-bond'
    assert node.remaps['~input'] == '/b/d'
    values = node.parameters
    assert [values[name] for name in ('warn', 'stop', 'padding', 'surface')] == [1, 0.1, 0.05, 2]
    assert values['region'] == [{'frame': 'world', 'center': [1, 2, 3], 'size': [4, 5, 6]}]
    assert values['expected'] == [{'frame': 'oven', 'center': [0, 0, 0], 'size': [1, 1, 1]}]


def test_noise_of_the_sensor(parse: Parse) -> None:
    assert finder(parse, '<objects noise="realsense"/>').parameters['noise'] == 0.0042
    assert finder(parse, '<objects noise="0.002"/>').parameters['noise'] == 0.002


def test_a_crop_comes_first(parse: Parse) -> None:
    node = finder(parse, '<roi size="1 1 1"/><objects/>')
    assert node.remaps['~input'] == '/k/roi_points'


def test_objects_are_drawn(parse: Parse) -> None:
    cell = parse(CELL.format('<objects/>'))
    objects = device_displays(cell.devices[-1])[-1]
    assert (objects['Class'], objects['Name'], objects['Marker Topic']) == (
        'process_visualizer/MarkerArray', 'Objects', '/k/objects_markers')
