# SPDX-License-Identifier: BSD-3-Clause
"""The panel below RViz in real-time mode, with the curves of the last seconds."""
from __future__ import annotations

import math
import time
from dataclasses import replace
from typing import Callable, Dict, Optional, Sequence

from PyQt5.QtCore import QSize, Qt, QTimer, pyqtSignal
from PyQt5.QtGui import QHideEvent, QShowEvent
from PyQt5.QtWidgets import (
    QComboBox,
    QHBoxLayout,
    QPushButton,
    QToolButton,
    QWidget,
)

from process_visualizer.curves.live_curves import LiveCurve, LiveWindow
from process_visualizer.curves.position_values import Key, key_of
from process_visualizer.gui.compare.live_comparison_model import LiveComparisonModel
from process_visualizer.gui.lanes.curves_dialog import CurvesDialog
from process_visualizer.gui.lanes.lane_choice import LaneChoices
from process_visualizer.gui.lanes.lanes_timeline import framed
from process_visualizer.gui.lanes.timeline_lanes import Lane, grouped_lanes, lane_label, lane_of
from process_visualizer.gui.live.live_curves_model import DURATIONS_S, LiveCurvesModel
from process_visualizer.gui.live.live_timeline import LiveTimeline, LiveValue
from process_visualizer.gui.live.replay_model import ReplayModel, ReplayPhase, age_text
from process_visualizer.gui.playback.transport_view import RateBox
from process_visualizer.gui.playback.values_model import ValuesModel
from process_visualizer.gui.toolkit.icons import icon
from process_visualizer.gui.toolkit.labels import plain_label, plain_tip
from process_visualizer.gui.toolkit.theme import color, set_sheet
from process_visualizer.gui.toolkit.widgets import ElidedLabel, in_column, in_row
from process_visualizer.health.near_objects import NearSpan

_ICON = QSize(18, 18)
_STEADY = 0.1
"""Minimum span of a scale, as a share of the value: at first only its noise may be known."""


_SLOW_S = 20
"""Time to prepare a replay after which the reason (its low priority) is shown [s]."""


class ReplayBar(QWidget):
    """Controls of the replay; visible only while a replay is shown or prepared."""

    def __init__(self, replay: ReplayModel, now_s: Callable[[], float],
                 parent: Optional[QWidget] = None) -> None:
        """Set the replay, and a function that returns the time on the recorder's clock."""
        super().__init__(parent)
        self._replay, self._now_s = replay, now_s
        self._since_s: Optional[float] = None
        playback = replay.playback
        self.state = ElidedLabel(Qt.ElideRight)
        self.state.setObjectName('replay_state')
        set_sheet(self.state, 'color: <warning>; font-weight: bold')
        self.play = self._button('play', 'Play or pause  (space)', playback.toggle)
        self._moving = (
            self._button('step_back', 'One step back  (left arrow, or ,)',
                         lambda: playback.step(-1)),
            self._button('play_backwards', 'Play backwards  (shift+space)',
                         playback.toggle_backwards), self.play,
            self._button('step_forward', 'One step forward  (right arrow, or .)',
                         lambda: playback.step(1)))
        self.rate = RateBox(playback)
        self.rate.setObjectName('replay_rate')
        self.back = QPushButton('Back to live')
        self.back.setObjectName('back_to_live')
        self.back.setToolTip('Show what happens now  (Esc)')
        self.back.clicked.connect(replay.leave)
        row = QHBoxLayout(self)
        row.setContentsMargins(0, 0, 0, 0)
        for widget in (self.back, *self._moving, self.rate, self.state):
            row.addWidget(widget)
        row.addStretch(1)
        for changed in (replay.changed, playback.changed, playback.moved):
            changed.connect(self.show_state)
        self.show_state()

    def show_state(self) -> None:
        """Show how long ago the replayed moment was."""
        replay = self._replay
        is_shown = replay.phase is ReplayPhase.SHOWN
        if replay.phase is not ReplayPhase.PREPARING:
            self._since_s = None
        elif self._since_s is None:
            self._since_s = self._now_s()
        self.setVisible(not replay.is_live)
        for widget in (*self._moving, self.rate):
            widget.setEnabled(is_shown)
        self.play.setIcon(icon('pause' if replay.playback.state.is_playing else 'play'))
        self.rate.show_rate(replay.playback.rate)
        if is_shown:
            trouble = f'. {replay.trouble} has ended: old data' if replay.trouble else ''
            self.state.setText(f'REPLAY  {age_text(self._now_s() - replay.time_s)} ago{trouble}')
        else:
            taken_s = int(self._now_s() - (self._since_s or self._now_s()))
            self.state.setText('Preparing the replay…' + (f' {taken_s} s' if taken_s else '')
                               + (': the running cell has priority' if taken_s >= _SLOW_S else ''))

    def _button(self, name: str, hint: str, action: Callable[[], object]) -> QToolButton:
        button = QToolButton()
        button.setObjectName(f'replay_{name}')
        button.setIcon(icon(name))
        button.setIconSize(_ICON)
        button.setToolTip(plain_tip(hint))
        button.setAccessibleName(hint.split('  (')[0])
        button.setAutoRaise(True)
        button.setFocusPolicy(Qt.TabFocus)
        button.clicked.connect(lambda: action())
        return button


_IDLE = 'The process variables of the devices are drawn here while they run.'
_CLOCK_MS = 500
_WAITING = 'Waiting for the first values…'


class LivePanel(QWidget):
    """The live curves; follows the model while the panel is visible."""

    replay_wanted = pyqtSignal(float)
    """The operator wants to see this moment [s on the recorder's clock] in the scene."""

    def __init__(self, curves: LiveCurvesModel, choices: LaneChoices, replay: ReplayModel,
                 comparison: LiveComparisonModel, replayed: ValuesModel,
                 parent: Optional[QWidget] = None,
                 wall_s: Callable[[], float] = time.time) -> None:
        """``replayed`` reads the values at the position of a replay."""
        super().__init__(parent)
        self._wall_s = wall_s
        self._curves, self._choices, self._replay = curves, choices, replay
        self._comparison = comparison
        self._lanes: Dict[Key, Lane] = {}
        self._near: Sequence[NearSpan] = ()
        self.setObjectName('live_panel')
        self.state = ElidedLabel(Qt.ElideRight)
        self.state.setText(_IDLE)
        self.state.setObjectName('live_state')
        color(self.state, 'quiet')
        self.durations = QComboBox()
        self.durations.setObjectName('live_duration')
        self.durations.setAccessibleName('How much of the past is shown')
        self.durations.setFocusPolicy(Qt.TabFocus)
        for duration_s in DURATIONS_S:
            text = f'{duration_s:.0f} s' if duration_s < 60.0 else f'{duration_s / 60.0:.0f} min'
            self.durations.addItem(text, duration_s)
        self.hold = QToolButton()
        self.hold.setObjectName('live_hold')
        self.hold.setText('Hold')
        self.hold.setCheckable(True)
        self.hold.setToolTip('Freeze the curves; recording continues')
        self.timeline = LiveTimeline(choices, replayed.value)
        replayed.changed.connect(self.timeline.update)
        self.replay = ReplayBar(replay, wall_s)
        self._clock = QTimer(self, interval=_CLOCK_MS)
        self._clock.timeout.connect(self._show_age)
        self._clock.timeout.connect(self.replay.show_state)
        self._lay_out()
        self.durations.activated.connect(
            lambda row: curves.set_duration(float(self.durations.itemData(row))))
        self.durations.activated.connect(lambda: self.timeline.setFocus())
        self.hold.clicked.connect(curves.hold)
        self.timeline.curves_wanted.connect(
            lambda: CurvesDialog(tuple(self._lanes.values()), choices, self).open())
        self.timeline.longer_wanted.connect(self._change_duration)
        self.timeline.replay_wanted.connect(self._want_replay)
        replay.copied.connect(curves.keep)
        replay.changed.connect(self._follow_replay)
        replay.playback.moved.connect(self._show_moment)
        choices.changed.connect(self._show)
        curves.changed.connect(self._show)
        self._show()

    def _lay_out(self) -> None:
        row = in_row(plain_label('Last'), self.durations, self.hold, self.replay, self.state,
                     wide=self.state)
        row.addStrut(self.replay.sizeHint().height())  # keeps the place of the curves below
        frame = framed(self.timeline)
        layout = in_column(self, 8, row, frame)
        layout.setStretchFactor(frame, 1)
        layout.addStretch(0)

    def showEvent(self, event: QShowEvent) -> None:
        """Read curves while the panel is visible."""
        self._curves.set_shown(True)
        if self.window().focusWidget() is None:
            self.timeline.setFocus()

    def hideEvent(self, event: QHideEvent) -> None:
        """Stop reading while the panel is hidden."""
        self._curves.set_shown(False)

    def set_near(self, spans: Sequence[NearSpan]) -> None:
        """Set the spans [s since the epoch] in which objects were near robots."""
        self._near = spans
        self._show_near()

    def _show_near(self) -> None:
        end_s = self._end_s()
        self.timeline.show_near([
            it._replace(begin_s=it.begin_s - end_s, end_s=it.end_s - end_s) for it in self._near])

    def _show(self) -> None:
        curves, window = self._curves, self._curves.window
        self.durations.setCurrentIndex(self.durations.findData(curves.duration_s))
        self.hold.setEnabled(window is not None and self._replay.is_live)
        self.hold.setChecked(curves.is_held)
        self.state.setText(self._state())
        self._show_age()
        if window is None:
            self._lanes = {}
            self.timeline.show_lanes(0.0, (), {}, (), 0.0)
        else:
            self._show_window(window)

    def _show_age(self) -> None:
        """Show the age of the right end, which grows while the curves do not move."""
        stands = self._curves.window is not None and (
            self._curves.is_held or not self._curves.is_running or self._curves.is_stale)
        if stands != self._clock.isActive():
            self._clock.start() if stands else self._clock.stop()
        self.timeline.show_age(self._wall_s() - self._end_s() if stands else 0.0,
                               self._curves.is_held)

    def _state(self) -> str:
        curves = self._curves
        if curves.is_held:
            return '' if not self._replay.is_live else 'On hold; press Hold again for new data'
        if not curves.is_running:
            return _IDLE if curves.window is None else 'Stopped; showing the last values'
        return curves.problem or ('' if curves.window and curves.window.curves else _WAITING)

    def _show_window(self, window: LiveWindow) -> None:
        self._lanes = {lane.key: lane for lane in (
            _lane(curve, window.duration_s).with_band(self._comparison.band(curve, window))
            for curve in window.curves)}
        self.timeline.show_lanes(
            window.duration_s, grouped_lanes(self._lanes, self._choices.choice),
            {_key(curve): LiveValue(self._present(curve), curve.age_s)
             for curve in window.curves}, window.marks,
            window.begin_s + window.duration_s)
        self._show_near()
        self._show_moment()

    def _present(self, curve: LiveCurve) -> float:
        """Return a curve's value; NaN if it is stale, and must not pass for the current one."""
        is_stale = self._curves.is_stale and not self._curves.is_held
        return math.nan if is_stale else curve.value

    def _want_replay(self, time_s: float) -> None:
        if self._curves.is_running:
            self._curves.hold(True)  # the chosen moment must not move away
            self.replay_wanted.emit(self._end_s() + time_s)

    def _follow_replay(self) -> None:
        if self._replay.is_live:
            self._curves.hold(False)
        self._show()
        self._show_moment()

    def _show_moment(self) -> None:
        if not self._replay.is_live and self._replay.time_s > self._end_s():
            self._curves.renew()  # the memory continues after the picture on hold
        self.timeline.show_replay(None if self._replay.is_live
                                  else self._replay.time_s - self._end_s())

    def _end_s(self) -> float:
        """Return the time of the right end on the recorder's clock [s]."""
        window = self._curves.window
        return 0.0 if window is None else window.epoch_s + window.begin_s + window.duration_s

    def _change_duration(self, steps: int) -> None:
        row = min(max(self.durations.currentIndex() + steps, 0), self.durations.count() - 1)
        self._curves.set_duration(float(self.durations.itemData(row)))


def _key(curve: LiveCurve) -> Key:
    source = curve.source
    return key_of(source.device, source.label, source.topic)


def _lane(curve: LiveCurve, duration_s: float) -> Lane:
    source = curve.source
    lane = lane_of(lane_label(source.device, source.label), source.unit, source.color, curve.low,
                   curve.high, duration_s / len(curve.low))
    return replace(lane, key=_key(curve), limits=source.limits, steady=_STEADY)
