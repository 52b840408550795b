# SPDX-License-Identifier: BSD-3-Clause
"""The latencies that the benchmark ``seek`` prints."""
from __future__ import annotations

import numpy as np
import pytest
from command_latency import Seen, pause_latency_ms, rate_latency_ms, scene_latency_ms

MS = 1_000_000


def seen(*arrivals):
    """Arrivals (ms, topic, index) in order."""
    times, topics, indexes = zip(*arrivals) if arrivals else ((), (), ())
    return Seen(np.array(times, np.int64) * MS, np.array(topics, int), np.array(indexes, int))


def test_a_scene_is_there_with_its_last_topic():
    arrivals = seen((105, 0, 7), (112, 1, 3), (130, 0, 8))
    assert scene_latency_ms(arrivals, 100 * MS, [7, 3]) == 12.0


def test_other_messages_do_not_count():
    arrivals = seen((101, 0, 6), (105, 0, 7), (106, 1, 3), (107, 1, 4))
    assert scene_latency_ms(arrivals, 100 * MS, [7, 4]) == 7.0


def test_a_topic_without_a_message_so_far_is_not_waited_for():
    assert scene_latency_ms(seen((105, 0, 7)), 100 * MS, [7, -1]) == 5.0


def test_a_missing_message_is_a_failure():
    assert np.isnan(scene_latency_ms(seen((105, 0, 7)), 100 * MS, [7, 3]))


def test_only_the_time_of_the_request_counts():
    arrivals = seen((90, 0, 7), (105, 0, 7), (200, 0, 7)).between(100 * MS, 200 * MS)
    assert arrivals.times_ns.tolist() == [105 * MS]


def test_pause_ends_with_the_last_message():
    assert pause_latency_ms(seen((101, 0, 1), (104, 1, 1)), 100 * MS) == 4.0
    assert pause_latency_ms(seen(), 100 * MS) == 0.0


def test_a_repeated_scene_is_not_new():
    arrivals = seen((101, 0, 1), (102, 1, 4), (103, 0, 2), (200, 0, 2), (200, 1, 4), (201, 1, 3))
    assert list(arrivals.first_arrivals().times_ns) == [101 * MS, 102 * MS, 103 * MS]


@pytest.mark.parametrize(('old', 'new'), [(1.0, 0.25), (0.25, 1.0), (1.0, 4.0)])
@pytest.mark.parametrize('latency_ms', [0.0, 7.0])
def test_the_change_of_rate_is_where_the_lines_meet(old, new, latency_ms):
    due_ns = [5_000 * MS + np.arange(2000) * MS]
    change_ns, change_index = 100 * MS + latency_ms * MS, 400
    indexes = np.arange(300, 600)
    slope = np.where(indexes < change_index, old, new)
    times = change_ns + (indexes - change_index) * MS / slope
    arrivals = Seen(times, np.zeros(300, int), indexes)
    before, after = arrivals.between(-1000 * MS, 100 * MS), arrivals.between(110 * MS, 900 * MS)
    assert rate_latency_ms(before, after, due_ns, old, new,
                           100 * MS) == pytest.approx(latency_ms, abs=1e-3)
