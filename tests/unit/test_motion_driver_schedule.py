"""Messages of an even driver are laid on its schedule, those of an uneven one keep their times."""
from __future__ import annotations

import random
from typing import List

import pytest
from hypothesis import given
from hypothesis import strategies as st

from process_visualizer.motion.driver_schedule import DriverSchedule

PERIOD_S = 0.008
KNOWN = 100  # messages after which the schedule is known


def placed(times_s: List[float], period_s: float = PERIOD_S) -> List[float]:
    """When the messages were measured."""
    schedule = DriverSchedule()
    return [schedule.measured_s(time_s, period_s) for time_s in times_s]


def delays(seed: int, count: int) -> List[float]:
    """Most messages come soon, some late [s]; none so late that it passes another."""
    generator = random.Random(seed)
    return [min(generator.expovariate(1 / 0.0003) + (0.003 if generator.random() < 0.02 else 0.0),
                0.0035) for _ in range(count)]


@given(st.integers(0, 1000), st.sampled_from([1.0, -1.0]), st.floats(-1e5, 1e9))
def test_late_messages_do_not_matter(seed: int, direction: float, begin_s: float) -> None:
    true_s = [begin_s + direction * PERIOD_S * number for number in range(1000)]
    came_s = [time_s + late_s for time_s, late_s in zip(true_s, delays(seed, 1000))]
    errors_s = [found - time_s for found, time_s in zip(placed(came_s), true_s)][KNOWN:]
    assert max(errors_s) - min(errors_s) < 0.0004  # a tenth of what they were late by


def test_lost_messages_leave_their_places_empty() -> None:
    true_s = [PERIOD_S * number for number in range(600) if number % 7 and not 300 < number < 310]
    assert placed(true_s)[KNOWN:] == pytest.approx(true_s[KNOWN:], abs=1e-9)


def test_period_that_is_known_inexactly() -> None:
    true_s = [PERIOD_S * number for number in range(600)]
    assert placed(true_s, 0.97 * PERIOD_S)[KNOWN:] == pytest.approx(true_s[KNOWN:], abs=1e-9)


@pytest.mark.parametrize('shift_s', [0.0039, 0.003, 0.1, 0.1035, 5.003])
def test_driver_that_begins_anew_is_followed(shift_s: float) -> None:
    first_s = [PERIOD_S * number for number in range(400)]
    second_s = [first_s[-1] + PERIOD_S + shift_s + PERIOD_S * number for number in range(400)]
    found_s = placed(first_s + second_s)[400:]
    assert max(abs(found - time_s) for found, time_s in zip(found_s, second_s)) < PERIOD_S / 2
    assert found_s[KNOWN:] == pytest.approx(second_s[KNOWN:], abs=PERIOD_S / 20)


def test_uneven_driver_keeps_its_times() -> None:
    generator = random.Random(1)
    came_s = [PERIOD_S * (number + generator.uniform(-0.45, 0.45)) for number in range(1000)]
    assert placed(came_s) == came_s


def test_no_period_no_schedule() -> None:
    came_s = [PERIOD_S * number + late_s for number, late_s in enumerate(delays(1, 300))]
    assert placed(came_s, 0.0) == came_s


def test_clock_of_the_driver_that_runs_slowly_faster() -> None:
    """Its schedule is that of the last two seconds."""
    true_s, time_s = [], 0.0
    for number in range(3000):
        time_s += PERIOD_S * (1.0 - 1e-6 * number)
        true_s.append(time_s)
    errors_s = [found - time for found, time in zip(placed(true_s), true_s)][KNOWN:]
    assert max(map(abs, errors_s)) < 0.0002
