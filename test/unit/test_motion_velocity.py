# SPDX-License-Identifier: BSD-3-Clause
"""Velocity on known trajectories with repeats, jitter, bunches, gaps and noise."""
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from process_visualizer.robot.velocity import ScaledClock, VelocityEstimator

PERIOD_S = 0.008
VELOCITY = np.array([0.05, -0.12, 0.02])


def estimates(times, positions, **options):
    """Return the known estimates (n, 3) after each sample."""
    estimator = VelocityEstimator(**options)
    found = []
    for time_s, position in zip(times, positions):
        estimator.add(time_s, position)
        if estimator.velocity() is not None:
            found.append(estimator.velocity())
    return np.array(found)


def straight(times):
    return np.outer(times, VELOCITY) + [0.5, 0.1, 0.2]


def test_straight_motion_is_exact():
    times = np.arange(100) * PERIOD_S
    found = estimates(times, straight(times))
    assert len(found) > 90
    assert np.allclose(found, VELOCITY, atol=1e-9)


@given(st.lists(st.floats(0.0001, 0.3), min_size=3, max_size=60))
def test_straight_motion_is_exact_at_any_times(steps):
    times = np.cumsum(steps)
    for velocity in estimates(times, straight(times)):
        assert np.allclose(velocity, VELOCITY, atol=1e-6)


def test_unknown_before_the_first_positions_span_a_time():
    estimator = VelocityEstimator(window_s=0.1)
    assert estimator.velocity() is None
    for time_s in (0.0, 0.02, 0.04):
        estimator.add(time_s, VELOCITY * time_s)
        assert estimator.velocity() is None


@pytest.mark.parametrize('repeats', [2, 3, 5])
def test_repeated_positions_make_no_zeros(repeats):
    times = np.arange(300) * PERIOD_S
    held = straight(times)[np.arange(300) // repeats * repeats]
    found = estimates(times, held)
    assert np.allclose(found, VELOCITY, rtol=1e-6)
    differences = np.diff(held, axis=0) / PERIOD_S  # as the thesis computes it
    assert (np.abs(differences).max(axis=1) == 0.0).any()


def test_standing_still_is_exactly_zero_after_a_window():
    times = np.arange(200) * PERIOD_S
    positions = straight(np.minimum(times, 0.8))
    found = estimates(times, positions, window_s=0.1)
    standing_since = 200 - int(np.ceil((times[-1] - 0.8 - 0.15) / PERIOD_S))
    late = found[-(200 - standing_since):]
    assert len(late) > 60
    assert np.abs(late).max() < 1e-12


def test_bunched_messages_make_no_spikes():
    times = np.arange(500) * PERIOD_S
    bunched = np.ceil(times / 0.04) * 0.04 + np.arange(500) % 5 * 1e-5  # five at once
    found = estimates(bunched, straight(times))
    speed = np.linalg.norm(VELOCITY)
    assert np.linalg.norm(found - VELOCITY, axis=1).max() < 0.6 * speed
    steady = found[20:]
    assert np.linalg.norm(steady - VELOCITY, axis=1).max() < 0.45 * speed
    differences = np.diff(straight(times), axis=0) / np.diff(bunched)[:, None]
    assert np.linalg.norm(differences, axis=1).max() > 100 * speed  # figure 6.15 b of the thesis


def test_bunch_after_a_gap_makes_no_spike():
    times = np.concatenate([np.arange(30) * PERIOD_S, 0.24 + np.arange(40) * PERIOD_S])
    arrival = np.where((times > 0.24) & (times < 0.5), 0.5 + (times - 0.24) * 1e-3, times)
    found = estimates(arrival, straight(times))
    assert np.linalg.norm(found, axis=1).max() < 2.5 * np.linalg.norm(VELOCITY)


def test_noise_and_jitter_stay_small():
    random = np.random.default_rng(3)
    times = np.arange(2000) * PERIOD_S
    stamps = np.sort(times + random.uniform(0.0, 0.004, 2000))
    positions = straight(times) + random.normal(0.0, 2e-5, (2000, 3))
    error = estimates(stamps, positions)[20:] - VELOCITY
    assert np.sqrt((error ** 2).mean()) < 0.02 * np.linalg.norm(VELOCITY)


def test_delay_is_half_a_window():
    times = np.arange(1000) * PERIOD_S
    positions = np.stack([0.1 * np.sin(2 * times), 0 * times, 0 * times], axis=1)
    found = estimates(times, positions, window_s=0.1)[:, 0]
    late = times[-len(found):] - 0.05
    error = found - 0.2 * np.cos(2 * late)
    assert np.abs(error[20:]).max() < 0.02 * 0.2


def test_backwards_gives_the_recorded_velocity():
    times = np.arange(100)[::-1] * PERIOD_S
    assert np.allclose(estimates(times, straight(times)), VELOCITY, atol=1e-9)


def test_turning_back_keeps_the_velocity():
    forwards = np.arange(100) * PERIOD_S
    times = np.concatenate([forwards, forwards[::-1]])
    assert np.allclose(estimates(times, straight(times)), VELOCITY, atol=1e-9)


@pytest.mark.parametrize('step_s', [1.5, -1.5])
def test_a_step_in_time_starts_anew(step_s):
    estimator = VelocityEstimator(gap_s=1.0)
    for time_s in np.arange(50) * PERIOD_S:
        estimator.add(time_s, VELOCITY * time_s)
    estimator.add(0.392 + step_s, np.array([7.0, 7.0, 7.0]))
    assert estimator.velocity() is None


def test_reset_forgets():
    estimator = VelocityEstimator()
    for time_s in (0.0, 0.1, 0.2):
        estimator.add(time_s, VELOCITY * time_s)
    assert estimator.velocity() is not None
    estimator.reset()
    assert estimator.velocity() is None


def test_time_standing_still_is_no_spike_and_no_growth():
    estimator = VelocityEstimator(max_samples=50)
    for step in range(1000):
        estimator.add(1.0, np.array([step, 0.0, 0.0]))
    assert estimator.velocity() is None


@pytest.mark.parametrize('window_s, gap_s', [(0.0, 1.0), (-1.0, 1.0), (2.0, 1.0)])
def test_window_and_gap_are_checked(window_s, gap_s):
    with pytest.raises(ValueError, match='window'):
        VelocityEstimator(window_s, gap_s)


@pytest.mark.parametrize('rate', [0.25, 1.0, 4.0, -1.0])
def test_the_clock_gives_the_same_velocity_at_every_rate(rate):
    times = np.arange(100) * PERIOD_S
    shown = times if rate > 0 else times[::-1]
    clock = ScaledClock()
    scaled = [clock.advance(1000.0 + now / abs(rate), rate) for now in times]
    assert np.allclose(estimates(scaled, straight(shown)), VELOCITY, atol=1e-6)


def test_the_clock_takes_rate_changes():
    clock = ScaledClock()
    assert [clock.advance(5.0, 1.0), clock.advance(6.0, 2.0), clock.advance(8.0, -0.5)] == [0, 2, 1]
