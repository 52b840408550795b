# SPDX-License-Identifier: BSD-3-Clause
"""The curves are drawn one after another, so that the window never blocks for long."""
from __future__ import annotations

from typing import List

import numpy as np
import pytest
from PyQt5.QtGui import QFont
from pytestqt.qtbot import QtBot
from timeline_bench import Bench

from process_visualizer.curves.value_scale import EMPTY_SCALE
from process_visualizer.gui.lanes.lane_picture import LanePictures
from process_visualizer.gui.lanes.lane_scale import TEXT_HEIGHT, LaneLook
from process_visualizer.gui.lanes.timeline_lanes import Lane
from process_visualizer.gui.toolkit.theme import theme
from process_visualizer.gui.toolkit.time_axis import TimeAxis
from process_visualizer.runs.comparison.timeline_bands import TimelineBand

AXIS = TimeAxis(10.0, 0.0, 100.0)
ROWS = [0, 1, 2]


class Clock:
    """Clock that advances by ``step_s`` whenever it is read."""

    def __init__(self) -> None:
        self.now_s = self.step_s = 0.0

    def __call__(self) -> float:
        self.now_s += self.step_s
        return self.now_s


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def pictures(qtbot: QtBot, clock: Clock) -> LanePictures:
    made = LanePictures(clock)
    values = np.linspace(0.0, 1.0, 50)
    made.set_lanes([Lane(f'lane {row}', 'N', (1.0, 0.0, 0.0), values, values) for row in range(3)])
    return made


def want(pictures: LanePictures, width: int = 100, duration_s: float = 10.0) -> None:
    look = LaneLook(AXIS._replace(duration_s=duration_s), width, 46, 1.0, QFont(), 10.0)
    pictures.want([look] * len(ROWS))


def draw_all(pictures: LanePictures) -> List[int]:
    """Draw in turns until all lanes are complete; return them in drawing order."""
    drawn: List[int] = []
    while pictures.missing(ROWS):
        drawn += pictures.draw(ROWS)
    return drawn


def test_nothing_is_drawn_before_it_is_asked_for(pictures: LanePictures) -> None:
    want(pictures)
    assert pictures.picture(0) is None and pictures.missing(ROWS) == [0, 1, 2]


def test_all_are_drawn_in_their_order(pictures: LanePictures) -> None:
    want(pictures)
    assert draw_all(pictures) == [0, 1, 2]


@pytest.mark.parametrize('each_s, at_once', [(0.001, [0, 1, 2]), (0.006, [0, 1]), (0.01, [0])])
def test_what_takes_long_is_drawn_in_turns(pictures: LanePictures, clock: Clock, each_s: float,
                                           at_once: List[int]) -> None:
    want(pictures)
    clock.step_s = each_s
    assert pictures.draw(ROWS) == at_once
    assert pictures.missing(ROWS) == ROWS[len(at_once):]


def test_lanes_that_never_were_in_time_come_first_when_there_are_newer_values(
        pictures: LanePictures, clock: Clock) -> None:
    clock.step_s = 0.01
    values = np.linspace(0.0, 1.0, 50)
    lanes = [Lane('', 'N', (1.0, 0.0, 0.0), values, values, key=('', str(it), '')) for it in ROWS]
    drawn = []
    for _ in range(4):
        pictures.update_lanes(lanes)
        want(pictures)
        drawn += pictures.draw(ROWS)
    assert drawn == [0, 1, 2, 0]


def test_only_lanes_in_sight_are_drawn(pictures: LanePictures) -> None:
    want(pictures)
    pictures.draw([1])
    assert pictures.picture(0) is None and pictures.picture(1) is not None


def test_an_old_picture_stays_until_there_is_a_new_one(pictures: LanePictures) -> None:
    want(pictures)
    draw_all(pictures)
    want(pictures, width=120)
    assert pictures.picture(0).width() == 100
    draw_all(pictures)
    assert pictures.picture(2).width() == 120


def test_what_has_been_drawn_is_not_drawn_again(pictures: LanePictures) -> None:
    want(pictures)
    draw_all(pictures)
    want(pictures)
    assert pictures.draw(ROWS) == []


def test_other_lanes_have_no_pictures_yet(pictures: LanePictures) -> None:
    want(pictures)
    draw_all(pictures)
    pictures.set_lanes([])
    assert pictures.picture(0) is None


def test_the_scale_stays_while_the_lanes_stay(pictures: LanePictures) -> None:
    want(pictures)
    assert pictures.scale(0) == EMPTY_SCALE
    draw_all(pictures)
    assert (pictures.scale(0).low, pictures.scale(0).high) == (0.0, 1.0)
    want(pictures, duration_s=8.0)
    draw_all(pictures)
    assert pictures.scale(0).high == 1.0  # although 0.8 would be enough
    want(pictures, duration_s=2.0)
    draw_all(pictures)
    assert pictures.scale(0).high < 0.3


def test_lanes_that_were_not_in_time_are_drawn_in_the_next_paint(qtbot: QtBot) -> None:
    bench = Bench(qtbot, lanes=12)
    qtbot.waitUntil(lambda: bench.view.stack.is_drawn)
    bench.view.zoom.show_part(5.0, 6.0)
    qtbot.waitUntil(lambda: bench.view.stack.is_drawn)


def test_a_band_is_behind_the_curve_and_what_departs_is_marked(qtbot: QtBot) -> None:
    made, columns = LanePictures(), 100
    low = np.where(np.arange(columns) < 50, 0.2, np.nan)
    departed = np.arange(columns) >= 40
    lane = Lane('lane', 'N', (1.0, 0.0, 0.0), np.zeros(columns), (np.arange(columns) == 0) * 1.0,
                band=TimelineBand(low, low + 0.6, departed & (np.arange(columns) < 50)))
    made.set_lanes([lane, Lane('top', 'N', (1.0, 0.0, 0.0), np.zeros(columns), np.ones(columns))])
    made.want([LaneLook(TimeAxis(10.0, 0.0, 100.0), 110, 46, 1.0, QFont(), 10.0)] * 2)
    made.draw([0, 1])
    picture = made.picture(0)
    assert picture is not None
    image = picture.toImage()
    rows = range(TEXT_HEIGHT - 3, 46)
    colors = [{image.pixelColor(x, y).name() for y in rows} for x in (20, 45, 80)]
    assert [theme().band in found for found in colors] == [True, True, False]
    assert [theme().bad in found for found in colors] == [False, True, False]
