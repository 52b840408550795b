# SPDX-License-Identifier: BSD-3-Clause
"""Messages that come together after a silence were held up."""
from __future__ import annotations

from typing import List

import numpy as np
import pytest

from process_visualizer.robot.late_arrivals import LateArrivals

STEADY_S = [0.1 * it for it in range(100)]


def late_of(times_s: List[float], part: int) -> List[bool]:
    arrivals, late = LateArrivals(), []
    for begin in range(0, len(times_s), part):
        times_ns = np.round(np.array(times_s[begin:begin + part]) * 1e9).astype(np.int64) + 1
        late += arrivals.find(times_ns).tolist()
    return late


@pytest.mark.parametrize('part', [1, 2, 7, 1000])
def test_a_bunch_after_a_silence_was_held_up(part: int) -> None:
    bunch_s = [20.0 + 1e-4 * it + (0.05 if it > 30 else 0.0) for it in range(100)]  # not evenly
    after_s = [20.2 + 0.1 * it for it in range(50)]
    late = late_of([*STEADY_S, *bunch_s, *after_s], part)
    assert not any(late[:100]) and not any(late[205:])
    assert all(late[102:200])
    assert all(late[100:102]) or part in (1, 2)  # few are not known to be of a bunch


def test_the_first_messages_after_a_silence_may_be_old() -> None:
    times_s = [*(0.01 * it for it in range(300)), *(20.0 + 0.01 * it for it in range(100))]
    late = late_of(times_s, 7)
    assert [row for row, is_late in enumerate(late) if is_late] == list(range(300, 310))


@pytest.mark.parametrize(('since_s', 'count'), [(18.0, 10), (19.5, 0)])
def test_a_part_may_begin_in_a_silence(since_s: float, count: int) -> None:
    late = LateArrivals(0.01, round(1e9 * since_s)).find(
        np.round(1e9 * (20.0 + 0.01 * np.arange(50))).astype(np.int64))
    assert late.tolist() == [True] * count + [False] * (50 - count)


@pytest.mark.parametrize('times_s', [
    [*STEADY_S, *(9.95 + 1e-4 * it for it in range(20)), 10.5],  # no silence before
    [begin_s + 1e-3 * it for begin_s in range(0, 50, 5) for it in range(20)],  # it sends in bursts
    [0.0, 20.0, 20.001, 20.002],  # nobody knows what is usual
    [0.0]])
def test_what_else_comes_fast_was_not(times_s: List[float]) -> None:
    assert not any(late_of(times_s, 7))
