# SPDX-License-Identifier: BSD-3-Clause
"""The program without its window: what can be launched, and the pending changes."""
from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Iterator, List

import pytest
import rosbag
from genpy import Time
from PyQt5.QtWidgets import QWidget
from session_stand import play
from std_msgs.msg import Float64

from process_visualizer.cell.model import Mode, Pose
from process_visualizer.clients.bag_recorder import RecorderError
from process_visualizer.generate.choice import RvizStart, Viewers
from process_visualizer.generate.plan import BAG_PART, PlanError
from process_visualizer.gui.app.launcher import Launcher, _takes_topics
from process_visualizer.gui.app.main import store_changes, words_to_go_on
from process_visualizer.gui.app.quitting import Quitting
from process_visualizer.gui.app.settings import Settings
from process_visualizer.gui.cell.launch_model import LaunchPhase
from process_visualizer.gui.live.replay_model import ReplayPhase
from process_visualizer.gui.recording.recording_types import FinishedBag, RecordingPhase
from process_visualizer.gui.ros.snapshots import PlayerSnapshot, RecorderSnapshot
from process_visualizer.launching.part_report import NodeReport, NodeState, PartReport, PartState
from process_visualizer.launching.ros_master import RosMasterError

DEVICES = '''<visualizer>
  <device type="other" name="oven"><base frame="oven" xyz="1 0 0"/></device>
  <device type="other" name="press"/>
</visualizer>'''


@pytest.fixture
def config(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv('ROS_HOME', str(tmp_path))
    path = tmp_path / 'cell.xml'
    path.write_text(DEVICES)
    return path


@pytest.fixture
def launcher(qtbot: Any, config: Path) -> Iterator[Launcher]:
    program = Launcher()
    yield program
    program.close()


@pytest.fixture
def loaded(launcher: Launcher, qtbot: Any, config: Path) -> Launcher:
    with qtbot.waitSignal(launcher.cell.loaded):
        launcher.cell.open(str(config))
    return launcher


def run(launcher: Launcher) -> None:
    """Set the state as if all selected parts had been launched."""
    launcher.launch.running = launcher.choice()
    launcher.launch.phase = LaunchPhase.RUNNING
    launcher.launch.changed.emit()


def test_why_nothing_can_be_launched(loaded: Launcher) -> None:
    assert 'master' in loaded.blocked_reason()
    loaded.master.is_connected = True
    assert loaded.blocked_reason() == ''
    loaded.cell.tick_only(set())
    assert loaded.blocked_reason() == 'Tick a device first'


def test_broken_configuration_cannot_be_launched(launcher: Launcher, qtbot: Any,
                                                 config: Path) -> None:
    config.write_text('<visualizer><device/></visualizer>')
    launcher.master.is_connected = True
    with qtbot.waitSignal(launcher.cell.loaded):
        launcher.cell.open(str(config))
    assert launcher.blocked_reason() == 'The configuration has problems'


def test_choice(loaded: Launcher) -> None:
    loaded.cell.tick('press', False)
    loaded.session.set_mode(Mode.PLAYBACK)
    choice = loaded.choice()
    assert [device.name for device in choice.devices] == ['oven']
    assert (choice.mode, choice.rviz, choice.bag) == (Mode.PLAYBACK, RvizStart.OPTIONAL, None)


def test_the_status_tells_at_once_that_it_launches(loaded: Launcher, qtbot: Any,
                                                   monkeypatch: pytest.MonkeyPatch) -> None:
    """Before the launch, a check for other publishers takes some time."""
    launched: List[Any] = []
    monkeypatch.setattr(loaded.guard, '_launch', launched.append)
    loaded.master.is_connected = True
    loaded.start()
    assert loaded.status() == 'Launching nodes…'
    qtbot.waitUntil(lambda: len(launched) == 1)
    assert loaded.status() == 'Idle'


def test_nothing_is_pending_while_what_runs_is_what_is_chosen(loaded: Launcher) -> None:
    assert loaded.pending() == ''
    run(loaded)
    assert loaded.pending() == ''


def test_ticks_are_pending_while_nodes_run(loaded: Launcher) -> None:
    loaded.cell.tick('press', False)
    run(loaded)
    loaded.cell.tick('press', True)
    loaded.cell.tick('oven', False)
    assert loaded.pending() == 'start press; stop oven'


def test_a_changed_device_is_pending_after_a_reload(loaded: Launcher, qtbot: Any,
                                                    config: Path) -> None:
    run(loaded)
    config.write_text('\n\n' + DEVICES.replace('1 0 0', '2 0 0').lstrip())
    with qtbot.waitSignal(loaded.cell.loaded):
        loaded.cell.reload()
    assert loaded.pending() == 'restart oven'


@pytest.mark.parametrize('mode', [Mode.REALTIME, Mode.PLAYBACK])
def test_only_what_runs_in_the_mode_is_restarted(loaded: Launcher, qtbot: Any, config: Path,
                                                 mode: Mode) -> None:
    play(loaded.session, '/a.bag')
    loaded.session.set_mode(mode)
    run(loaded)
    config.write_text(DEVICES.replace(
        'name="press"/>', 'name="press"><node pkg="press" type="driver.py" name="driver" '
        'ifstate="realtime"/></device>'))
    with qtbot.waitSignal(loaded.cell.loaded):
        loaded.cell.reload()
    assert loaded.pending() == ('restart press' if mode is Mode.REALTIME else '')


@pytest.mark.parametrize('is_taken', [True, False])
def test_a_pose_that_was_moved_and_saved_is_in_effect_if_the_nodes_took_it(
        loaded: Launcher, qtbot: Any, config: Path, monkeypatch: pytest.MonkeyPatch,
        is_taken: bool) -> None:
    """There are no nodes here: each move fails unless it is answered."""
    if is_taken:
        monkeypatch.setattr(loaded.link, 'move_frame', lambda *_: None)
    run(loaded)
    loaded.calibration.choose('oven')
    loaded.calibration.set_value(0, 1.23456789)
    with qtbot.waitSignal(loaded.cell.loaded):
        loaded.calibration.save()
    assert 'xyz="1.234568 0 0"' in config.read_text()
    qtbot.waitUntil(lambda: loaded.pending() == ('' if is_taken else 'restart oven'))


def test_only_the_pose_is_taken_as_in_effect(loaded: Launcher, qtbot: Any, config: Path) -> None:
    run(loaded)
    config.write_text(config.read_text().replace('frame="oven"', 'frame="hot"'))
    with qtbot.waitSignal(loaded.cell.loaded):
        loaded.cell.reload()
    loaded.calibration.choose('oven')
    loaded.calibration.set_value(0, 1.1)
    with qtbot.waitSignal(loaded.cell.loaded):
        loaded.calibration.save()
    assert loaded.pending() == 'restart oven'


def test_devices_are_not_changed_during_a_recording(loaded: Launcher,
                                                    monkeypatch: pytest.MonkeyPatch) -> None:
    messages: List[str] = []
    loaded.failed.connect(messages.append)
    run(loaded)
    monkeypatch.setattr(type(loaded.recording), 'is_recording', property(lambda _: True))
    loaded.apply()
    assert 'stop it before' in messages[0]
    assert loaded.launch.phase is LaunchPhase.RUNNING


def test_a_recorder_has_ended_when_its_process_has(loaded: Launcher) -> None:
    run(loaded)
    recorder = NodeReport('/bag_recorder', NodeState.RUNNING)
    for node, phase in ((recorder, RecordingPhase.WAITING),
                        (recorder.exited(-9), RecordingPhase.GONE)):
        loaded.launch.reports = {BAG_PART: PartReport(BAG_PART, PartState.RUNNING, (node,))}
        loaded.launch.changed.emit()
        assert loaded.recording.phase is phase


def test_what_the_status_waits_for(launcher: Launcher, qtbot: Any, config: Path) -> None:
    launcher.cell.open(str(config))
    assert launcher.status() == 'Reading the configuration…'
    launcher.master.is_connecting = True
    assert launcher.status() == 'Starting the ROS master…'
    launcher.master.is_connecting, launcher.master.is_connected = False, True
    qtbot.waitUntil(lambda: launcher.status() == 'Idle')


def test_a_master_that_is_lost_while_nothing_runs_is_an_alarm(loaded: Launcher) -> None:
    master = loaded.master
    master.is_lost = True
    master.lost.emit()
    assert [it.condition.source for it in loaded.alarms.alarms] == ['ROS master']
    master.is_lost = False
    master.returned.emit()
    assert loaded.alarms.alarms == ()


def test_the_status_says_why_the_button_launches_nothing(loaded: Launcher) -> None:
    loaded.master._report_failure(RosMasterError('the ROS master at http://a:1 does not answer'))
    assert loaded.status() == 'Cannot launch: the ROS master at http://a:1 does not answer'
    loaded.master.is_connected = True
    assert loaded.status() == 'Idle'
    loaded.cell.tick_only(set())
    assert loaded.status() == 'Cannot launch: tick a device first'
    loaded.cell.tick_only({'oven'})
    run(loaded)
    assert 'Cannot launch' not in loaded.status()


def test_the_status_says_that_the_nodes_are_those_of_another_file(loaded: Launcher) -> None:
    """Their errors do not concern the cell that is displayed."""
    run(loaded)
    running = loaded.launch.running
    assert running is not None and 'press Apply' not in loaded.status()
    loaded.launch.running = replace(running, cell=replace(running.cell, file='/old/press.xml'))
    loaded.launch.changed.emit()
    assert loaded.status().splitlines()[-1] == (
        'The nodes are still those of press.xml: press Apply to launch those of '
        f'{os.path.basename(running.cell.file)}.')


def test_another_configuration_and_its_recording_wait_for_apply(loaded: Launcher) -> None:
    """Apply is offered even if all devices are the same."""
    play(loaded.session, '/a.bag')
    loaded.session.set_mode(Mode.PLAYBACK)
    run(loaded)
    running = loaded.launch.running
    assert running is not None and loaded.pending() == ''
    name = os.path.basename(running.cell.file)
    loaded.launch.running = replace(running, cell=replace(running.cell, file='/old/press.xml'))
    loaded.launch.changed.emit()
    assert loaded.pending() == f'use {name}'
    play(loaded.session, '/b.bag')
    assert loaded.pending() == 'play b.bag'


def test_all_files_of_a_split_recording_are_played(loaded: Launcher,
                                                   monkeypatch: pytest.MonkeyPatch) -> None:
    play(loaded.session, '/a_0.bag', '/a_1.bag')
    assert loaded.choice().bag is None
    loaded.session.set_mode(Mode.PLAYBACK)
    assert (loaded.choice().bag, loaded.choice().further_bags) == ('/a_0.bag', ('/a_1.bag',))


@pytest.mark.parametrize('paths', [
    ('/b.bag',), ('/a_0.bag',), ('/b_0.bag', '/b_1.bag'), ('/a_0.bag', '/a_2.bag')])
def test_another_recording_is_played_with_all_its_files_and_no_others(
        loaded: Launcher, monkeypatch: pytest.MonkeyPatch, paths: 'tuple[str, ...]') -> None:
    applied: List[Any] = []
    monkeypatch.setattr(loaded.launch, 'apply', applied.append)
    play(loaded.session, '/a_0.bag', '/a_1.bag')
    loaded.session.set_mode(Mode.PLAYBACK)
    run(loaded)
    loaded.bag.chosen.emit()
    assert applied == []
    play(loaded.session, *paths)
    loaded.bag.chosen.emit()
    assert [(choice.bag, *choice.further_bags) for choice in applied] == [paths]


def test_a_recording_of_another_cell_does_not_end_the_player(
        loaded: Launcher, monkeypatch: pytest.MonkeyPatch) -> None:
    applied: List[Any] = []
    failed: List[str] = []
    monkeypatch.setattr(loaded.launch, 'apply', applied.append)
    loaded.failed.connect(failed.append)
    play(loaded.session, '/a.bag')
    loaded.session.set_mode(Mode.PLAYBACK)
    loaded.master.is_connected = True
    run(loaded)
    play(loaded.session, '/foreign.bag')
    monkeypatch.setattr(type(loaded.bag), 'is_foreign', property(lambda _: True))
    loaded.bag.chosen.emit()
    assert applied == []
    loaded.apply()
    assert failed == ['Nothing to play: foreign.bag has no topic of the ticked devices.']
    assert loaded.blocked_reason() == 'foreign.bag has no topic of the ticked devices'
    loaded.session.set_mode(Mode.REALTIME)
    assert loaded.blocked_reason() == ''


def test_a_recording_of_a_cell_that_does_not_run_yet_waits_for_apply(
        loaded: Launcher, monkeypatch: pytest.MonkeyPatch) -> None:
    """The player was restarted with the old cell's topics: "nothing can be played"."""
    applied: List[Any] = []
    monkeypatch.setattr(loaded.launch, 'apply', applied.append)
    play(loaded.session, '/a.bag')
    loaded.session.set_mode(Mode.PLAYBACK)
    loaded.master.is_connected = True
    run(loaded)
    running = loaded.launch.running
    assert running is not None
    loaded.session.set_run(replace(running, cell=replace(running.cell, file='/old.xml')), True, {})
    play(loaded.session, '/b.bag')
    loaded.bag.chosen.emit()
    assert applied == []
    loaded.session.set_run(running, True, {})
    loaded.bag.chosen.emit()
    assert [it.bag for it in applied][-1:] == ['/b.bag']


def test_a_recorder_that_refuses_other_topics_is_not_restarted(loaded: Launcher) -> None:
    """Another user is recording with it."""
    def refuse(_topics: Any) -> None:
        raise RecorderError('/x.bag is being recorded; stop that first')

    link: Any = SimpleNamespace(recorder=SimpleNamespace(watch=refuse))
    with pytest.raises(PlanError, match='Nothing was changed: /x.bag is being recorded'):
        _takes_topics(link, ['/a'])


def test_the_mode_of_what_runs_is_changed(loaded: Launcher,
                                          monkeypatch: pytest.MonkeyPatch) -> None:
    """One click each way: the same devices and the open recording."""
    applied: List[Any] = []
    monkeypatch.setattr(loaded.launch, 'apply', applied.append)
    play(loaded.session, '/a.bag')
    loaded.choose_mode(Mode.PLAYBACK)
    assert applied == []  # nothing runs
    loaded.choose_mode(Mode.REALTIME)
    loaded.cell.tick('press', False)
    run(loaded)
    loaded.choose_mode(Mode.REALTIME)
    assert applied == []
    for mode, bag in ((Mode.PLAYBACK, '/a.bag'), (Mode.REALTIME, None)):
        loaded.choose_mode(mode)
        assert [(it.mode, it.bag, [device.name for device in it.devices])
                for it in applied] == [(mode, bag, ['oven'])]
        applied.clear()


def test_a_recording_is_played_by_what_runs_once_it_is_read(
        loaded: Launcher, qtbot: Any, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    applied: List[Any] = []
    monkeypatch.setattr(loaded.launch, 'apply', applied.append)
    loaded.master.is_connected = True
    run(loaded)
    path = str(tmp_path / 'seam.bag')
    with rosbag.Bag(path, 'w') as bag:
        bag.write('/q', Float64(1.0), Time(1000))
    loaded.play((path,))
    assert loaded.session.mode is Mode.PLAYBACK and applied == []
    qtbot.waitUntil(lambda: bool(applied))
    assert [(it.mode, it.bag) for it in applied] == [(Mode.PLAYBACK, path)]


@pytest.mark.parametrize('is_other', [False, True])
def test_nothing_is_played_or_applied_by_nodes_whose_master_is_lost(
        loaded: Launcher, monkeypatch: pytest.MonkeyPatch, is_other: bool) -> None:
    """The window would be in playback mode, and the nodes in real-time mode."""
    applied: List[Any] = []
    told: List[str] = []
    monkeypatch.setattr(loaded.launch, 'apply', applied.append)
    loaded.failed.connect(told.append)
    run(loaded)
    loaded.master.is_lost, loaded.master.is_other = True, is_other
    loaded.master.problem = 'The ROS master was restarted'
    loaded.play(('/seam.bag',))
    loaded.apply()
    assert loaded.session.mode is Mode.REALTIME and applied == []
    assert not loaded.bag.is_loading
    assert told == 2 * ['Nothing was changed: the ROS master was restarted' + is_other * (
        ' and does not know the running nodes: stop the cell and start it again') + '.']


def test_a_recording_that_is_gone_changes_nothing(
        loaded: Launcher, qtbot: Any, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    applied: List[Any] = []
    told: List[str] = []
    monkeypatch.setattr(loaded.launch, 'apply', applied.append)
    loaded.failed.connect(told.append)
    loaded.master.is_connected = True
    run(loaded)
    path = str(tmp_path / 'seam.bag')
    monkeypatch.setattr(loaded.recording, '_state', loaded.recording.state._replace(
        finished=FinishedBag((path,))))
    window = QWidget()
    qtbot.addWidget(window)
    Quitting(window, loaded).play((path,))
    qtbot.waitUntil(lambda: bool(told))
    assert loaded.session.mode is Mode.REALTIME and applied == []
    assert told == [f'{path} no longer exists: it was moved or deleted. Nothing was changed.']
    assert loaded.recording.state.finished is None, 'it is not offered again'


def test_the_window_closes_when_the_end_of_a_recording_is_noted(
        loaded: Launcher, qtbot: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The recorder finished its bag, but ended before its last message was received."""
    bag = tmp_path / 'seam.bag'
    loaded.session.set_run(loaded.choice(), True, {})
    loaded.recording.take_state(RecorderSnapshot('recording', files=(str(bag),)))
    run(loaded)
    window = QWidget()
    qtbot.addWidget(window)
    command = Quitting(window, loaded)
    noted: List[str] = []  # at the first one, the launcher saves the events of the recording
    monkeypatch.setattr(loaded.bag, 'keep_open', lambda: noted.append('kept'))
    loaded.recording.finished.connect(noted.append)
    command.close_wanted.connect(lambda: noted.append('closed'))
    loaded.launch.quit = loaded.launch.stopped.emit  # type: ignore[method-assign]
    loaded.session.set_run(None, False, {})
    bag.touch()
    with qtbot.waitSignal(command.close_wanted):
        command.leave()
    assert noted == ['kept', str(bag), 'closed']


def test_a_dead_player_is_not_said_to_hang(loaded: Launcher, monkeypatch: pytest.MonkeyPatch
                                           ) -> None:
    loaded.session.set_mode(Mode.PLAYBACK)
    run(loaded)
    loaded.session.take_player(PlayerSnapshot(0.0, 0.0, 10.0, 1.0, 1.0, 1.0, False))
    for state, activity in ((PartState.RUNNING, ' The player is not responding'),
                            (PartState.FAILED, '')):
        loaded.session.set_run(loaded.choice(), True, {BAG_PART: PartReport(BAG_PART, state)})
        loaded.playback.state = loaded.playback.state._replace(is_silent=True)
        assert loaded.status() == f'In playback mode.{activity}'


def test_topics_that_are_not_ticked_are_not_played(loaded: Launcher,
                                                   monkeypatch: pytest.MonkeyPatch) -> None:
    loaded.session.set_mode(Mode.PLAYBACK)
    play(loaded.session, '/a.bag')
    run(loaded)
    monkeypatch.setattr(type(loaded.bag.played), 'left_out', property(lambda _: ('/oven/image',)))
    assert loaded.choice().left_out == ('/oven/image',)
    assert loaded.pending() == 'restart the player'
    loaded.session.set_mode(Mode.REALTIME)
    assert loaded.choice().left_out == ()


def test_marker_of_a_frame(loaded: Launcher, qtbot: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    told: List[Any] = []
    monkeypatch.setattr(loaded.link, 'show_marker', lambda *words: told.append(words))
    monkeypatch.setattr(loaded.link, 'move_marker', lambda *words: told.append(words))
    monkeypatch.setattr(loaded.link, 'hide_marker', lambda: told.append('hidden'))
    monkeypatch.setattr(loaded.calibration, '_move', lambda *_: None)
    loaded.calibration.set_running(True)
    loaded.calibration.show_marker(True)
    loaded.calibration.set_value(1, 0.5)
    loaded.calibration.show_marker(False)
    qtbot.waitUntil(lambda: len(told) == 3)
    assert told == [('world', 'oven', Pose((1.0, 0.0, 0.0))), ('oven', Pose((1.0, 0.5, 0.0))),
                    'hidden']


def test_what_is_dragged_moves_the_frame(loaded: Launcher, qtbot: Any,
                                         monkeypatch: pytest.MonkeyPatch) -> None:
    moved: List[Any] = []
    monkeypatch.setattr(loaded.link, 'show_marker', lambda *_: None)
    monkeypatch.setattr(loaded.link, 'hide_marker', lambda: None)
    monkeypatch.setattr(loaded.calibration, '_move', lambda *words: moved.append(words))
    loaded.calibration.set_running(True)
    loaded.calibration.show_marker(True)
    loaded.link.pose_dragged.emit('another', Pose((9.0, 0.0, 0.0)))
    loaded.link.pose_dragged.emit('oven', Pose((2.0, 0.0, 0.0)))
    qtbot.waitUntil(lambda: bool(moved))
    assert moved == [('oven', Pose((2.0, 0.0, 0.0)))]
    assert loaded.calibration.pose == Pose((2.0, 0.0, 0.0))


def test_playback_has_the_recording_of_the_last_time(loaded: Launcher, qtbot: Any,
                                                     tmp_path: Path) -> None:
    """In real-time mode no recording is read unless requested."""
    path = str(tmp_path / 'a.bag')
    with rosbag.Bag(path, 'w') as bag:
        bag.write('/n', Float64(1.0), Time(1000))
    loaded.bag.restore({'recent': [[path]], 'open': [path]})
    loaded.cell.tick('oven', False)
    assert not loaded.bag.is_loading
    loaded.session.set_mode(Mode.PLAYBACK)
    qtbot.waitUntil(lambda: loaded.session.paths == (path,))


def test_the_name_of_recordings_is_stored_at_once(loaded: Launcher, tmp_path: Path) -> None:
    path = str(tmp_path / 'launcher.conf')
    store_changes(loaded, Settings(path))
    loaded.recording.choices.set_prefix('seam')
    assert Settings(path).value('recording')['prefix'] == 'seam'


def test_a_program_that_begins_again_goes_on_where_it_was(loaded: Launcher) -> None:
    """It was started with a different configuration, mode and recording than are open now."""
    loaded.session.set_mode(Mode.PLAYBACK)
    loaded.cell.tick('oven', False)
    assert words_to_go_on(loaded.session, Viewers(True, '50000-50063'), [
        'gui', 'other.xml', '--mode', 'realtime', '--bag', 'b.bag', '--launch', '--remote',
        '--ports', '50000-50063', 'a:=1', '__name:=launcher']) == [
            'gui', '--mode', 'playback', '--devices', 'press', '--remote', '--ports',
            '50000-50063', '__name:=launcher']


def test_rviz_draws_little_while_a_replay_covers_it(launcher: Launcher,
                                                    monkeypatch: pytest.MonkeyPatch) -> None:
    told: List[bool] = []
    monkeypatch.setattr(launcher.link, 'cover_rviz', told.append)
    for phase in (ReplayPhase.PREPARING, ReplayPhase.SHOWN, ReplayPhase.LIVE):
        launcher.replay._phase = phase
        launcher.replay.changed.emit()
    assert told == [False, True, False]
