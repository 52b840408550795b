# SPDX-License-Identifier: BSD-3-Clause
"""The markers of a robot: position, direction, length and number."""
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from visualization_msgs.msg import Marker

from process_visualizer.nodes.common.markers import STALE_COLOR, VectorSample
from process_visualizer.nodes.robot.robot_display import RobotDisplay, ShownMotion
from process_visualizer.nodes.robot.tool_placing import ToolPlace
from process_visualizer.parameters.reading import Parameters
from process_visualizer.parameters.robot_parameters import RobotParameters
from process_visualizer.robot.rotations import matrix_from_quaternion

PARAMETERS = RobotParameters.read(Parameters({'force_frame': 'r/force'}, '/r/robot_proc'), 'r')
# Half a turn about x.
DOWN = ToolPlace('r/tool', (1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (-0.6, 0.0, 0.2))
NOW_S = 100.0


def shown(velocity=None, force=None, now_s=NOW_S, place=DOWN, force_frame='r/force'):
    """Return the markers by namespace and number."""
    motion = None if velocity is None else ShownMotion(place, np.array(velocity), NOW_S)
    sample = None if force is None else VectorSample(force, force_frame, NOW_S)
    markers = RobotDisplay(PARAMETERS).markers(motion, sample, now_s)
    return {(marker.ns, marker.id): marker for marker in markers}


def direction(arrow):
    """Return the direction of an arrow in its frame."""
    rotation = arrow.pose.orientation
    return matrix_from_quaternion((rotation.x, rotation.y, rotation.z, rotation.w)) @ [1, 0, 0]


def test_velocity_arrow_acts_in_the_tool_frame():
    arrow = shown(velocity=(0.0, 0.05, 0.0))['velocity', 0]
    assert (arrow.type, arrow.header.frame_id, arrow.frame_locked) == (Marker.ARROW, 'r/tool', True)
    assert arrow.header.stamp.to_sec() == 0.0
    assert np.allclose(direction(arrow), [0, -1, 0])
    assert arrow.scale.x == pytest.approx(0.175)
    assert (arrow.pose.position.x, arrow.pose.position.y, arrow.pose.position.z) == (0, 0, 0)
    assert (arrow.color.r, arrow.color.g, arrow.color.b) == (0.0, 0.8, 0.1)


def test_force_arrow_acts_in_the_force_frame():
    markers = shown(force=(0.0, 0.0, -20.0))
    arrow = markers['force', 0]
    assert arrow.header.frame_id == 'r/force'
    assert np.allclose(direction(arrow), [0, 0, -1])
    assert arrow.scale.x == pytest.approx(0.36)
    assert markers['force', 1].text.strip() == 'F 20.0 N'
    assert markers['force', 1].header.frame_id == 'r/force'  # the tool's pose is unknown


def test_arrows_and_numbers_begin_where_the_tool_is_in_its_frame():
    place = DOWN._replace(foot=(0.0, 0.1, 0.2))
    markers = shown(velocity=(0.0, 0.05, 0.0), force=(9.0, 0.0, 0.0), place=place,
                    force_frame='r/tool')
    for namespace in ('velocity', 'force'):
        foot = markers[namespace, 0].pose.position
        assert (foot.x, foot.y, foot.z) == (0.0, 0.1, 0.2)
    text = PARAMETERS.text
    number = markers['velocity', 1].pose.position
    assert np.allclose((number.x, number.y, number.z),
                       (-text.outward_m, 0.1, 0.2 - text.up_m))
    foot = shown(force=(9.0, 0.0, 0.0), place=place)['force', 0].pose.position
    assert (foot.x, foot.y, foot.z) == (0.0, 0.0, 0.0)  # in its own frame


def test_numbers_stand_beyond_the_tool_in_two_lines():
    markers = shown(velocity=(0.0, 0.0523, 0.0), force=(12.34, 0.0, 0.0))
    velocity, force = markers['velocity', 1], markers['force', 1]
    assert velocity.text.split('\n') == ['v 0.052 m/s', ' ']
    assert force.text.split('\n') == [' ', 'F 12.3 N']
    assert velocity.header.frame_id == force.header.frame_id == 'r/tool'
    assert velocity.pose.position == force.pose.position
    in_base = matrix_from_quaternion(DOWN.quaternion) @ [
        velocity.pose.position.x, velocity.pose.position.y, velocity.pose.position.z]
    assert np.allclose(in_base, [-PARAMETERS.text.outward_m, 0.0, PARAMETERS.text.up_m])


def test_standing_still_removes_the_arrow_and_keeps_the_number():
    markers = shown(velocity=(0.0, 0.001, 0.0), force=(0.0, 0.0, 0.0))
    assert markers['velocity', 0].action == markers['force', 0].action == Marker.DELETE
    assert markers['velocity', 1].text.startswith('v 0.001 m/s')


def test_what_is_not_available_is_not_shown():
    assert shown() == {}
    assert {namespace for namespace, _ in shown(velocity=(1.0, 0.0, 0.0))} == {'velocity'}
    unknown = ShownMotion(DOWN, None, NOW_S)
    assert RobotDisplay(PARAMETERS).markers(unknown, None, NOW_S) == []


def test_stale_is_grey_and_says_since_when():
    markers = shown(velocity=(0.1, 0.0, 0.0), force=(5.0, 0.0, 0.0), now_s=NOW_S + 3.2)
    for namespace, text in (('velocity', 'v no data for 3.2 s'), ('force', 'F no data for 3.2 s')):
        color = markers[namespace, 0].color
        assert (color.r, color.g, color.b, color.a) == STALE_COLOR
        assert markers[namespace, 1].text.strip() == text


def test_what_nobody_draws_anew_goes_away():
    markers = shown(velocity=(0.1, 0.0, 0.0), force=(5.0, 0.0, 0.0))
    assert len(markers) == 4
    assert all(0.5 < marker.lifetime.to_sec() < 1.0 for marker in markers.values())


def test_numbers_change_ten_times_a_second():
    display = RobotDisplay(PARAMETERS)
    motion = ShownMotion(DOWN, np.array([0.1, 0.0, 0.0]), NOW_S)
    counts = [len(display.markers(motion, None, NOW_S + tick / 30.0 + 1e-6)) for tick in range(31)]
    assert set(counts) == {1, 2}
    assert 8 <= counts.count(2) <= 11
    assert len(display.markers(motion, None, NOW_S - 50.0)) == 2  # a clock that was set back


finite = st.floats(-1e6, 1e6)


@given(st.tuples(finite, finite, finite), st.tuples(finite, finite, finite))
def test_rviz_takes_every_marker(velocity, force):
    for marker in shown(velocity=velocity, force=force).values():
        rotation = marker.pose.orientation
        norm = math.hypot(rotation.x, rotation.y, rotation.z, rotation.w)
        assert norm == pytest.approx(1.0, abs=1e-6)
        if marker.action == Marker.ADD and marker.type == Marker.ARROW:
            assert 0.05 <= marker.scale.x <= 0.6
            assert marker.scale.y > 0.0 and marker.scale.z > 0.0
        assert marker.frame_locked
