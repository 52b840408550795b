# SPDX-License-Identifier: BSD-3-Clause
"""LauncherApp: the operator's window, with its questions, its theme, and files dropped on it."""
from __future__ import annotations

import os
from enum import Enum
from pathlib import Path
from typing import Callable, NamedTuple, Optional, Sequence, Set, Tuple

from PyQt5.QtCore import QEvent, QObject, pyqtSignal
from PyQt5.QtGui import QCloseEvent, QDropEvent, QGuiApplication
from PyQt5.QtWidgets import (
    QActionGroup,
    QApplication,
    QFileDialog,
    QHBoxLayout,
    QInputDialog,
    QMainWindow,
    QMenu,
    QMessageBox,
    QSizePolicy,
    QStackedWidget,
    QToolButton,
    QVBoxLayout,
    QWidget,
)
from rosgraph.network import get_local_addresses

from process_visualizer.cell.errors import Problem
from process_visualizer.cell.model import Mode
from process_visualizer.gui.app.launcher import Launcher
from process_visualizer.gui.app.look_on import ServeDialog, WatchDialog
from process_visualizer.gui.app.quitting import Quitting
from process_visualizer.gui.app.settings import Settings
from process_visualizer.gui.app.shortcuts import WindowKeys
from process_visualizer.gui.cell.alarm_strip import AlarmStrip
from process_visualizer.gui.cell.calibration_panel import (
    CalibrationPanel,
    ExpectedPanel,
    RegionPanel,
)
from process_visualizer.gui.cell.devices_panel import DevicesPanel, LogView, WarningsView
from process_visualizer.gui.cell.launch_model import LaunchPhase
from process_visualizer.gui.cell.launch_view import LaunchView
from process_visualizer.gui.cell.notices import (
    ChangedNotice,
    LostMasterNotice,
    MadeNotice,
    MixtureNotice,
    NewConfigurationView,
    ToolNotice,
    UnsavedNotice,
)
from process_visualizer.gui.compare.compare_panel import ComparePanel
from process_visualizer.gui.live.live_panel import LivePanel
from process_visualizer.gui.playback.playback_panel import PlaybackPanel
from process_visualizer.gui.recording.recording_panel import RecordingPanel
from process_visualizer.gui.recording.recording_types import RecordingPhase
from process_visualizer.gui.toolkit.desktop import open_in_editor, working_folder
from process_visualizer.gui.toolkit.dialogs import (
    ask,
    message_box,
    set_growing_text,
    show_aside,
)
from process_visualizer.gui.toolkit.labels import listing, parted, plain_label, plain_tip, sentence
from process_visualizer.gui.toolkit.scrolling import Column, ColumnOf, ColumnScroll, NoticePlace
from process_visualizer.gui.toolkit.theme import DARK, LIGHT, DesktopTheme, apply_theme, color
from process_visualizer.gui.toolkit.widgets import MessageBar, PanelTabs, title, tool_button
from process_visualizer.health.alarm_board import Action, Condition

_BRIEF_MS = 15_000


class WindowQuestions(QObject):
    """The messages and questions of a window."""

    def __init__(self, window: QMainWindow, launcher: Launcher) -> None:
        super().__init__(window)
        self._window = window
        self._launcher = launcher
        self._message: Optional[QMessageBox] = None
        self._mixture: Optional[QMessageBox] = None
        self._lost: Optional[QMessageBox] = None
        self._refused: Set[str] = set()  # messages about recordings that did not start
        launcher.recording.failed.connect(self._note_refusal)
        launcher.recording.changed.connect(self._drop_refusals)

    def _note_refusal(self, message: str) -> None:
        if self._launcher.recording.state.refused_options is not None:
            self._refused.add(parted(sentence(message))[0])

    def _drop_refusals(self) -> None:
        """Close the message once a recording has started, if it says only why one did not."""
        if self._refused and self._launcher.recording.phase is RecordingPhase.RECORDING:
            if self._message is not None and self._refused.issuperset(
                    self._message.text().split('\n\n')):
                self._message.close()
            self._refused.clear()

    def show_message(self, message: str) -> None:
        """Show a message; further ones are added to it while it is open."""
        message, details = parted(sentence(message))
        if self._message is None:
            self._message = message_box(self._window, message)
            self._message.setDetailedText(details)
            self._message.finished.connect(self._forget_message)
            show_aside(self._message)
        elif message not in self._message.text():
            set_growing_text(self._message, f'{self._message.text()}\n\n{message}')
        self.show_briefly(message)

    def show_briefly(self, message: str) -> None:
        """Show a message in the status bar, for long enough to be read."""
        bar = self._window.statusBar()
        assert bar is not None
        bar.showMessage(sentence(message), _BRIEF_MS)

    def show_whole(self, message: str) -> None:
        """Show the whole text of a message that is cut in the status bar."""
        message_box(self._window, message, QMessageBox.Information).open()

    def ask_about_lost_master(self, start_again: Callable[[], None]) -> None:
        """Offer to start the program again; the question closes when its text is outdated."""
        if self._lost is not None:
            return
        launcher, problem = self._launcher, self._launcher.master.problem
        unsaved = launcher.unsaved.unsaved
        stays = f' Not saved, but offered again then: {listing(unsaved)}.' if unsaved else ''
        if launcher.launch.is_idle:
            text, yes = 'Nothing can be launched until the launcher starts again. Start it ' \
                'again?', 'Start again'
        else:
            nodes = 'It does not know the running nodes: they' if launcher.master.is_other \
                else 'Running nodes'
            text, yes = f'{nodes} continue, but nothing can be launched, and they do not follow ' \
                'every command. Quit all nodes (this finishes a recording) and start the ' \
                'launcher again? Then you can launch them again.', 'Quit and start again'
        self._lost = ask(self._window, f'{problem}. {text}{stays}', yes, start_again)
        self._lost.setDefaultButton(QMessageBox.Cancel)
        self._lost.finished.connect(self._forget_lost)
        for outdated in (launcher.master.returned, launcher.master.lost, launcher.launch.stopped):
            outdated.connect(self._lost.close)

    def ask_about_mixture(self, who: str, mode: Mode) -> None:
        """Ask about nodes that prevent a launch; the question closes when they are gone."""
        what, first = (('playback', ', paused') if mode is Mode.PLAYBACK
                       else ('real-time mode', ''))
        text = (f'{who}.\n\nStop that node: {what} starts by itself as soon as it is gone. '
                f'Or start anyway{first}.')
        if self._mixture is not None:
            self._mixture.setText(text)
            return
        guard = self._launcher.guard
        question = ask(self._window, text, 'Start anyway', guard.launch_all_the_same,
                       guard.cancel)
        question.setDefaultButton(QMessageBox.Cancel)
        guard.settled.connect(question.close)
        question.finished.connect(self._forget_mixture)
        self._mixture = question

    def _forget_message(self) -> None:
        self._message = None

    def _forget_lost(self) -> None:
        self._lost = None

    def _forget_mixture(self) -> None:
        self._mixture = None


_SETTING = 'theme'


class Wanted(Enum):
    """A theme, or that of the desktop."""

    DESKTOP = 'Follow desktop'
    LIGHT = 'Light'
    DARK = 'Dark'


def theme_choice(settings: Settings, parent: QObject) -> ThemeChoice:
    """Return the choice for the running application."""
    app = QApplication.instance()
    assert isinstance(app, QApplication)
    desktop = app.findChild(DesktopTheme) or DesktopTheme(app.palette(), parent=app)
    return ThemeChoice(app, desktop, settings, parent)


class ThemeChoice(QObject):
    """Gives the application the chosen theme, and remembers the choice."""

    def __init__(self, app: QApplication, desktop: DesktopTheme, settings: Settings,
                 parent: Optional[QObject] = None) -> None:
        super().__init__(parent)
        self._app, self._desktop, self._settings = app, desktop, settings
        names = {wanted.name: wanted for wanted in Wanted}
        self.wanted = names.get(settings.value(_SETTING, ''), Wanted.DESKTOP)
        desktop.changed.connect(self._apply)
        self._apply()

    def choose(self, wanted: Wanted) -> None:
        """Choose another theme."""
        self.wanted = wanted
        self._settings.store(_SETTING, wanted.name)
        self._apply()

    def button(self) -> QToolButton:
        """Return a button with a menu of the choices."""
        button = tool_button('theme', 'theme', 'Light or dark', lambda: None)
        menu = QMenu(button)
        group = QActionGroup(menu)
        for wanted in Wanted:
            action = menu.addAction(wanted.value)
            action.setCheckable(True)
            action.setChecked(wanted is self.wanted)
            action.setActionGroup(group)
            action.triggered.connect(lambda _, wanted=wanted: self.choose(wanted))
        button.setMenu(menu)
        button.setPopupMode(QToolButton.InstantPopup)
        button.setStyleSheet('QToolButton::menu-indicator { image: none; }')
        return button

    def _apply(self) -> None:
        is_dark = self._desktop.is_dark if self.wanted is Wanted.DESKTOP \
            else self.wanted is Wanted.DARK
        apply_theme(self._app, DARK if is_dark else LIGHT)


_MARGIN = 10
_MIN_DEVICES_PX, _DEVICES_SHARE_OF_SCREEN = 160, 0.17
"""The height of the devices does not depend on the window's: the buttons below them do not move
when its size changes."""


class LauncherApp(QMainWindow):
    """Devices, mode, status, launch button, and below them the panel of the mode.

    Closing the window quits all nodes first. ``restarts`` says that the program then starts again.
    """

    def __init__(self, launcher: Launcher, settings: Settings,
                 parent: Optional[QWidget] = None) -> None:
        super().__init__(parent)
        self._launcher = launcher
        self._theme = theme_choice(settings, self)
        self.restarts = False
        self._is_closed = False
        self._questions = WindowQuestions(self, launcher)
        self._quitting = Quitting(self, launcher)
        self.setWindowTitle('Process Visualizer')
        self.file = plain_label()
        self.alarms = AlarmStrip(launcher.alarms)
        self._devices_panel = DevicesPanel()
        self.devices = self._devices_panel.devices
        self.problems = self._devices_panel.problems
        self.new = NewConfigurationView(launcher.new, lambda: launcher.cell.path, self)
        self.made = MadeNotice(launcher.new)
        self.launch = LaunchView()
        self.mixture = MixtureNotice(launcher.mixture)
        self.lost = LostMasterNotice(launcher.master)
        self.tool = ToolNotice(launcher.tool)
        self.recording = RecordingPanel(launcher.recording)
        self.playback = PlaybackPanel(launcher.playback, launcher.bag, launcher.values,
                                      launcher.bands)
        self.live = LivePanel(launcher.live, launcher.bag.curves.choices, launcher.replay,
                              launcher.live_comparison, launcher.replayed_values)
        self.expected = ExpectedPanel(launcher.expected)
        self.calibration = ColumnScroll(_stacked(
            CalibrationPanel(launcher.calibration, launcher.calibrating.fit),
            RegionPanel(launcher.region), self.expected))
        self.compare = ComparePanel(launcher.compare, launcher.ghost, launcher.live_comparison,
                                    lambda: launcher.recording.choices.folder)
        self._drops = DropTarget(self, launcher)
        self._lay_out()
        self._keys = WindowKeys(self, launcher, self.launch.press, self.recording.bar.press,
                                self._mark_playback, self.playback.timeline.zoom_in,
                                self.playback.bag.choose_files)
        self._serve = ServeDialog(
            self, [it for it in get_local_addresses() if not it.startswith('127.')],
            lambda: (launcher.session.file, launcher.cell.arguments))
        self._connect()
        self._show_cell()
        self._show_launch()
        self._show_views()

    def focusNextPrevChild(self, is_next: bool) -> bool:
        """See Qt; when a button is disabled, its keyboard focus goes nowhere.

        Otherwise Qt would give it to the next button, such as one that acknowledges an alarm.
        """
        focused = self.focusWidget()
        return (focused is None or focused.isEnabled()) and super().focusNextPrevChild(is_next)

    # Layout

    def _lay_out(self) -> None:
        self._mode_panels = QStackedWidget()
        self._mode_panels.addWidget(self.recording)
        self._playback_page = ColumnScroll(ColumnOf(self.playback))
        self._mode_panels.addWidget(self._playback_page)
        self.panels = PanelTabs()
        self.panels.addTab(self._mode_panels, 'Recording')
        self.panels.addTab(self.calibration, 'Calibration')
        self.panels.addTab(ColumnScroll(ColumnOf(self.compare)), 'Compare')
        body = Column()
        layout = QVBoxLayout(body)
        layout.setContentsMargins(_MARGIN, _MARGIN, _MARGIN, _MARGIN)
        layout.addWidget(self.alarms)
        layout.addWidget(self._devices_group())
        layout.addWidget(self.launch)
        layout.addWidget(self.panels, 1)
        for notice in (self.tool, self.mixture, self.lost):
            self.launch.show_above_status(notice)
        self.setCentralWidget(ColumnScroll(body))
        bar = MessageBar()
        bar.whole_wanted.connect(self._questions.show_whole)
        self.setStatusBar(bar)

    def _devices_group(self) -> QWidget:
        group = QWidget()
        room_px = QGuiApplication.primaryScreen().availableGeometry().height()
        group.setFixedHeight(max(_MIN_DEVICES_PX, round(_DEVICES_SHARE_OF_SCREEN * room_px)))
        layout = QVBoxLayout(group)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(4)
        row = QHBoxLayout()
        row.addWidget(title('Devices'))
        row.addSpacing(6)
        self.file.setObjectName('configuration')
        color(self.file, 'quiet')
        row.addWidget(self.file, 1)
        for symbol, name, hint, action in (
                ('restart', 'restart_device', 'Restart the selected device',
                 self._restart_selected),
                ('open', 'open_configuration', 'Open another configuration', self._open),
                ('view', 'watch_cell', 'Watch a cell that runs on another computer…',
                 lambda: WatchDialog(self).show()),
                ('browsers', 'serve_cell', 'Show the running cell in browsers…',
                 lambda: self._serve.show()),
                ('reload', 'reload_configuration', 'Read the configuration again (F5)',
                 self._launcher.cell.reload),
                ('help', 'show_keys', 'Keys (?)', lambda: self._keys.show())):
            row.addWidget(tool_button(name, symbol, hint, action))
        row.insertWidget(row.count() - 2, self.new.button)
        row.insertWidget(row.count() - 1, self._theme.button())
        layout.addLayout(row)
        layout.addWidget(self._devices_panel, 1)
        layout.addWidget(NoticePlace(  # below, so that the rows of devices stay where they are
            self.new, self.made, UnsavedNotice(self._launcher.unsaved),
            ChangedNotice(self._launcher.cell)))
        return group

    # Connections

    def _connect(self) -> None:
        self._connect_cell()
        self._connect_master()
        self._connect_devices()
        self._connect_launch()
        self._connect_recordings()

    def _connect_cell(self) -> None:
        cell = self._launcher.cell
        cell.changed.connect(self._show_cell)
        cell.changed.connect(self._show_launch)
        cell.loaded.connect(self._show_devices)
        self.new.open_wanted.connect(self._open)
        self.made.open_wanted.connect(self._open_in_editor)
        self.problems.open_wanted.connect(self._open_in_editor)
        self._drops.configuration_wanted.connect(self._open_file)

    def _connect_master(self) -> None:
        launcher, master = self._launcher, self._launcher.master
        for signal in (master.connected, master.failed, master.lost, master.returned):
            signal.connect(self._show_launch)
        master.lost.connect(lambda: self._questions.show_briefly(master.problem))
        self.lost.remedy_wanted.connect(self._ask_about_lost_master)
        master.returned.connect(
            lambda: self._questions.show_briefly('The ROS master responds again'))
        launcher.noted.connect(self.tell)
        launcher.guard.asked.connect(self._questions.ask_about_mixture)
        for refused in (launcher.failed, self._drops.refused):
            refused.connect(self._questions.show_message)

    def _connect_devices(self) -> None:
        launcher = self._launcher
        launcher.states.changed.connect(self._show_states)
        self.devices.ticked.connect(launcher.cell.tick)
        self.devices.restart_wanted.connect(launcher.launch.restart)
        self.alarms.action_wanted.connect(self._act_on_alarm)
        self.devices.log_wanted.connect(self._show_log)
        self.devices.warnings_wanted.connect(
            lambda device: WarningsView(device, launcher.states, self).show())
        launcher.expected.changed.connect(lambda: self.devices.set_seen(launcher.expected.seen))
        launcher.expected.noted.connect(self.tell)
        self.devices.expect_wanted.connect(self.expected.ask_about)

    def _connect_launch(self) -> None:
        launcher = self._launcher
        launcher.launch.changed.connect(self._show_launch)
        launcher.launch.problems_found.connect(self._show_refusal)
        launcher.status_changed.connect(self._show_status)
        launcher.view.changed.connect(self._show_views)
        self.launch.mode_chosen.connect(launcher.choose_mode)
        self.launch.launch_wanted.connect(self._start)
        self.launch.quit_wanted.connect(self._quitting.quit)
        self._quitting.grace.changed.connect(self._show_launch)
        self.launch.apply_wanted.connect(launcher.apply)
        self.launch.rviz.restart_wanted.connect(launcher.view.restart)
        self.launch.rviz.save_wanted.connect(self._save_view)
        self.launch.rviz.chosen.connect(launcher.view.choose)

    def _connect_recordings(self) -> None:
        bag = self._launcher.bag
        bag.played.changed.connect(self._show_launch)
        bag.changed.connect(self._show_launch)
        bag.noted.connect(self.tell)
        self._launcher.recording.finished.connect(bag.add_recent)
        self._launcher.recording.changed.connect(self._show_possible_changes)
        self.compare.seek_wanted.connect(self._launcher.playback.seek)
        self.compare.refused.connect(self.tell)
        self._launcher.compare.changed.connect(
            lambda: self.playback.timeline.set_moments(self._launcher.compare.moments))
        self.playback.timeline.anchor_wanted.connect(self._launcher.compare.anchor)
        self._launcher.objects.model.changed.connect(self._show_near)
        self.live.replay_wanted.connect(self._launcher.show_replay)
        self.playback.bag.configuration_wanted.connect(self.new.ask_path)
        self.recording.play_wanted.connect(lambda path: self._quitting.play((path,)))
        self._drops.play_wanted.connect(self._quitting.play)
        self._quitting.close_wanted.connect(self._close_now)

    # Display

    def _show_devices(self, _valid: bool) -> None:
        self.devices.set_devices(self._launcher.session.devices, self._launcher.cell.is_ticked)
        self._show_states()

    def _show_cell(self) -> None:
        cell = self._launcher.cell
        self.file.setText(Path(cell.path).name if cell.path else '')
        self.file.setToolTip(plain_tip(cell.path))
        self.made.follow(cell.path)
        self._launcher.bag.curves.choices.set_configuration(cell.path)
        self.devices.set_ticks(cell.is_ticked)
        self._devices_panel.show_problems(cell.problems, cell.in_force)
        mode = self._launcher.session.mode
        is_playback = mode is Mode.PLAYBACK
        self.launch.show_mode(mode)
        self.compare.set_live(not is_playback)
        self._mode_panels.setCurrentWidget(
            self._playback_page if is_playback else self.recording)
        self.panels.setTabText(0, 'Playback' if is_playback else 'Recording')

    def _show_refusal(self, problems: Sequence[Problem]) -> None:
        self._devices_panel.show_problems(
            problems, 'This cannot be launched here. Fix the problem or untick the device.')

    def _show_launch(self) -> None:
        launcher = self._launcher
        reason = launcher.blocked_reason()
        can_launch = reason == '' or launcher.master.is_lost  # then the button offers a remedy
        self.launch.show_phase(launcher.launch.phase, can_launch, reason,
                               self._quitting.grace.left_s)
        self._show_possible_changes()
        self.launch.rviz.show_rviz(launcher.view.is_rviz_alive)
        self._keys.enable()
        self._show_status()

    def _show_possible_changes(self) -> None:
        launcher, launch = self._launcher, self._launcher.launch
        obstacle = '' if launch.is_idle else launcher.lost_master()
        is_recording, pending = launcher.recording.is_recording, launcher.pending()
        if is_recording:
            obstacle = 'Stop the recording before you change the mode'
        self.launch.show_mode_choice(launch.is_idle or launch.is_running, obstacle)
        self.launch.show_changes(
            f'Apply: {pending}' if pending else '', pending,
            f'Stop the recording first, then apply: {pending}' if is_recording else '')

    def _show_states(self) -> None:
        for device in self._launcher.session.devices:
            self.devices.set_state(device.name, self._launcher.states.state(device))

    def _show_status(self) -> None:
        self.launch.show_status(self._launcher.status())

    def _show_views(self) -> None:
        self.launch.rviz.show_views(self._launcher.view.names, self._launcher.view.chosen)

    def _show_near(self) -> None:
        objects = self._launcher.objects.model
        self.live.set_near(objects.live)
        self.playback.set_near(objects.played)

    def _act_on_alarm(self, action: Action, condition: Condition) -> None:
        launcher = self._launcher
        if action is Action.SHOW_LOG:
            self._show_log(condition.part, condition.node)
        elif action is Action.RESTART_RVIZ:
            launcher.view.restart()
        elif action is Action.GO_THERE:
            launcher.playback.seek(condition.position_s or 0.0)
        elif action is Action.ACKNOWLEDGE:
            launcher.alarms.acknowledge(condition)
        elif action is Action.REPLAY:
            launcher.replay.leave_for(condition.since_s or 0.0)
            launcher.live.hold(True)  # until the replay is left
            launcher.show_replay(condition.since_s or 0.0)
        else:
            launcher.launch.restart(condition.part)

    def _show_log(self, device: str, node: str) -> None:
        report = self._launcher.launch.reports.get(device)
        if report is not None:
            LogView.show_node(self, report, node)

    # Actions

    def _start(self) -> None:
        """Launch, or offer what must be done first."""
        self._ask_about_lost_master()
        self._launcher.start()

    def _ask_about_lost_master(self) -> None:
        if self._launcher.master.is_lost and not self._is_closed:
            self._questions.ask_about_lost_master(self._restart_program)

    def _open(self) -> None:
        is_own = self.new.isHidden()  # else the example is open
        folder = str(Path(self._launcher.cell.path).parent) if is_own else working_folder()
        path, _ = QFileDialog.getOpenFileName(
            self, 'Open a configuration', folder, 'Configurations (*.xml)')
        if path:
            self._open_file(path)

    def _open_file(self, path: str) -> None:
        self.new.hide()
        self._launcher.cell.open(path)

    def _open_in_editor(self, file: str, line: int) -> None:
        self._launcher.tasks.run('editor', lambda: open_in_editor(file, line), None,
                                 lambda error: self._questions.show_message(str(error)))

    def _restart_selected(self) -> None:
        name = self.devices.selected_device()
        if name and self._launcher.launch.phase is LaunchPhase.RUNNING:
            self._launcher.launch.restart(name)

    def _mark_playback(self) -> None:
        if self._launcher.playback.state.is_available:
            self.playback.ask_for_mark(self._launcher.playback.position_s)

    def _save_view(self) -> None:
        """Ask for the name under which RViz's view is saved for these devices."""
        dialog = QInputDialog(self)
        dialog.setObjectName('view_name')
        dialog.setWindowTitle('Save this view')
        dialog.setLabelText('Name of the view:')
        dialog.setTextValue(self._launcher.view.chosen or '')
        dialog.textValueSelected.connect(self._launcher.view.save)
        dialog.open()

    def tell(self, message: str) -> None:
        """Show a message in the status bar for a while."""
        self._questions.show_briefly(message)

    # Closing

    def closeEvent(self, event: QCloseEvent) -> None:
        """Quit everything first, without freezing; the window closes when that is done."""
        if not self._is_closed:
            self._quitting.ask_to_leave()  # if nothing runs, the window is closed at once
        if self._is_closed:
            self._serve.end()
            for watching in self.findChildren(WatchDialog):
                watching.end()
        event.setAccepted(self._is_closed)

    def leave(self) -> None:
        """Quit all nodes (the recorder finishes its bag), then close, without a question."""
        self._quitting.leave()

    def _restart_program(self) -> None:
        self.restarts = True
        self.leave()

    def _close_now(self) -> None:
        self._is_closed = True
        self.close()


def _stacked(*widgets: QWidget) -> Column:
    column = Column()
    layout = QVBoxLayout(column)
    layout.setContentsMargins(0, 0, 0, 0)
    for widget in widgets:
        widget.setSizePolicy(QSizePolicy.Preferred, QSizePolicy.Maximum)
        layout.addWidget(widget)
    layout.addStretch(1)
    return column


_BAGS = ('.bag', '.bag.active')
_WHAT = 'Drop a recording (all .bag files of a split one), or one configuration (.xml).'


class Dropped(NamedTuple):
    """The files of a recording, or a configuration, or why nothing can be done with them."""

    bags: Tuple[str, ...] = ()
    configuration: str = ''
    refusal: str = ''


def sort_out(paths: Sequence[str]) -> Dropped:
    """Sort dropped paths by kind; '' means anything that is not a local file."""
    names = [path.lower() for path in paths]
    if paths and all(name.endswith(_BAGS) for name in names):
        return Dropped(bags=tuple(paths))
    if len(paths) == 1 and names[0].endswith('.xml'):
        return Dropped(configuration=paths[0])
    strange = next((os.path.basename(path) for path in paths
                    if path and not path.lower().endswith((*_BAGS, '.xml'))), '')
    return Dropped(refusal=f'{strange} cannot be opened here. {_WHAT}' if strange else _WHAT)


class DropTarget(QObject):
    """Lets a window accept files dropped anywhere on it, except during a recording."""

    play_wanted = pyqtSignal(object)
    """The operator wants to quit the running nodes, and to play a recording (its paths)."""
    configuration_wanted = pyqtSignal(str)
    refused = pyqtSignal(str)

    def __init__(self, window: QWidget, launcher: Launcher) -> None:
        super().__init__(window)
        self._window, self._launcher = window, launcher
        window.setAcceptDrops(True)
        window.installEventFilter(self)

    def eventFilter(self, window: Optional[QObject], event: Optional[QEvent]) -> bool:
        """Accept files; leave all other events to the window."""
        if not isinstance(event, QDropEvent) or not event.mimeData().hasUrls():
            return super().eventFilter(window, event)
        event.acceptProposedAction()
        if event.type() == QEvent.Drop:
            self._take(sort_out([url.toLocalFile() for url in event.mimeData().urls()]))
        return True

    def _take(self, dropped: Dropped) -> None:
        if dropped.refusal:
            self.refused.emit(dropped.refusal)
        elif self._launcher.recording.is_recording:
            self.refused.emit('A recording is in progress: stop it before you open another file.')
        elif dropped.configuration:
            self.configuration_wanted.emit(dropped.configuration)
        else:
            self._open(dropped.bags)

    def _open(self, bags: Tuple[str, ...]) -> None:
        """Open a recording in playback mode, after a question if nodes run in real-time mode."""
        session = self._launcher.session
        if self._launcher.launch.is_idle or session.mode is Mode.PLAYBACK:
            self._launcher.bag.open(bags)
            session.set_mode(Mode.PLAYBACK)
        else:
            ask(self._window, f'Leave real-time mode, and play {os.path.basename(bags[0])}?',
                'Play', lambda: self.play_wanted.emit(bags))
