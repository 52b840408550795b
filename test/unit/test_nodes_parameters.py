# SPDX-License-Identifier: BSD-3-Clause
"""Parameters of the nodes: defaults, and a message for each wrong value."""
import pytest

from process_visualizer.parameters.reading import ParameterError, Parameters
from process_visualizer.parameters.robot_parameters import RobotParameters, TopicParameters


def read(values):
    return RobotParameters.read(Parameters(values, '/r/robot_proc'), 'r')


def test_defaults():
    parameters = read({})
    assert (parameters.base_frame, parameters.tool_frame) == ('r/link0', 'r/tool')
    assert parameters.force_frame == 'r/tool'
    assert parameters.joint_states == TopicParameters('', '')
    assert parameters.velocity_arrow.color == (0.0, 0.8, 0.1, 1.0)
    assert parameters.marker_rate_hz == 30.0


def test_values_are_taken():
    parameters = read({
        'tool_frame': '/r/flange',
        'topics': {'force_sensor': {'name': '/ft', 'msg': 'geometry_msgs/WrenchStamped'}},
        'arrows': {'force': {'scale': 1, 'min': 0.1, 'max': 0.2, 'color': '1 0.5 0'},
                   'velocity': {'color': [0, 0, 1, 0.5]}}})
    assert parameters.force_frame == 'r/flange'
    assert parameters.force_sensor == TopicParameters('/ft', 'geometry_msgs/WrenchStamped')
    assert parameters.force_arrow.color == (1.0, 0.5, 0.0, 1.0)
    assert (parameters.force_arrow.scale_m, parameters.force_arrow.max_m) == (1.0, 0.2)
    assert parameters.velocity_arrow.color == (0.0, 0.0, 1.0, 0.5)


def test_an_arrow_may_shrink_to_nothing():
    assert read({'arrows': {'force': {'min': 0}}}).force_arrow.min_m == 0.0


@pytest.mark.parametrize('values, problem', [
    ({'marker_rate': 0}, '/r/robot_proc/marker_rate: a number above 0'),
    ({'marker_rate': 'fast'}, 'marker_rate: a number'),
    ({'marker_rate': True}, 'marker_rate: a number'),
    ({'velocity_window': float('nan')}, 'velocity_window: a number'),
    ({'tool_frame': 3}, 'tool_frame: a string'),
    ({'arrows': {'force': {'color': 'red'}}}, 'arrows/force/color: three or four numbers'),
    ({'arrows': {'force': {'color': 3}}}, 'arrows/force/color: three or four numbers'),
    ({'arrows': {'force': {'color': [0, 0, 255]}}}, 'arrows/force/color: three or four numbers'),
    ({'arrows': {'velocity': {'min': 0.5, 'max': 0.4}}}, 'min 0.5 m is above max 0.4 m'),
    ({'arrows': {'velocity': {'min': -1}}}, 'arrows/velocity/min: a number of 0 or more'),
    ({'arrows': {'velocity': {'scale': -1}}}, 'arrows/velocity/scale: a number above 0'),
    ({'arrows': {'velocity': 3}}, 'arrows/velocity: a group'),
    ({'topics': {'joint_states': '/q'}}, 'topics/joint_states: a group'),
])
def test_wrong_values_are_named(values, problem):
    with pytest.raises(ParameterError, match=problem):
        read(values)


@pytest.mark.parametrize('value', ['0 0 0', [0, 0], [0, 0, 'x'], 1, [0, 0, float('inf')]])
def test_wrong_vectors_are_named(value):
    with pytest.raises(ParameterError, match='/n/xyz: a list of three numbers'):
        Parameters({'xyz': value}, '/n').vector('xyz', (0.0, 0.0, 0.0))
