# SPDX-License-Identifier: BSD-3-Clause
"""The simulated sewing cycle is smooth, consistent, repeatable, and good or poor as set."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sewing_cell import kinematics, layout
from sewing_cell.cycle import SewingCycle
from sewing_cell.layout import ARMS, LOWER, UPPER, Arm

PERIOD_S = 20.0
STEP_S = 0.004
#: Two cycles and a bit, so that the wrap-around is inside.
TIMES_S = np.arange(0.0, 2.2 * PERIOD_S, STEP_S)

both_arms = pytest.mark.parametrize("arm", ARMS, ids=lambda arm: arm.name)
both_qualities = pytest.mark.parametrize("quality", ["good", "poor"])


def sewing_times(cycle: SewingCycle) -> np.ndarray:
    """Times in the first cycle at which the machine feeds at full speed."""
    sew = cycle.schedule.sew
    return np.arange(sew.begin + 1.5, sew.end - 1.5, STEP_S)


@both_arms
@both_qualities
def test_tools_move_smoothly(arm: Arm, quality: str) -> None:
    tool = SewingCycle(quality, seed=3).truth(arm, TIMES_S)
    assert np.abs(tool.velocity).max() < 0.5
    assert np.abs(np.diff(tool.velocity, axis=0) / STEP_S).max() < 1.0
    assert np.linalg.norm(np.diff(tool.position, axis=0), axis=1).max() < 0.5 * STEP_S


@both_arms
@both_qualities
def test_true_velocity_is_the_derivative(arm: Arm, quality: str) -> None:
    cycle, step = SewingCycle(quality, seed=5), 1e-5
    rate = (
        cycle.truth(arm, TIMES_S + step).position - cycle.truth(arm, TIMES_S - step).position
    ) / (2 * step)
    inside = step < TIMES_S
    np.testing.assert_allclose(
        rate[inside], cycle.truth(arm, TIMES_S).velocity[inside], atol=1e-7
    )


@both_arms
def test_joints_move_smoothly_over_the_wrap(arm: Arm) -> None:
    joints = SewingCycle(seed=3).joints(arm, TIMES_S)
    speed = np.diff(joints, axis=0) / STEP_S
    assert np.abs(speed).max() < 1.0
    assert np.abs(np.diff(speed, axis=0) / STEP_S).max() < 2.0
    assert np.abs(joints).max() < 2 * np.pi


@both_arms
def test_tool_frame_agrees_with_the_joints(arm: Arm) -> None:
    cycle = SewingCycle("poor", seed=1)
    pose = kinematics.forward(cycle.joints(arm, TIMES_S))
    frame = cycle.tool_frame(arm, TIMES_S)
    np.testing.assert_allclose(pose[:, :3, 3], frame[:, :3], atol=1e-6)
    np.testing.assert_allclose(
        pose[:, :3, :3], kinematics.rotation_matrix(frame[:, 3:]), atol=1e-6
    )


@both_arms
def test_truth_is_the_tool_frame_in_world(arm: Arm) -> None:
    cycle = SewingCycle(seed=1)
    in_world = cycle.tool_frame(arm, TIMES_S)[:, :3] @ arm.base_rotation.T
    np.testing.assert_allclose(cycle.truth(arm, TIMES_S).position, in_world, atol=1e-12)


@both_arms
def test_robots_keep_clear(arm: Arm) -> None:
    """Each tool is on its side of the sewing plane, clear of the machine and of the floor."""
    frames = kinematics.link_frames(SewingCycle("poor", seed=2).joints(arm, TIMES_S[::5]))
    points = frames[..., :3, 3] @ arm.base_rotation.T
    away_from_base = points[:, 3:]
    assert (arm.side * (away_from_base[..., 2] - layout.SEWING_PLANE_Z)).min() > 0.05
    assert points[..., 1].min() > layout.MACHINE_BASE[1] + 0.15
    assert points[..., 2].min() > layout.FLOOR_Z + 0.2


@both_arms
def test_tool_points_at_the_sewing_plane(arm: Arm) -> None:
    pose = arm.tool_pose(np.array([-0.6, 0.0, 0.16]))
    axis = arm.base_rotation @ pose[:3, 2]
    np.testing.assert_allclose(axis, [0.0, 0.0, -arm.side], atol=1e-12)


@both_arms
def test_feed_is_as_fast_as_a_sewing_machine(arm: Arm) -> None:
    cycle = SewingCycle(seed=4)
    times = sewing_times(cycle)
    forward = -cycle.truth(arm, times).velocity[:, 1]
    assert 0.05 <= forward.min() <= forward.max() <= 0.08
    np.testing.assert_allclose(cycle.feed_rate(times), forward, atol=0.005)


@both_qualities
def test_covers_move_with_the_tools_while_sewing(quality: str) -> None:
    cycle = SewingCycle(quality, seed=4)
    for time_s in np.linspace(cycle.schedule.grip.end, cycle.schedule.sew.end, 40):
        current = cycle.covers(time_s)[0]
        for arm, shift in zip(ARMS, current.steering):
            tool = cycle.truth(arm, time_s).position
            assert current.y == pytest.approx(tool[1], abs=1e-9)
            assert current.x + shift == pytest.approx(tool[0], abs=1e-9)


def test_next_covers_take_the_place_of_the_sewn_ones() -> None:
    cycle = SewingCycle()
    for boundary in (PERIOD_S, 2 * PERIOD_S):
        sewn, following = cycle.covers(boundary - 1e-6)
        current, _ = cycle.covers(boundary + 1e-6)
        assert (current.x, current.y) == pytest.approx((following.x, following.y), abs=1e-6)
        assert sewn.y + layout.COVER_BOX[3] < -1.1
        assert current.sewn == 0.0 < sewn.sewn


def test_seam_grows_with_the_feed() -> None:
    cycle = SewingCycle()
    sewn = [cycle.covers(time_s)[0].sewn for time_s in np.arange(0.0, PERIOD_S, 0.1)]
    assert sewn[0] == 0.0
    assert np.all(np.diff(sewn) >= 0.0)
    assert sewn[-1] == pytest.approx(0.5)


@settings(max_examples=15)
@given(
    st.integers(0, 2**32), st.sampled_from(["good", "poor"]), st.floats(0, 500), st.floats(12, 60)
)
def test_same_seed_same_data(seed: int, quality: str, time_s: float, period_s: float) -> None:
    """Single times and arrays of times also give the same data."""
    times = time_s + np.arange(5) * 0.008
    one, other = (SewingCycle(quality, seed, period_s) for _ in range(2))
    for arm in ARMS:
        for kind in ("joints", "tool_frame", "wrench", "edge"):
            together = getattr(one, kind)(arm, times)
            apart = [getattr(other, kind)(arm, time) for time in times]
            np.testing.assert_allclose(together, apart, rtol=0, atol=1e-12)
    np.testing.assert_array_equal(one.feed_rate(times), other.feed_rate(times))


def test_other_seed_other_data() -> None:
    times = sewing_times(SewingCycle())
    one, other = SewingCycle(seed=1), SewingCycle(seed=2)
    assert np.any(one.edge(UPPER, times) != other.edge(UPPER, times))
    assert np.any(one.wrench(UPPER, times) != other.wrench(UPPER, times))
    assert np.any(one.joints(LOWER, times) != other.joints(LOWER, times))


def test_cycles_of_a_run_differ() -> None:
    cycle = SewingCycle()
    times = sewing_times(cycle)
    assert np.any(cycle.edge(UPPER, times) != cycle.edge(UPPER, times + PERIOD_S))


@both_arms
@both_qualities
@pytest.mark.parametrize("seed", range(4))
def test_edge_readings_are_those_of_the_sensor(arm: Arm, quality: str, seed: int) -> None:
    readings = SewingCycle(quality, seed).edge(arm, TIMES_S)
    assert readings.dtype.kind == "i"
    assert readings.min() >= 0
    assert readings.max() <= 511
    assert abs(np.median(readings) - 255) < 5


@both_arms
@pytest.mark.parametrize("seed", range(6))
def test_good_seam_is_steered_back(arm: Arm, seed: int) -> None:
    cycle = SewingCycle("good", seed)
    readings = cycle.edge(arm, sewing_times(cycle))
    assert readings.std() > 4
    assert np.abs(readings - 255).max() < 80
    force = np.linalg.norm(cycle.wrench(arm, sewing_times(cycle))[:, :3], axis=1)
    assert 10 < force.min() <= force.max() < 25


@pytest.mark.parametrize("seed", range(6))
def test_poor_seam_goes_wrong(seed: int) -> None:
    """An edge drifts, the force rises, and the seam leaves its line."""
    good, poor = SewingCycle("good", seed), SewingCycle("poor", seed)
    times = sewing_times(good)
    drifts, forces = [], []
    for arm in ARMS:
        drifts.append(np.abs(poor.edge(arm, times) - good.edge(arm, times)).max())
        forces.append(np.linalg.norm(poor.wrench(arm, times)[:, :3], axis=1).max())
    assert max(drifts) > 100
    assert max(forces) > 40
    along = np.linspace(0.0, 0.45, 50)
    worst = max(np.abs(poor.seam_offset(n * PERIOD_S + 12.0, along)).max() for n in range(8))
    best = max(np.abs(good.seam_offset(n * PERIOD_S + 12.0, along)).max() for n in range(8))
    assert best < 0.0035 < 0.005 < worst


def test_poor_seam_starts_well_and_the_seed_decides_until_when() -> None:
    starts = []
    for seed in range(8):
        good, poor = SewingCycle("good", seed), SewingCycle("poor", seed)
        times = sewing_times(good)
        wrong = np.zeros(times.shape, dtype=bool)
        for arm in ARMS:
            wrong |= np.abs(poor.edge_error(arm, times) - good.edge_error(arm, times)) > 5e-4
        starts.append(times[np.argmax(wrong)])
    assert min(starts) > good.schedule.sew.begin + 1.5
    assert np.ptp(starts) > 0.5


@both_arms
def test_machine_pulls_in_sewing_direction(arm: Arm) -> None:
    cycle = SewingCycle()
    wrench = cycle.wrench(arm, sewing_times(cycle))
    tool = arm.tool_pose(np.zeros(3))[:3, :3]
    force_frame = tool @ np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 1]])  # yaw -pi/2
    in_world = wrench[:, :3].mean(axis=0) @ force_frame.T @ arm.base_rotation.T
    assert in_world[1] < -10
    assert abs(in_world[0]) < 4


@both_arms
def test_nothing_pulls_when_nothing_is_held(arm: Arm) -> None:
    cycle = SewingCycle("poor", seed=1)
    plan = cycle.schedule
    idle = np.arange(plan.release.end, plan.period_s, STEP_S)
    assert np.abs(cycle.wrench(arm, idle)[:, :3]).max() < 2.0
    assert np.all(cycle.feed_rate(idle) == 0.0)


def test_robots_steer_against_their_edge() -> None:
    cycle = SewingCycle(seed=7)
    times = sewing_times(cycle)
    x = cycle.truth(UPPER, times).position[:, 0] - layout.SEAM_START_XY[0]
    assert 5e-4 < np.abs(x).max() < 8e-3


@pytest.mark.parametrize("period_s", [12.0, 20.0, 45.0])
def test_any_period_works(period_s: float) -> None:
    cycle = SewingCycle(period_s=period_s)
    first = cycle.truth(UPPER, np.array([0.0, period_s]))
    np.testing.assert_allclose(first.position[0], first.position[1], atol=1e-9)
    cycle.joints(LOWER, np.arange(0, period_s, 0.05))


@pytest.mark.parametrize(
    "arguments, word",
    [
        ({"quality": "bad"}, "good, poor"),
        ({"seed": -1}, "seed"),
        ({"period_s": 3.0}, "12 to 120"),
        ({"period_s": float("nan")}, "12 to 120"),
    ],
)
def test_wrong_arguments_say_what_to_give(arguments: dict, word: str) -> None:
    with pytest.raises(ValueError, match=word):
        SewingCycle(**arguments)
