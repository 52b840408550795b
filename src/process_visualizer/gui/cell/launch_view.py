# SPDX-License-Identifier: BSD-3-Clause
"""Mode, status, and the button that launches and quits all nodes."""
from __future__ import annotations

from typing import Optional, Tuple

from PyQt5.QtCore import Qt, pyqtSignal
from PyQt5.QtGui import QCursor, QGuiApplication
from PyQt5.QtWidgets import (
    QActionGroup,
    QButtonGroup,
    QGridLayout,
    QHBoxLayout,
    QMenu,
    QPushButton,
    QRadioButton,
    QToolButton,
    QToolTip,
    QWidget,
)

from process_visualizer.cell.model import Mode
from process_visualizer.gui.cell.launch_model import LaunchPhase
from process_visualizer.gui.toolkit.icons import icon
from process_visualizer.gui.toolkit.labels import plain_tip
from process_visualizer.gui.toolkit.scrolling import TextPlace
from process_visualizer.gui.toolkit.theme import set_primary
from process_visualizer.gui.toolkit.widgets import (
    ElidedButton,
    MeaningGuard,
    WrappedLabel,
    title,
)


class RvizMenu(QMenu):
    """The menu of RViz: one that has died can be restarted, but has no view to be saved."""

    restart_wanted = pyqtSignal()
    save_wanted = pyqtSignal()
    chosen = pyqtSignal(object)
    """The name of a saved view, or None for the default one."""

    def __init__(self, parent: Optional[QWidget] = None) -> None:
        super().__init__(parent)
        self.setObjectName('rviz_menu')
        self.setToolTipsVisible(True)
        self._restart = self.addAction('Restart RViz', self.restart_wanted.emit)
        self._save = self.addAction('Save this view as…', self.save_wanted.emit)
        self.addSection('View at next launch')
        self._views = QActionGroup(self)
        self.show_rviz(True)

    def show_rviz(self, is_alive: bool) -> None:
        """Offer what is possible while RViz runs, or after it has died."""
        self._restart.setToolTip('Restarts with the current view' if is_alive
                                 else 'Restarts with the view of the launch')
        self._save.setEnabled(is_alive)
        self._save.setToolTip('' if is_alive else 'RViz is not running: restart it first')

    def show_views(self, names: Tuple[str, ...], chosen: Optional[str]) -> None:
        """Offer the saved views of the ticked devices."""
        for action in self._views.actions():
            self._views.removeAction(action)
            self.removeAction(action)
            action.deleteLater()
        for name in (None, *names):
            action = self._views.addAction(name or 'default')
            action.setCheckable(True)
            action.setChecked(name == chosen)
            action.triggered.connect(lambda _checked, it=name: self.chosen.emit(it))
        self.addActions(self._views.actions())


_LAUNCH_TEXT = {LaunchPhase.IDLE: 'Launch nodes', LaunchPhase.LAUNCHING: 'Quit all nodes',
                LaunchPhase.RUNNING: 'Quit all nodes', LaunchPhase.QUITTING: 'Quitting…'}
_TALL_PX = 1025


def status_lines(screen_px: int) -> int:
    """Return the number of lines of the status; on a tall screen, a notice of four lines fits."""
    return 5 if screen_px >= _TALL_PX else 3


class LaunchView(QWidget):
    """The part below the list of devices in the thesis' window."""

    mode_chosen = pyqtSignal(object)
    launch_wanted = pyqtSignal()
    quit_wanted = pyqtSignal()
    apply_wanted = pyqtSignal()

    def __init__(self, parent: Optional[QWidget] = None) -> None:
        super().__init__(parent)
        self._phase = LaunchPhase.IDLE
        self._modes = QButtonGroup(self)
        self.realtime = self._mode_button('Real-time', 'realtime', Mode.REALTIME)
        self.playback = self._mode_button('Playback', 'playback', Mode.PLAYBACK)
        self.status = WrappedLabel('status')
        self._texts = TextPlace(status_lines(
            QGuiApplication.primaryScreen().availableGeometry().height()), self.status)
        self.launch = QPushButton('Launch nodes')
        self.launch.setObjectName('launch')
        self.launch.setMinimumHeight(34)
        self.launch.clicked.connect(self._on_launch)
        self._meaning = MeaningGuard(self.launch)
        self.apply = ElidedButton('Apply')
        self.apply.setObjectName('apply')
        self.apply.clicked.connect(self.apply_wanted)
        self.view = QToolButton()
        self.view.setObjectName('view')
        self.view.setIcon(icon('view'))
        self.view.setMinimumHeight(34)
        self.view.setAccessibleName('RViz')
        self.view.setToolTip('RViz: restart it, save or choose a view')
        self.view.setPopupMode(QToolButton.InstantPopup)
        self.rviz = RvizMenu(self.view)
        self.view.setMenu(self.rviz)
        self._lay_out()

    def press(self) -> None:
        """Launch or quit for a key, unless that had the other meaning just before."""
        if not self._meaning.is_ignoring:
            self.launch.click()

    def show_mode(self, mode: Mode) -> None:
        """Check the button of a mode."""
        (self.realtime if mode is Mode.REALTIME else self.playback).setChecked(True)

    def show_status(self, text: str) -> None:
        """Show the activity of the system."""
        if text == self.status.text():
            return
        is_tip_shown = self.status.underMouse() and QToolTip.isVisible()
        self.status.setText(text)
        self.status.setToolTip(plain_tip(text))
        if is_tip_shown:  # Qt would leave the old one
            QToolTip.showText(QCursor.pos(), plain_tip(text), self.status)

    def show_above_status(self, notice: QWidget) -> None:
        """Give a notice, which may be hidden, its place above the status."""
        self._texts.put_first(notice)

    def show_phase(self, phase: LaunchPhase, can_launch: bool, reason: str,
                   left_s: int = 0) -> None:
        """Enable what can be done.

        ``reason`` says why nothing can be launched. ``left_s`` is the number of seconds for which
        the command to quit all nodes can be taken back; 0 if they are not about to be quit.
        """
        self._phase = phase
        self.launch.setText(f'Keep running (quits in {left_s} s)' if left_s
                            else _LAUNCH_TEXT[phase])
        self._meaning.show('keep' if left_s else '' if phase is LaunchPhase.QUITTING
                           else 'launch' if phase is LaunchPhase.IDLE else 'quit')
        self.launch.setEnabled(phase is not LaunchPhase.QUITTING
                               and (phase is not LaunchPhase.IDLE or can_launch))
        self.launch.setToolTip(plain_tip('Do not quit after all' if left_s else reason or 'Ctrl+L'))
        set_primary(self.launch, phase is LaunchPhase.IDLE)
        self.view.setEnabled(phase is LaunchPhase.RUNNING)

    def show_mode_choice(self, is_settled: bool, obstacle: str) -> None:
        """Let the mode be chosen, except while nodes are launched or quit, or with an obstacle."""
        for button in self._modes.buttons():
            button.setEnabled(is_settled and not obstacle)
            button.setToolTip(plain_tip(
                obstacle or 'The same devices, view and place, in another mode'))

    def show_changes(self, text: str, hint: str, obstacle: str = '') -> None:
        """Offer to apply the present ticks and configuration; an empty text offers nothing.

        An ``obstacle`` says why it cannot be done now.
        """
        self.apply.setEnabled(bool(text) and not obstacle)
        self.apply.setText(text or 'Apply')
        self.apply.setToolTip(plain_tip(
            (text and obstacle) or hint or 'Bring the running nodes up to date with the ticks'))

    def _mode_button(self, text: str, name: str, mode: Mode) -> QRadioButton:
        button = QRadioButton(text)
        button.setObjectName(name)
        button.clicked.connect(lambda: self.mode_chosen.emit(mode))
        self._modes.addButton(button)
        return button

    def _on_launch(self) -> None:
        (self.launch_wanted if self._phase is LaunchPhase.IDLE else self.quit_wanted).emit()

    def _lay_out(self) -> None:
        modes = QHBoxLayout()
        modes.setSpacing(16)
        for button in self._modes.buttons():
            modes.addWidget(button)
        modes.addStretch()
        buttons = QHBoxLayout()
        buttons.addWidget(self.launch, 1)
        buttons.addWidget(self.view)
        layout = QGridLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setHorizontalSpacing(12)
        layout.setColumnStretch(1, 1)
        layout.addWidget(title('Mode'), 0, 0)
        layout.addLayout(modes, 0, 1)
        layout.addWidget(title('Status'), 1, 0, Qt.AlignTop)
        layout.addWidget(self._texts, 1, 1)
        layout.addWidget(self.apply, 2, 0, 1, 2)
        layout.addLayout(buttons, 3, 0, 1, 2)
