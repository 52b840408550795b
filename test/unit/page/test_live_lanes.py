# SPDX-License-Identifier: BSD-3-Clause
"""The curves of a live page: the columns of the launcher's curves, each with its number."""
from __future__ import annotations

from struct import unpack_from
from typing import List, NamedTuple, Optional, Sequence

import numpy as np
import pytest

from process_visualizer.cell.model import WarningLimits
from process_visualizer.curves.curve_sources import CurveSource, Quantity
from process_visualizer.curves.live_curves import COLUMN_S, LiveCurve, LiveWindow
from process_visualizer.page.live_lanes import MAX_LANES, STEP_S, LiveLanes
from process_visualizer.runs.comparison.live_comparison import LiveBands, live_bands
from process_visualizer.runs.comparison.timeline_bands import TimelineBand

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
    bands: List[Optional[TimelineBand]]


def read(data: bytes) -> Seen:
    kind, lanes, number, first, count, epoch_s = unpack_from('<BBHIId', data)
    assert kind == 2
    at, columns, bands = 20 + lanes, [], []
    for has_band in data[20:at]:
        columns.append(np.frombuffer(data, '<f4', 2 * count, at).reshape(2, count))
        at += 8 * count
        bands.append(None)
        if has_band:
            limits = np.frombuffer(data, '<f4', 2 * count, at).reshape(2, count)
            bands[-1] = TimelineBand(*limits, np.frombuffer(data, bool, count, at + 8 * count))
            at += 9 * count
    assert at == len(data)
    values = np.array(columns).reshape(lanes, 2, count)
    return Seen(number, first, epoch_s, values[:, 0], values[:, 1], bands)


def window(end: int, *sources: CurveSource, count: int = 30,
           epoch_s: float = EPOCH_S) -> LiveWindow:
    """Each column has its number as the value; the maximum is one more."""
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
    assert (seen.low[0, 100:104] == 99.0).all()  # the value holds for some intervals
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


def bands_at(first: int, limits: Sequence[float], out: Sequence[bool]) -> LiveBands:
    """A band of the force with width 2, starting at the column with this number."""
    middle = np.array(limits, float)
    return LiveBands(EPOCH_S + first * STEP_S, STEP_S, {
        ('arm', 'tool force'): TimelineBand(middle - 1.0, middle + 1.0, np.array(out, bool)),
        ('arm', 'unknown'): TimelineBand(middle, middle, np.array(out, bool))})


def test_the_band_of_good_runs_is_behind_its_curve() -> None:
    lanes = LiveLanes()
    lanes.take(window(100, FORCE, FEED))
    assert read(lanes.columns(2.0)).bands == [None, None]
    told = live_bands(bands_at(95, [5.0, np.nan, 7.0], [False, False, True]).text())
    lanes.take_bands(told)
    lanes.take(window(110, FORCE, FEED))  # newer values, whose band is still unknown
    seen = read(lanes.columns(2.0))
    force, feed = seen.bands
    assert feed is None and force is not None
    assert (seen.first, np.flatnonzero(np.isfinite(force.low)).tolist()) == (90, [5, 7])
    assert (force.low[[5, 7]].tolist(), force.high[[5, 7]].tolist()) == ([4.0, 6.0], [6.0, 8.0])
    assert np.flatnonzero(force.departed).tolist() == [7]


def test_the_band_is_in_the_scale_of_its_lane() -> None:
    lanes = LiveLanes()
    lanes.take(window(30, FORCE))
    lanes.take_bands(bands_at(10, [500.0], [True]))
    lanes.take(window(31, FORCE))
    assert lanes.entries[0]['scale'][1] >= 501.0


def test_what_a_band_changes_late_is_sent_again() -> None:
    lanes = LiveLanes()
    lanes.take(window(100, FORCE))
    assert read(lanes.new_columns(1.0)).first == 90
    lanes.take_bands(bands_at(60, [5.0] * 30, [False] * 30))
    lanes.take(window(101, FORCE))
    assert read(lanes.new_columns(1.0)).first == 60
    lanes.take_bands(bands_at(60, [5.0] * 30, [False] * 30))
    assert read(lanes.new_columns(1.0)).first == 91, 'nothing has changed'


@pytest.mark.parametrize('text', [
    '', '[]', '{}', '[' * 100_000, 'null', '{"begin_s": 1, "step_s": 0, "channels": []}',
    '{"begin_s": NaN, "step_s": 1, "channels": []}', '{"begin_s": 1, "step_s": 1, "channels": 3}',
    '{"begin_s": 1, "step_s": 1, "channels": [["a", "b", [1], [2, 3], "0"]]}',
    '{"begin_s": 1, "step_s": 1, "channels": [["a", "b", [[1]], [[2]], "0"]]}',
    '{"begin_s": 1, "step_s": 1, "channels": [["a", "b", ["x"], ["y"], "0"]]}',
    '{"begin_s": 1, "step_s": 1, "channels": [["a", "b", [1]]]}', 'x' * 300_000])
def test_what_are_no_bands_is_refused(text: str) -> None:
    with pytest.raises(ValueError):
        live_bands(text)


def test_curves_that_come_later_have_no_room_and_empty_ones_no_lane() -> None:
    lanes = LiveLanes()
    for first in (0, MAX_LANES, 2 * MAX_LANES):
        lanes.take(window(100, *(FORCE._replace(label=str(first + row))
                                 for row in range(MAX_LANES))))
    assert len(read(lanes.columns(2.0)).low) == MAX_LANES
    empty = np.empty(0)
    lanes.take(LiveWindow(0.0, 20.0, (LiveCurve(FORCE, empty, empty, np.nan),), (), EPOCH_S))
    assert len(read(lanes.columns(2.0)).low) == MAX_LANES
