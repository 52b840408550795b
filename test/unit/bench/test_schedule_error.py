# SPDX-License-Identifier: BSD-3-Clause
"""The schedule error that play_timing prints."""
from __future__ import annotations

import numpy as np
import pytest
from schedule_error import TopicArrivals, pooled, schedule_errors

MS = 1_000_000
BAG_BEGIN_NS = 1_600_000_000_000_000_000


def played(topic_phase_ms=0, rate=1.0, late_ms=(), kept=None, order=None):
    """Ten messages, 10 ms apart in the bag, that arrive some ms late."""
    bag_times_ns = BAG_BEGIN_NS + (topic_phase_ms + np.arange(10) * 10) * MS
    arrivals_ns = 777 + np.round((bag_times_ns - BAG_BEGIN_NS) / rate).astype(np.int64)
    for index, late in enumerate(late_ms):
        arrivals_ns[index] += round(late * MS)
    indexes = np.arange(10) if kept is None else np.array(kept)
    arrivals_ns = arrivals_ns[indexes]
    if order is not None:
        indexes = indexes[order]
    return TopicArrivals(indexes, arrivals_ns, bag_times_ns)


@pytest.mark.parametrize('rate', [0.25, 1.0, 4.0])
def test_a_perfect_player_has_no_error(rate):
    errors = schedule_errors([played(rate=rate), played(3, rate=rate)], [0], rate)
    assert all(error.percentile(100) < 1e-3 for error in errors)
    assert all((error.lost, error.disordered) == (0, 0) for error in errors)


def test_a_topic_that_always_comes_late_has_an_error():
    late, _ = schedule_errors([played(late_ms=[5] * 10), played(3)], [1], 1.0)
    assert late.percentile(50) == pytest.approx(5.0)


def test_a_stall_does_not_shift_the_others():
    error, = schedule_errors([played(late_ms=[0, 0, 80])], [0], 1.0)
    assert error.percentile(50) == 0.0
    assert error.percentile(100) == pytest.approx(80.0)


def test_early_messages_count_like_late_ones():
    error, = schedule_errors([played(late_ms=[0, -6])], [0], 1.0)
    assert error.percentile(100) == pytest.approx(6.0)


def test_the_wrong_rate_is_an_error():
    error, = schedule_errors([played(rate=1.01)], [0], 1.0)
    assert error.percentile(100) > 0.4


def test_lost_messages_leave_the_others_in_time():
    error, = schedule_errors([played(kept=[0, 1, 2, 5, 6, 7, 9])], [0], 1.0)
    assert error.lost == 3
    assert error.percentile(100) == 0.0


def test_messages_out_of_order_and_twice_are_counted():
    swapped, = schedule_errors([played(order=[0, 2, 1, 3, 4, 5, 6, 7, 8, 9])], [0], 1.0)
    twice, = schedule_errors([played(kept=[0, 1, 1, 2, 3, 4, 5, 6, 7, 8, 9])], [0], 1.0)
    assert (swapped.lost, swapped.disordered) == (0, 1)
    assert (twice.lost, twice.disordered) == (0, 1)


def test_a_silent_topic_is_lost():
    error, _ = schedule_errors([played(kept=np.zeros(0, int)), played()], [1], 1.0)
    assert error.lost == 10
    assert np.isnan(error.percentile(99))


def test_rounds_are_pooled():
    first = schedule_errors([played(kept=[0, 1, 2])], [0], 1.0)
    second = schedule_errors([played(late_ms=[4])], [0], 1.0)
    error, = pooled([first, second])
    assert len(error.errors_ms) == 13
    assert error.lost == 7
    assert error.percentile(100) == pytest.approx(4.0)
