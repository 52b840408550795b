# SPDX-License-Identifier: BSD-3-Clause
"""The distance of a reported tool from the model's, and vectors in the drawing frame."""
from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any, Optional

import numpy as np

from process_visualizer.nodes.robot.message_reader import StaticFrames, ToolPose
from process_visualizer.nodes.robot.tool_placing import (
    ToolDifference,
    ToolPlace,
    ToolPlacer,
    base_place,
)
from process_visualizer.parameters.reading import Parameters
from process_visualizer.parameters.robot_parameters import RobotParameters
from process_visualizer.robot.kinematics import Kinematics, Placement

ARM = """<robot name="arm"><link name="base" /><link name="tool" />
  <joint name="mount" type="fixed"><parent link="base" /><child link="tool" />
    <origin xyz="0.5 0 0" /></joint></robot>"""
TURNED = (0.0, 0.0, math.sqrt(0.5), math.sqrt(0.5))  # a quarter turn about z


def test_offset_is_in_the_tool_frame_and_outliers_do_not_count() -> None:
    difference = ToolDifference()
    for number in range(15):
        assert not difference.is_settled()
        position = (1.0, 2.0, 3.1) if number % 3 else (9.0, 9.0, 9.0)
        difference.add(Placement((1.0, 2.5, 3.0), TURNED), position, (0.0, 0.0, 0.0, 1.0))
    found = difference.median()
    assert difference.is_settled()
    assert np.allclose(found.offset, (-0.5, 0.0, 0.1))
    assert math.isclose(found.angle, math.pi / 2)
    assert math.isclose(found.distance_m(), math.hypot(0.5, 0.1))


def test_a_pose_without_an_orientation_has_no_angle() -> None:
    difference = ToolDifference()
    difference.add(Placement(), (0.1, 0.0, 0.0), None)
    assert math.isnan(difference.median().angle)
    assert np.allclose(difference.median().offset, (0.1, 0.0, 0.0))


def test_nothing_to_compare_is_no_difference() -> None:
    assert ToolDifference().median().distance_m() == 0.0


def test_vectors_in_the_frame() -> None:
    place = ToolPlace('tool', TURNED, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    assert np.allclose(place.in_frame((0.0, 1.0, 0.0)), (1.0, 0.0, 0.0))
    place = base_place('base', (1.0, 2.0, 3.0))
    assert (place.frame, place.foot) == ('base', (1.0, 2.0, 3.0))
    assert np.allclose(place.in_frame((0.0, 1.0, 0.0)), (0.0, 1.0, 0.0))


class Watched:
    """Placer of a tool 0.5 m from the base; it checks once a second."""

    def __init__(self) -> None:
        self.now_s, self.said = 0.0, ''
        node = SimpleNamespace(monotonic_s=lambda: self.now_s, resolve=lambda name: name)
        complaints = SimpleNamespace(state=self._say, end=lambda _about: self._say('', ''))
        parameters = RobotParameters.read(Parameters({
            'base_frame': 'base', 'tool_frame': 'tool',
            'topics': {'tool_center_frame': {'name': '/pose'}}}, '/r/robot_proc'), 'r')
        self.placer = ToolPlacer(node, parameters, Kinematics(ARM),  # type: ignore[arg-type]
                                 complaints,  # type: ignore[arg-type]
                                 StaticFrames(node, complaints))  # type: ignore[arg-type]

    def _say(self, _about: str, text: str, *_values: Any, **_more: Any) -> None:
        self.said = text

    def look(self, seconds: int, pose_x: Optional[float] = None) -> None:
        """Send poses for some seconds."""
        for _ in range(seconds):
            for _ in range(15 * (pose_x is not None)):
                self.placer.place(ToolPose((pose_x or 0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0),
                                           stamp_s=self.now_s), False)
            self.now_s += 1.0
            self.placer.look()


def test_a_tool_elsewhere_is_told_if_it_stays_there() -> None:
    watched = Watched()
    watched.look(20, pose_x=0.6)
    assert 'are 0.100 m and 0° apart' in watched.said
    watched.look(1, pose_x=0.5)
    assert watched.said == ''


def test_messages_that_come_late_for_some_seconds_are_no_other_tool() -> None:
    watched = Watched()
    watched.look(6, pose_x=0.5)
    for _ in range(3):
        watched.look(8, pose_x=0.7)
        assert watched.said == ''
        watched.look(1, pose_x=0.5)
    watched.look(1, pose_x=0.7)
    watched.look(60)  # no poses arrive: that is no further evidence
    assert watched.said == ''
