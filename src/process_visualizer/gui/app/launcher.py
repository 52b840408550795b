# SPDX-License-Identifier: BSD-3-Clause
"""Creates and connects all models of the window; decides the status line, and what can launch."""
from __future__ import annotations

import os
import sys
from dataclasses import replace
from typing import Any, Callable, Dict, Mapping, Optional, Sequence, Set

from PyQt5.QtCore import QObject, pyqtSignal

from process_visualizer.bagio.bag_errors import BagError
from process_visualizer.cell.errors import ConfigurationError
from process_visualizer.cell.model import Device, Mode
from process_visualizer.clients.bag_recorder import RecorderError, RecorderUnreachable
from process_visualizer.clients.ghost_client import follow_ghost, show_ghost
from process_visualizer.clients.player_client import PlayerError
from process_visualizer.generate.choice import Choice, RvizStart, Viewers
from process_visualizer.generate.plan import BAG_PART, PlanError
from process_visualizer.gui.app.calibration_actions import CalibrationActions, RegionActions
from process_visualizer.gui.app.event_notes import EventNotes, ObjectAlarms
from process_visualizer.gui.cell.alarms_model import AlarmsModel
from process_visualizer.gui.cell.calibration_model import ToolModel
from process_visualizer.gui.cell.cell_model import CellModel, NewConfigurationModel
from process_visualizer.gui.cell.device_states_model import DeviceStatesModel, WarningsModel
from process_visualizer.gui.cell.edited_values import UnsavedModel
from process_visualizer.gui.cell.expected_model import ExpectModel
from process_visualizer.gui.cell.launch_model import (
    LaunchGuard,
    LaunchModel,
    LaunchPhase,
    MixtureModel,
)
from process_visualizer.gui.cell.master_model import MasterModel, WatchModel
from process_visualizer.gui.cell.view_model import ViewModel
from process_visualizer.gui.compare.compare_model import BandsModel, CompareModel
from process_visualizer.gui.compare.ghost_model import GhostModel
from process_visualizer.gui.compare.live_comparison_model import LiveComparisonModel
from process_visualizer.gui.live.live_curves_model import LiveCurvesModel
from process_visualizer.gui.live.replay_model import ReplayModel, ReplayPhase
from process_visualizer.gui.playback.bag_model import BagModel, missing_of, placed_marks
from process_visualizer.gui.playback.playback_model import PlaybackModel
from process_visualizer.gui.playback.values_model import Played, ValuesModel
from process_visualizer.gui.recording.recording_choices import is_for_anybody
from process_visualizer.gui.recording.recording_model import RecordingModel
from process_visualizer.gui.recording.recording_state import NOT_RESPONDING
from process_visualizer.gui.recording.recording_types import RecordingPhase
from process_visualizer.gui.ros.replay_link import ReplayLinkError
from process_visualizer.gui.ros.ros_link import RosLink
from process_visualizer.gui.ros.snapshots import PlayerSnapshot
from process_visualizer.gui.session import Session
from process_visualizer.gui.toolkit.labels import within_sentence
from process_visualizer.gui.toolkit.tasks import Tasks
from process_visualizer.health.device_state import Level, Line
from process_visualizer.launching.ros_master import RosMasterError

# The status line, in the thesis' words (figures 5.2 to 5.4).

_MODE = {Mode.REALTIME: 'In real-time mode.', Mode.PLAYBACK: 'In playback mode.'}
_OTHER_CELL = 'The nodes are still those of {}: press Apply to launch those of {}.'
_SLOW = 'RViz draws slowly on this computer: its picture is up to {:.0f} s behind.'
_WAS_SLOW = 'RViz drew slowly a moment ago: its picture was up to {:.0f} s behind.'
_RECORDING = {RecordingPhase.STARTING: 'Waiting for the topics to record',
              RecordingPhase.RECORDING: 'Recording',
              RecordingPhase.STOPPING: 'Finishing the recording'}


def status_text(phase: LaunchPhase, mode: Optional[Mode], activity: str, trouble: Line,
                compared: str = '') -> str:
    """Return the activity of the system in lines, of which the last one may be long.

    ``mode`` is the mode of the nodes, ``trouble`` their worst state, ``compared`` the result of the
    comparison with a good run.
    """
    if phase is LaunchPhase.IDLE or mode is None:
        return 'Idle'
    if phase is LaunchPhase.LAUNCHING:
        return 'Launching nodes…'
    if phase is LaunchPhase.QUITTING:
        return 'Quitting all nodes…'
    worst = trouble.text if trouble.level >= Level.WAITING else ''
    text = ' '.join(filter(None, [_MODE[mode], activity]))
    return '\n'.join(filter(None, [text, compared, worst]))


def _takes_topics(link: RosLink, topics: Sequence[str]) -> bool:
    """Return whether the recorder has accepted other topics, so that no restart is needed.

    Raises:
        PlanError: it refuses, as a recording is in progress that a restart would end.
    """
    try:
        link.recorder.watch(topics)
    except RecorderUnreachable:
        return False
    except RecorderError as error:
        raise PlanError(f'Nothing was changed: {error}') from error
    return True


def recorder_activity(phase: RecordingPhase, is_silent: bool) -> str:
    """Return the activity of the recorder."""
    if is_silent:
        return NOT_RESPONDING
    return _RECORDING.get(phase, '')


def player_activity(player: Optional[PlayerSnapshot], is_silent: bool,
                    has_ended: bool = False) -> str:
    """Return the activity of the player; none if its process has ended, which counts as trouble."""
    if player is None or has_ended:
        return ''
    if is_silent:
        return 'The player is not responding'
    if player.paused:
        return 'Paused'
    direction = '' if player.rate > 0.0 else ' backwards'
    return f'Playing{direction} at {abs(player.rate):g}×'


_REPLAY_ERRORS = (RecorderError, ReplayLinkError, ConfigurationError, PlanError, RosMasterError,
                  BagError, OSError)

_SWITCH_INTERVAL_S = 0.0005
"""Maximum wait of the window for another computing thread [s]; Python's own 5 ms add up."""


class Launcher(QObject):
    """The program without its window."""

    failed = pyqtSignal(str)
    noted = pyqtSignal(str)
    """A command was refused, which needs no answer."""
    status_changed = pyqtSignal()

    def __init__(self, parent: Optional[QObject] = None) -> None:
        super().__init__(parent)
        self.viewers = Viewers()
        self.tasks = tasks = Tasks(self)
        self.link = link = RosLink(self)
        self.session = session = Session(self)
        self.master = MasterModel(tasks, link, self)
        self.calibrating = CalibrationActions(tasks, link, session, self)
        self.calibration = self.calibrating.model
        self.region = RegionActions(tasks, session, self).model
        self.unsaved = UnsavedModel({'the pose': self.calibration, 'the crop box': self.region},
                                    session, self)
        self.new = NewConfigurationModel(tasks, link.look_at_system, self)
        self.launch = LaunchModel(tasks, session, self,
                                  watch=lambda topics: _takes_topics(link, topics))
        self.guard = LaunchGuard(tasks, self.launch.launch, parent=self)
        self.mixture = MixtureModel(tasks, session, parent=self)
        self.warnings = WarningsModel(link.warnings, session, self)
        self.states = DeviceStatesModel(self.launch, self.warnings, session)
        self.recording = RecordingModel(tasks, link.recorder, session, self)
        self.live = LiveCurvesModel(tasks, link.memory, session, self)
        self.playback = PlaybackModel(tasks, link.player, PlayerError, parent=self)
        self.replay = ReplayModel(
            tasks, PlaybackModel(tasks, link.replay.player, PlayerError, parent=self),
            link.replay, _REPLAY_ERRORS, session, self)
        self.bag = BagModel(tasks, session, self, lambda: self.recording.choices.folder)
        self.compare = CompareModel(tasks, session, self)
        self.bands = BandsModel(tasks, self.compare, self)
        self.ghost = GhostModel(tasks, self.compare, session, show_ghost, follow_ghost, self)
        self.live_comparison = LiveComparisonModel(self.compare, self.live, self)
        self.values = ValuesModel(
            tasks, self.playback, lambda: Played(session.paths, session.played_devices),
            parent=self)
        self.replayed_values = ValuesModel(tasks, self.replay.playback, lambda: self.replay.played,
                                           'replayed values', parent=self)
        self.view = ViewModel(tasks, session, self.launch)
        self.tool = ToolModel(tasks, session, self)
        self.alarms = AlarmsModel(self.launch, self.states)
        self.watch = WatchModel(self.launch)
        self.objects = ObjectAlarms(tasks, session, self.launch, self.alarms)
        self.expected = ExpectModel(tasks, session, self)
        self._notes = EventNotes(tasks, self.alarms, self.launch, self.recording)
        self.cell = CellModel(tasks, session, self)  # last, so that the other models follow first
        self._devices_when_ready: Optional[Sequence[str]] = None
        self._launches_when_ready = False
        self._saved_devices: Set[str] = set()
        self._connect()

    def begin(self) -> None:
        """Clean up after a crash, and find or start the master."""
        sys.setswitchinterval(_SWITCH_INTERVAL_S)
        self.launch.prepare(self.master.connect_to_master)
        self.watch.begin()

    def close(self) -> None:
        """End everything that was started; block until it is done."""
        self.watch.close()
        self.compare.close()  # a film takes minutes
        self.replay.close()
        self.launch.close()
        self.master.close()
        self.tasks.close()

    def settings(self) -> Dict[str, Any]:
        """Return the ticks, good runs, comparisons and edits, for ``restore``."""
        return {'unticked': self.cell.unticked, 'compare': self.compare.settings(),
                'finished': self.live_comparison.settings(),
                'unsaved': self.unsaved.settings(),
                'recorded': self.recording.choices.changed_ticks}

    def restore(self, settings: Mapping[str, Any]) -> None:
        """Restore the ticks, comparisons and edits of an earlier session.

        Raises:
            AttributeError, KeyError, TypeError, ValueError: these are not settings.
        """
        self.compare.restore(settings['compare'])
        self.live_comparison.restore(settings.get('finished', []))
        self.unsaved.restore(settings.get('unsaved', {}))
        self.recording.choices.restore_ticks(settings.get('recorded', {}))
        self.cell.set_unticked(settings['unticked'])

    def choice(self) -> Choice:
        """Return the choice that would be launched now."""
        session, folder = self.session, self.recording.choices.folder
        assert session.cell is not None
        choice = Choice(session.cell, session.mode, session.chosen, RvizStart.OPTIONAL,
                        window=self.view.window, view=self.view.content, viewers=self.viewers)
        if session.mode is Mode.PLAYBACK:
            return self._playing(choice)
        is_known = is_for_anybody(folder, os.path.expanduser('~'))
        return choice if is_known else replace(choice, bag_folder=folder)

    def _playing(self, choice: Choice) -> Choice:
        """Return a choice with the open recording, and the topics that are left out of it."""
        bag, *others = self.bag.next_paths or (None,)
        return replace(choice, bag=bag, further_bags=tuple(others),
                       left_out=self.bag.played.left_out)

    def start(self) -> None:
        """Launch the choice, once no other node publishes topics that would be mixed with it."""
        if self.blocked_reason() == '':
            self.guard.launch(self.choice())

    def when_ready(self, devices: Optional[Sequence[str]], launches: bool) -> None:
        """Tick only these devices (None: no change) and launch, as soon as possible."""
        self._devices_when_ready, self._launches_when_ready = devices, launches
        self._try_to_begin()

    def _try_to_begin(self) -> None:
        if self.session.cell is not None and self._devices_when_ready is not None:
            devices, self._devices_when_ready = self._devices_when_ready, None
            self.cell.tick_only(set(devices))
        if self._launches_when_ready and self.blocked_reason() == '' and not self.bag.is_loading:
            self._launches_when_ready = False
            self.launch.apply(self.choice()) if self.launch.is_running else self.start()

    def blocked_reason(self) -> str:
        """Return why nothing can be launched now; empty when it can."""
        if not self.master.is_connected:
            return self.lost_master() or self.master.problem
        if self.session.cell is None:
            return 'The configuration has problems' if self.cell.problems else 'Loading'
        if not self.session.chosen:
            return 'Tick a device first'
        return self.bag.foreign_text if self.session.mode is Mode.PLAYBACK else ''

    def lost_master(self) -> str:
        """Return the problem with a lost master, and its remedy; '' while it is not lost."""
        master = self.master
        if not master.is_lost:
            return ''
        if self.launch.is_idle:
            return f'{master.problem}. Restart the launcher ("Launch nodes" offers this)'
        return f'{master.problem} and does not know the running nodes: stop the cell and ' \
               'start it again' if master.is_other else master.problem

    def pending(self) -> str:
        """Return what would change if the present choice were applied to the running nodes."""
        return '' if self.session.cell is None else self.launch.pending(self.choice())

    def choose_mode(self, mode: Mode) -> None:
        """Change the mode, also of running nodes; parts that are the same in both keep running."""
        if mode is not self.session.mode:
            self.session.set_mode(mode)
            if self.launch.is_running:
                self.launch.apply(self.choice())

    def if_there(self, paths: Sequence[str], act: Callable[[], None]) -> None:
        """Act on a recording if all its files still exist; otherwise report the missing one."""
        self.tasks.run('files', lambda: missing_of(paths),
                       lambda gone: self._forget_recording(gone) if gone else act())

    def _forget_recording(self, gone: Sequence[str]) -> None:
        self.recording.forget(gone)
        self.failed.emit(f'{gone[0]} no longer exists: it was moved or deleted. '
                         'Nothing was changed.')

    def play(self, paths: Sequence[str]) -> None:
        """Open a recording, and play it once it is read; running nodes change their mode."""
        if self._can_change_nodes():
            self.bag.open(paths)
            self.session.set_mode(Mode.PLAYBACK)
            self.when_ready(None, True)

    def apply(self) -> None:
        """Apply the present choice; a recording must not be interrupted."""
        if self.recording.is_recording:
            self.failed.emit('A recording is in progress: stop it before you change devices.')
        elif self.session.mode is Mode.PLAYBACK and self.bag.is_foreign:
            self.failed.emit(f'Nothing to play: {self.bag.foreign_text}.')
        elif self._can_change_nodes():
            self.launch.apply(self.choice())

    def _can_change_nodes(self) -> bool:
        """Return whether running nodes, if any, can be changed; report a lost master."""
        is_possible = self.launch.is_idle or not self.master.is_lost
        if not is_possible:
            self.failed.emit(f'Nothing was changed: {within_sentence(self.lost_master())}.')
        return is_possible

    def show_replay(self, time_s: float) -> None:
        """Show a moment [s, on the recorder's clock] of the running cell."""
        running = self.session.running
        if running is not None and running.mode is Mode.REALTIME:
            self.replay.show(time_s, replace(running, window=self.view.window,
                                             view=self.view.content))

    def status(self) -> str:
        """Return the status line."""
        if self.guard.is_looking:
            return status_text(LaunchPhase.LAUNCHING, self.session.mode, '', Line(Level.OFF, ''))
        if self.launch.is_idle and self._waits_for():
            return self._waits_for()
        running = self.launch.running
        mode = None if running is None else running.mode
        activity = (
            recorder_activity(self.recording.phase, self.recording.state.is_silent)
            if mode is Mode.REALTIME
            else player_activity(self.session.player, self.playback.state.is_silent,
                                 self.session.has_ended(BAG_PART)))
        trouble = self.states.trouble(() if running is None else running.devices)
        if running is not None and self.session.awaits_apply:
            activity, trouble = '', Line(Level.WARNING, _OTHER_CELL.format(
                os.path.basename(running.cell.file), os.path.basename(self.session.file)))
        text = status_text(self.launch.phase, mode, activity, trouble, self.live_comparison.text)
        if self.launch.is_running and self.watch.picture_age_s:
            slow = _WAS_SLOW if self.watch.draws_again else _SLOW
            text += '\n' + slow.format(self.watch.picture_age_s)
        reason = self.blocked_reason() if self.launch.is_idle else ''
        if reason and not self.master.is_lost:
            return f'Cannot launch: {within_sentence(reason)}'
        return '\n'.join(filter(None, (self.lost_master(), text)))

    def _waits_for(self) -> str:
        """Return the activity that a launch has to wait for; '' if there is none."""
        if self.master.is_connecting:
            return 'Starting the ROS master…'
        if self.new.is_making:
            return f'Looking at {self.new.where}…'
        return 'Reading the configuration…' if self.cell.is_loading else ''

    # Connections

    def _connect(self) -> None:
        self._connect_node()
        self._connect_playback()
        self._connect_alarms()
        for model in (self.master, self.launch, self.recording, self.bag,
                      self.calibrating, self.region, self.expected, self.tool, self.view, self.new,
                      self.compare, self.ghost, self.replay):
            model.failed.connect(self.failed)
        for playback in (self.playback, self.replay.playback):
            playback.failed.connect(self.noted)  # such as a step at the end of the recording
        for model in (self.guard, self.launch, self.recording, self.playback, self.states,
                      self.new, self.live_comparison):
            model.changed.connect(self.status_changed)
        self.new.made.connect(self.cell.open)
        self.tool.saved.connect(lambda _device: self.cell.reload())
        self.expected.saved.connect(self.cell.reload)
        self.objects.link.seen.connect(self.expected.take)
        self.calibration.saved.connect(self._take_saved)
        self.region.saved.connect(self._take_saved)
        self.cell.loaded.connect(self._adopt_saved)
        self.warnings.changed.connect(lambda: self.tool.take_warnings(
            {device.name: self.states.warnings(device.name) for device in self.session.devices}))
        self.launch.stopped.connect(self.recording.take_end_of_run)
        for ready in (self.cell.loaded, self.master.connected, self.bag.changed):
            ready.connect(self._try_to_begin)

    def _take_saved(self, name: str) -> None:
        """Read the file again, and note that the nodes already have what was saved."""
        self._saved_devices.add(name)
        self.cell.reload()

    def _adopt_saved(self) -> None:
        """Adopt saved poses and boxes without a restart: running nodes got them when edited."""
        names, self._saved_devices = self._saved_devices, set()
        running = self.launch.running
        if running is None or running.cell.file != self.session.file:
            return
        for saved in self.session.devices:
            device = next((it for it in running.cell.devices if it.name == saved.name), None)
            if saved.name in names and device is not None and all(
                    it.is_taken(saved.name) for it in (self.calibration, self.region)):
                running = running.with_device(_with_saved(device, saved))
        if names:
            self.launch.adopt(running)

    def _connect_node(self) -> None:
        """Pass on what the window's node receives."""
        link = self.link
        link.player_state.connect(self.session.take_player)
        for model in (self.recording.take_state, self.states.take_recorder,
                      self.alarms.take_recorder):
            link.recorder_state.connect(model)
        self.recording.unheard.connect(self.states.forget_topics)
        link.replay.reported.connect(self.replay.take_report)
        link.replay.player_state.connect(self.replay.take_state)
        link.rviz_moved.connect(self.replay.follow_window)
        self.replay.changed.connect(
            lambda: link.cover_rviz(self.replay.phase is ReplayPhase.SHOWN))
        link.ghost_phase.connect(self.live_comparison.take_phase)
        self.live_comparison.changed.connect(
            lambda: link.tell_comparison(lambda: self.live_comparison.told,
                                         lambda: self.live_comparison.told_bands))

    def _connect_playback(self) -> None:
        session, playback = self.session, self.playback
        session.run_changed.connect(lambda: playback.follow_player(session.runs(BAG_PART)))
        for changed in (session.recording_changed, session.cell_changed, session.run_changed):
            changed.connect(self.values.follow)
        self.replay.changed.connect(self.replayed_values.follow)
        session.player_changed.connect(lambda: playback.take_state(session.player))
        session.recording_changed.connect(
            lambda: playback.set_marks(placed_marks(session.recording)))
        self.launch.stopped.connect(playback.forget_player)
        self.mixture.begun.connect(
            lambda: playback.pause() if self.mixture.mode is Mode.PLAYBACK else None)
        for other in (self.bag.chosen, session.run_changed):
            other.connect(self._play_other_bag)

    def _connect_alarms(self) -> None:
        alarms, curves, comparison = self.alarms, self.bag.curves, self.live_comparison
        comparison.changed.connect(
            lambda: alarms.set_departed(comparison.departed, comparison.lost))
        comparison.run_finished.connect(lambda: alarms.note(
            'run finished (reference {0.reference}): {0.verdict}'.format(comparison.finished[-1])))
        self.watch.found.connect(self.states.take_look)
        self.watch.slowed.connect(self.status_changed)
        for change in (self.master.lost, self.master.returned):
            change.connect(
                lambda: alarms.set_master(self.master.is_lost, self.master.is_other))
        for drawn in (self.watch.take_drawing, self.view.take_drawing):
            self.link.displays.connect(lambda _displays, take=drawn: take())
        self.playback.moved.connect(lambda: alarms.take_position(self.playback.position_s))
        curves.changed.connect(lambda: alarms.set_recorded(curves.alarms))

    def _play_other_bag(self) -> None:
        """Restart the player with another bag; everything else keeps running.

        A bag of another cell than that which runs waits for *Apply*.
        """
        running, paths = self.session.running, self.session.paths
        if running is None or self.session.awaits_apply:
            return
        if running.mode is Mode.PLAYBACK and paths and not self.bag.is_foreign \
                and paths != (running.bag, *running.further_bags):
            self.launch.apply(self._playing(running))


def _with_saved(running: Device, saved: Device) -> Device:
    """Return a running device with the saved pose and box."""
    if running.base is not None and saved.base is not None:
        running = replace(running, base=replace(running.base, pose=saved.base.pose))
    if running.roi is not None and saved.roi is not None:
        running = replace(running, roi=replace(running.roi, center=saved.roi.center,
                                               size=saved.roi.size))
    return running
