# SPDX-License-Identifier: BSD-3-Clause
"""The parameters of the node scene_watch for a cell."""
from __future__ import annotations

from typing import Callable

import pytest

from process_visualizer.cell.model import Cell
from process_visualizer.generate.processor_nodes import watch_parameters

Parse = Callable[[str], Cell]


def test_a_robot_that_hangs_has_its_words_above_it(parse: Parse) -> None:
    cell = parse('<device type="robot" name="r"><base frame="b" ypr="0 3.14159265 0"/></device>')
    (found,) = watch_parameters(cell, cell.devices).to_parameters()['devices']
    assert (found['name'], found['frame']) == ('r', 'b')
    assert found['position'] == pytest.approx([0.0, 0.0, -0.7], abs=1e-6)
    assert found['nodes']['/r/joint_proc'] == 'the robot does not move'
    assert found['topics'] == ['/r/marker_array']
    assert 'age_topic' not in found


def test_a_depth_sensor_tells_the_age_of_its_cloud(parse: Parse) -> None:
    cell = parse('<device type="depth_sensor" name="c"><topic name="p" type="pointcloud"/>'
                 '</device>')
    (found,) = watch_parameters(cell, cell.devices).to_parameters()['devices']
    assert (found['frame'], found['age_topic']) == ('world', '/c/points_age')
    assert found['topics'] == ['/c/points']


def test_words_are_in_view_and_apart(parse: Parse) -> None:
    cell = parse('<device type="robot" name="a"><base frame="a"/></device>'
                 '<device type="robot" name="b"><base frame="b"/></device>'
                 '<device type="robot" name="far"><base frame="far" xyz="1 0 0"/></device>'
                 '<device type="depth_sensor" name="c"><base frame="c" xyz="0 0 3"/></device>')
    found = watch_parameters(cell, cell.devices).to_parameters()['devices']
    assert [(device['frame'], device['position'][2]) for device in found] == [
        ('a', 0.7), ('b', 0.84), ('far', 0.7), ('a', 0.98)]


def test_topics_of_displays_in_groups(parse: Parse) -> None:
    cell = parse('<device type="other" name="d"><rviz type="Group"><rviz type="LaserScan" '
                 'topic="scan"/><rviz type="TF"/></rviz></device>'
                 '<device type="other" name="nothing"><rviz type="Grid"/></device>')
    (found,) = watch_parameters(cell, cell.devices).to_parameters()['devices']
    assert found['topics'] == ['/scan']
