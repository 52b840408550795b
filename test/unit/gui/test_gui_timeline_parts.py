# SPDX-License-Identifier: BSD-3-Clause
"""The parts of the timeline: axis, colors, and the pictures of the curves."""
from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PyQt5.QtGui import QColor, QFont, QImage
from pytestqt.qtbot import QtBot

from process_visualizer.cell.model import WarningLimits
from process_visualizer.curves.value_scale import ValueScale
from process_visualizer.gui.lanes.lane_picture import lane_picture
from process_visualizer.gui.lanes.lane_scale import (
    LANE_HEIGHT,
    TEXT_HEIGHT,
    LaneLook,
    VisiblePart,
    visible_part,
    visible_scales,
)
from process_visualizer.gui.lanes.timeline_lanes import (
    Lane,
    decimals_for,
    lane_of,
    lane_texts,
    number_text,
)
from process_visualizer.gui.toolkit.theme import contrast, readable_color
from process_visualizer.gui.toolkit.time_axis import TimeAxis, tick_label
from process_visualizer.runs.comparison.timeline_bands import TimelineBand

NAN = float('nan')


@given(st.floats(0.01, 1e5), st.floats(50.0, 3000.0), st.floats(0.0, 1.0))
def test_a_place_leads_back_to_its_time(duration_s: float, width: float, share: float) -> None:
    axis = TimeAxis(duration_s, 12.0, width)
    assert axis.time_s(axis.x(share * duration_s)) == pytest.approx(share * duration_s,
                                                                    abs=1e-6 * duration_s)


@given(st.floats(0.0, 80000.0), st.floats(0.5, 4000.0))
def test_ticks_of_a_part_are_those_of_the_whole(begin_s: float, duration_s: float) -> None:
    axis = TimeAxis(duration_s, 12.0, 400.0, begin_s)
    step_s = axis.tick_step_s(60.0)
    ticks = axis.ticks(60.0)
    assert all(tick / step_s == pytest.approx(round(tick / step_s)) for tick in ticks)
    assert all(begin_s - 1e-3 <= tick <= begin_s + duration_s + 1e-3 for tick in ticks)
    assert len(ticks) >= 400.0 / 60.0 / 4 - 1


@given(st.floats(0.2, 80000.0), st.floats(200.0, 3000.0))
def test_ticks_are_far_enough_apart_and_not_too_few(duration_s: float, width: float) -> None:
    axis = TimeAxis(duration_s, 12.0, width)
    ticks = axis.ticks(60.0)
    places = [axis.x(time_s) for time_s in ticks]
    assert ticks[0] == 0.0 and ticks[-1] <= duration_s * (1 + 1e-9)
    assert all(after - before >= 59.9 for before, after in zip(places, places[1:]))
    assert len(ticks) >= width / 60.0 / 4 - 1


@pytest.mark.parametrize('time_s, step_s, label', [
    (0.0, 10.0, '0:00'), (75.0, 15.0, '1:15'), (3700.0, 600.0, '1:01:40'), (1.5, 0.5, '0:01.5'),
    (1.25, 0.05, '0:01.25'), (0.004, 0.002, '0:00.004')])
def test_ticks_have_as_many_digits_as_needed(time_s: float, step_s: float, label: str) -> None:
    assert tick_label(time_s, step_s) == label


@given(st.tuples(*[st.floats(0.0, 1.0)] * 3))
def test_every_color_becomes_readable_on_white(color: tuple) -> None:
    readable = readable_color(color)
    assert contrast(readable, QColor('white')) >= 3.6


@pytest.mark.parametrize('color', [(1.0, 1.0, 0.0), (0.0, 1.0, 1.0), (0.0, 1.0, 0.0)])
def test_a_bright_color_keeps_its_hue(color: tuple) -> None:
    assert readable_color(color).hsvHue() == pytest.approx(QColor.fromRgbF(*color).hsvHue(),
                                                           abs=2)


def test_a_dark_color_is_not_made_darker() -> None:
    assert readable_color((0.0, 0.0, 0.4)).valueF() == pytest.approx(0.4, abs=0.01)


@pytest.mark.parametrize('value, decimals, text', [
    (255.0, 0, '255'), (0.36, 1, '0.4'), (-12.34, 1, '−12.3'), (-1e-9, 3, '0.000'), (NAN, 1, '–')])
def test_numbers(value: float, decimals: int, text: str) -> None:
    assert number_text(value, decimals) == text


@pytest.mark.parametrize('span, decimals', [(300.0, 0), (20.0, 1), (1.0, 2), (0.4, 3), (0.0, 6)])
def test_a_hundredth_of_what_is_shown_can_be_read(span: float, decimals: int) -> None:
    assert decimals_for(span) == decimals


class TestTexts:
    """The values at the position and at the mouse."""

    LANE = Lane('a', 'N', (1.0, 0.0, 0.0), np.array([0.5]), np.array([19.8]))

    @pytest.mark.parametrize('at_position, at_mouse, texts', [
        (5.0, None, ('5.0 N', '', '')), (5.0, 4.0, ('5.0', '4.0', 'Δ −1.0 N')),
        (4.04, 5.26, ('4.0', '5.3', 'Δ +1.3 N')), (NAN, 5.0, ('no data', '5.0', 'Δ – N')),
        (NAN, None, ('no data', '', '')), (5.0, NAN, ('5.0', 'no data', 'Δ – N')),
        (None, None, ('… N', '', '')), (None, 5.0, ('…', '5.0', 'Δ – N'))])
    def test_values(self, at_position: float, at_mouse: float, texts: tuple) -> None:
        assert lane_texts(self.LANE, 20.0, at_position, at_mouse) == texts

    def test_a_column_with_several_values_has_no_value_that_nobody_sent(self) -> None:
        """An edge jumped from 253 to 424: there was never a 338 in between."""
        lane = Lane('a', '', (1.0, 0.0, 0.0), np.array([253.0]), np.array([424.0]))
        assert lane_texts(lane, 300.0, 253.0, lane.range_at(0.5)) == (
            '253', '253 to 424', 'Δ +0 to +171')
        assert lane_texts(lane, 300.0, 253.0, (253.1, 253.2)) == ('253', '253', 'Δ +0')
        assert lane_texts(lane, 300.0, 253.0, (NAN, NAN)) == ('253', 'no data', 'Δ –')

    def test_what_good_runs_have_is_beside_the_value(self) -> None:
        found = lane_texts(self.LANE, 20.0, 19.24, None, 17.7).at_position
        assert found == '19.2 N  (reference 17.7, Δ +1.5)'
        assert lane_texts(self.LANE, 20.0, NAN, None, 17.7).at_position == 'no data'
        assert lane_texts(self.LANE, 20.0, 19.2, 5.0, 17.7).at_position == '19.2'

    def test_good_is_the_middle_of_the_band(self) -> None:
        band = TimelineBand(np.array([1.0, NAN]), np.array([3.0, NAN]), np.zeros(2, bool))
        lane = replace(self.LANE, band=band)
        assert [lane.good_at(share) for share in (0.0, 0.4, 0.6, 1.0)] == [2.0, 2.0, None, None]
        assert self.LANE.good_at(0.5) is None

    def test_whole_numbers_have_no_decimals(self) -> None:
        lane = Lane('a', '', (1.0, 0.0, 0.0), np.array([254.0, NAN]), np.array([255.0, NAN]))
        assert lane_texts(lane, 1.0, 254.0, 255.0) == ('254', '255', 'Δ +1')


class TestLane:
    """Values at a time, and between messages."""

    def test_a_slow_topic_holds_its_value_but_not_over_a_hole(self) -> None:
        values = np.full(100, NAN)
        values[0:40:5] = values[80:100:5] = 3.0
        lane = lane_of('a', '', (1.0, 0.0, 0.0), values, values, 0.01)
        assert not np.isnan(lane.low[:56]).any()
        assert np.isnan(lane.low[70:80]).all()
        assert not np.isnan(lane.low[80:]).any()

    def test_nothing_is_made_up_before_the_first_message(self) -> None:
        values = np.full(100, NAN)
        values[50:] = 1.0
        lane = lane_of('a', '', (1.0, 0.0, 0.0), values, values, 0.01)
        assert np.isnan(lane.low[:50]).all()

    def test_values(self) -> None:
        lane = Lane('a', 'N', (1.0, 0.0, 0.0), np.array([0.0, -8.0]), np.array([2.0, -6.0]))
        assert (lane.at(0.0), lane.at(0.6), lane.at(1.0)) == (1.0, -7.0, -7.0)
        assert lane.extent == (-8.0, 2.0)

    def test_an_empty_lane(self) -> None:
        lane = Lane('a', 'N', (1.0, 0.0, 0.0), np.array([]), np.array([]))
        assert math.isnan(lane.at(0.5)) and math.isnan(lane.extent[0])


def drawn(lane: Lane, axis: TimeAxis, scale: float = 1.0) -> np.ndarray:
    """The dots (rows, columns, 4) of a lane of 100 px: red, green, blue, opacity."""
    look = LaneLook(axis, 100, LANE_HEIGHT, scale, QFont(), 10.0)
    part = visible_part(lane, look)
    picture = lane_picture(lane, look, [part], visible_scales(lane, [part], {}))
    image = picture.toImage().convertToFormat(QImage.Format_RGBA8888)
    dots = np.frombuffer(image.bits().asarray(image.byteCount()), np.uint8)
    return dots.reshape(image.height(), -1, 4).copy()


class TestLimits:
    """The curve is red beyond the limits, and only there."""

    @staticmethod
    def is_red(low: float, high: float, values: np.ndarray) -> np.ndarray:
        """Return which columns have a red dot of the curve; the lines of the limits are ignored."""
        lane = Lane('', '', (0.0, 0.0, 1.0), values, values,
                    limits=WarningLimits(low, high, (1.0, 0.0, 0.0)))
        dots = drawn(lane, TimeAxis(10.0, 0.0, 100.0)).astype(int)
        is_curve = (dots[:, :, 0] > dots[:, :, 2] + 80) & (dots[:, :, 3] > 185)
        return np.asarray(is_curve.any(axis=0))

    def test_beyond_them(self, qtbot: QtBot) -> None:
        values = np.repeat([1.0, 5.0, 9.0], 1000)
        red = self.is_red(2.0, 8.0, values)
        assert red[:32].all() and not red[36:64].any() and red[68:].all()

    def test_not_below_a_good_value(self, qtbot: QtBot) -> None:
        """The shaded area below it covers the forbidden values, but is not red."""
        lane = Lane('', '', (0.0, 0.0, 1.0), np.full(50, 9.0), np.full(50, 9.0),
                    limits=WarningLimits(3.0, None, (1.0, 0.0, 0.0)))
        dots = drawn(lane, TimeAxis(10.0, 0.0, 100.0)).astype(int)
        rows = [row for row in range(TEXT_HEIGHT, LANE_HEIGHT)
                if (dots[row, :, 0] > dots[row, :, 2] + 80).any()]
        assert len(rows) == 1  # the line of the limit

    def test_a_limit_that_is_near_is_shown(self) -> None:
        values = np.linspace(0.0, 10.0, 50)
        lane = Lane('', '', (0.0, 0.0, 1.0), values, values,
                    limits=WarningLimits(-100.0, 14.0, (1.0, 0.0, 0.0)))
        scale = visible_scales(lane, [VisiblePart(values, values)], {})[lane.scale_name]
        assert scale.high >= 14.0 and scale.low > -100.0


def test_what_is_visible_decides_the_scale() -> None:
    """0.4 N of a curve of 20 N: the small oscillation is visible."""
    values = np.concatenate([np.zeros(500), 19.8 + 0.2 * np.sin(np.linspace(0.0, 40.0, 500))])
    lane = Lane('', 'N', (1.0, 0.0, 0.0), values, values)
    parts = [visible_part(lane, LaneLook(TimeAxis(5.0, 0.0, 100.0, begin_s), 100, 46, 1.0,
                                         QFont(), 10.0)) for begin_s in (0.0, 5.0)]
    whole, close = (visible_scales(lane, [part], {})[lane.scale_name] for part in parts)
    assert (close.low, close.high) == (19.6, 20.0)
    assert whole.low <= 0.0


def scale_of(lane: Lane) -> ValueScale:
    look = LaneLook(TimeAxis(10.0, 0.0, 100.0), 100, 46, 1.0, QFont(), 10.0)
    return visible_scales(lane, [visible_part(lane, look)], {})[lane.scale_name]


def test_a_band_is_in_the_scale_where_it_is_visible() -> None:
    values, low = np.full(100, 0.0625), np.full(100, 0.05)
    low[50:] = NAN
    lane = Lane('', 'm/s', (1.0, 0.0, 0.0), values, values + 0.001)
    assert scale_of(lane).low > 0.05
    banded = replace(lane, band=TimelineBand(low, low + 0.05, np.zeros(100, bool)))
    assert (scale_of(banded).low, scale_of(banded).high) == (0.0, 0.1)
    nowhere = replace(lane, band=TimelineBand(low + NAN, low + NAN, np.zeros(100, bool)))
    assert scale_of(nowhere) == scale_of(lane)


def test_there_is_no_band_where_a_live_lane_has_no_values() -> None:
    values = np.where(np.arange(100) < 30, NAN, 0.5)
    lane = Lane('', 'm/s', (1.0, 0.0, 0.0), values, values)
    band = lane.with_band(TimelineBand(np.zeros(100), np.ones(100), np.zeros(100, bool))).band
    assert band is not None
    assert np.isnan(band.low[:30]).all() and np.isnan(band.high[:30]).all()
    assert (band.low[30:] == 0.0).all() and (band.high[30:] == 1.0).all()
    assert lane.with_band(None).band is None


def test_the_noise_of_a_steady_value_does_not_fill_the_lane() -> None:
    noise = 0.0625 + 0.0005 * np.sin(np.linspace(0.0, 40.0, 100))
    lane = Lane('', 'm/s', (1.0, 0.0, 0.0), noise, noise)
    assert scale_of(lane).span < 0.002
    assert scale_of(replace(lane, steady=0.1)).span > 0.006


class TestPicture:
    """The drawn curve is at its values."""

    @staticmethod
    def alpha(lane: Lane, scale: float = 1.0, begin_s: float = 0.0,
              duration_s: float = 10.0) -> np.ndarray:
        """The opacity of each dot of a lane's curve (rows, columns); text and border left out."""
        dots = drawn(lane, TimeAxis(duration_s, 0.0, 100.0, begin_s), scale)
        dots[np.all(dots[:, :, :3] > 200, axis=2)] = 0  # lines of the scale
        return dots[int(TEXT_HEIGHT * scale):, :, 3]

    def test_a_step(self, qtbot: QtBot) -> None:
        values = np.repeat([0.0, 10.0], 500)
        alpha = self.alpha(Lane('', '', (1.0, 0.0, 0.0), values, values))
        assert alpha[:20, :45].max() == 0
        assert alpha[0, 55:].min() > 200
        assert alpha[:24, 50].min() > 200  # the step itself is a line
        assert 0 < alpha[12, 75] < 100  # light shading down to zero

    def test_what_is_not_known_is_not_drawn(self, qtbot: QtBot) -> None:
        values = np.concatenate([np.full(300, 5.0), np.full(400, NAN), np.full(300, 5.0)])
        alpha = self.alpha(Lane('', '', (1.0, 0.0, 0.0), values, values))
        assert alpha[:, 31:69].max() == 0
        assert alpha[:, 10].max() > 200 and alpha[:, 90].max() > 200

    def test_a_single_peak_is_not_lost(self, qtbot: QtBot) -> None:
        values = np.zeros(5000)
        values[2345] = 1.0
        alpha = self.alpha(Lane('', '', (1.0, 0.0, 0.0), values, values))
        assert alpha[1, 46] > 200

    def test_a_part_of_the_recording(self, qtbot: QtBot) -> None:
        """Parts around a step at 5 s: before, at and after it."""
        values = np.repeat([0.0, 10.0], 500)
        lane = Lane('', '', (1.0, 0.0, 0.0), values, values)
        before, at, after = (self.alpha(lane, 1.0, begin_s, 1.0)
                             for begin_s in (3.9, 4.75, 9.0))
        assert before[:20].max() == 0
        assert after[6:12].max(axis=0).min() > 200  # below the end of the scale, 15
        assert at[:20, :24].max() == 0 and at[0, 27:].min() > 200

    def test_fine_screens_get_fine_curves(self, qtbot: QtBot) -> None:
        values = np.sin(np.linspace(0, 20, 1000))
        lane = Lane('', '', (1.0, 0.0, 0.0), values, values)
        assert self.alpha(lane, 2.0).shape == (2 * (LANE_HEIGHT - TEXT_HEIGHT), 200)

    def test_nothing_known_at_all(self, qtbot: QtBot) -> None:
        values = np.full(10, NAN)
        assert self.alpha(Lane('', '', (1.0, 0.0, 0.0), values, values)).max() == 0
