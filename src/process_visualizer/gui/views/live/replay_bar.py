# SPDX-License-Identifier: BSD-3-Clause
"""The row that commands an instant replay."""
from __future__ import annotations

from typing import Callable, Optional

from PyQt5.QtCore import QSize, Qt
from PyQt5.QtWidgets import QHBoxLayout, QLabel, QPushButton, QToolButton, QWidget

from process_visualizer.gui.models.recording.replay_model import ReplayModel, ReplayPhase
from process_visualizer.gui.toolkit.icons import icon
from process_visualizer.gui.toolkit.theme_following import set_sheet
from process_visualizer.gui.views.playback.rate_box import RateBox

_ICON = QSize(18, 18)


class ReplayBar(QWidget):
    """To be seen only while the past is shown, or is about to be."""

    def __init__(self, replay: ReplayModel, now_s: Callable[[], float],
                 parent: Optional[QWidget] = None) -> None:
        """``now_s`` is the clock of the recorder."""
        super().__init__(parent)
        self._replay, self._now_s = replay, now_s
        self._since_s: Optional[float] = None
        playback = replay.playback
        self.state = QLabel()
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
        """Show how long ago it is what is seen."""
        replay = self._replay
        is_shown = replay.phase is ReplayPhase.SHOWN
        if replay.phase is not ReplayPhase.PREPARING:
            self._since_s = None
        elif self._since_s is None:
            self._since_s = self._now_s()
        self.setVisible(not replay.is_live)
        for widget in (*self._moving, self.rate):
            widget.setEnabled(is_shown)
        self.play.setIcon(icon('pause' if replay.playback.is_playing else 'play'))
        self.rate.show_rate(replay.playback.rate)
        self.state.setText(f'REPLAY  {self._now_s() - replay.time_s:.1f} s ago' if is_shown
                           else self._preparing())

    def _preparing(self) -> str:
        taken_s = int(self._now_s() - (self._since_s or self._now_s()))
        return f'Preparing the replay… {taken_s} s' if taken_s else 'Preparing the replay…'

    def _button(self, name: str, hint: str, action: Callable[[], object]) -> QToolButton:
        button = QToolButton()
        button.setObjectName(f'replay_{name}')
        button.setIcon(icon(name))
        button.setIconSize(_ICON)
        button.setToolTip(hint)
        button.setAccessibleName(hint.split('  (')[0])
        button.setAutoRaise(True)
        button.setFocusPolicy(Qt.TabFocus)
        button.clicked.connect(lambda: action())
        return button
