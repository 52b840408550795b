# SPDX-License-Identifier: BSD-3-Clause
"""The stamp of a velocity is that of the position to which it belongs."""
from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from simulated_node import SimulatedNode

from process_visualizer.nodes.robot.twist_source import RecordedMoment, TwistSource
from process_visualizer.robot.recorded_velocity import RecordedVelocity

TIMES_S = np.linspace(0.0, 1.0, 101)
POSITIONS = np.outer(TIMES_S, [0.1, 0.0, 0.0])
QUATERNIONS = np.tile([0.0, 0.0, 0.0, 1.0], (101, 1))


class HeldUpRecording:
    """Recording whose reader is delayed each time after it has found the position."""

    def __init__(self, node: SimulatedNode) -> None:
        self.node = node

    def is_in_charge(self) -> bool:
        return True

    def moment(self) -> RecordedMoment:
        wall_s = self.node.wall_s()
        self.node.advance(0.02)
        return RecordedMoment(0.5, wall_s, RecordedVelocity(TIMES_S, POSITIONS, QUATERNIONS))


def stamp_s(node: Any) -> float:
    """Return the stamp [s] of the velocity when the node's clock is at 1000 s."""
    recording: Any = HeldUpRecording(node)
    twist = TwistSource(node, recording, 0.2, 0.5).twist()
    assert twist is not None
    assert twist.linear == pytest.approx((0.1, 0.0, 0.0))
    return float(twist.stamp.to_sec())


def test_who_is_held_up_tells_the_time_of_the_position() -> None:
    assert stamp_s(SimulatedNode()) == pytest.approx(1000.0, abs=1e-6)


def test_under_simulated_time_it_is_told_in_that() -> None:
    node = SimulatedNode()
    node.ros_offset_s = -990.0
    assert stamp_s(node) == pytest.approx(10.02, abs=1e-6)
