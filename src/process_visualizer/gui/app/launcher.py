# SPDX-License-Identifier: BSD-3-Clause
"""All models of the window and their connections; no widgets."""
from __future__ import annotations

import os
import sys
from dataclasses import replace
from typing import Any, Dict, List, Mapping, Optional, Sequence, Tuple

from PyQt5.QtCore import QObject, pyqtSignal

from process_visualizer.cell.changes import changes
from process_visualizer.cell.errors import ConfigurationError
from process_visualizer.cell.model import Mode
from process_visualizer.clients.bag_recorder import RecorderError
from process_visualizer.clients.ghost_client import follow_ghost, show_ghost
from process_visualizer.clients.player_client import PlayerError
from process_visualizer.generate.choice import Choice, RvizStart, Viewers
from process_visualizer.generate.plan import BAG_PART, FRAMES_PART, PlanError
from process_visualizer.gui.app.calibration_actions import CalibrationActions
from process_visualizer.gui.app.event_notes import EventNotes
from process_visualizer.gui.cell.alarms_model import AlarmsModel
from process_visualizer.gui.cell.calibration_model import RegionModel, ToolModel
from process_visualizer.gui.cell.cell_model import CellModel, NewConfigurationModel
from process_visualizer.gui.cell.device_states_model import DeviceStatesModel, WarningsModel
from process_visualizer.gui.cell.edited_values import UnsavedModel
from process_visualizer.gui.cell.launch_model import (
    LaunchGuard,
    LaunchModel,
    LaunchPhase,
    MixtureModel,
)
from process_visualizer.gui.cell.master_model import MasterModel, WatchModel
from process_visualizer.gui.cell.objects_model import ObjectsModel
from process_visualizer.gui.cell.view_model import ViewModel
from process_visualizer.gui.compare.compare_model import BandsModel, CompareModel
from process_visualizer.gui.compare.ghost_model import GhostModel
from process_visualizer.gui.compare.live_comparison_model import LiveComparisonModel
from process_visualizer.gui.live.live_curves_model import LiveCurvesModel
from process_visualizer.gui.live.replay_model import ReplayModel
from process_visualizer.gui.playback.bag_model import BagModel
from process_visualizer.gui.playback.playback_model import PlaybackModel
from process_visualizer.gui.playback.values_model import ValuesModel
from process_visualizer.gui.recording.recording_choices import is_for_anybody
from process_visualizer.gui.recording.recording_model import RecordingModel
from process_visualizer.gui.recording.recording_types import RecordingPhase
from process_visualizer.gui.ros.replay_link import ReplayLinkError
from process_visualizer.gui.ros.ros_link import RosLink, RosLinkError
from process_visualizer.gui.ros.sensor_links import ObjectLink, RegionLink
from process_visualizer.gui.ros.snapshots import PlayerSnapshot
from process_visualizer.gui.toolkit.tasks import Tasks
from process_visualizer.health.device_state import Level, Line
from process_visualizer.launching.part_report import NodeState, PartState
from process_visualizer.launching.ros_master import RosMasterError

# The status line, in the thesis' words (figures 5.2 to 5.4).

_MODE = {Mode.REALTIME: 'In real-time mode.', Mode.PLAYBACK: 'In playback mode.'}
_RECORDING = {RecordingPhase.STARTING: 'Waiting for the topics to record',
              RecordingPhase.RECORDING: 'Recording',
              RecordingPhase.STOPPING: 'Finishing the recording'}


def status_text(phase: LaunchPhase, mode: Optional[Mode], activity: str, trouble: Line) -> str:
    """Return the activity of the system; ``mode`` is that of the nodes, ``trouble`` the worst."""
    if phase is LaunchPhase.IDLE or mode is None:
        return 'Idle'
    if phase is LaunchPhase.LAUNCHING:
        return 'Launching nodes…'
    if phase is LaunchPhase.QUITTING:
        return 'Quitting all nodes…'
    text = ' '.join(filter(None, [_MODE[mode], activity]))
    return f'{text}\n{trouble.text}' if trouble.level >= Level.WAITING else text


def recorder_activity(phase: RecordingPhase) -> str:
    """Return the activity of the recorder."""
    return _RECORDING.get(phase, '')


def player_activity(player: Optional[PlayerSnapshot]) -> str:
    """Return the activity of the player."""
    if player is None:
        return ''
    if player.paused:
        return 'Paused'
    direction = '' if player.rate > 0.0 else ' backwards'
    return f'Playing{direction} at {abs(player.rate):g}×'


_MARKER_LINE = 'marker'


class RegionControl(QObject):
    """Has the model; what takes its time is a task."""

    def __init__(self, tasks: Tasks, parent: QObject) -> None:
        super().__init__(parent)
        self._tasks = tasks
        self._link = RegionLink(self)
        self.model = RegionModel(tasks, self._link.move, self)
        self._link.dragged.connect(self.model.take_dragged)
        self.model.marker_wanted.connect(self._show_marker)
        self.model.moved.connect(lambda device, region: tasks.run(
            _MARKER_LINE, lambda: self._link.move_marker(device, region)))

    def _show_marker(self, is_shown: bool) -> None:
        device, region = self.model.device, self.model.region
        if is_shown and region is not None:
            chosen = region
            self._tasks.run(_MARKER_LINE, lambda: self._link.show_marker(device, chosen), None,
                            self._tell)
        else:
            self._tasks.run(_MARKER_LINE, self._link.hide_marker)

    def _tell(self, error: Exception) -> None:
        if not isinstance(error, RosLinkError):
            raise error
        self.model.failed.emit(str(error))


_OBJECTS_LINE = 'objects'


class ObjectAlarms(QObject):
    """Has the model; subscribing is a task."""

    def __init__(self, tasks: Tasks, launch: LaunchModel, alarms: AlarmsModel) -> None:
        super().__init__(alarms)
        self._tasks, self._launch, self._alarms = tasks, launch, alarms
        self._link = ObjectLink(self)
        self.model = ObjectsModel(self)
        self.model.sensors_wanted.connect(self._follow_sensors)
        self.model.changed.connect(self._tell)
        self._link.seen.connect(self.model.take)
        launch.changed.connect(self._follow_launch)

    def _follow_launch(self) -> None:
        is_up = self._launch.phase in (LaunchPhase.LAUNCHING, LaunchPhase.RUNNING)
        self.model.set_running(self._launch.running if is_up else None)

    def _follow_sensors(self, names: Sequence[str]) -> None:
        self._tasks.run(_OBJECTS_LINE, lambda: self._link.follow(names), None, self._refuse)

    def _refuse(self, error: Exception) -> None:
        if not isinstance(error, RosLinkError):
            raise error
        self._alarms.note(str(error))

    def _tell(self) -> None:
        self._alarms.set_objects(self.model.conditions, [
            (it.device, it.text, it.begin_s, it.end_s) for it in self.model.played])


_REPLAY_ERRORS = (RecorderError, ReplayLinkError, ConfigurationError, PlanError, RosMasterError,
                  OSError)

_SWITCH_INTERVAL_S = 0.0005
"""How long the window waits for each other computing thread; Python's own 5 ms add up."""


class Launcher(QObject):
    """The program without its window."""

    failed = pyqtSignal(str)
    status_changed = pyqtSignal()

    def __init__(self, parent: Optional[QObject] = None) -> None:
        super().__init__(parent)
        self.viewers = Viewers()
        self.tasks = Tasks(self)
        self.link = RosLink(self)
        self.master = MasterModel(self.tasks, self.link, self)
        self.cell = CellModel(self.tasks, self)
        self.new = NewConfigurationModel(self.tasks, self.link.look_at_system, self)
        self.launch = LaunchModel(self.tasks, self)
        self.guard = LaunchGuard(self.tasks, self.launch.launch, parent=self)
        self.mixture = MixtureModel(self.tasks, self._own_nodes, parent=self)
        self.warnings = WarningsModel(self.link.warnings, self)
        self.states = DeviceStatesModel(self.launch, self.warnings)
        self.recording = RecordingModel(self.tasks, self.link.recorder, self)
        self.live = LiveCurvesModel(self.tasks, self.link.memory, self)
        self.playback = PlaybackModel(self.tasks, self.link.player, PlayerError, parent=self)
        self.replay = ReplayModel(
            self.tasks, PlaybackModel(self.tasks, self.link.replay.player, PlayerError,
                                      parent=self), self.link.replay, _REPLAY_ERRORS, self)
        self.bag = BagModel(self.tasks, self, lambda: self.recording.choices.folder)
        self.compare = CompareModel(self.tasks, self)
        self.bands = BandsModel(self.tasks, self.compare, self)
        self.ghost = GhostModel(self.tasks, self.compare, show_ghost, follow_ghost, self)
        self.live_comparison = LiveComparisonModel(self.compare, self.live, self)
        self.values = ValuesModel(self.tasks, self.playback, parent=self)
        self.view = ViewModel(self.tasks, self.cell, self.launch)
        self._regions = RegionControl(self.tasks, self)
        self.region = self._regions.model
        self.calibrating = CalibrationActions(self.tasks, self.link, self)
        self.calibration = self.calibrating.model
        self.unsaved = UnsavedModel({'the pose': self.calibration,
                                     'the crop box': self.region}, self)
        self.tool = ToolModel(self.tasks, self)
        self.alarms = AlarmsModel(self.launch, self.states)
        self.watch = WatchModel(self.launch)
        self.objects = ObjectAlarms(self.tasks, self.launch, self.alarms)
        self._notes = EventNotes(self.tasks, self.alarms, self.launch, self.recording)
        self._player: Optional[PlayerSnapshot] = None
        self._devices_when_ready: Optional[Sequence[str]] = None
        self._launches_when_ready = False
        self._connect()

    def begin(self) -> None:
        """Clean up after a crash, and find or start the master."""
        sys.setswitchinterval(_SWITCH_INTERVAL_S)
        self.launch.prepare(self.master.connect_to_master)
        self.watch.begin()

    def close(self) -> None:
        """End everything that was started; block until it is done."""
        self.watch.close()
        self.replay.close()
        self.launch.close()
        self.master.close()
        self.tasks.close()

    def settings(self) -> Dict[str, Any]:
        """Return what is ticked, called good, compared and edited, for ``restore``."""
        return {'unticked': self.cell.unticked, 'compare': self.compare.settings(),
                'finished': self.live_comparison.settings(),
                'unsaved': self.unsaved.settings()}

    def restore(self, settings: Mapping[str, Any]) -> None:
        """Take what was ticked, compared and edited in an earlier session.

        Raises:
            AttributeError, KeyError, TypeError, ValueError: these are not settings.
        """
        self.compare.restore(settings['compare'])
        self.live_comparison.restore(settings.get('finished', []))
        self.unsaved.restore(settings.get('unsaved', {}))
        self.cell.set_unticked(settings['unticked'])

    def choice(self) -> Choice:
        """The choice that would be launched now."""
        mode = self.cell.mode
        bag, *others = self.bag.paths if mode is Mode.PLAYBACK and self.bag.paths else (None,)
        assert self.cell.cell is not None
        return Choice(self.cell.cell, mode, self.cell.chosen, RvizStart.OPTIONAL, bag,
                      self.view.window, self.view.content, tuple(others), self._left_out(),
                      bag_folder=self._bag_folder(), viewers=self.viewers)

    def _bag_folder(self) -> str:
        """The folder for recordings, if the recorder has to be started with it to use it."""
        folder = self.recording.choices.folder
        is_known = is_for_anybody(folder, os.path.expanduser('~'))
        return '' if is_known or self.cell.mode is Mode.PLAYBACK else folder

    def _left_out(self) -> Tuple[str, ...]:
        return self.bag.played.left_out if self.cell.mode is Mode.PLAYBACK else ()

    def start(self) -> None:
        """Launch the choice, once no other node publishes topics that would be mixed with it."""
        if self.blocked_reason() == '':
            self.guard.launch(self.choice())

    def when_ready(self, devices: Optional[Sequence[str]], launches: bool) -> None:
        """Tick only these devices (None: no change) and launch, as soon as possible."""
        self._devices_when_ready, self._launches_when_ready = devices, launches
        self._try_to_begin()

    def _try_to_begin(self) -> None:
        if self.cell.cell is not None and self._devices_when_ready is not None:
            devices, self._devices_when_ready = self._devices_when_ready, None
            self.cell.tick_only(set(devices))
        if self._launches_when_ready and self.blocked_reason() == '' and not self.bag.is_loading:
            self._launches_when_ready = False
            self.launch.apply(self.choice()) if self.launch.is_running else self.start()

    def blocked_reason(self) -> str:
        """Return why nothing can be launched now; empty when it can."""
        if not self.master.is_connected:
            return self.master.problem
        if self.cell.cell is None:
            return 'The configuration has problems' if self.cell.problems else 'Loading'
        if not self.cell.chosen:
            return 'Tick a device first'
        return self.bag.foreign_text if self.cell.mode is Mode.PLAYBACK else ''

    def pending(self) -> str:
        """Return what would change if the present choice were applied to the running nodes."""
        running = self.launch.running
        if not self.launch.is_running or running is None or self.cell.cell is None:
            return ''
        return _difference(running, self.choice())

    def choose_mode(self, mode: Mode) -> None:
        """Take another mode, also for what runs: what is the same in both keeps running."""
        if mode is not self.cell.mode:
            self.cell.set_mode(mode)
            if self.launch.is_running:
                self.launch.apply(self.choice())

    def play(self, paths: Sequence[str]) -> None:
        """Open a recording and play it, once it is read; nodes that run change the mode."""
        self.bag.open(paths)
        self.cell.set_mode(Mode.PLAYBACK)
        self.when_ready(None, True)

    def apply(self) -> None:
        """Apply the present choice; a recording must not be interrupted."""
        if self.recording.is_recording:
            self.failed.emit('A recording is in progress: stop it before you change devices.')
        elif self.cell.mode is Mode.PLAYBACK and self.bag.is_foreign:
            self.failed.emit(f'Nothing to play: {self.bag.foreign_text}.')
        else:
            self.launch.apply(self.choice())

    def show_replay(self, time_s: float) -> None:
        """Show a moment [s, on the recorder's clock] of the cell that runs."""
        running = self.launch.running
        if running is not None and self.launch.is_running and running.mode is Mode.REALTIME:
            self.replay.show(time_s, replace(running, window=self.view.window,
                                             view=self.view.content))

    def status(self) -> str:
        """The status line."""
        if self.guard.is_looking:
            return status_text(LaunchPhase.LAUNCHING, self.cell.mode, '', Line(Level.OFF, ''))
        if self.launch.is_idle and self._waits_for():
            return self._waits_for()
        running = self.launch.running
        mode = None if running is None else running.mode
        activity = (recorder_activity(self.recording.phase) if mode is Mode.REALTIME
                    else player_activity(self._player))
        trouble = self.states.trouble(() if running is None else running.devices)
        text = status_text(self.launch.phase, mode, activity, trouble)
        compared = self.live_comparison.text if self.launch.is_running else ''
        problem = self.master.problem if self.master.is_lost else ''
        return '\n'.join(filter(None, (text, compared, problem)))

    def _waits_for(self) -> str:
        """Return what must be done before anything can be launched; empty if nothing."""
        if self.master.is_connecting:
            return 'Starting the ROS master…'
        if self.new.is_making:
            return f'Looking at {self.new.where}…'
        return 'Reading the configuration…' if self.cell.is_loading else ''

    def _connect(self) -> None:
        self.link.player_state.connect(self._take_player)
        self.link.replay.reported.connect(self.replay.take_report)
        self.link.rviz_moved.connect(self.replay.follow_window)
        self.link.replay.player_state.connect(self.replay.take_state)
        for saved in (self.calibration.saved, self.region.saved, self.tool.saved):
            saved.connect(lambda _device: self.cell.reload())
        self.warnings.changed.connect(self._follow_warnings)
        self.link.ghost_phase.connect(self.live_comparison.take_phase)
        self.live_comparison.changed.connect(
            lambda: self.alarms.set_departed(self.live_comparison.departed))
        self.live_comparison.run_finished.connect(self._note_run)
        self.watch.found.connect(self.alarms.take_look)
        self.link.recorder_state.connect(self.recording.take_state)
        self.link.recorder_state.connect(self.states.take_recorder)
        self.link.recorder_state.connect(self.alarms.take_recorder)
        self.playback.moved.connect(lambda: self.alarms.take_position(self.playback.position_s))
        curves = self.bag.curves
        curves.changed.connect(lambda: self.alarms.set_recorded(curves.alarms))
        for model in (self.master, self.launch, self.recording, self.playback, self.bag,
                      self.calibrating, self.region, self.tool, self.view, self.new, self.compare,
                      self.ghost, self.replay, self.replay.playback):
            model.failed.connect(self.failed)
        for model in (self.guard, self.launch, self.recording, self.playback, self.states,
                      self.new, self.live_comparison):
            model.changed.connect(self.status_changed)
        self.new.made.connect(self.cell.open)
        self.launch.changed.connect(self._follow_launch)
        self.launch.stopped.connect(self.recording.take_end_of_run)
        self.launch.stopped.connect(self.playback.forget_player)
        self.mixture.begun.connect(self._pause_mixture)
        self.cell.changed.connect(self._follow_cell)
        for ready in (self.cell.loaded, self.master.connected, self.bag.changed):
            ready.connect(self._try_to_begin)
        self.bag.chosen.connect(self._play_other_bag)
        self.bag.changed.connect(self._follow_bag)

    def _note_run(self) -> None:
        run = self.live_comparison.finished[-1]
        self.alarms.note(f'run finished (reference {run.reference}): {run.verdict}')

    def _follow_launch(self) -> None:
        running = self.launch.running
        mode = running.mode if running is not None and self.launch.is_running else None
        self.playback.follow_player(self._runs(BAG_PART))
        has_ghost = self._runs(BAG_PART if mode is Mode.PLAYBACK else FRAMES_PART)
        self.ghost.set_running(mode if has_ghost else None)
        self.mixture.follow(running)
        self.warnings.follow(running is not None)
        self.recording.set_running(mode is Mode.REALTIME)
        if mode is Mode.REALTIME and self._has_ended(BAG_PART):
            self.recording.take_end_of_recorder()
        self.live.set_running(mode is Mode.REALTIME)
        if mode is not Mode.REALTIME:
            self.replay.stop()
        self.region.set_running(mode is not None)
        frames = self.launch.reports.get(FRAMES_PART)  # it may have been restarted
        self.calibrating.set_mode(mode or self.cell.mode)
        self.calibration.set_running(
            mode is not None and (frames is None or frames.state is PartState.RUNNING))
        if mode is Mode.PLAYBACK:
            self._play_other_bag('')
        else:
            self._take_player(None)

    def _runs(self, part: str) -> bool:
        report = self.launch.reports.get(part)
        return report is not None and report.state is PartState.RUNNING

    def _has_ended(self, part: str) -> bool:
        """Return whether a part, or a node of it, has ended by itself."""
        report = self.launch.reports.get(part)
        return report is not None and (
            report.state in (PartState.FAILED, PartState.STOPPED)
            or any(node.state in (NodeState.EXITED, NodeState.FAILED) for node in report.nodes))

    def _own_nodes(self) -> List[str]:
        """The nodes that were launched here."""
        return [node.name for report in self.launch.reports.values() for node in report.nodes]

    def _pause_mixture(self) -> None:
        if self.mixture.mode is Mode.PLAYBACK:
            self.playback.pause()

    def _follow_cell(self) -> None:
        self.recording.choices.set_devices(self.cell.chosen)
        self.live.set_devices(self.cell.chosen)
        self.bag.set_devices(self.cell.chosen)
        if self.cell.mode is Mode.PLAYBACK:
            self.bag.reopen()
        self.values.set_devices(self.cell.chosen)
        self.compare.set_cell(self.cell.cell)
        self.unsaved.set_file('' if self.cell.cell is None else self.cell.cell.file)
        self.region.set_devices(self.cell.devices)
        self.calibrating.set_cell(self.cell.cell, [it.name for it in self.cell.chosen])
        running = self.launch.running if self.launch.is_running else None
        self.calibrating.set_mode(self.cell.mode if running is None else running.mode)
        editor = self.cell.editor
        self.tool.set_devices(self.cell.devices, None if editor is None else editor.save_tool)
        if editor is not None:
            self.calibration.set_save(editor.save)
            self.region.set_save(editor.save_region)

    def _follow_warnings(self) -> None:
        self.tool.take_warnings({device.name: self.states.warnings(device.name)
                                 for device in self.cell.devices})

    def _follow_bag(self) -> None:
        self.playback.set_marks(self.bag.marks)
        self.values.set_recording(self.bag.paths)
        self.compare.set_recording(self.bag.paths)
        self.calibrating.recording.set_recording(self.bag.paths)
        self.states.set_recording(self.bag.catalogue)

    def _play_other_bag(self, _path: str) -> None:
        """Restart the player with another bag; everything else keeps running."""
        running, paths = self.launch.running, self.bag.paths
        if running is not None and self.launch.is_running and running.mode is Mode.PLAYBACK \
                and paths and paths != (running.bag, *running.further_bags) \
                and not self.bag.is_foreign:
            self.launch.apply(replace(running, bag=paths[0], further_bags=paths[1:],
                                      left_out=self._left_out()))

    def _take_player(self, player: Optional[PlayerSnapshot]) -> None:
        if player is None and self._player is None:
            return
        self._player = player
        self.objects.model.take_player(player)
        self.calibrating.take_player(player)
        self.playback.take_state(player)
        if player is not None:
            self.states.take_player(player)
            self.mixture.take_player(player.others)


def _difference(before: Choice, after: Choice) -> str:
    old = [device.name for device in before.devices]
    new = [device.name for device in after.devices]
    changed = changes(before.cell, after.cell).changed
    words = [('start', [name for name in new if name not in old]),
             ('stop', [name for name in old if name not in new]),
             ('restart', [name for name in new if name in old and name in changed]
              + ['the player'] * (before.left_out != after.left_out))]
    return '; '.join(f'{word} {", ".join(names)}' for word, names in words if names)
