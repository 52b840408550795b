# SPDX-License-Identifier: BSD-3-Clause
"""The velocity from arriving poses: with and without stamps, at another player's rate."""
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from process_visualizer.robot.velocity import HOLD_S, ToolVelocity

VELOCITY = np.array([0.05, -0.12, 0.02])
TURNING = np.array([0.3, -0.5, 0.8])  # rad/s in the base frame
PERIOD_S = 0.008
START_S = 1000.0


def pose(time_s):
    """Return position and quaternion at a time."""
    rotation = Rotation.from_rotvec(TURNING * time_s) * Rotation.from_rotvec((3.1, 0.1, 0.2))
    return tuple(VELOCITY * time_s + [0.5, 0.1, 0.2]), tuple(rotation.as_quat())


def test_poses_without_a_stamp_wait_for_those_that_follow():
    velocity = ToolVelocity(0.1)
    for step in range(60):
        wall_s = START_S + step * PERIOD_S
        velocity.add(wall_s, wall_s, *pose(step * PERIOD_S))
    assert np.allclose(velocity.velocity(), VELOCITY)
    assert velocity.wall_s() == pytest.approx(wall_s - HOLD_S - 6.5 * PERIOD_S, abs=PERIOD_S)
    velocity.settle(wall_s + HOLD_S)
    assert velocity.wall_s() == pytest.approx(wall_s - 6.5 * PERIOD_S, abs=PERIOD_S)


@pytest.mark.parametrize('rate', [0.25, 2.0, 8.0, -1.0])
def test_the_rate_of_another_player_scales_the_time(rate):
    velocity = ToolVelocity(0.1)
    for step in range(60):
        wall_s = START_S + step * PERIOD_S / abs(rate)
        velocity.add(wall_s, wall_s, *pose(np.copysign(step * PERIOD_S, rate)), rate)
    velocity.settle(wall_s + HOLD_S)
    assert np.allclose(velocity.velocity(), VELOCITY)
    assert np.allclose(velocity.angular_velocity(), TURNING, atol=1e-4)
    assert velocity.wall_s() == pytest.approx(wall_s - 6.5 * PERIOD_S / abs(rate),
                                              abs=PERIOD_S / abs(rate))


def test_poses_with_stamps_do_not_wait():
    velocity = ToolVelocity(0.1)
    for step in range(30):
        wall_s = START_S + step * PERIOD_S
        velocity.add(wall_s + 0.03 * (step % 3), wall_s - 1e-4, *pose(step * PERIOD_S))
    assert np.allclose(velocity.velocity(), VELOCITY)
    assert velocity.wall_s() == pytest.approx(wall_s - 6.5 * PERIOD_S, abs=PERIOD_S)


@pytest.mark.parametrize('back_s', [0.05, 2.0, 900.0])
def test_a_clock_that_was_set_back(back_s):
    velocity, found = ToolVelocity(0.1), []
    for step in range(100):
        wall_s = START_S + step * PERIOD_S - (back_s if step >= 50 else 0.0)
        velocity.add(wall_s, wall_s, *pose(step * PERIOD_S))
        if velocity.velocity() is not None:
            found.append(velocity.velocity())
    assert len(found) > 50
    assert np.allclose(found[-20:], VELOCITY)
    if back_s > 1.0:
        assert np.allclose(found, VELOCITY)
