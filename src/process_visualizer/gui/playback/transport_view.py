# SPDX-License-Identifier: BSD-3-Clause
"""The buttons of playback, the time, the speed, and the size of a step."""
from __future__ import annotations

import math
from typing import Callable, Dict, List, Optional, Sequence, Tuple

from PyQt5.QtCore import QPointF, QRect, QRectF, QSize, Qt, pyqtSignal
from PyQt5.QtGui import QColor, QMouseEvent, QPainter, QPaintEvent, QPalette, QPen, QResizeEvent
from PyQt5.QtWidgets import (
    QAbstractSlider,
    QComboBox,
    QDoubleSpinBox,
    QGridLayout,
    QHBoxLayout,
    QLabel,
    QSizePolicy,
    QToolButton,
    QWidget,
)

from process_visualizer.figures import clock_text
from process_visualizer.gui.playback.playback_model import PlaybackModel
from process_visualizer.gui.playback.playback_state import MESSAGE, TIMES, StepUnit
from process_visualizer.gui.toolkit.icons import icon
from process_visualizer.gui.toolkit.labels import plain_label, plain_tip
from process_visualizer.gui.toolkit.theme import set_sheet, tabular_font, theme
from process_visualizer.playback.timeline import MAX_RATE, MIN_RATE, RATES


class RateBox(QDoubleSpinBox):
    """The speed as a number; arrows step through usual speeds, Enter returns the focus."""

    def __init__(self, playback: PlaybackModel, parent: Optional[QWidget] = None) -> None:
        super().__init__(parent)
        self._playback = playback
        self._is_being_written = False
        self.setObjectName('rate')
        self.setAccessibleName('Speed')
        self.setToolTip('Speed; 1 is that of the recording  ([ slower, ] faster)')
        self.setRange(MIN_RATE, MAX_RATE)
        self.setDecimals(2)
        self.setSuffix(' ×')
        self.setPrefix('−')
        self.setFixedWidth(self.sizeHint().width())  # nothing moves when the direction changes
        self.setKeyboardTracking(False)
        self.setFocusPolicy(Qt.StrongFocus)
        self.valueChanged.connect(playback.set_speed)
        self.lineEdit().textEdited.connect(lambda _text: self._set_written(True))
        self.editingFinished.connect(lambda: self._set_written(False))
        self.lineEdit().returnPressed.connect(self.clearFocus)

    def show_rate(self, rate: float) -> None:
        """Show a rate without commanding it; text that is being edited stays."""
        if not self._is_being_written:
            self.blockSignals(True)
            self.setPrefix('−' if rate < 0.0 else '')
            self.setValue(abs(rate))
            self.blockSignals(False)

    def _set_written(self, is_being_written: bool) -> None:
        self._is_being_written = is_being_written

    def stepBy(self, steps: int) -> None:
        """Go to the next usual speed."""
        for _ in range(abs(steps)):
            self._playback.faster() if steps > 0 else self._playback.slower()
        self.clearFocus()


LABELED = (0.01, 0.1, 0.25, 0.5, 1.0, 2.0, 4.0, 16.0)
_UNITS = 1000  # of the value, per factor of ten
_DETENT_PX = 5.0
_SIDE, _GROOVE_Y, _KNOB = 13.0, 10.0, 6.5


class SpeedSlider(QAbstractSlider):
    """A slider for speeds from 0.01 to 16; a double click sets 1."""

    speed_chosen = pyqtSignal(float)

    def __init__(self, parent: Optional[QWidget] = None) -> None:
        super().__init__(parent)
        self.setRange(_value(MIN_RATE), _value(MAX_RATE))
        self.setSingleStep(50)
        self.setPageStep(300)
        self.setOrientation(Qt.Horizontal)
        self.setFocusPolicy(Qt.TabFocus)
        self.setSizePolicy(QSizePolicy.Expanding, QSizePolicy.Fixed)
        self.actionTriggered.connect(lambda _action: self._choose(_speed(self.sliderPosition())))

    @property
    def speed(self) -> float:
        """The speed that is shown."""
        return _speed(self.value())

    def show_speed(self, speed: float) -> None:
        """Show a speed, without reporting it as chosen."""
        self.setValue(_value(speed))

    def sizeHint(self) -> QSize:
        """Return a size in which all labels are readable."""
        return QSize(260, 32)

    def minimumSizeHint(self) -> QSize:
        """Return a size in which the slider can be used."""
        return QSize(170, 32)

    def x_of(self, speed: float) -> float:
        """Return the place of a speed [px]."""
        share = (_value(speed) - self.minimum()) / (self.maximum() - self.minimum())
        return _SIDE + share * (self.width() - 2 * _SIDE)

    def mousePressEvent(self, event: QMouseEvent) -> None:
        """Choose the speed at the mouse."""
        if event.button() == Qt.LeftButton:
            self._choose(self._speed_at(event.localPos().x()))

    def mouseMoveEvent(self, event: QMouseEvent) -> None:
        """Choose the speed at the mouse, with detents at usual speeds."""
        if event.buttons() & Qt.LeftButton:
            self._choose(self._speed_at(event.localPos().x()))

    def mouseDoubleClickEvent(self, _event: QMouseEvent) -> None:
        """Return to the speed of the recording."""
        self._choose(1.0)

    def paintEvent(self, _event: QPaintEvent) -> None:
        """Draw the groove (colored from 1 to the speed), ticks with labels, and the knob."""
        painter = QPainter(self)
        painter.setRenderHint(QPainter.Antialiasing)
        color = QColor(theme().accent if self.isEnabled() else theme().disabled_shape)
        left, right = sorted((self.x_of(1.0), self.x_of(self.speed)))
        painter.setPen(Qt.NoPen)
        painter.setBrush(QColor(theme().groove))
        painter.drawRoundedRect(QRectF(_SIDE - 2, _GROOVE_Y - 2, self.width() - 2 * _SIDE + 4, 4),
                                2, 2)
        painter.fillRect(QRectF(left, _GROOVE_Y - 2, right - left, 4), color)
        self._draw_ticks(painter)
        painter.setPen(QPen(QColor(theme().on_signal), 1.5))
        painter.setBrush(color)
        painter.drawEllipse(QPointF(self.x_of(self.speed), _GROOVE_Y), _KNOB, _KNOB)
        if self.hasFocus():
            painter.setPen(QPen(color, 1, Qt.DotLine))
            painter.setBrush(Qt.NoBrush)
            painter.drawRoundedRect(QRectF(self.rect()).adjusted(0.5, 0.5, -0.5, -0.5), 3, 3)

    def _draw_ticks(self, painter: QPainter) -> None:
        font = painter.font()
        font.setPixelSize(10)
        painter.setFont(font)
        for speed in RATES:
            x = self.x_of(speed)
            painter.setPen(QColor(theme().tick))
            painter.drawLine(QPointF(x, _GROOVE_Y + 6), QPointF(x, _GROOVE_Y + 9))
            if speed in LABELED:
                painter.setPen(QColor(theme().quiet if self.isEnabled() else theme().disabled_text))
                painter.drawText(QRectF(x - 20, _GROOVE_Y + 9, 40, 13), Qt.AlignCenter,
                                 f'{speed:g}')

    def _speed_at(self, x: float) -> float:
        """Return the speed at a place [px], or that of a detent near it."""
        nearest = min(RATES, key=lambda speed: abs(self.x_of(speed) - x))
        if abs(self.x_of(nearest) - x) <= _DETENT_PX:
            return nearest
        share = (x - _SIDE) / max(self.width() - 2 * _SIDE, 1.0)
        value = self.minimum() + share * (self.maximum() - self.minimum())
        return _speed(round(min(max(value, self.minimum()), self.maximum())))

    def _choose(self, speed: float) -> None:
        self.show_speed(speed)
        self.speed_chosen.emit(speed)


def _value(speed: float) -> int:
    return round(_UNITS * math.log10(speed))


def _speed(value: int) -> float:
    """Return the speed of a slider value, with three digits."""
    detent = next((it for it in RATES if _value(it) == value), None)
    return float(f'{10 ** (value / _UNITS):.3g}') if detent is None else detent


_UNKNOWN = '-:--.---'
_SIZE = 1.25  # of the usual font


class TimeLabel(QLabel):
    """Position and length of the recording, m:ss.mmm."""

    def __init__(self, parent: Optional[QWidget] = None) -> None:
        super().__init__(parent)
        font = tabular_font(self.font())
        font.setPointSizeF(_SIZE * font.pointSizeF())
        self.setFont(font)
        self.setSizePolicy(QSizePolicy.Minimum, QSizePolicy.Fixed)
        self._position = self._end = _UNKNOWN

    def text(self) -> str:
        """Return the shown text."""
        return f'{self._position.rjust(len(self._end))} / {self._end}'

    def show_nothing(self) -> None:
        """Show placeholders instead of times."""
        self._show(_UNKNOWN, _UNKNOWN)

    def show_time(self, position_s: float, duration_s: float) -> None:
        """Show a position and a length [s]."""
        self._show(clock_text(position_s, 3), clock_text(duration_s, 3))

    def sizeHint(self) -> QSize:
        """Return the size of the text, which depends only on the length of the recording."""
        metrics = self.fontMetrics()
        return QSize(metrics.horizontalAdvance(self.text()) + 2, metrics.height())

    def minimumSizeHint(self) -> QSize:
        """Return the size of the text."""
        return self.sizeHint()

    def paintEvent(self, _event: QPaintEvent) -> None:
        """Draw the position in the text color, the length in a quiet color."""
        painter = QPainter(self)
        color = self.palette().color(QPalette.WindowText)
        width = self._draw(painter, 0, self._position.rjust(len(self._end)), color)
        quiet = QColor(theme().quiet) if self.isEnabled() else color
        self._draw(painter, width, f' / {self._end}', quiet)

    def _draw(self, painter: QPainter, left: int, text: str, color: QColor) -> int:
        width = self.fontMetrics().horizontalAdvance(text)
        painter.setPen(color)
        painter.drawText(QRect(left, 0, width + 2, self.height()), Qt.AlignVCenter, text)
        return left + width

    def _show(self, position: str, end: str) -> None:
        if len(end) != len(self._end):
            self.updateGeometry()
        if (position, end) != (self._position, self._end):
            self._position, self._end = position, end
            self.update()


_WIDE_SPACING, _NARROW_SPACING = 24, 8
_MIN_WIDTH = 400
_MAX_SLIDER, _UNLIMITED = 420, 16777215  # px; the second is Qt's default maximum
_ICON = QSize(20, 20)


class TransportView(QWidget):
    """The controls of a playback model, and its state."""

    def __init__(self, playback: PlaybackModel, parent: Optional[QWidget] = None) -> None:
        super().__init__(parent)
        self._playback = playback
        self._rows = 0
        self._topics: Sequence[str] = ()
        self.time = TimeLabel()
        self.reached = plain_label()
        self.slider = SpeedSlider()
        self.rate = RateBox(playback)
        self.unit = QComboBox()
        self._prepare()
        self._buttons = self._button_row()
        self._speed_row = _row(plain_label('Speed'), self.slider, self.rate)
        self._step_row = _row(plain_label('Step'), self.unit)
        self._grid = QGridLayout(self)
        self._grid.setContentsMargins(0, 0, 0, 0)
        self._grid.setVerticalSpacing(6)
        self._grid.setSizeConstraint(QGridLayout.SetNoConstraint)
        self._arrange(3)
        self.set_topics(())
        playback.changed.connect(self._show)
        playback.moved.connect(self._show_time)
        self._show()

    def set_topics(self, topics: Sequence[str]) -> None:
        """Offer topics as units of a step."""
        if tuple(topics) == tuple(self._topics) and self.unit.count():
            return
        self._topics = tuple(topics)
        self.unit.blockSignals(True)
        self.unit.clear()
        for unit in (MESSAGE, *TIMES, *(StepUnit(topic) for topic in topics)):
            self.unit.addItem(unit.label, unit)
            self.unit.setItemData(self.unit.count() - 1, plain_tip(unit.label), Qt.ToolTipRole)
        self.unit.insertSeparator(1 + len(TIMES))
        self.unit.blockSignals(False)
        if self._playback.state.unit.topic not in ('', *topics):
            self._playback.set_step_unit(MESSAGE)
        self._show_unit()

    # Parts

    def _prepare(self) -> None:
        self.time.setObjectName('time')
        self.time.setToolTip('Position and length of the recording, m:ss.mmm')
        self.reached.setObjectName('reached_rate')
        set_sheet(self.reached, 'color: <warning>')
        self.reached.setToolTip('The machine is too slow for this speed; all topics slow down '
                                'together')
        self.reached.setSizePolicy(QSizePolicy.Ignored, QSizePolicy.Preferred)
        self.reached.setAlignment(Qt.AlignCenter)
        self.slider.setObjectName('speed')
        self.slider.setAccessibleName('Speed')
        self.slider.setToolTip('Speed; a double click is 1  ([ slower, ] faster)')
        self.slider.speed_chosen.connect(self._playback.set_speed)
        self.unit.setObjectName('step_unit')
        self.unit.setAccessibleName('Size of a step')
        self.unit.setSizeAdjustPolicy(QComboBox.AdjustToMinimumContentsLengthWithIcon)
        self.unit.setMinimumContentsLength(6)
        self.unit.setFocusPolicy(Qt.TabFocus)
        self.unit.activated.connect(
            lambda row: self._playback.set_step_unit(StepUnit(*self.unit.itemData(row))))

    def _button_row(self) -> QWidget:
        playback = self._playback
        self.play = self._button('play', 'Play or pause  (space)', playback.toggle)
        self.play.setIconSize(QSize(26, 26))
        self.backwards = self._button('play_backwards', 'Play backwards  (shift+space)',
                                      playback.toggle_backwards, True)
        self.loop = self._button('loop', 'Repeat all, or from A to B  (L)', playback.toggle_loop,
                                 True)
        self.begin = self._button('loop_begin', 'Set loop start  (A)',
                                  lambda: playback.set_loop_begin(), True)
        self.end = self._button('loop_end', 'Set loop end  (B)',
                                lambda: playback.set_loop_end(), True)
        moving = [self._button('to_start', 'To the beginning  (home)', lambda: playback.seek(0.0)),
                  self._button('step_back', 'One step back  (left arrow, or ,)',
                               lambda: playback.step(-1), repeats=True),
                  self.backwards, self.play, self._button('stop', 'Stop: pause at the beginning',
                                                          playback.stop),
                  self._button('step_forward', 'One step forward  (right arrow, or .)',
                               lambda: playback.step(1), repeats=True),
                  self._button('to_end', 'To the end  (end)',
                               lambda: playback.seek(playback.state.duration_s))]
        row = _row(*moving, spacing=1)
        layout = row.layout()
        layout.addWidget(self.reached, 1)
        for button in (self.begin, self.loop, self.end):
            layout.addWidget(button)
        return row

    def _button(self, name: str, hint: str, action: Callable[[], object], checks: bool = False,
                repeats: bool = False) -> QToolButton:
        button = QToolButton()
        button.setObjectName(name)
        button.setIcon(icon(name))
        button.setIconSize(_ICON)
        button.setToolTip(plain_tip(hint))
        button.setAccessibleName(hint.split('  (')[0])
        button.setCheckable(checks)
        button.setAutoRepeat(repeats)
        button.setAutoRaise(True)
        button.setFocusPolicy(Qt.TabFocus)
        button.setMinimumSize(32, 34)
        button.clicked.connect(lambda: self._do(action))
        return button

    def _do(self, action: Callable[[], object]) -> None:
        action()
        self._show()  # a checkable button shows the state, not the press

    # Layout

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Use one row where there is room, otherwise two or three."""
        width = event.size().width()
        without_speed = self._width_of(self._buttons, self.time, self._step_row)
        self._arrange(1 if width >= without_speed + self._width_of(self._speed_row)
                      else 2 if width >= without_speed else 3)

    def minimumSizeHint(self) -> QSize:
        """Return a size that fits several rows, so that a single row can be narrowed to it."""
        size = super().minimumSizeHint()
        return QSize(min(size.width(), _MIN_WIDTH), size.height())

    def _width_of(self, *parts: QWidget) -> int:
        """Return the width of parts in one row, including their spacing."""
        reached = self._reached_width() - self.reached.minimumWidth()
        return (sum(part.minimumSizeHint().width() + _WIDE_SPACING for part in parts)
                + (reached if self._buttons in parts else 0))

    def _reached_width(self) -> int:
        return self.fontMetrics().horizontalAdvance(' only 0.00× ')

    def _arrange(self, rows: int) -> None:
        if rows == self._rows:
            return
        self._rows = rows
        for widget, place in self._places(rows).items():
            self._grid.addWidget(widget, *place)
        is_wide = rows < 3
        self.reached.setMinimumWidth(self._reached_width() if is_wide else 0)
        self.slider.setMaximumWidth(_MAX_SLIDER if rows == 1 else _UNLIMITED)
        self._grid.setHorizontalSpacing(_WIDE_SPACING if is_wide else _NARROW_SPACING)
        for column in range(5):
            self._grid.setColumnStretch(column, int(column == (4, 1, 0)[rows - 1]))

    def _places(self, rows: int) -> Dict[QWidget, Tuple[int, ...]]:
        """Return row and column of each part, and its numbers of spanned rows and columns."""
        buttons, speed, step = self._buttons, self._speed_row, self._step_row
        if rows == 1:
            return {buttons: (0, 0), self.time: (0, 1), speed: (0, 2), step: (0, 3)}
        if rows == 2:
            return {buttons: (0, 0), self.time: (0, 1), step: (0, 2), speed: (1, 0, 1, 3)}
        return {self.time: (0, 0), step: (0, 1), buttons: (1, 0, 1, 2), speed: (2, 0, 1, 2)}

    # State

    def _show(self) -> None:
        it = self._playback
        for widget in (self._buttons, self._speed_row, self._step_row, self.time):
            widget.setEnabled(it.state.is_available)
        is_forward = it.state.is_playing and it.rate > 0.0
        self.play.setIcon(icon('pause' if is_forward else 'play'))
        self.backwards.setChecked(it.state.is_playing and it.rate < 0.0)
        self.backwards.setIcon(icon('pause' if self.backwards.isChecked() else 'play_backwards'))
        self.loop.setChecked(it.is_looping)
        self.begin.setChecked(it.state.points.begin_s is not None)
        self.end.setChecked(it.state.points.end_s is not None)
        self.slider.show_speed(abs(it.rate))
        self.rate.show_rate(it.rate)
        reached = it.state.reached_rate
        self.reached.setText('' if reached is None else f'only {abs(reached):.2g}×')
        self._show_unit()
        self._show_time()

    def _show_unit(self) -> None:
        row = next((row for row in range(self.unit.count())
                    if self.unit.itemData(row) == self._playback.state.unit), 0)
        self.unit.setCurrentIndex(row)
        self.unit.setToolTip(plain_tip(f'Size of a step: {self._playback.state.unit.label}'
                             '  (left and right arrow, or , and .)'))

    def _show_time(self) -> None:
        if self._playback.state.is_available:
            self.time.show_time(self._playback.position_s, self._playback.state.duration_s)
        else:
            self.time.show_nothing()


def _row(*widgets: QWidget, spacing: int = 6) -> QWidget:
    row = QWidget()
    layout = QHBoxLayout(row)
    layout.setContentsMargins(0, 0, 0, 0)
    layout.setSpacing(spacing)
    items: List[QWidget] = list(widgets)
    for widget in items:
        layout.addWidget(widget)
    return row
