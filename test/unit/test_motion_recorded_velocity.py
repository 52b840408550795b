# SPDX-License-Identifier: BSD-3-Clause
"""The velocity at a time of a recording: from the curves, and from the estimator at any time."""
from __future__ import annotations

from typing import List, Tuple

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from process_visualizer.robot.recorded_velocity import WINDOW_S, RecordedVelocity, speeds
from process_visualizer.robot.velocity import VelocityEstimator

PERIOD_S = 0.008
# multiples of 0.7 ms never meet the ends of windows and gaps, where rounding would decide
steps_s = st.one_of(st.sampled_from([11, 3, 71, 428, 2143]), st.integers(1, 300)).map(
    lambda count: count * 0.0007)
points = st.tuples(*[st.sampled_from([0.0, 0.1, -0.2, 1.0, 0.15])] * 3)
VELOCITY, TURNING = np.array([0.05, -0.12, 0.02]), np.array([0.3, -0.2, 0.9])


def turned(times_s: np.ndarray) -> np.ndarray:
    """The quaternions (n, 4) of a constant angular velocity."""
    rate = np.linalg.norm(TURNING)
    half = 0.5 * rate * times_s
    return np.column_stack((np.sin(half)[:, None] * TURNING / rate, np.cos(half)))


def straight(times_s: np.ndarray) -> RecordedVelocity:
    """A tool that moves and turns at constant speed."""
    return RecordedVelocity(times_s, np.outer(times_s, VELOCITY) + 0.3, turned(times_s))


@given(st.lists(st.tuples(steps_s, points), min_size=1, max_size=150))
def test_its_length_is_the_curve_at_every_point_of_it(
        samples: List[Tuple[float, Tuple[float, ...]]]) -> None:
    times_s = np.cumsum([step for step, _ in samples])
    positions = np.array([point for _, point in samples])
    recorded = RecordedVelocity(times_s, positions)
    for middle_s, speed in zip(*speeds(times_s, positions)):
        velocity = recorded.velocity(middle_s)
        assert velocity is not None
        assert np.linalg.norm(velocity) == pytest.approx(speed, rel=1e-5, abs=1e-6)


@given(st.integers(0, 10**6), st.floats(0.001, 0.02))
def test_it_is_what_the_estimator_says_of_that_time_later(seed: int, period_s: float) -> None:
    random = np.random.default_rng(seed)
    times_s = np.cumsum(random.uniform(0.8, 1.2, 400) * period_s)
    positions = np.column_stack([np.sin(times_s * rate + seed) * 0.1 for rate in (1.0, 2.3, 0.4)])
    positions += random.normal(0.0, 1e-5, positions.shape)
    recorded = RecordedVelocity(times_s, positions, turned(times_s))
    estimator = VelocityEstimator(WINDOW_S)
    for time_s, position, quaternion in zip(times_s, positions, turned(times_s)):
        estimator.add(time_s, position, quaternion, time_s)
        if estimator.velocity() is not None:
            middle_s = estimator.wall_s()
            assert np.allclose(recorded.velocity(middle_s), estimator.velocity(), atol=1e-6)
            assert np.allclose(recorded.angular_velocity(middle_s), estimator.angular_velocity(),
                               atol=1e-6)


@given(st.lists(st.floats(0.0001, 0.3), min_size=3, max_size=60), st.floats(0.0, 1.0))
def test_an_even_motion_is_exact_at_any_time(steps: List[float], share: float) -> None:
    times_s = np.cumsum(steps)
    recorded = straight(times_s)
    time_s = times_s[0] + share * (times_s[-1] - times_s[0])
    velocity, turning = recorded.velocity(time_s), recorded.angular_velocity(time_s)
    if times_s[-1] - times_s[0] < 0.5 * WINDOW_S:
        assert velocity is None and turning is None
    else:
        assert np.allclose(velocity, VELOCITY, atol=1e-6)
        assert np.allclose(turning, TURNING, atol=1e-5)


@pytest.mark.parametrize('rate_hz', [50.0, 125.0, 500.0])
def test_a_stamp_as_float_seconds_since_1970_says_the_same(rate_hz: float) -> None:
    """A window is a whole number of periods: its start must not depend on a stamp's last bit."""
    begin_s = 1_700_000_000.0
    exact_s = np.arange(round(2.0 * rate_hz)) / rate_hz
    rounded_s = (begin_s + exact_s) - begin_s
    positions = np.column_stack((np.sin(5.0 * exact_s), np.cos(5.0 * exact_s), exact_s ** 3))
    exact, rounded = RecordedVelocity(exact_s, positions), RecordedVelocity(rounded_s, positions)
    for time_s in np.arange(0.3, 1.7, 0.013):
        assert rounded.velocity(time_s) == pytest.approx(exact.velocity(time_s), abs=2e-5)
    live = VelocityEstimator(WINDOW_S)
    for number, (time_s, position) in enumerate(zip(rounded_s.tolist(), positions)):
        live.add(time_s, position)
        if time_s > 2.0 * WINDOW_S:
            middle_s = exact_s[number] - 0.5 * WINDOW_S
            assert live.velocity() == pytest.approx(exact.velocity(middle_s), abs=2e-5)


def test_it_follows_the_motion_without_delay() -> None:
    times_s = np.arange(0.0, 5.0, PERIOD_S)
    path_m = 0.1 * np.sin(2.0 * times_s)
    recorded = RecordedVelocity(times_s, np.outer(path_m, [1.0, 0.0, 0.0]))
    for time_s in np.linspace(0.11, 4.85, 200):
        velocity = recorded.velocity(time_s)
        assert velocity is not None
        assert velocity[0] == pytest.approx(0.2 * np.cos(2.0 * time_s), abs=0.002)
    assert recorded.angular_velocity(1.0) is None  # it is unknown


def test_it_is_there_up_to_the_first_and_the_last_pose() -> None:
    recorded = straight(np.arange(0.0, 2.0, PERIOD_S) + 1.0)
    for time_s in (0.95, 1.0, 1.02, 2.99, 3.0, 3.05):
        assert np.allclose(recorded.velocity(time_s), VELOCITY)
    assert recorded.velocity(0.88) is None
    assert recorded.velocity(3.2) is None


def test_at_the_end_it_is_the_part_of_the_window_that_is_there() -> None:
    times_s = np.arange(0.0, 2.0, PERIOD_S)
    recorded = RecordedVelocity(times_s, np.outer(times_s ** 2, [1.0, 0.0, 0.0]))
    velocity = recorded.velocity(float(times_s[-1]))
    assert velocity is not None
    assert velocity[0] == pytest.approx(2.0 * (times_s[-1] - 0.25 * WINDOW_S), abs=0.02)


def test_there_is_none_in_a_gap() -> None:
    times_s = np.concatenate((np.arange(0.0, 1.0, PERIOD_S), np.arange(3.0, 4.0, PERIOD_S)))
    positions = np.outer(np.where(times_s < 2.0, times_s, -times_s), [1.0, 0.0, 0.0])
    recorded = RecordedVelocity(times_s, positions)
    assert np.allclose(recorded.velocity(1.05), [1.0, 0.0, 0.0])
    assert recorded.velocity(1.2) is None
    assert recorded.velocity(2.8) is None
    assert np.allclose(recorded.velocity(2.95), [-1.0, 0.0, 0.0])


def test_poses_that_are_too_few_have_none() -> None:
    for count in (0, 1, 2):
        recorded = straight(np.arange(count) * 0.01)
        assert recorded.velocity(0.01) is None
        assert recorded.angular_velocity(0.01) is None


def test_a_tool_that_turns_in_its_place_is_seen_to_turn() -> None:
    times_s = np.arange(0.0, 2.0, PERIOD_S)
    recorded = RecordedVelocity(times_s, np.zeros((len(times_s), 3)), turned(times_s))
    assert np.allclose(recorded.velocity(1.0), 0.0)
    assert np.allclose(recorded.angular_velocity(1.0), TURNING)


def test_the_age_is_that_of_the_last_pose() -> None:
    recorded = straight(np.arange(0.0, 1.0, 0.25))
    assert recorded.age_s(-0.1) is None
    assert recorded.age_s(0.0) == 0.0
    assert recorded.age_s(0.6) == pytest.approx(0.1)
    assert recorded.age_s(5.0) == pytest.approx(4.25)
