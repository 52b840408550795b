# SPDX-License-Identifier: BSD-3-Clause
"""Lanes one below the other, and the common base of the two timelines that show them."""
from __future__ import annotations

from functools import partial
from itertools import accumulate
from typing import Callable, List, Optional, Sequence, Tuple

from PyQt5.QtCore import QObject, QPoint, QPointF, QRect, QRectF, QSize, Qt, pyqtSignal
from PyQt5.QtGui import (
    QColor,
    QFont,
    QFontMetricsF,
    QPainter,
    QPaintEvent,
    QPalette,
    QPixmap,
    QPolygonF,
    QResizeEvent,
    QWheelEvent,
)
from PyQt5.QtWidgets import QFrame, QMenu, QScrollBar, QSizePolicy, QVBoxLayout, QWidget

from process_visualizer.gui.lanes.lane_choice import LaneChoice, LaneChoices
from process_visualizer.gui.lanes.lane_picture import LanePictures
from process_visualizer.gui.lanes.lane_scale import (
    GROWTH,
    LANE_HEIGHT,
    SIDE,
    TEXT_HEIGHT,
    LaneLook,
    growth,
    heights,
    least_height,
    range_text,
)
from process_visualizer.gui.lanes.timeline_header import HEADER_HEIGHT
from process_visualizer.gui.lanes.timeline_lanes import Lane, LaneTexts
from process_visualizer.gui.toolkit.theme import readable_color, set_sheet, theme, translucent
from process_visualizer.gui.toolkit.time_axis import TimeAxis

_MIN_LANES = 2  # that are always visible, if there are that many
_FONT_PX = 11


class LanesTimeline(QWidget):
    """Curves over time in lanes that scroll, fold and are chosen; subclasses define the time."""

    curves_wanted = pyqtSignal()
    """The operator wants to choose the curves."""

    _below_lanes = 0
    """The height [px] that is kept free below the lanes."""

    def __init__(self, choices: LaneChoices, parent: Optional[QWidget] = None) -> None:
        super().__init__(parent)
        self._choices = choices
        self._hover_x: Optional[float] = None
        self._font = QFont(self.font())
        self._font.setPixelSize(_FONT_PX)
        self.stack = LaneStack(self)
        self.stack.redraw.connect(self.update)
        self.setMouseTracking(True)
        self.setSizePolicy(QSizePolicy.Expanding, QSizePolicy.Preferred)

    @property
    def axis(self) -> TimeAxis:
        """The axis of time."""
        raise NotImplementedError

    @property
    def hover_s(self) -> Optional[float]:
        """The time at the mouse, which changes when the axis moves; None without the mouse."""
        return None if self._hover_x is None else self.axis.time_s(self._hover_x)

    def lane_texts(self, row: int, number: int = 0) -> LaneTexts:
        """Return the texts of one curve of a lane."""
        raise NotImplementedError

    def _lanes_axis(self) -> Tuple[TimeAxis, float]:
        """Return the axis in the time of the curves, which begins at 0, and their length [s]."""
        raise NotImplementedError

    # Size

    def sizeHint(self) -> QSize:
        """Return a size with room for all lanes."""
        return QSize(400, self._height_of(len(self.stack.lanes)))

    def minimumSizeHint(self) -> QSize:
        """Return a size in which some lanes can be seen."""
        return QSize(260, self._height_of(min(len(self.stack.lanes), _MIN_LANES)))

    def _height_of(self, lanes: int) -> int:
        return int(HEADER_HEIGHT) + self.stack.height_of(lanes) + self._below_lanes

    def _fit(self) -> None:
        """Give the lanes their places."""
        self.setMaximumHeight(int(HEADER_HEIGHT) + self.stack.most_height + self._below_lanes)
        self.stack.place(self.rect().adjusted(0, int(HEADER_HEIGHT), 0, -self._below_lanes))

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Give the lanes their height in the new size."""
        self._fit()

    # Drawing

    def paintEvent(self, event: QPaintEvent) -> None:
        """Draw the cached pictures of the curves, and everything else over them."""
        painter = QPainter(self)
        painter.setFont(self._font)
        painter.fillRect(event.rect(), self.palette().color(QPalette.Base))
        self.stack.draw(painter, *self._lanes_axis(), event.rect())
        axis = self.axis
        self._draw(painter, axis, float(self.height() - self._below_lanes), event.rect())
        self.stack.draw_texts(painter, axis, event.rect(), self.lane_texts)
        painter.end()

    def _draw(self, painter: QPainter, axis: TimeAxis, bottom: float, area: QRect) -> None:
        """Draw the header, and what lies over the curves down to ``bottom`` [px], in an area."""
        raise NotImplementedError

    def _update_header(self) -> None:
        self.update(0, 0, self.width(), int(HEADER_HEIGHT))

    # The mouse

    def _scrolls_lanes(self, event: QWheelEvent) -> bool:
        """Scroll lanes that do not fit if the wheel turns over them without a modifier key.

        Return whether the wheel was over such lanes.
        """
        if not self.stack.scroll.maximum() or event.modifiers() \
                or event.pos().y() < HEADER_HEIGHT:
            return False
        self.stack.scroll.event(event)
        return True

    def _add_lane_actions(self, menu: QMenu, row: Optional[int]) -> None:
        """Add the actions for a lane, if there is one, and the choice of curves."""
        if row is not None:
            self.stack.add_actions(menu, row, self._choices)
        menu.addAction('Curves…', self.curves_wanted)


def framed(timeline: LanesTimeline, *below: QWidget) -> QFrame:
    """Return a frame on paper around a timeline and the widgets below it; it grows with lanes."""
    frame = QFrame()
    frame.setFrameShape(QFrame.StyledPanel)
    set_sheet(frame, 'QFrame { background: <paper>; }')
    inside = QVBoxLayout(frame)
    inside.setContentsMargins(0, 2, 0, 0)
    inside.setSpacing(0)
    inside.setSizeConstraint(QVBoxLayout.SetMinAndMaxSize)
    inside.addWidget(timeline, 1)
    for widget in below:
        inside.addWidget(widget)
    return frame


def add_lane_actions(menu: QMenu, choices: LaneChoices, lane: Lane, above: Optional[Lane]) -> None:
    """Add actions for a lane; ``above`` is the lane above it, if any."""
    choice = choices.choice

    def add(text: str, change: Callable[[], LaneChoice]) -> None:
        menu.addAction(text, lambda: choices.choose(change()))

    for curve in lane.curves:
        add(f'Hide “{curve.label}”', partial(choice.with_hidden, curve.key))
    for curve in lane.overlaid:
        add(f'A lane of its own for “{curve.label}”', partial(choice.with_own_lane, curve.key))
    if above is not None:
        add(f'Overlay on “{above.label}”', partial(choice.with_joined, lane.key, above.key))
    keys = [curve.key for curve in lane.curves]
    add('Unfold the lane' if lane.is_folded else 'Fold the lane',
        partial(choice.with_folded, keys, not lane.is_folded))


_EDGES = 2  # px above and below all lanes
_MIN_NAME = 20.0  # px: a name with less room is not shown
_BETWEEN = 7.0  # px between texts
_BACKGROUND_ALPHA = 225  # keeps texts readable over the playhead
_FOLD_PX, _FOLD_SIZE = 13, 3.5  # the triangle that folds a lane: size of its place, half its size


class LaneStack(QObject):
    """The lanes of a timeline, which scroll if there is not enough room."""

    redraw = pyqtSignal(QRect)
    """A part of the widget has to be drawn again."""

    def __init__(self, parent: QWidget) -> None:
        super().__init__(parent)
        self.lanes: Tuple[Lane, ...] = ()
        self.rect = QRect()
        self.pictures = LanePictures()
        self.scroll = QScrollBar(Qt.Vertical, parent)
        self.scroll.setObjectName('timeline_scroll')
        self.scroll.valueChanged.connect(lambda: self.redraw.emit(self.rect))
        self._heights: Tuple[int, ...] = ()
        self._tops: Tuple[int, ...] = ()

    def set_lanes(self, lanes: Sequence[Lane]) -> None:
        """Set the lanes, from top to bottom; call ``place`` afterwards."""
        self.lanes = tuple(lanes)
        self.pictures.set_lanes(lanes)

    def update_lanes(self, lanes: Sequence[Lane], end_s: float) -> None:
        """Set lanes with values up to ``end_s``; pictures of the same lanes stay until redrawn."""
        self.lanes = tuple(lanes)
        self.pictures.update_lanes(lanes, end_s)

    def height_of(self, lanes: int) -> int:
        """Return the height [px] that the first ``lanes`` lanes need."""
        return sum(map(least_height, self.lanes[:lanes])) + _EDGES

    @property
    def most_height(self) -> int:
        """The height [px] beyond which the lanes do not grow."""
        return self.height_of(len(self.lanes)) + GROWTH * sum(map(growth, self.lanes))

    def place(self, rect: QRect) -> None:
        """Set the place of all lanes."""
        self.rect = rect
        visible = rect.height()
        self._heights = heights(self.lanes, visible - _EDGES)
        self._tops = tuple(accumulate((0, *self._heights)))
        hidden = max(self._tops[-1] + _EDGES - visible, 0)
        self.scroll.setRange(0, hidden)
        self.scroll.setPageStep(max(visible, 1))
        self.scroll.setSingleStep(LANE_HEIGHT // 2)
        self.scroll.setVisible(hidden > 0)
        self.scroll.setGeometry(rect.right() + 3 - int(SIDE), rect.top(), int(SIDE) - 2,
                                max(visible, 0))

    def lane_rect(self, row: int) -> QRect:
        """Return the place of a lane, which may be scrolled out of view."""
        top = self.rect.top() + self._tops[row] - self.scroll.value()
        return QRect(self.rect.left(), top, self.rect.width(), self._heights[row])

    def texts_rect(self, row: int, axis: TimeAxis) -> QRectF:
        """Return the place of a lane's names and values."""
        return QRectF(axis.left, self.lane_rect(row).top() + 1, axis.width,
                      TEXT_HEIGHT * len(self.lanes[row].curves) - 1)

    def row_at(self, y: int) -> Optional[int]:
        """Return the row of the lane at a height [px]; None without a lane there."""
        if not self.rect.top() <= y < self.rect.bottom():
            return None
        return next((row for row in range(len(self.lanes))
                     if self.lane_rect(row).top() <= y <= self.lane_rect(row).bottom()), None)

    def fold_rect(self, row: int) -> QRect:
        """Return the place of the triangle that folds a lane."""
        return QRect(self.lane_rect(row).topLeft() + QPoint(0, 1), QSize(_FOLD_PX, _FOLD_PX))

    def fold(self, place: QPoint, choices: LaneChoices) -> bool:
        """Fold or unfold the lane whose triangle is at a place; return whether there is one."""
        row = self.row_at(place.y())
        if row is None or not self.fold_rect(row).contains(place):
            return False
        keys, is_folded = self.lanes[row].arrangement
        choices.choose(choices.choice.with_folded(keys, not is_folded))
        return True

    def add_actions(self, menu: QMenu, row: int, choices: LaneChoices) -> None:
        """Add the actions for a lane to a menu."""
        add_lane_actions(menu, choices, self.lanes[row], self.lanes[row - 1] if row else None)

    def draw(self, painter: QPainter, axis: TimeAxis, length_s: float, area: QRect) -> None:
        """Draw the curves in an area; request a redraw for lanes that are not ready yet."""
        dots, font, width = painter.device().devicePixelRatioF(), painter.font(), self.rect.width()
        self.pictures.want([LaneLook(axis, width, height, dots, font, length_s, len(lane.curves))
                            for lane, height in zip(self.lanes, self._heights)])
        drawn = self.pictures.draw(self._visible_rows())
        painter.setClipRect(area.intersected(self.rect))
        for row in self._visible_rows():
            picture, place = self.pictures.picture(row), self.lane_rect(row)
            if picture is not None and place.intersects(area):
                late_px = round(self.pictures.age_s(row) * axis.width / length_s) if length_s else 0
                _draw_picture(painter, place, picture, round(axis.left), late_px)
                _draw_fold(painter, QRectF(self.fold_rect(row)), self.lanes[row].is_folded)
        painter.setClipRect(area)
        for row in self.pictures.missing(self._visible_rows()) + drawn:
            if row not in drawn or not area.contains(self.lane_rect(row).intersected(self.rect)):
                self.redraw.emit(self.lane_rect(row))

    @property
    def is_drawn(self) -> bool:
        """Return whether all visible lanes look as wanted."""
        return not self.pictures.missing(self._visible_rows())

    def _visible_rows(self) -> List[int]:
        return [row for row in range(len(self.lanes))
                if self.lane_rect(row).intersects(self.rect)]

    def draw_texts(self, painter: QPainter, axis: TimeAxis, area: QRect,
                   texts_of: Callable[[int, int], LaneTexts]) -> None:
        """Draw names and values within an area, over everything else.

        ``texts_of`` returns the texts for a row and the number of a curve in its lane.
        """
        painter.setClipRect(area.intersected(self.rect))
        for row, lane in enumerate(self.lanes):
            place = self.texts_rect(row, axis)
            if not place.toAlignedRect().intersects(area):
                continue
            for number in range(len(lane.curves)):
                rect = QRectF(place.left(), place.top() + number * TEXT_HEIGHT, place.width(),
                              TEXT_HEIGHT - 1)
                right = _draw_values(painter, rect, texts_of(row, number))
                self._draw_name(painter, row, number, rect, right)
        painter.setClipRect(area)

    def _draw_name(self, painter: QPainter, row: int, number: int, rect: QRectF,
                   right: float) -> None:
        """Draw a curve's name, and its scale if that differs from the scale at the left."""
        lane, curve = self.lanes[row], self.lanes[row].curves[number]
        metrics, room = QFontMetricsF(painter.font()), right - rect.left()
        if room < _MIN_NAME:
            return
        text = curve.label
        if curve.scale_name != lane.scale_name and not lane.is_folded:
            text += '  ' + range_text(self.pictures.scale(row, number), curve.unit)
        text = metrics.elidedText(text, Qt.ElideMiddle, room)
        place = QRectF(rect.topLeft(), rect.bottomRight())
        place.setWidth(metrics.horizontalAdvance(text) + 2.0)
        painter.fillRect(place, translucent(theme().paper, _BACKGROUND_ALPHA))
        painter.setPen(readable_color(curve.color))
        painter.drawText(place, Qt.AlignLeft | Qt.AlignVCenter, text)


def _draw_picture(painter: QPainter, place: QRect, picture: QPixmap, left: int,
                  late_px: int) -> None:
    """Draw a lane; one whose values end earlier is moved, so that they stay at their times."""
    if not late_px:
        painter.drawPixmap(place, picture)
        return
    for part, by_px in ((place.adjusted(0, 0, left - place.right() - 1, 0), 0),
                        (place.adjusted(left - place.left(), 0, 0, 0), late_px)):
        painter.save()
        painter.setClipRect(part, Qt.IntersectClip)
        painter.drawPixmap(place.translated(-by_px, 0), picture)
        painter.restore()


def _draw_fold(painter: QPainter, rect: QRectF, is_folded: bool) -> None:
    """Draw a triangle that points to the right for a folded lane, else down."""
    size, middle = _FOLD_SIZE, rect.center()
    corners = ((-size / 2, -size), (size / 2, 0.0), (-size / 2, size)) if is_folded \
        else ((-size, -size / 2), (0.0, size / 2), (size, -size / 2))
    painter.save()
    painter.setRenderHint(QPainter.Antialiasing)
    painter.setPen(Qt.NoPen)
    painter.setBrush(QColor(theme().tick))
    painter.drawPolygon(QPolygonF([middle + QPointF(*it) for it in corners]))
    painter.restore()


def _draw_values(painter: QPainter, rect: QRectF, texts: LaneTexts) -> float:
    """Draw the values at the right in the colors of their lines; return their left end [px]."""
    right, colors = rect.right(), theme()
    if texts.at_mouse:
        right = _draw_left_of(painter, rect, right, texts.difference, colors.quiet)
        right = _draw_left_of(painter, rect, right - 4.0, texts.at_mouse, colors.paper,
                              colors.text) - 4.0
    return _draw_left_of(painter, rect, right, texts.at_position, colors.accent)


def _draw_left_of(painter: QPainter, rect: QRectF, right: float, text: str, color: str,
                  behind: str = '') -> float:
    """Draw a text that ends at ``right`` [px]; return the right end for the next text."""
    width = painter.fontMetrics().horizontalAdvance(text) + 2.0
    place = QRectF(right - width, rect.top(), width, rect.height())
    painter.setPen(Qt.NoPen)
    painter.setBrush(QColor(behind) if behind
                     else translucent(theme().paper, _BACKGROUND_ALPHA))
    margin = 3.0 if behind else 0.0
    painter.drawRoundedRect(place.adjusted(-margin, 0, margin, 0), margin, margin)
    painter.setPen(QColor(color))
    painter.drawText(place, Qt.AlignCenter, text)
    return place.left() - _BETWEEN
