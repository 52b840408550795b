# SPDX-License-Identifier: BSD-3-Clause
"""A strip of fixed size with the alarms (amber and red chips) and their buttons."""
from __future__ import annotations

import time
from typing import Dict, Optional, Sequence, Tuple

from PyQt5.QtCore import QEvent, Qt, QTimer, pyqtSignal
from PyQt5.QtGui import QCursor, QShowEvent
from PyQt5.QtWidgets import (
    QApplication,
    QFrame,
    QHBoxLayout,
    QPlainTextEdit,
    QPushButton,
    QScrollArea,
    QSizePolicy,
    QToolButton,
    QVBoxLayout,
    QWidget,
)

from process_visualizer.figures import clock_text
from process_visualizer.gui.cell.alarms_model import AlarmsModel, RecordedAlarms
from process_visualizer.gui.toolkit.dialogs import TextDialog
from process_visualizer.gui.toolkit.labels import plain_label, plain_tip
from process_visualizer.gui.toolkit.scrolling import StillScroll, keep_room_for_bar
from process_visualizer.gui.toolkit.theme import color, set_sheet
from process_visualizer.gui.toolkit.widgets import ElidedLabel, tool_button
from process_visualizer.health.alarm_board import Action, Alarm, Condition, events_text
from process_visualizer.health.device_state import Level

# Events since the launcher was opened, and the alarms of the open recording.

class EventsView(TextDialog):
    """A window with all events, kept up to date; deletes itself."""

    def __init__(self, model: AlarmsModel, parent: Optional[QWidget] = None) -> None:
        super().__init__('events', 'Events', parent)
        self.setAttribute(Qt.WA_DeleteOnClose)
        self._model = model
        self.text.setLineWrapMode(QPlainTextEdit.WidgetWidth)
        self.text.setPlaceholderText('Nothing has happened yet.')
        self.text.setAccessibleName('Events')
        model.happened.connect(self.refresh)
        model.changed.connect(self.refresh)
        self.refresh()

    @classmethod
    def open(cls, model: AlarmsModel, window: QWidget) -> None:
        """Show the window; there is only one."""
        view = next((it for it in window.findChildren(cls) if it.isVisible()), None)
        if view is None:
            view = cls(model, window)
            view.show()
        view.raise_()
        view.activateWindow()

    def showEvent(self, event: QShowEvent) -> None:
        """Scroll to the newest event; only now the text has its lines."""
        super().showEvent(event)
        QTimer.singleShot(0, self._go_to_end)

    def _go_to_end(self) -> None:
        self.text.verticalScrollBar().setValue(self.text.verticalScrollBar().maximum())

    def refresh(self) -> None:
        """Show all events, scrolled to the last one; while text is selected, nothing changes."""
        recorded = recorded_text(self._model.recorded)
        text = '\n\n'.join(filter(None, [recorded, events_text(self._model.events)]))
        if text != self.text.toPlainText() and not self.text.textCursor().hasSelection():
            self.show_text('Events (newest last)', text)
            self._go_to_end()


def recorded_text(alarms: RecordedAlarms) -> str:
    """Return the alarms of a recording, each with its place and length."""
    lines = [f'{clock_text(begin_s, 3)}  {device}: {text}, for {end_s - begin_s:.1f} s'
             for device, text, begin_s, end_s in alarms]
    return '\n'.join(['In the recording:', *lines]) if lines else ''


ROWS = 2
_LINES, _BESIDE_PX, _GAP_PX = 2, 4, 2
_SHORT = {Action.SHOW_LOG: 'Log', Action.RESTART_DEVICE: 'Restart', Action.RESTART_RVIZ: 'Restart',
          Action.ACKNOWLEDGE: 'Ack'}
"""Short labels, which leave room for the text; tooltip and accessible name have the whole label."""
_REST_MS = 1000
"""Time for which the strip is left alone before its alarms are sorted again."""


class AlarmStrip(QWidget):
    """Shows the alarms of a model, the worst first; scrolls if they do not fit.

    The alarms keep their places while the mouse is over them or a button of theirs has the keyboard
    focus, so that nobody acknowledges or restarts something that has just moved there. An alarm
    that has ended stays in its place, dimmed; a new one is added below, and is counted beside the
    alarms if it is out of view.
    """

    action_wanted = pyqtSignal(object, object)
    """An Action about a Condition."""

    def __init__(self, model: AlarmsModel, parent: Optional[QWidget] = None) -> None:
        super().__init__(parent)
        self._model = model
        self._shown: Tuple[Alarm, ...] = ()
        self._known = 0  # rows when the alarms were sorted last
        self._is_under_mouse = self._is_blocked = False
        self.summary = plain_label()
        self.summary.setObjectName('no_alarms')
        color(self.summary, 'quiet')
        self._chips = QWidget()
        self._column = QVBoxLayout(self._chips)
        self._column.setContentsMargins(0, 0, 0, 0)
        self._column.setSpacing(_GAP_PX)
        self._column.setAlignment(Qt.AlignTop)
        self._area = StillScroll()
        keep_room_for_bar(self._area)
        self.more = _more_button(self._area)
        self._rest = QTimer(self, singleShot=True, interval=_REST_MS)
        self._rest.timeout.connect(self._show)
        self.setAttribute(Qt.WA_Hover)
        application = QApplication.instance()
        assert isinstance(application, QApplication)
        application.focusChanged.connect(self._follow_focus)
        self._lay_out()
        model.changed.connect(self._show)
        self._show()

    def _lay_out(self) -> None:
        self._area.setObjectName('alarms')
        self._area.setAccessibleName('Alarms')
        self._area.setFrameShape(QFrame.NoFrame)
        self._area.setWidgetResizable(True)
        self._area.setHorizontalScrollBarPolicy(Qt.ScrollBarAlwaysOff)
        self._area.setWidget(self._chips)
        layout = QHBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(4)
        layout.addWidget(self.summary, 1, Qt.AlignTop)
        layout.addWidget(self._area, 1)
        events = tool_button('show_events', 'list', 'Events: what happened, with times',
                             lambda: EventsView.open(self._model, self.window()))
        self.more.setFixedWidth(events.sizeHint().width())
        beside = QVBoxLayout()
        beside.setSpacing(0)
        beside.addWidget(events, 0, Qt.AlignTop)
        beside.addWidget(self.more, 0, Qt.AlignBottom)
        layout.addLayout(beside)
        self.setFixedHeight(ROWS * _row_px(self) + (ROWS - 1) * _GAP_PX)

    def event(self, event: QEvent) -> bool:
        """See Qt; notice the mouse over the alarms."""
        if event.type() in (QEvent.HoverEnter, QEvent.HoverMove):
            self._is_under_mouse = True
        elif event.type() == QEvent.HoverLeave and QApplication.activeModalWidget() is not None:
            self._is_blocked = True  # a message box takes the mouse, which has not moved
        elif event.type() in (QEvent.HoverLeave, QEvent.Hide):
            self._is_under_mouse = False
            self._rest.start()
        return super().event(event)

    def _follow_focus(self, before: Optional[QWidget], _now: Optional[QWidget]) -> None:
        if before is not None and self._chips.isAncestorOf(before):
            self._rest.start()

    @property
    def _is_in_use(self) -> bool:
        """Return whether the operator may be about to use a button, or was a moment ago."""
        if self._is_blocked and QApplication.activeModalWidget() is None:
            self._is_blocked = False
            self._is_under_mouse = self.rect().contains(self.mapFromGlobal(QCursor.pos()))
        focused = QApplication.focusWidget()
        return self._is_under_mouse or self._rest.isActive() or (
            focused is not None and self._chips.isAncestorOf(focused))

    def _show(self) -> None:
        """Show the alarms; a chip stays while its alarm lasts, so that it can be clicked."""
        alarms = self._model.alarms
        present = {_key(it) for it in alarms}
        if self._is_in_use:
            alarms = _in_place(self._shown, alarms)
        else:
            self._known = len(alarms)
        for row, alarm in enumerate(alarms):
            if row >= len(self._shown) or _key(self._shown[row]) != _key(alarm):
                self._put(row)
            self._chip(row).show_alarm(alarm, _key(alarm) in present,
                                       self._model.can_replay(alarm))
        while self._column.count() > len(alarms):
            self._drop(len(alarms))
        self._shown = alarms
        self.summary.setText(self._model.summary)
        self.summary.setVisible(not alarms)
        self._area.setVisible(bool(alarms))
        new = sum(_key(it) in present for it in alarms[max(self._known, ROWS):])
        self.more.setText(f'+{new}' if new > 0 else '')
        self.more.setAccessibleName(f'{new} new below' if new > 0 else 'No new alarms below')
        self.more.setToolTip(plain_tip(self.more.accessibleName()) if new > 0 else '')
        self.more.setEnabled(new > 0)

    def _put(self, row: int) -> None:
        if row < self._column.count():
            self._drop(row)
        chip = AlarmChip()
        chip.action_wanted.connect(self.action_wanted)
        self._column.insertWidget(row, chip)
        chip.show()

    def _drop(self, row: int) -> None:
        chip = self._chip(row)
        chip.setEnabled(False)  # so that the strip does not scroll when the keyboard focus moves on
        self._column.removeWidget(chip)
        chip.hide()
        chip.deleteLater()

    def _chip(self, row: int) -> AlarmChip:
        chip = self._column.itemAt(row).widget()
        assert isinstance(chip, AlarmChip)
        return chip


def _in_place(shown: Sequence[Alarm], alarms: Sequence[Alarm]) -> Tuple[Alarm, ...]:
    """Return the alarms in their shown places, including those that are gone; new ones last."""
    new = {_key(it): it for it in alarms}
    return (*(new.pop(_key(it), it) for it in shown), *new.values())


def _key(alarm: Alarm) -> Tuple[str, str, Optional[float]]:
    condition = alarm.condition
    return condition.source, condition.about, condition.position_s


def _more_button(area: QScrollArea) -> QToolButton:
    """Return a button, in a place of its own, that scrolls to the last alarm."""
    button = QToolButton()
    button.setObjectName('new_alarms')
    button.setAutoRaise(True)
    button.setFocusPolicy(Qt.TabFocus)
    button.setStyleSheet('padding: 0px;')
    _make_small(button)
    button.clicked.connect(
        lambda: area.verticalScrollBar().setValue(area.verticalScrollBar().maximum()))
    return button


_NOT_REPLAYABLE = "Its beginning is no longer in the recorder's memory"


class AlarmChip(QFrame):
    """One alarm: its time, source and text, and buttons with remedies.

    A button stays while its alarm has that remedy, so that a click that has begun counts.
    """

    action_wanted = pyqtSignal(object, object)

    def __init__(self, parent: Optional[QWidget] = None) -> None:
        super().__init__(parent)
        self.setObjectName('alarm')
        self.setFixedHeight(_row_px(self))
        self._condition: Optional[Condition] = None
        self.text = ElidedLabel(Qt.ElideRight, lines=_LINES)
        self.text.setObjectName('alarm_text')
        _make_small(self.text)
        self._row = QHBoxLayout(self)
        self._row.setContentsMargins(6, 1, 2, 1)
        self._row.setSpacing(2)
        self._row.addWidget(self.text, 1)
        self._buttons: Dict[Action, QPushButton] = {}

    def show_alarm(self, alarm: Alarm, is_there: bool, can_replay: bool) -> None:
        """Show the present state of the alarm, and enable the actions that are possible now.

        An alarm that is gone is dimmed.

        Args:
            alarm: as it is now, or as it was last.
            is_there: whether the alarm is still present.
            can_replay: whether the beginning of the alarm can be replayed.
        """
        before, self._condition = self._condition, alarm.condition
        if before is None or before.level is not alarm.condition.level:
            tone = 'bad' if alarm.condition.level is Level.BAD else 'warning'
            set_sheet(self, f'QFrame#alarm {{ border: 1px solid <{tone}>; border-left-width: 5px; '
                            f'border-radius: 4px; background: <behind_{tone}>; }}')
        if before is None or before.actions != alarm.condition.actions:
            self._show_buttons(alarm.condition.actions)
        self.text.setText(chip_text(alarm))
        self.text.setEnabled(is_there)
        can_not = {Action.ACKNOWLEDGE: alarm.is_acknowledged, Action.REPLAY: not can_replay}
        for action, button in self._buttons.items():
            button.setEnabled(is_there and not can_not.get(action, False))
            if action is Action.REPLAY:
                button.setToolTip(plain_tip(action.value if can_replay else _NOT_REPLAYABLE))

    def _show_buttons(self, actions: Sequence[Action]) -> None:
        for action in set(self._buttons).difference(actions):
            button = self._buttons.pop(action)
            button.setEnabled(False)  # so that the strip does not scroll as the focus moves on
            self._row.removeWidget(button)
            button.hide()
            button.deleteLater()
        for place, action in enumerate(actions, start=1):  # behind the text
            if action not in self._buttons:
                self._buttons[action] = self._button(action)
                self._row.insertWidget(place, self._buttons[action])

    def _button(self, action: Action) -> QPushButton:
        button = QPushButton(_SHORT.get(action, action.value))
        button.setObjectName(f'alarm_{action.name.lower()}')
        button.setToolTip(plain_tip(action.value))
        button.setAccessibleName(action.value)
        button.setFocusPolicy(Qt.TabFocus)  # a click takes no focus from a text that is being typed
        button.setSizePolicy(QSizePolicy.Fixed, QSizePolicy.Preferred)
        button.setStyleSheet('padding: 1px 5px;')
        _make_small(button)
        button.clicked.connect(lambda: self.action_wanted.emit(action, self._condition))
        return button


def _row_px(widget: QWidget) -> int:
    """Return the height of an alarm in the font of a widget."""
    return _LINES * widget.fontMetrics().lineSpacing() + _BESIDE_PX


def _make_small(widget: QWidget) -> None:
    font = widget.font()
    font.setPointSizeF(font.pointSizeF() * 0.9)
    widget.setFont(font)


def chip_text(alarm: Alarm) -> str:
    """Return the alarm's time (of day, or in the recording), its count, source and text."""
    condition = alarm.condition
    if condition.position_s is not None:
        since = clock_text(condition.position_s, 3)
    else:
        since = _of_day(alarm.since_s if alarm.first_s is None else alarm.first_s)
        if alarm.ended_s is not None:
            since += f'–{_of_day(alarm.ended_s)}'
        if alarm.times > 1:
            since += f' ({alarm.times}×)'
    return f'{since}  {alarm.worst.said}'


def _of_day(time_s: float) -> str:
    return time.strftime('%H:%M:%S', time.localtime(time_s))
