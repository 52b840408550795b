# SPDX-License-Identifier: BSD-3-Clause
"""A timeline on a screen, with a player of 20 s and a mouse."""
from __future__ import annotations

from typing import List

import numpy as np
from playback_stand import PlaybackStand
from PyQt5.QtCore import QEvent, QPoint, QPointF, Qt
from PyQt5.QtGui import QColor, QMouseEvent, QPaintEvent, QWheelEvent
from PyQt5.QtWidgets import QApplication
from pytestqt.qtbot import QtBot

from process_visualizer.gui.lanes.lane_choice import LaneChoices
from process_visualizer.gui.lanes.lane_scale import SIDE
from process_visualizer.gui.lanes.timeline_header import LEFT
from process_visualizer.gui.lanes.timeline_lanes import Lane
from process_visualizer.gui.playback.timeline_view import TimelineView

WIDTH = 400 + int(LEFT + SIDE)  # 20 s: 20 px correspond to 1 s
TRACK_Y, FLAGS_Y, HANDLES_Y, LANES_Y = 38, 8, 26, 100


def x_of(time_s: float) -> int:
    return int(LEFT + 20 * time_s)


def lane(number: int = 0) -> Lane:
    values = np.linspace(0.0, 10.0, 101)
    return Lane(f'variable {number}', 'N', (1.0, 0.0, 0.0), values, values)


class NotingTimeline(TimelineView):
    """Timeline that notes the width of each drawn region."""

    widths: List[int] = []

    def paintEvent(self, event: QPaintEvent) -> None:
        self.widths.append(event.region().boundingRect().width())
        super().paintEvent(event)


class Bench:
    """Timeline on the screen, with a player of 20 s, paused at 2 s."""

    def __init__(self, qtbot: QtBot, lanes: int = 3) -> None:
        self.qtbot = qtbot
        self.stand = PlaybackStand()
        self.choices = LaneChoices()
        self.view = NotingTimeline(
            self.stand.model, lambda _key: 0.5 * self.stand.model.position_s, self.choices)
        self.view.widths = []
        qtbot.addWidget(self.view)
        self.view.set_recording(20.0)
        self.view.set_lanes([lane(number) for number in range(lanes)])
        self.view.resize(WIDTH, self.view.sizeHint().height())
        self.view.show()
        qtbot.waitExposed(self.view)
        self.stand.state(position_s=2.0)

    def move(self, time_s: float, y: int, buttons: Qt.MouseButtons = Qt.NoButton) -> None:
        """Move the mouse, with or without a button held."""
        place = QPointF(x_of(time_s), y)
        event = QMouseEvent(QEvent.MouseMove, place, self.view.mapToGlobal(place.toPoint()),
                            Qt.NoButton, buttons, Qt.NoModifier)
        QApplication.sendEvent(self.view, event)

    def press(self, time_s: float, y: int) -> None:
        self.qtbot.mousePress(self.view, Qt.LeftButton, pos=QPoint(x_of(time_s), y))

    def release(self, time_s: float, y: int) -> None:
        self.qtbot.mouseRelease(self.view, Qt.LeftButton, pos=QPoint(x_of(time_s), y))

    def wheel(self, place: QPoint, turned: QPoint,
              modifiers: Qt.KeyboardModifiers = Qt.NoModifier) -> None:
        """Turn the wheel at a position; one notch is 120."""
        QApplication.sendEvent(self.view, QWheelEvent(
            QPointF(place), QPointF(self.view.mapToGlobal(place)), QPoint(), turned, Qt.NoButton,
            modifiers, Qt.NoScrollPhase, False))

    def drawn_widths(self) -> List[int]:
        """Widths of the regions drawn since the last call; this call draws the last one.

        At least one pixel: Qt draws everything that is pending at once.
        """
        self.view.update(0, 0, 1, 1)
        count = len(self.view.widths)
        self.qtbot.waitUntil(lambda: len(self.view.widths) > count)
        drawn, self.view.widths = self.view.widths, []
        return drawn

    def pixel(self, x: int, y: int) -> str:
        image = self.view.grab().toImage()
        scale = image.devicePixelRatio()
        return str(QColor(image.pixel(int(x * scale), int(y * scale))).name())
