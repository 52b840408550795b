# SPDX-License-Identifier: BSD-3-Clause
"""The period of a driver, and its effect on the velocity of late and bunched messages."""
import numpy as np
import pytest

from process_visualizer.robot.velocity import SendingPeriod, ToolVelocity

PERIOD_S = 0.008
VELOCITY = np.array([0.05, -0.12, 0.02])
NO_TURN = (0.0, 0.0, 0.0, 1.0)


def period_of(times):
    period = SendingPeriod()
    for time_s in times:
        period.add(time_s)
    return period.period_s


def late(times, random, share=0.02, longest_s=0.06):
    """Delay some messages, and those after them."""
    held = times + np.where(random.random(len(times)) < share,
                            random.uniform(0.0, longest_s, len(times)), 0.0)
    return np.maximum.accumulate(held + random.exponential(0.0005, len(times)))


def test_period_of_late_bunched_and_lost_messages():
    random = np.random.default_rng(5)
    times = np.arange(1000) * PERIOD_S
    assert period_of(times) == pytest.approx(PERIOD_S)
    assert 0.94 * PERIOD_S < period_of(late(times, random)) <= PERIOD_S  # rather too short
    assert period_of(times[::-1]) == pytest.approx(PERIOD_S)
    assert period_of(times[random.random(1000) > 0.02]) == pytest.approx(PERIOD_S, rel=0.01)


def test_irregular_messages_have_no_period():
    random = np.random.default_rng(5)
    assert period_of(np.cumsum(random.exponential(PERIOD_S, 1000) ** 2 * 100)) == 0.0
    assert period_of([1.0] * 1000) == 0.0


def errors(times, arrivals):
    """Return the relative errors (n,) of the velocity once the period is known."""
    velocity, found = ToolVelocity(0.15), []
    for time_s, arrival_s in zip(times, arrivals):
        wall_s = 1000 + arrival_s
        velocity.add(wall_s, wall_s, VELOCITY * time_s, NO_TURN)
        found.append(velocity.velocity())
    return np.linalg.norm(np.array(found[300:]) - VELOCITY, axis=1) / np.linalg.norm(VELOCITY)


def test_messages_that_were_held_up():
    random = np.random.default_rng(5)
    times = np.arange(5000) * PERIOD_S
    found = errors(times, late(times, random))
    assert np.sqrt((found ** 2).mean()) < 0.02
    assert found.max() < 0.12


def test_a_third_of_a_second_at_once():
    times = np.arange(2000) * PERIOD_S
    arrivals = np.where((times > 6.0) & (times < 6.3), 6.3, times)
    assert errors(times, arrivals).max() < 0.06


def test_five_at_once():
    times = np.arange(2000) * PERIOD_S
    found = errors(times, np.ceil(times / 0.04 - 1e-9) * 0.04 + np.arange(2000) % 5 * 1e-5)
    assert found.max() < 0.05


def test_lost_messages_make_no_spike():
    random = np.random.default_rng(5)
    times = np.arange(3000) * PERIOD_S
    times = times[(random.random(3000) > 0.02) & ((np.arange(3000) % 400) > 8)]
    assert errors(times, times).max() < 0.06


def test_an_irregular_driver_is_taken_as_it_is():
    times = np.cumsum(np.random.default_rng(5).exponential(PERIOD_S, 3000))
    assert errors(times, times).max() < 1e-6


def test_another_rate_of_the_driver():
    times = np.cumsum(np.where(np.arange(3000) < 1500, 0.016, 0.008))
    found = errors(times, times)  # without the first 300
    assert found[:1190].max() < 1e-6
    assert found.max() < 0.8  # for a moment: the new messages look like a bunch
    assert found[1300:].max() < 1e-6
