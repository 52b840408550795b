# SPDX-License-Identifier: BSD-3-Clause
"""The generated parameters are those that the nodes read."""
from __future__ import annotations

from dataclasses import replace
from typing import Any, Optional, Tuple

import pytest
from hypothesis import given
from hypothesis import strategies as st

from process_visualizer.bagio.number_places import FieldPath
from process_visualizer.parameters.cell_parameters import (
    SceneParameters,
    WatchedDevice,
    read_frames,
    written_frames,
)
from process_visualizer.parameters.reading import ParameterError, Parameters
from process_visualizer.parameters.robot_parameters import (
    RobotParameters,
    TextParameters,
    TopicParameters,
)
from process_visualizer.parameters.variable_parameters import (
    VariableColors,
    VariableParameters,
    VariablesParameters,
)
from process_visualizer.robot.arrows import FORCE_ARROW, VELOCITY_ARROW, ArrowStyle
from process_visualizer.robot.frames import Frame

SHARES = st.integers(0, 10).map(lambda it: it / 10)
COLORS = st.tuples(SHARES, SHARES, SHARES, SHARES)
LENGTHS_M = st.floats(0.001, 1.0)
NUMBERS = st.floats(-1e6, 1e6)
NAMES = st.text('abc', min_size=1, max_size=8)
TOPICS = st.one_of(st.just(TopicParameters()), st.builds(
    TopicParameters, NAMES, st.sampled_from(('', 'std_msgs/Float32')), st.just(''), NAMES))
VECTORS = st.tuples(NUMBERS, NUMBERS, NUMBERS)


@st.composite
def arrows(draw: Any, default: ArrowStyle) -> ArrowStyle:
    low, high = sorted((draw(LENGTHS_M), draw(LENGTHS_M)))
    return replace(default, scale_m=draw(LENGTHS_M), min_m=low, max_m=high,
                   threshold=draw(NUMBERS), color=draw(COLORS), diameter_m=draw(LENGTHS_M))


ROBOTS = st.builds(
    RobotParameters, st.just('r'), NAMES, NAMES, NAMES, TOPICS,
    st.lists(NAMES, max_size=2, unique=True).map(tuple), TOPICS, TOPICS,
    arrows(VELOCITY_ARROW), arrows(FORCE_ARROW),
    st.builds(TextParameters, LENGTHS_M, NUMBERS, NUMBERS), LENGTHS_M, LENGTHS_M, LENGTHS_M,
    st.booleans(), LENGTHS_M, LENGTHS_M, st.sampled_from(('', 'left_')))


@given(ROBOTS)
def test_robot(robot: RobotParameters) -> None:
    assert RobotParameters.read(Parameters(robot.to_parameters(), '/r'), 'r') == robot


def test_of_a_plain_robot_only_the_frames_are_written() -> None:
    robot = RobotParameters('r', 'base', 'tool', 'tool')
    assert robot.to_parameters() == {'base_frame': 'base', 'tool_frame': 'tool', 'topics': {}}


@st.composite
def variables(draw: Any) -> VariableParameters:
    scale: Optional[Tuple[float, float, Any]] = draw(st.one_of(
        st.none(), st.tuples(st.just(0.0), LENGTHS_M, COLORS)))
    limits = draw(st.sampled_from(({}, {'low': -1.0}, {'high': 2.0, 'low': 1.0})))
    colors = VariableColors(draw(COLORS), scale, **limits)
    axis = draw(st.sampled_from(((1.0, 0.0, 0.0), (0.0, -1.0, 0.0))))
    return VariableParameters(
        draw(NAMES), FieldPath(draw(st.sampled_from(('data', 'v[2]', 'wrench.force.z')))),
        draw(NAMES), axis, colors, draw(NAMES), draw(NUMBERS), draw(NUMBERS), draw(NAMES),
        draw(st.sampled_from(('', 'setpoint'))), draw(LENGTHS_M), draw(st.booleans()))


@given(st.lists(variables(), min_size=1, max_size=3), st.one_of(st.none(), VECTORS), LENGTHS_M)
def test_variables(chosen: Any, position: Any, height_m: float) -> None:
    written = VariablesParameters(chosen, 'f', position, height_m)
    found = VariablesParameters.read(Parameters(written.to_parameters(), '/v'))
    assert [str(it.field) for it in found.variables] == [str(it.field) for it in chosen]
    path = FieldPath('data')
    assert [replace(it, field=path) for it in found.variables] == [
        replace(it, field=path) for it in chosen]
    assert replace(found, variables=[]) == replace(written, variables=[])


@given(st.lists(st.builds(Frame, NAMES, NAMES, VECTORS, VECTORS), max_size=3))
def test_frames(frames: Any) -> None:
    assert read_frames(written_frames(frames)) == frames


@pytest.mark.parametrize('stale_after_s', [0.7, 2.0])
@pytest.mark.parametrize('age_topic', ['', '/k/points_age'])
def test_scene(age_topic: str, stale_after_s: float) -> None:
    device = WatchedDevice('k', 'f', (1.0, 2.0, 3.0), {'/k/depth_proc': 'old'}, ('/a', '/b'),
                           age_topic)
    scene = SceneParameters('world', (device,), stale_after_s)
    assert SceneParameters.read(Parameters(scene.to_parameters(), '/s')) == scene


@pytest.mark.parametrize('values', [[{'a': 1}], [['a']], {'a': {'b': 'c'}}, 5, ['x' * 10_000, 1]])
def test_what_is_no_group_of_texts_is_told_in_a_line(values: Any) -> None:
    with pytest.raises(ParameterError, match='/node/nodes: a dictionary of strings') as caught:
        Parameters({'nodes': values}, '/node').texts('nodes')
    assert len(str(caught.value)) < 300
