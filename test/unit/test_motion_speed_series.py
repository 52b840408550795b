# SPDX-License-Identifier: BSD-3-Clause
"""The speed over a whole recording: as from the estimator, and robust against bunches."""
from __future__ import annotations

import math
from pathlib import Path
from typing import List, Optional, Tuple

import numpy as np
import pytest
import rosbag
from geometry_msgs.msg import PoseStamped
from hypothesis import example, given
from hypothesis import strategies as st
from rospy import Time
from std_msgs.msg import Header

from process_visualizer.bagio.number_places import FieldLocator
from process_visualizer.bagio.recording import Recording
from process_visualizer.curves.samples import part_numbers
from process_visualizer.robot.measuring_time import measuring_times, sending_period_s
from process_visualizer.robot.recorded_velocity import WINDOW_S, speeds
from process_visualizer.robot.velocity import GAP_S, VelocityEstimator

# multiples of 0.7 ms never meet the ends of windows and gaps, where rounding would decide
steps_s = st.one_of(st.sampled_from([11, 3, 71, 428, 2143, 28571]), st.integers(1, 300)).map(
    lambda count: count * 0.0007)
points = st.tuples(*[st.sampled_from([0.0, 0.1, -0.2, 1.0, 0.15])] * 3)
NO_STAMPS = float('nan')


def estimated(times_s: np.ndarray, positions: np.ndarray) -> List[float]:
    """The speeds of the estimator after each new sample, and at the end of the poses."""
    estimator = VelocityEstimator(WINDOW_S, GAP_S)
    found: List[Optional[float]] = []
    last = None
    for before_s, time_s, position in zip([0.0, *times_s], times_s, positions):
        if time_s - before_s > GAP_S:
            found += ending(estimator)
        estimator.add(time_s, position)
        if estimator._samples[-1] is not last:
            found.append(speed(estimator))
        last = estimator._samples[-1]
    return [it for it in found + ending(estimator) if it is not None]


def ending(estimator: VelocityEstimator) -> List[Optional[float]]:
    """The speeds of the last window, as it gets shorter from its beginning."""
    found = []
    while estimator._samples:
        estimator._samples.popleft()
        found.append(speed(estimator))
    return found


def speed(estimator: VelocityEstimator) -> Optional[float]:
    """The speed of the estimator, if it is known."""
    velocity = estimator.velocity()
    return None if velocity is None else math.hypot(*velocity)


@given(st.lists(st.tuples(steps_s, points), min_size=1, max_size=150))
@example([(0.0077, (0.0, 0.0, 0.0)), (0.0924, (0.0, 0.0, 0.0)), (0.0077, (0.0, 0.0, 0.0))])
def test_they_are_those_of_the_estimator(samples: List[Tuple[float, Tuple[float, ...]]]) -> None:
    times_s = np.cumsum([step for step, _ in samples])
    positions = np.array([point for _, point in samples])
    middle_s, found = speeds(times_s, positions)
    assert found.tolist() == pytest.approx(estimated(times_s, positions), rel=1e-6, abs=1e-9)
    assert (np.diff(middle_s) > -1e-9).all()


def test_many_samples_are_as_exact_as_few() -> None:
    times_s = np.arange(0.0, 3600.0, 0.008)
    path_m = 0.05 * times_s + 0.02 * np.sin(times_s)
    positions = np.column_stack((path_m, np.zeros_like(path_m), np.ones_like(path_m)))
    middle_s, found = speeds(times_s, positions)
    assert np.abs(found - (0.05 + 0.02 * np.cos(middle_s))).max() < 1e-4


@pytest.mark.parametrize('count', [0, 1, 2])
def test_few_samples_have_no_speed(count: int) -> None:
    middle_s, found = speeds(np.arange(count) * 0.01, np.zeros((count, 3)))
    assert (len(middle_s), len(found)) == (0, 0)


def test_messages_that_come_late_together_are_dated_back() -> None:
    measured_s = np.arange(1000) * 0.008
    arrival_s = measured_s.copy()
    arrival_s[300:310] = measured_s[309]  # ten at once
    arrival_s[600:] += 0.5  # a gap stays a gap
    found = measuring_times(arrival_s, np.full(1000, NO_STAMPS))
    assert np.abs(found[:600] - measured_s[:600]).max() < 0.005
    assert found[600] - found[599] > 0.49
    middle_s, speed = speeds(found, np.outer(measured_s, [0.1, 0.0, 0.0]))
    near = np.abs(middle_s - measured_s[305]) < 0.5
    assert np.abs(speed[near] - 0.1).max() < 0.01
    _, raw = speeds(arrival_s, np.outer(measured_s, [0.1, 0.0, 0.0]))
    assert np.abs(raw[near[:len(raw)]] - 0.1).max() > 0.03  # shows the benefit


def test_a_part_of_a_recording_has_the_times_of_the_whole() -> None:
    random = np.random.default_rng(2)
    arrival_s = np.maximum.accumulate(np.arange(5000) * 0.008 + random.exponential(0.01, 5000))
    none = np.full(5000, NO_STAMPS)
    whole = measuring_times(arrival_s, none)
    part = measuring_times(arrival_s[1000:1300], none[1000:1300], sending_period_s(arrival_s))
    assert part[20:200] == pytest.approx(whole[1020:1200], abs=1e-9)


def test_stamps_are_read_to_the_nanosecond(tmp_path: Path) -> None:
    """A velocity's window is a whole number of periods: it must not depend on rounding."""
    stamps = [Time(1_700_000_000, 8_000_000 * number + 1) for number in range(50)]
    path = str(tmp_path / 'a.bag')
    with rosbag.Bag(path, 'w') as bag:
        for stamp in stamps:
            bag.write('/pose', PoseStamped(header=Header(stamp=stamp)), stamp)
    with Recording([path]) as recording:
        connection = recording.index.connections[0]
        locator = FieldLocator(connection.type, connection.message_definition,
                               [f'pose.position.{axis}' for axis in 'xyz'])
        found = part_numbers(recording, {0: locator})
    assert found.stamps_ns.tolist() == [it.to_nsec() for it in stamps]


def test_stamps_are_used_where_they_can_be() -> None:
    arrival_s = np.array([1.0, 1.1, 1.2, 1.3, 1.4])
    stamps_s = np.array([0.95, 1.06, NO_STAMPS, 900.0, 1.06])
    assert measuring_times(arrival_s, stamps_s).tolist() == [0.95, 1.06, 1.2, 1.3, 1.4]


def test_what_waited_while_the_recorder_was_held_up_moves_no_faster() -> None:
    stamps_s = np.arange(0.0, 20.0, 0.01)
    arrivals_s = stamps_s + 0.002
    waited = (stamps_s > 6.0) & (stamps_s < 15.0)
    arrivals_s[waited] = 15.0 + 1e-5 * np.arange(np.count_nonzero(waited))
    places = np.column_stack((0.3 * stamps_s, np.zeros((len(stamps_s), 2))))
    measured_s = measuring_times(np.maximum.accumulate(arrivals_s), stamps_s)
    assert measured_s == pytest.approx(stamps_s)
    assert speeds(measured_s, places)[1] == pytest.approx(0.3, abs=1e-3)
    other_clock_s = measuring_times(arrivals_s, stamps_s - 100.0)
    assert np.abs(other_clock_s - arrivals_s).max() < 10.0, 'of a clock that is wrong'


def test_a_position_that_no_tool_can_have_does_not_set_the_scale() -> None:
    times_s = 0.01 * np.arange(200)
    positions = np.column_stack((0.3 * times_s, np.zeros((200, 2))))
    positions[100, 1] = 5e29  # a damaged message
    _, found = speeds(times_s, positions)
    assert found == pytest.approx(0.3, rel=1e-6)
