# SPDX-License-Identifier: BSD-3-Clause
"""Several curves in one lane: colors, scales, names, limits and bands; and folded lanes."""
from __future__ import annotations

from dataclasses import replace
from typing import Any, List, Sequence

import numpy as np
import pytest
from PyQt5.QtCore import QPoint, QRect, Qt
from PyQt5.QtGui import QColor, QFont
from pytestqt.qtbot import QtBot
from timeline_bench import Bench

from process_visualizer.cell.model import WarningLimits
from process_visualizer.gui.lanes.lane_choice import LaneChoice
from process_visualizer.gui.lanes.lane_picture import LanePictures
from process_visualizer.gui.lanes.lane_scale import (
    TEXT_HEIGHT,
    LaneLook,
    least_height,
    range_text,
)
from process_visualizer.gui.lanes.timeline_lanes import Lane, distinct, grouped_lanes
from process_visualizer.gui.toolkit.theme import contrast, readable_color, theme
from process_visualizer.gui.toolkit.time_axis import TimeAxis
from process_visualizer.runs.comparison.timeline_bands import TimelineBand

GREEN, RED = (0.0, 1.0, 0.0), (1.0, 0.0, 0.0)
HEIGHT = 120


def curve(name: str, value: float, unit: str = 'N', color: Any = GREEN, **more: Any) -> Lane:
    """A line from 0 to a value in 20 s."""
    values = np.linspace(0.0, value, 200)
    return Lane(name, unit, color, values, values, ('arm', name, '/t'), **more)


def lane(*curves: Lane) -> Lane:
    return replace(curves[0], overlaid=tuple(distinct(curves)[1:]))


def drawn(shown: Lane) -> Any:
    """The pictures of a lane of 100 px, and its image."""
    made = LanePictures()
    made.set_lanes([shown])
    made.want([LaneLook(TimeAxis(20.0, 0.0, 100.0), 100, HEIGHT, 1.0, QFont(), 20.0,
                        len(shown.curves))])
    made.draw([0])
    picture = made.picture(0)
    assert picture is not None
    return made, picture.toImage()


def rows_of(image: Any, color: QColor, x: int) -> List[int]:
    """The rows of a column that have a color."""
    return [y for y in range(HEIGHT) if image.pixelColor(x, y).alpha() > 200
            and image.pixelColor(x, y).rgb() & 0xffffff == color.rgb() & 0xffffff]


def test_curves_of_one_unit_have_one_scale_and_others_their_own(qtbot: QtBot) -> None:
    made, _ = drawn(lane(curve('a', 10.0), curve('b', 100.0), curve('c', 3.0, 'm/s'),
                         curve('d', 1.0, ''), curve('e', 5.0, '')))
    ends = [made.scale(0, number).high for number in range(5)]
    assert ends == [100.0, 100.0, 3.0, 1.0, 5.0]  # without a unit, they may have nothing in common


def test_they_are_where_the_common_scale_says(qtbot: QtBot) -> None:
    shown = lane(curve('a', 10.0), curve('b', 5.0))
    _, image = drawn(shown)
    high, low = (rows_of(image, readable_color(it.color), 98) for it in shown.curves)
    top, bottom = 2 * 15, HEIGHT - 5
    assert np.mean(high) == pytest.approx(top, abs=3)
    assert np.mean(low) == pytest.approx(0.5 * (top + bottom), abs=3)


def test_curves_of_one_color_get_others_that_can_be_read_and_told_apart(qtbot: QtBot) -> None:
    colors = [readable_color(it.color) for it in distinct([curve('', 1.0)] * 8)]
    assert colors[0] == readable_color(GREEN) and len({it.rgb() for it in colors}) == 8
    assert min(contrast(it, QColor(theme().paper)) for it in colors) > 3.0


def test_beyond_a_limit_each_has_its_warning_color_and_a_line_in_its_own(qtbot: QtBot) -> None:
    shown = lane(curve('a', 10.0, color=(0.0, 0.0, 1.0)),
                 curve('b', 10.0, 'm', limits=WarningLimits(None, 5.0, RED)))
    _, image = drawn(shown)
    red = readable_color(RED)
    assert rows_of(image, red, 20) == [] and rows_of(image, red, 80) != []
    line = {image.pixelColor(10, y).name() for y in range(35, HEIGHT)}
    assert readable_color(shown.overlaid[0].color).name() in line


def test_a_departure_is_red_and_has_the_color_of_its_curve_below(qtbot: QtBot) -> None:
    band = TimelineBand(np.zeros(200), np.full(200, 2.0), np.arange(200) > 100)
    shown = lane(curve('a', 10.0, color=RED), curve('b', 10.0, 'm', band=band))
    _, image = drawn(shown)
    names_px = 2 * TEXT_HEIGHT  # they would cover it
    above = [image.pixelColor(80, y).name() for y in range(names_px, names_px + 8)]
    assert above[0] == theme().bad
    assert readable_color(shown.overlaid[0].color).name() in above
    assert theme().bad not in [image.pixelColor(20, y).name()
                               for y in range(names_px, names_px + 8)]


@pytest.mark.parametrize('value, unit, text', [
    (10.0, 'N', '[0 … 10 N]'), (-0.5, '', '[−0.5 … 0]'), (1e6, 'Pa', '[0 … 1e+06 Pa]')])
def test_a_scale_without_numbers_is_told(value: float, unit: str, text: str,
                                         qtbot: QtBot) -> None:
    made, _ = drawn(curve('a', value, unit))
    assert range_text(made.scale(0), unit) == text


class TestTimeline:
    """Overlaid curves on the screen."""

    @staticmethod
    def show(bench: Bench, curves: Sequence[Lane], choice: LaneChoice) -> None:
        by_key = {it.key: it for it in curves}

        def follow() -> None:
            bench.view.set_lanes(grouped_lanes(by_key, bench.choices.choice))
            bench.view.stack.place(QRect(0, 68, bench.view.width(), 400))

        bench.choices.choose(choice)
        bench.choices.changed.connect(follow)
        follow()
        bench.qtbot.waitUntil(lambda: bench.view.stack.is_drawn)

    def test_names_and_values_are_below_each_other(self, qtbot: QtBot) -> None:
        bench, curves = Bench(qtbot), [curve('a', 10.0), curve('b', 100.0), curve('c', 1.0, 'm')]
        a, b, _ = (it.key for it in curves)
        self.show(bench, curves, LaneChoice().with_joined(b, a))
        stack = bench.view.stack
        assert [len(it.curves) for it in stack.lanes] == [2, 1]
        assert stack.texts_rect(0, bench.view.axis).height() == 2 * 15 - 1
        assert bench.view.lane_texts(0, 1).at_position == '1 N'
        assert stack.lane_rect(1).top() == stack.lane_rect(0).bottom() + 1
        assert stack.row_at(stack.lane_rect(1).top()) == 1

    def test_a_lane_is_folded_by_its_triangle_and_unfolded(self, qtbot: QtBot) -> None:
        bench, curves = Bench(qtbot), [curve('a', 10.0), curve('b', 100.0)]
        self.show(bench, curves, LaneChoice())
        stack = bench.view.stack
        full = stack.lane_rect(0).height()
        for is_folded in (True, False):
            qtbot.mouseClick(bench.view, Qt.LeftButton, pos=stack.fold_rect(0).center())
            assert stack.lanes[0].is_folded is is_folded
            assert (stack.lane_rect(0).height() == least_height(stack.lanes[0]) < full) is is_folded
            assert bench.stand.model.position_s == 2.0
        qtbot.mouseClick(bench.view, Qt.LeftButton,
                         pos=stack.fold_rect(0).center() + QPoint(0, 20))
        assert not stack.lanes[0].is_folded and bench.stand.model.position_s == 0.0

    def test_lanes_share_what_is_left_by_their_curves(self, qtbot: QtBot) -> None:
        bench, curves = Bench(qtbot), [curve(name, 1.0) for name in 'abcd']
        a, b, c, _ = (it.key for it in curves)
        choice = LaneChoice().with_joined(b, a).with_folded([c], True)
        self.show(bench, curves, choice)
        stack = bench.view.stack
        stack.place(QRect(0, 0, 500, stack.height_of(3) + 30))
        grown = [stack.lane_rect(row).height() - least_height(it)
                 for row, it in enumerate(stack.lanes)]
        assert grown == [20, 0, 10] and stack.scroll.maximum() == 0
        stack.place(QRect(0, 0, 500, stack.height_of(3) - 10))
        shrunk = [least_height(it) - stack.lane_rect(row).height()
                  for row, it in enumerate(stack.lanes)]
        assert shrunk == [5, 0, 5] and stack.scroll.maximum() == 0
        stack.place(QRect(0, 0, 500, stack.height_of(3) - 30))
        assert stack.scroll.maximum() == 30
        assert stack.lane_rect(0).height() == least_height(stack.lanes[0])
