# SPDX-License-Identifier: BSD-3-Clause
"""The time that a velocity is told with is that of the position to which it belongs."""
from __future__ import annotations

import time
from typing import Any

import numpy as np
import pytest

from process_visualizer.motion.velocity.recorded_velocity import RecordedVelocity
from process_visualizer.nodes.robot import twist_source
from process_visualizer.nodes.robot.recorded_motion import RecordedMoment

TIMES_S = np.linspace(0.0, 1.0, 101)
POSITIONS = np.outer(TIMES_S, [0.1, 0.0, 0.0])
QUATERNIONS = np.tile([0.0, 0.0, 0.0, 1.0], (101, 1))


class HeldUpRecording:
    """A recording of which the reader is held up whenever it has found the position."""

    wall_s = 0.0

    def is_in_charge(self) -> bool:
        return True

    def moment(self) -> RecordedMoment:
        self.wall_s = time.time()
        time.sleep(0.02)
        return RecordedMoment(0.5, self.wall_s,
                              RecordedVelocity(TIMES_S, POSITIONS, QUATERNIONS))


def test_who_is_held_up_tells_the_time_of_the_position(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(twist_source, 'LiveNumber', lambda *arguments: None)
    recording: Any = HeldUpRecording()
    twist = twist_source.TwistSource(recording, 0.2, 0.5).twist()
    assert twist is not None
    assert twist.linear == pytest.approx((0.1, 0.0, 0.0))
    assert twist.stamp.to_sec() == pytest.approx(recording.wall_s, abs=1e-6)
