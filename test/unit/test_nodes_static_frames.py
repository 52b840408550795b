# SPDX-License-Identifier: BSD-3-Clause
"""Static transforms of the cell reach each part of a robot processor, from any sender."""
from __future__ import annotations

from typing import List

import pytest
from geometry_msgs.msg import TransformStamped
from simulated_node import SimulatedNode
from tf2_msgs.msg import TFMessage

from process_visualizer.nodes.common.complaints import Complaints
from process_visualizer.nodes.robot.message_reader import StaticFrames


def transform(child: str, x: float, stamp_s: float = 0.0, parent: str = 'base') -> TransformStamped:
    made = TransformStamped(child_frame_id=child)
    made.header.frame_id = parent
    made.header.stamp = made.header.stamp.from_sec(stamp_s)
    made.transform.translation.x, made.transform.rotation.w = x, 1.0
    return made


class Follower:
    """Received transforms: child frames and their x."""

    def __init__(self) -> None:
        self.calls: List[List['tuple[str, float]']] = []

    def __call__(self, transforms: List[TransformStamped]) -> None:
        self.calls.append([(it.child_frame_id, it.transform.translation.x) for it in transforms])


@pytest.fixture
def node() -> SimulatedNode:
    return SimulatedNode()


@pytest.fixture
def static(node: SimulatedNode) -> StaticFrames:
    return StaticFrames(node, Complaints(node, 'r'))


def test_it_is_listened_to_only_if_a_part_asks(node: SimulatedNode, static: StaticFrames) -> None:
    assert not node.listens('/tf_static')
    static.follow(Follower())
    assert node.listens('/tf_static')


def test_several_publishers_add_up_and_a_later_part_gets_them_all(
        node: SimulatedNode, static: StaticFrames) -> None:
    first, later = Follower(), Follower()
    static.follow(first)
    node.send('/tf_static', TFMessage([transform('tool', 1.0)]))
    node.send('/tf_static', TFMessage([transform('camera', 2.0), transform('table', 3.0)]))
    static.follow(later)
    assert first.calls == [[('tool', 1.0)], [('camera', 2.0), ('table', 3.0)]]
    assert later.calls == [[('tool', 1.0), ('camera', 2.0), ('table', 3.0)]]


def test_only_what_changes_is_passed_on(node: SimulatedNode, static: StaticFrames) -> None:
    """Publishers send all of their transforms again with each new one."""
    follower = Follower()
    static.follow(follower)
    node.send('/tf_static', TFMessage([transform('tool', 1.0), transform('camera', 2.0)]))
    node.send('/tf_static', TFMessage([transform('tool', 1.0, 9.0), transform('camera', 2.5)]))
    node.send('/tf_static', TFMessage([transform('tool', 1.0, parent='flange')]))
    assert follower.calls[1:] == [[('camera', 2.5)], [('tool', 1.0)]]
    assert {it.child_frame_id: it.header.frame_id for it in static.known()} == {
        'tool': 'flange', 'camera': 'base'}
