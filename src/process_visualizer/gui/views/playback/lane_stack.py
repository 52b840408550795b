# SPDX-License-Identifier: BSD-3-Clause
"""The lanes of the timeline, one below the other: their places, and what is drawn in them."""
from __future__ import annotations

from typing import Callable, List, Optional, Sequence, Tuple

from PyQt5.QtCore import QObject, QRect, QRectF, Qt, pyqtSignal
from PyQt5.QtGui import QColor, QFontMetricsF, QPainter
from PyQt5.QtWidgets import QScrollBar, QWidget

from process_visualizer.gui.toolkit.colours import readable_colour, translucent
from process_visualizer.gui.toolkit.theme import theme
from process_visualizer.gui.toolkit.time_axis import TimeAxis
from process_visualizer.gui.views.playback.lane_picture import (
    LANE_HEIGHT,
    MOST_LANE_HEIGHT,
    TEXT_HEIGHT,
    LaneLook,
)
from process_visualizer.gui.views.playback.lane_pictures import LanePictures
from process_visualizer.gui.views.playback.timeline_lanes import Lane, LaneTexts
from process_visualizer.gui.views.playback.timeline_layout import SIDE

_LEAST_NAME = 20.0  # px: less of a name is not worth to be shown
_BETWEEN = 7.0  # px between texts
_BACKGROUND_ALPHA = 225  # texts are readable over the playhead


class LaneStack(QObject):
    """Scrolls if there is not enough room."""

    redraw = pyqtSignal(QRect)
    """A part has to be drawn again."""

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self.lanes: Tuple[Lane, ...] = ()
        self.rect = QRect()
        self.pictures = LanePictures()
        self.scroll = QScrollBar(Qt.Vertical, parent)
        self.scroll.setObjectName('timeline_scroll')
        self.scroll.valueChanged.connect(self._redraw_all)
        self._lane_height = LANE_HEIGHT

    def set_lanes(self, lanes: Sequence[Lane]) -> None:
        """Set the lanes, from top to bottom; then give them a place."""
        self.lanes = tuple(lanes)
        self.pictures.set_lanes(lanes)

    def update_lanes(self, lanes: Sequence[Lane]) -> None:
        """Set lanes with newer values; those that stay keep their picture until its turn."""
        self.lanes = tuple(lanes)
        self.pictures.update_lanes(lanes)

    def height_of(self, lanes: int) -> int:
        """Return the height [px] that so many lanes need."""
        return lanes * LANE_HEIGHT + 2

    @property
    def most_height(self) -> int:
        """The height [px] beyond which the lanes do not grow."""
        return len(self.lanes) * MOST_LANE_HEIGHT + 2

    def place(self, rect: QRect) -> None:
        """Set the place of all lanes."""
        self.rect = rect
        count, visible = len(self.lanes), rect.height()
        self._lane_height = min(max((visible - 2) // max(count, 1), LANE_HEIGHT), MOST_LANE_HEIGHT)
        hidden = max(count * self._lane_height + 2 - visible, 0)
        self.scroll.setRange(0, hidden)
        self.scroll.setPageStep(max(visible, 1))
        self.scroll.setSingleStep(LANE_HEIGHT // 2)
        self.scroll.setVisible(hidden > 0)
        self.scroll.setGeometry(rect.right() + 3 - int(SIDE), rect.top(), int(SIDE) - 2,
                                max(visible, 0))

    def lane_rect(self, row: int) -> QRect:
        """Return the place of a lane; perhaps it is scrolled out of sight."""
        top = self.rect.top() + row * self._lane_height - self.scroll.value()
        return QRect(self.rect.left(), top, self.rect.width(), self._lane_height)

    def texts_rect(self, row: int, axis: TimeAxis) -> QRectF:
        """Return the place of a lane's name and values."""
        return QRectF(axis.left, self.lane_rect(row).top() + 1, axis.width, TEXT_HEIGHT - 1)

    def row_at(self, y: int) -> Optional[int]:
        """Return which lane is at a height; None: none."""
        row = (y - self.rect.top() + self.scroll.value()) // self._lane_height
        return row if self.rect.top() <= y < self.rect.bottom() and row < len(self.lanes) else None

    def draw(self, painter: QPainter, axis: TimeAxis, length_s: float, area: QRect) -> None:
        """Draw the curves in an area; what is not ready yet comes later."""
        self.pictures.want(LaneLook(axis, self.rect.width(), self._lane_height,
                                    painter.device().devicePixelRatioF(), painter.font(),
                                    length_s))
        drawn = self.pictures.draw(self._visible_rows())
        painter.setClipRect(area.intersected(self.rect))
        for row in self._visible_rows():
            picture, place = self.pictures.picture(row), self.lane_rect(row)
            if picture is not None and place.intersects(area):
                painter.drawPixmap(place, picture)
        painter.setClipRect(area)
        for row in self.pictures.missing(self._visible_rows()) + drawn:
            if row not in drawn or not area.contains(self.lane_rect(row).intersected(self.rect)):
                self.redraw.emit(self.lane_rect(row))

    @property
    def is_drawn(self) -> bool:
        """Whether all lanes in sight are as wanted."""
        return not self.pictures.missing(self._visible_rows())

    def _visible_rows(self) -> List[int]:
        return [row for row in range(len(self.lanes))
                if self.lane_rect(row).intersects(self.rect)]

    def _redraw_all(self) -> None:
        self.redraw.emit(self.rect)

    def draw_texts(self, painter: QPainter, axis: TimeAxis, area: QRect,
                   texts_of: Callable[[int], LaneTexts]) -> None:
        """Draw names and values in an area, over everything else."""
        painter.setClipRect(area.intersected(self.rect))
        for row, lane in enumerate(self.lanes):
            rect = self.texts_rect(row, axis)
            if rect.toAlignedRect().intersects(area):
                right = _draw_values(painter, rect, texts_of(row))
                _draw_name(painter, lane, QRectF(rect.topLeft(), rect.bottomRight()), right)
        painter.setClipRect(area)


def _draw_name(painter: QPainter, lane: Lane, rect: QRectF, right: float) -> None:
    metrics = QFontMetricsF(painter.font())
    room = right - rect.left()
    if room < _LEAST_NAME:
        return
    text = metrics.elidedText(lane.label, Qt.ElideMiddle, room)
    rect.setWidth(metrics.horizontalAdvance(text) + 2.0)
    painter.fillRect(rect, translucent(theme().paper, _BACKGROUND_ALPHA))
    painter.setPen(readable_colour(lane.colour))
    painter.drawText(rect, Qt.AlignLeft | Qt.AlignVCenter, text)


def _draw_values(painter: QPainter, rect: QRectF, texts: LaneTexts) -> float:
    """Draw the values at the right, in the colours of their lines; return where they begin."""
    right, colours = rect.right(), theme()
    if texts.at_mouse:
        right = _draw_left_of(painter, rect, right, texts.difference, colours.quiet)
        right = _draw_left_of(painter, rect, right - 4.0, texts.at_mouse, colours.paper,
                              colours.text) - 4.0
    return _draw_left_of(painter, rect, right, texts.at_position, colours.accent)


def _draw_left_of(painter: QPainter, rect: QRectF, right: float, text: str, colour: str,
                  behind: str = '') -> float:
    """Draw a text that ends at a place [px]; return where the next one ends."""
    width = painter.fontMetrics().horizontalAdvance(text) + 2.0
    place = QRectF(right - width, rect.top(), width, rect.height())
    painter.setPen(Qt.NoPen)
    painter.setBrush(QColor(behind) if behind
                     else translucent(theme().paper, _BACKGROUND_ALPHA))
    margin = 3.0 if behind else 0.0
    painter.drawRoundedRect(place.adjusted(-margin, 0, margin, 0), margin, margin)
    painter.setPen(QColor(colour))
    painter.drawText(place, Qt.AlignCenter, text)
    return place.left() - _BETWEEN
