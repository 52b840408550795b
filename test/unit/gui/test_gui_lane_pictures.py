# SPDX-License-Identifier: BSD-3-Clause
"""The curves are drawn one after the other, so that the window is never held up for long."""
from __future__ import annotations

from typing import List

import numpy as np
import pytest
from PyQt5.QtGui import QFont
from pytestqt.qtbot import QtBot

from process_visualizer.curves.value_scale import EMPTY_SCALE
from process_visualizer.gui.toolkit.time_axis import TimeAxis
from process_visualizer.gui.views.playback.lane_picture import LaneLook
from process_visualizer.gui.views.playback.lane_pictures import LanePictures
from process_visualizer.gui.views.playback.timeline_lanes import Lane

AXIS = TimeAxis(10.0, 0.0, 100.0)


@pytest.fixture
def pictures(qtbot: QtBot) -> LanePictures:
    made = LanePictures()
    values = np.linspace(0.0, 1.0, 50)
    made.set_lanes([Lane(f'lane {row}', 'N', (1.0, 0.0, 0.0), values, values) for row in range(3)])
    return made


def want(pictures: LanePictures, width: int = 100) -> None:
    pictures.want(LaneLook(AXIS, width, 46, 1.0, QFont(), 10.0))


def test_nothing_is_drawn_at_once(pictures: LanePictures) -> None:
    want(pictures)
    assert pictures.picture(0) is None


def test_all_are_drawn_in_their_order(pictures: LanePictures, qtbot: QtBot) -> None:
    drawn: List[int] = []
    pictures.drawn.connect(drawn.append)
    want(pictures)
    qtbot.waitUntil(lambda: len(drawn) == 3)
    qtbot.wait(20)
    assert drawn == [0, 1, 2]


def test_an_old_picture_stays_until_there_is_a_new_one(pictures: LanePictures,
                                                       qtbot: QtBot) -> None:
    want(pictures)
    qtbot.waitUntil(lambda: pictures.picture(2) is not None)
    want(pictures, width=120)
    assert pictures.picture(0).width() == 100
    qtbot.waitUntil(lambda: pictures.picture(2).width() == 120)


def test_what_has_been_drawn_is_not_drawn_again(pictures: LanePictures, qtbot: QtBot) -> None:
    want(pictures)
    qtbot.waitUntil(lambda: pictures.picture(2) is not None)
    drawn: List[int] = []
    pictures.drawn.connect(drawn.append)
    want(pictures)
    qtbot.wait(20)
    assert drawn == []


def test_other_lanes_have_no_pictures_yet(pictures: LanePictures, qtbot: QtBot) -> None:
    want(pictures)
    qtbot.waitUntil(lambda: pictures.picture(2) is not None)
    pictures.set_lanes([])
    assert pictures.picture(0) is None


def test_all_that_can_be_drawn_at_once_is_drawn_at_once(pictures: LanePictures) -> None:
    want(pictures)
    assert pictures.draw_some()[0] == 0
    while not pictures.are_ready:
        pictures.draw_some()
    assert pictures.draw_some() == () and pictures.picture(2) is not None


def test_the_scale_stays_while_the_lanes_stay(pictures: LanePictures) -> None:
    want(pictures)
    assert pictures.scale(0) == EMPTY_SCALE
    pictures.draw_some()
    assert (pictures.scale(0).low, pictures.scale(0).high) == (0.0, 1.0)
    pictures.want(LaneLook(AXIS._replace(duration_s=8.0), 100, 46, 1.0, QFont(), 10.0))
    pictures.draw_some()
    assert pictures.scale(0).high == 1.0  # though only 0.8 is needed
    pictures.want(LaneLook(AXIS._replace(duration_s=2.0), 100, 46, 1.0, QFont(), 10.0))
    pictures.draw_some()
    assert pictures.scale(0).high < 0.3
