# SPDX-License-Identifier: BSD-3-Clause
"""The strip of the whole recording: its frame marks the visible part, and can be dragged."""
from __future__ import annotations

from typing import Tuple

import pytest
from PyQt5.QtCore import QEvent, QPoint, QPointF, Qt
from PyQt5.QtGui import QMouseEvent
from PyQt5.QtWidgets import QApplication
from pytestqt.qtbot import QtBot
from timeline_bench import Bench

from process_visualizer.gui.playback.minimap import Minimap
from process_visualizer.gui.playback.playback_state import PlacedMark
from process_visualizer.gui.toolkit.theme import LIGHT


@pytest.fixture
def bench(qtbot: QtBot) -> Bench:
    """20 s in 400 px, of which 10 to 12 s are visible."""
    made = Bench(qtbot)
    made.view.zoom.show_part(10.0, 12.0)
    assert strip(made).width() == 400
    return made


def strip(bench: Bench) -> Minimap:
    return bench.view.zoom.bar


def shown(bench: Bench) -> Tuple[float, float]:
    part = bench.view.zoom.shown
    return part.begin_s, part.end_s


def drag(bench: Bench, begin_s: float, end_s: float) -> None:
    bench.qtbot.mousePress(strip(bench), Qt.LeftButton, pos=QPoint(int(20 * begin_s), 8))
    place = QPointF(20 * end_s, 8)
    QApplication.sendEvent(strip(bench), QMouseEvent(
        QEvent.MouseMove, place, strip(bench).mapToGlobal(place.toPoint()), Qt.NoButton,
        Qt.LeftButton, Qt.NoModifier))
    bench.qtbot.mouseRelease(strip(bench), Qt.LeftButton, pos=place.toPoint())


def test_the_frame_is_what_is_shown(bench: Bench) -> None:
    frame = strip(bench).frame
    assert (frame.left(), frame.right()) == pytest.approx((200.0, 240.0), abs=0.1)


def test_it_is_there_only_while_a_part_is_shown(bench: Bench) -> None:
    assert strip(bench).isVisible()
    bench.view.zoom.show_all()
    assert not strip(bench).isVisible()


def test_dragging_the_frame(bench: Bench) -> None:
    drag(bench, 11.5, 15.5)
    assert shown(bench) == pytest.approx((14.0, 16.0), abs=1e-3)
    drag(bench, 15.0, 40.0)
    assert shown(bench) == pytest.approx((18.0, 20.0), abs=1e-3)


def test_a_press_elsewhere_looks_there(bench: Bench) -> None:
    drag(bench, 5.0, 5.0)
    assert shown(bench) == pytest.approx((4.0, 6.0), abs=1e-3)


def test_the_position_of_the_player_is_not_moved(bench: Bench) -> None:
    drag(bench, 11.0, 15.0)
    assert bench.stand.commands() == []


def test_a_very_short_part_can_be_grabbed(bench: Bench) -> None:
    bench.view.set_recording(3600.0)
    bench.view.zoom.show_part(3599.0, 3600.0)
    frame = strip(bench).frame
    assert frame.width() == 8.0 and frame.right() == 400.0


def test_marks_curve_and_position_are_in_it(bench: Bench) -> None:
    bench.stand.model.set_marks([PlacedMark(18.0, 'slack')])
    bench.view.zoom.show_part(17.0, 19.0)
    image = strip(bench).grab().toImage()
    assert image.pixelColor(360, 8).name() == LIGHT.warning
    bench.stand.state(position_s=5.0)
    after = strip(bench).grab().toImage()
    assert after.pixelColor(100, 3) != image.pixelColor(100, 3)
    assert image.pixelColor(340 + 4, 14) != image.pixelColor(20, 4)  # the curve rises to the right
