# SPDX-License-Identifier: BSD-3-Clause
"""Stamps of clouds: kept where possible, otherwise shifted together."""
from __future__ import annotations

from typing import List, Tuple

from hypothesis import given
from hypothesis import strategies as st

from process_visualizer.nodes.depth_processor import MAX_AGE_NS, KeptStamps

MS = 1_000_000
START_NS = 1_700_000_000_000 * MS
DELAYS = st.lists(st.integers(0, MAX_AGE_NS - 50 * MS), min_size=1, max_size=20)


def stamped(clock_ns: int, delays_ns: List[int], period_ns: int = 33 * MS
            ) -> Tuple[List[int], List[int], List[int]]:
    """Return stamps of a clock that is ahead, arrival times, and the stamps that are used."""
    keeper = KeptStamps()
    taken = [START_NS + number * period_ns for number in range(len(delays_ns))]
    arrivals = [time + delay for time, delay in zip(taken, delays_ns)]
    used = [keeper.stamp(time + clock_ns, arrival) for time, arrival in zip(taken, arrivals)]
    return [time + clock_ns for time in taken], arrivals, used


@given(DELAYS)
def test_stamps_of_this_clock_are_kept(delays_ns: List[int]) -> None:
    stamps, _, used = stamped(0, delays_ns)
    assert used == stamps


@given(st.integers(-START_NS + 1, START_NS), DELAYS)
def test_never_in_the_future_and_never_too_old(clock_ns: int, delays_ns: List[int]) -> None:
    _, arrivals, used = stamped(clock_ns, delays_ns)
    assert all(0 <= arrival - stamp <= MAX_AGE_NS for stamp, arrival in zip(used, arrivals))


@given(st.sampled_from((-START_NS // 2, -3_600_000 * MS, 5 * MS, 3_600_000 * MS)),
       st.lists(st.integers(10 * MS, 40 * MS), max_size=20))
def test_differences_of_another_clock_are_kept(clock_ns: int, delays_ns: List[int]) -> None:
    """From the message with the shortest delay on."""
    stamps, arrivals, used = stamped(clock_ns, [4 * MS, *delays_ns])
    assert used[0] == arrivals[0] or used == stamps  # 5 ms ahead, but never by its arrival
    assert [b - a for a, b in zip(used, used[1:])] == [b - a for a, b in zip(stamps, stamps[1:])]


def test_follows_a_clock_that_is_set() -> None:
    keeper = KeptStamps()
    assert keeper.stamp(START_NS - 10 ** 12, START_NS + 5 * MS) == START_NS + 5 * MS
    assert keeper.stamp(START_NS + 33 * MS, START_NS + 40 * MS) == START_NS + 33 * MS


def test_without_a_stamp_the_arrival_counts() -> None:
    keeper = KeptStamps()
    assert [keeper.stamp(0, START_NS + it) for it in (0, MS)] == [START_NS, START_NS + MS]
