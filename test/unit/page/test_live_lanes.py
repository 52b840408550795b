# SPDX-License-Identifier: BSD-3-Clause
"""The curves of a live page: the columns of the launcher's curves, each with its number."""
from __future__ import annotations

from struct import unpack_from
from typing import NamedTuple

import numpy as np
import pytest

from process_visualizer.cell.model import WarningLimits
from process_visualizer.curves.curve_sources import CurveSource, Quantity
from process_visualizer.curves.live_curves import COLUMN_S, LiveCurve, LiveWindow
from process_visualizer.page.live_lanes import MAX_LANES, STEP_S, LiveLanes

FORCE = CurveSource('arm', 'F', 'N', (0.9, 0.0, 0.0), Quantity.FORCE, 'force')
FEED = CurveSource('arm', 'feed', 'rpm', (0.0, 0.0, 1.0), Quantity.NUMBER, 'feed',
                   limits=WarningLimits(low=None, high=5.0, color=(1.0, 0.0, 0.0)))
EPOCH_S = 1.7e9


class Seen(NamedTuple):
    number: int
    first: int
    epoch_s: float
    low: np.ndarray  # (lanes, columns)
    high: np.ndarray


def read(data: bytes) -> Seen:
    kind, lanes, number, first, count, epoch_s = unpack_from('<BBHIId', data)
    assert kind == 2
    columns = np.frombuffer(data, '<f4', offset=20).reshape(lanes, 2, count)
    return Seen(number, first, epoch_s, columns[:, 0], columns[:, 1])


def window(end: int, *sources: CurveSource, count: int = 30,
           epoch_s: float = EPOCH_S) -> LiveWindow:
    """Each column has its number as the value, the greatest is one more."""
    low = np.arange(end - count, end, dtype=float)
    return LiveWindow((end - count) * STEP_S, count * STEP_S, tuple(
        LiveCurve(it, low, low + 1.0, low[-1]) for it in sources), (), epoch_s)


def test_columns_have_the_numbers_of_their_times() -> None:
    lanes = LiveLanes()
    lanes.take(window(100, FORCE, FEED))
    lanes.take(window(110, FORCE, FEED))
    seen = read(lanes.columns(2.0))
    assert (seen.first, seen.epoch_s) == (90, EPOCH_S)
    assert seen.low.tolist() == [list(range(90, 110))] * 2
    assert seen.high[1].tolist() == list(range(91, 111))
    assert round(STEP_S / COLUMN_S) * COLUMN_S == pytest.approx(STEP_S)


def test_all_that_is_kept_has_what_came_before_and_gaps_in_it() -> None:
    lanes = LiveLanes(keep_s=20.0)
    lanes.take(window(100, FORCE))
    lanes.take(window(160, FORCE))
    seen = read(lanes.columns(600.0))
    assert seen.first == 0
    assert np.isnan(seen.low[0, :70]).all()
    assert seen.low[0, 70:100].tolist() == list(range(70, 100))
    assert (seen.low[0, 100:104] == 99.0).all()  # it holds for some intervals
    assert np.isnan(seen.low[0, 104:130]).all()
    lanes.take(window(300, FORCE))
    assert read(lanes.columns(600.0)).first == 100


def test_a_value_that_is_sent_once_a_second_is_a_step() -> None:
    low = np.full(60, np.nan)
    low[5:50:10] = [1.0, 2.0, 3.0, 4.0, 5.0]
    lanes = LiveLanes()
    lanes.take(LiveWindow(0.0, 60 * STEP_S, (LiveCurve(FEED, low, low, 5.0),), (), EPOCH_S))
    seen = read(lanes.columns(60 * STEP_S)).low[0]
    assert np.isnan(seen[:5]).all()
    assert seen[5:60].tolist() == [float(1 + min(column // 10, 4)) for column in range(55)]


def test_another_set_of_curves_has_another_number() -> None:
    lanes = LiveLanes()
    lanes.take(window(100, FORCE))
    before = read(lanes.columns(1.0)).number
    lanes.take(window(101, FORCE))
    assert read(lanes.columns(1.0)).number == before
    lanes.take(window(102, FORCE, FEED))
    seen = read(lanes.columns(1.0))
    assert seen.number == before + 1
    assert seen.low.shape == (2, 10)


def test_a_recorder_that_has_begun_anew_leaves_nothing_of_before() -> None:
    lanes = LiveLanes()
    lanes.take(window(100, FORCE, FEED))
    lanes.take(window(31, FORCE, epoch_s=EPOCH_S + 500.0))
    seen = read(lanes.columns(600.0))
    assert (seen.epoch_s, seen.first, seen.low.shape) == (EPOCH_S + 500.0, 0, (1, 31))
    assert [it['label'] for it in lanes.entries] == ['tool force']


def test_lanes_have_scale_ticks_and_limits_of_the_launcher() -> None:
    lanes = LiveLanes()
    lanes.take(window(30, FEED, FORCE))
    feed, force = lanes.entries
    assert feed['limits'] == [5.0]
    assert feed['unit'] == 'rpm'
    assert force['scale'][0] <= 0.0
    assert force['scale'][1] >= 30.0
    assert [text for _, text in force['ticks']]


def test_curves_that_come_later_have_no_room_and_empty_ones_no_lane() -> None:
    lanes = LiveLanes()
    for first in (0, MAX_LANES, 2 * MAX_LANES):
        lanes.take(window(100, *(FORCE._replace(label=str(first + row))
                                 for row in range(MAX_LANES))))
    assert len(read(lanes.columns(2.0)).low) == MAX_LANES
    empty = np.empty(0)
    lanes.take(LiveWindow(0.0, 20.0, (LiveCurve(FORCE, empty, empty, np.nan),), (), EPOCH_S))
    assert len(read(lanes.columns(2.0)).low) == MAX_LANES
