# SPDX-License-Identifier: BSD-3-Clause
"""The recording model with a stand-in for the recorder: phases, figures, faults."""
from __future__ import annotations

import threading
from pathlib import Path
from typing import Iterator, List

import pytest
import rosbag
from held_tasks import wait_for_line
from recording_stand_in import StandInRecorder, devices, told
from rospy import Time
from session_stand import choose, run
from std_msgs.msg import Float64

from process_visualizer.cell.model import Mode
from process_visualizer.clients.bag_recorder import RecorderError, RecorderUnreachable
from process_visualizer.gui.recording import recording_choices
from process_visualizer.gui.recording.recording_choices import BagTarget, NameChoice
from process_visualizer.gui.recording.recording_model import RecordingModel
from process_visualizer.gui.recording.recording_types import RecordingPhase
from process_visualizer.gui.session import Session
from process_visualizer.gui.toolkit.tasks import Tasks
from process_visualizer.launching.part_report import PartState


class Clock:
    """A clock that the test moves."""

    def __init__(self) -> None:
        self.now_s = 100.0

    def __call__(self) -> float:
        return self.now_s


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def tasks(qtbot: object) -> Iterator[Tasks]:
    lines = Tasks()
    yield lines
    lines.close()


@pytest.fixture
def session() -> Session:
    return Session()


@pytest.fixture
def model(tasks: Tasks, client: StandInRecorder, session: Session, clock: Clock,
          tmp_path: Path) -> RecordingModel:
    recording = RecordingModel(tasks, client, session, now_s=clock, judge=client.judge)
    recording.choices.set_folder(str(tmp_path))
    choose(session, devices())
    run(session, Mode.REALTIME)
    recording.take_state(told())
    recording.messages = messages = []  # type: ignore[attr-defined]
    recording.failed.connect(messages.append)
    return recording


@pytest.fixture
def recording(model: RecordingModel, client: StandInRecorder, qtbot) -> RecordingModel:
    model.start()
    qtbot.waitUntil(lambda: model.phase is RecordingPhase.RECORDING)
    model.take_state(told('recording', files=(client.path,), duration_s=1.0, time_left_s=4000.0,
                          free_bytes=10 ** 11))
    return model


def messages_of(model: RecordingModel) -> List[str]:
    return list(model.messages)  # type: ignore[attr-defined]


def test_a_recording_from_start_to_end(model, client, qtbot):
    client.gate.clear()
    model.start()
    assert model.phase is RecordingPhase.STARTING and model.is_recording
    model.take_state(told('idle'))  # sent before the recorder received the command
    assert model.phase is RecordingPhase.STARTING
    client.gate.set()
    qtbot.waitUntil(lambda: model.phase is RecordingPhase.RECORDING)
    assert model.state.path == client.path
    client.gate.clear()
    model.stop()
    assert model.phase is RecordingPhase.STOPPING
    model.take_state(told('idle', files=(client.path,), duration_s=2.0, problems=('p',)))
    with qtbot.waitSignal(model.finished) as signal:
        client.gate.set()
    assert signal.args == [client.path]
    assert model.phase is RecordingPhase.IDLE and not model.is_recording
    assert model.state.finished.files == (client.path,) and model.state.finished.problems == ('p',)
    assert client.commands == ['start', 'stop'] and messages_of(model) == []


def test_a_finished_bag_has_the_problems_that_are_told_at_its_end(recording, client, qtbot):
    """The parts of a problem that concern the present are left out then."""
    files = (client.path,)
    recording.take_state(told('recording', files=files, problems=('/a fell silent; look',)))
    with qtbot.waitSignal(recording.finished):
        recording.stop()
    for problems in (('/a fell silent',), ('/a fell silent', 'of another time')):
        recording.take_state(told('idle', files=files, problems=problems))
        assert recording.state.finished.problems == ('/a fell silent',)


def test_the_finished_bag_is_told_once(recording, client, qtbot):
    paths: List[str] = []
    recording.finished.connect(paths.append)
    recording.stop()
    qtbot.waitUntil(lambda: recording.phase is RecordingPhase.IDLE)
    recording.take_state(told('stopping', files=(client.path,)))  # sent before the answer
    recording.take_state(told('idle', files=(client.path,)))
    assert recording.phase is RecordingPhase.IDLE and paths == [client.path]


def test_a_state_from_before_the_answer_does_not_end_a_recording(model, client, qtbot):
    model.start()
    qtbot.waitUntil(lambda: model.phase is RecordingPhase.RECORDING)
    model.take_state(told('idle', files=('/bags/earlier.bag',)))
    assert model.phase is RecordingPhase.RECORDING and model.state.finished is None


def test_the_topics_that_are_ticked_are_recorded(model, client, qtbot):
    model.choices.tick('/robot/tcf', False)
    model.choices.tick('/kinect/points', True)
    model.start()
    qtbot.waitUntil(lambda: model.phase is RecordingPhase.RECORDING)
    assert client.options.topics == ('/robot/q_act', '/kinect/image', '/kinect/points')


def test_the_same_topics_are_not_listed_anew(model, qtbot, session):
    with qtbot.assertNotEmitted(model.choices.topics_changed):
        choose(session, devices())
    run(session, None)
    with qtbot.waitSignal(model.choices.topics_changed):
        choose(session, devices()[:1])


@pytest.mark.parametrize('is_up', [True, False])
def test_ticks_that_are_not_applied_leave_the_topics_alone(model, session, is_up):
    def names() -> List[str]:
        return [row.name for row in model.choices.topics]

    all_names = names()
    session.set_run(session.launched, is_up, session.reports)
    session.choose(session.chosen[:1])
    assert names() == all_names
    run(session, Mode.REALTIME)  # applied
    assert names() == ['/robot/q_act', '/robot/tcf']
    run(session, Mode.PLAYBACK)
    session.choose(session.devices)
    assert names() == all_names, 'nothing is recorded: those that would be'


def test_without_a_topic_nothing_is_started(model, client):
    for row in model.choices.topics:
        model.choices.tick(row.name, False)
    model.start()
    assert (
        'tick' in messages_of(model)[0]
        and model.phase is RecordingPhase.IDLE
        and not client.commands
    )


@pytest.mark.parametrize('choice, prefix, name', [
    (NameChoice.DATE, '', ''), (NameChoice.PREFIX, 'run', ''), (NameChoice.NAME, '', 'seam')])
def test_the_name(model, client, qtbot, choice, prefix, name):
    model.choices.set_prefix('run')
    model.choices.set_name('seam.bag')
    model.choices.choose_name(choice)
    model.start()
    qtbot.waitUntil(lambda: model.phase is RecordingPhase.RECORDING)
    assert (client.options.prefix, client.options.name) == (prefix, name)


def test_an_existing_file_is_told_before_and_at_the_start(model, client, tmp_path, qtbot):
    model.choices.choose_name(NameChoice.NAME)
    model.choices.set_name('seam')
    model.start()  # before the check of the disk has answered
    qtbot.waitUntil(lambda: model.phase is RecordingPhase.RECORDING)
    model.stop()
    Path(client.path).touch()
    qtbot.waitUntil(lambda: model.phase is RecordingPhase.IDLE)
    model.choices.set_name('seam')
    qtbot.waitUntil(lambda: 'exists already' in model.choices.problem)
    assert model.choices.free_name == 'seam-2'
    model.start()
    assert 'seam.bag exists already' in messages_of(model)[0] and model.phase is RecordingPhase.IDLE
    assert client.commands == ['start', 'stop']


def test_a_file_that_appeared_meanwhile_is_not_overwritten(model, client, qtbot):
    model.choices.choose_name(NameChoice.NAME)
    model.choices.set_name('seam')
    qtbot.waitUntil(lambda: model.choices.free_bytes is not None)
    Path(client.path).touch()
    with qtbot.waitSignal(model.failed) as signal:
        model.start()
    assert 'exists already' in signal.args[0] and client.commands == []
    assert model.phase is RecordingPhase.IDLE


def test_a_refusal_of_a_folder_goes_with_another_folder(model, tmp_path, qtbot):
    model.choices.set_folder('bags')
    qtbot.waitUntil(lambda: 'Enter a full path' in model.choices.problem)
    model.start()
    assert 'Enter a full path' in model.state.error
    model.choices.changed.emit()  # for example by the recorder's figures
    assert 'Enter a full path' in model.state.error
    model.choices.set_folder(str(tmp_path))
    assert model.state.error == ''


def test_a_refusal_by_the_recorder_goes_with_another_folder(model, client, tmp_path, qtbot):
    client.error = RecorderError('/data is none of its folders')
    for command in (model.start, model.save_recent):
        with qtbot.waitSignal(model.failed):
            command()
        assert model.state.error == '/data is none of its folders'
        model.choices.set_folder(f'{model.choices.folder}/other')
        assert model.state.error == ''


def test_what_a_folder_has_to_do_with_nothing_stays(recording, client, tmp_path, qtbot):
    client.error = RecorderError('no place')
    with qtbot.waitSignal(recording.failed):
        recording.mark()
    recording.choices.set_folder(str(tmp_path / 'other'))
    assert 'was not written' in recording.state.error


def test_what_was_found_in_the_folder_before_says_nothing_of_the_next(
        model, monkeypatch, qtbot):
    gates = {'/before': threading.Event(), '/next': threading.Event()}
    begun: List[str] = []

    def held(folder: str, *_names: str) -> BagTarget:
        begun.append(folder)
        if folder not in gates:  # it was requested before
            return BagTarget()
        assert gates[folder].wait(60)
        return BagTarget(f'you have no write permission for {folder}')

    qtbot.waitUntil(lambda: model.choices.free_bytes is not None)
    monkeypatch.setattr(recording_choices, 'look_at', held)
    for folder in gates:
        model.choices.set_folder(folder)
    gates['/before'].set()
    qtbot.waitUntil(lambda: '/next' in begun)  # so the earlier result has been processed
    problem = model.choices.problem
    gates['/next'].set()
    qtbot.waitUntil(lambda: '/next' in model.choices.problem)
    assert problem == ''


def test_a_name_has_to_be_given(model):
    model.choices.choose_name(NameChoice.NAME)
    model.start()
    assert 'write a name' in messages_of(model)[0]


def test_the_clock_goes_on_between_states_and_never_back(recording, clock):
    clock.now_s += 0.4
    assert recording.elapsed_s == pytest.approx(1.4)
    recording.take_state(told('recording', files=(recording.state.path,), duration_s=1.35))
    assert recording.elapsed_s == pytest.approx(1.4)
    clock.now_s += 60.0  # the recorder is silent from now on
    assert recording.elapsed_s < 5.0


def test_marks_have_numbers_or_labels(recording, client, qtbot):
    recording.mark()
    recording.set_label(' the seam tears ')
    recording.mark()
    assert recording.state.label == ''
    assert [it.label for it in recording.state.marks] == ['mark 1', 'the seam tears']
    assert recording.state.next_label == 'mark 3'
    qtbot.waitUntil(lambda: client.commands[1:] == ['mark mark 1', 'mark the seam tears'])


def test_a_mark_may_be_of_a_moment_ago(recording, client, clock, qtbot):
    recording.take_state(told('recording', files=(client.path,), duration_s=1.0, stamp_s=5000.0))
    clock.now_s += 10.0
    recording.mark(7.0)
    recording.mark(1000.0)  # before the recording began
    assert [it.time_s for it in recording.state.marks] == [4.0, 0.0]
    qtbot.waitUntil(lambda: len(client.stamps_s) == 2)
    assert client.stamps_s == [5003.0, 4999.0]


def test_a_mark_that_fails_is_told_and_not_counted(recording, client, qtbot):
    client.error = RecorderError('no place')
    with qtbot.waitSignal(recording.failed) as signal:
        recording.mark()
    assert 'mark 1 was not written' in signal.args[0] and recording.state.marks == ()


def test_a_mark_waits_with_its_time_until_the_recorder_responds(recording, client, clock, tasks,
                                                                qtbot):
    state = told('recording', files=(client.path,), duration_s=1.0, stamp_s=5000.0)
    recording.take_state(state)
    clock.now_s += 20.0  # it hangs
    client.error = RecorderUnreachable('no answer')
    recording.mark()
    qtbot.waitUntil(lambda: client.commands[1:] == ['mark mark 1'])
    wait_for_line(tasks, 'recorder', qtbot)
    assert messages_of(recording) == []
    assert [it.time_s for it in recording.state.unwritten] == [21.0]
    client.error = None
    clock.now_s += 10.0
    recording.take_state(state._replace(duration_s=31.0, stamp_s=5030.0))
    qtbot.waitUntil(lambda: not recording.state.unwritten)
    assert client.stamps_s == [5020.0, 5020.0] and recording.state.marks[0].is_written


@pytest.mark.parametrize('is_heard', [False, True])
def test_a_mark_that_nobody_took_is_told_when_the_recording_ends(recording, client, session, tasks,
                                                                 is_heard, qtbot):
    client.error = RecorderUnreachable('no answer')
    recording.mark()
    wait_for_line(tasks, 'recorder', qtbot)
    with qtbot.waitSignal(recording.failed) as signal:
        if is_heard:  # too late for the mark
            recording.take_state(told(files=(client.path,)))
        else:
            run(session, None)
    assert 'mark 1 was not written' in signal.args[0] and recording.state.marks == ()


def test_there_are_no_marks_without_a_recording(model, client):
    model.mark()
    assert model.state.marks == () and client.commands == []


def test_saving_the_last_seconds(model, client, qtbot):
    model.choices.choose_name(NameChoice.NAME)
    model.choices.set_name('seam')
    with qtbot.waitSignal(model.finished) as signal:
        model.save_recent()
        model.take_state(told('stopping', files=(client.path,)))
        assert model.phase is RecordingPhase.STOPPING and model.state.path == ''
    assert signal.args == [client.path]
    assert client.options.recent_s == 30.0
    assert (client.options.prefix, client.options.name) == ('seam', '')


def test_nothing_to_save(model, client):
    model.take_state(told(recent_s=0.0))
    model.save_recent()
    assert model.phase is RecordingPhase.IDLE and client.commands == []


def test_low_disk(recording):
    assert not recording.room.is_low
    recording.take_state(told('recording', files=(recording.state.path,), time_left_s=200.0,
                              free_bytes=5 * 10 ** 9))
    assert recording.room.is_low and recording.room.free_bytes == 5 * 10 ** 9


def test_the_time_left_is_known_before_the_start(model, qtbot):
    qtbot.waitUntil(lambda: model.choices.free_bytes is not None)
    free = model.choices.free_bytes
    assert model.room.time_left_s == pytest.approx((free - (1 << 30)) / 20e6)


def test_a_refusal_is_told_and_leaves_the_recorder_idle(model, client, qtbot):
    client.error = RecorderError('not recording, because /robot/q_act does not send')
    with qtbot.waitSignal(model.failed) as signal:
        model.start()
    assert signal.args == ['not recording, because /robot/q_act does not send']
    assert model.phase is RecordingPhase.IDLE and model.state.error == signal.args[0]
    client.error = None
    model.start()
    assert model.state.error == ''
    qtbot.waitUntil(lambda: model.phase is RecordingPhase.RECORDING)


@pytest.mark.parametrize('problem, expected', [
    ('the disk is full', 'the recording has stopped: the disk is full'),
    2 * ('the recording was stopped, because the disk is full',)])
def test_the_disk_is_full_while_recording(recording, client, qtbot, problem, expected):
    with qtbot.waitSignals([recording.finished, recording.failed]):
        recording.take_state(told('idle', files=(client.path,), problems=(problem,)))
    assert messages_of(recording) == [expected]
    assert recording.phase is RecordingPhase.IDLE and recording.state.finished.files == (
        client.path,
    )


def test_a_stop_that_could_not_write_everything(recording, client, qtbot):
    client.error = RecorderError('the disk is full')
    with qtbot.waitSignals([recording.finished, recording.failed]):
        recording.stop()
    assert recording.phase is RecordingPhase.IDLE and messages_of(recording) == ['the disk is full']


def test_a_stop_that_fails_after_all_nodes_were_quit(recording, client, qtbot, session):
    client.gate.clear()
    recording.stop()
    run(session, None)
    client.error = RecorderError('the recorder is not recording')
    with qtbot.waitSignal(recording.failed):
        client.gate.set()
    assert recording.phase is RecordingPhase.OFF and recording.state.finished is None


def test_a_master_that_is_gone_does_not_end_the_recording(recording, client, qtbot):
    client.error = RecorderUnreachable('/bag_recorder does not answer')
    with qtbot.waitSignal(recording.failed) as signal:
        recording.stop()
    assert f'{client.path} is still being recorded' in signal.args[0]
    assert 'quit' not in signal.args[0].lower()
    assert recording.phase is RecordingPhase.RECORDING


def test_a_recorder_that_says_nothing_goes_on_recording_and_the_verdict_ends_with_it(
        recording, client, qtbot):
    recording._silence._timer.setInterval(1)
    recording.take_state(told('recording', files=(client.path,)))
    qtbot.waitUntil(lambda: recording.state.is_silent)
    assert recording.is_recording and recording.state.path == client.path
    assert messages_of(recording) == [] and recording.state.error == ''
    recording._silence._timer.setInterval(60_000)
    recording.take_state(told('recording', files=(client.path,)))
    assert not recording.state.is_silent and recording.phase is RecordingPhase.RECORDING


def test_what_says_nothing_can_be_stopped_and_answers_when_it_responds(recording, client, qtbot):
    recording._silence._timer.setInterval(1)
    recording.take_state(told('recording', files=(client.path,)))
    qtbot.waitUntil(lambda: recording.state.is_silent)
    with qtbot.waitSignal(recording.finished):
        recording.stop()
    assert messages_of(recording) == []


def test_nothing_is_started_while_the_recorder_says_nothing(model, client, qtbot):
    model._silence._timer.setInterval(1)
    model.take_state(told())
    qtbot.waitUntil(lambda: model.state.is_silent)
    model.start()
    assert 'Start when it responds' in messages_of(model)[0] and client.commands == []


def test_a_recorder_that_has_ended_without_finishing_its_bag(recording, client, qtbot, session):
    with qtbot.waitSignal(recording.failed) as signal:
        run(session, Mode.REALTIME, PartState.FAILED)
    assert (
        recording.phase is RecordingPhase.GONE
        and f'cell reindex {client.path}.active' in signal.args[0]
    )
    run(session, Mode.REALTIME, PartState.FAILED)  # sent with every report
    recording.take_state(told())
    assert recording.phase is RecordingPhase.IDLE and len(messages_of(recording)) == 1


def test_a_recorder_that_has_ended_and_finished_its_bag(recording, client, qtbot, session):
    Path(client.path).touch()
    with qtbot.waitSignal(recording.finished) as signal:
        run(session, Mode.REALTIME, PartState.FAILED)
    assert signal.args == [client.path] and messages_of(recording) == []


def test_what_an_ended_recorder_has_written_is_made_a_bag(recording, client, qtbot, session):
    with rosbag.Bag(client.path, 'w', chunk_threshold=2000) as bag:
        for number in range(1000):
            bag.write('/feed', Float64(number), Time(1000, 1_000_000 * number))
    data = Path(client.path).read_bytes()
    Path(client.path).unlink()
    Path(f'{client.path}.active').write_bytes(data[:int(0.8 * len(data))])
    with qtbot.waitSignal(recording.broken_off) as broken_off:
        run(session, Mode.REALTIME, PartState.FAILED)
    assert broken_off.args == [client.path] and 'Recover' in messages_of(recording)[0]
    copy = client.path.replace('.bag', '.reindexed.bag')
    with qtbot.waitSignal(recording.finished) as finished:
        recording.recover()
        recording.recover()  # once is enough
    state = recording.state
    assert finished.args == [copy] == list(state.finished.files)
    assert (state.error, state.unfinished, state.recovered) == ('', '', None)
    assert state.finished.recovery.startswith(f'{Path(copy).name}: recovered the first 0.')


def test_a_file_of_which_nothing_can_be_recovered(recording, client, qtbot, session):
    Path(f'{client.path}.active').write_bytes(b'#ROSBAG V2.0\n')
    with qtbot.waitSignal(recording.failed):
        run(session, Mode.REALTIME, PartState.FAILED)
    with qtbot.waitSignal(recording.failed) as signal:
        recording.recover()
    assert f'{client.path}.active' in signal.args[0]
    assert recording.state.unfinished == client.path and recording.state.recovered is None
    run(session, None)
    assert recording.state.unfinished and recording.state.error  # still offered


def test_a_recorder_that_was_started_anew(recording, clock, client, qtbot):
    clock.now_s += 10.0
    with qtbot.waitSignal(recording.failed) as signal:
        recording.take_state(told('idle', files=(), stamp_s=10.0))
    assert recording.phase is RecordingPhase.IDLE and recording.state.finished is None
    assert f'cell reindex {client.path}.active' in signal.args[0]


def test_a_state_that_waited_while_the_computer_stood_still(recording, clock):
    clock.now_s += 30.0
    recording.take_state(told('idle', files=(), stamp_s=0.0))  # sent before the recording began
    assert recording.phase is RecordingPhase.RECORDING and messages_of(recording) == []


def test_a_recording_that_somebody_else_started(model, clock):
    model.take_state(told('recording', files=('/bags/other.bag',), duration_s=7.0))
    assert model.phase is RecordingPhase.RECORDING and model.state.path == '/bags/other.bag'
    assert model.elapsed_s == pytest.approx(7.0)
    clock.now_s += 10.0
    model.take_state(told('idle', files=('/bags/other.bag',), duration_s=8.0))
    assert model.state.finished.files == ('/bags/other.bag',) and messages_of(model) == []


def test_that_it_runs_may_be_told_again(recording, session):
    run(session, Mode.REALTIME)
    assert recording.phase is RecordingPhase.RECORDING


def test_nothing_runs(model, client, session):
    run(session, None)
    model.take_state(told())
    assert model.phase is RecordingPhase.OFF
    model.start()
    assert 'launch the devices' in messages_of(model)[0] and client.commands == []
    run(session, Mode.REALTIME)
    assert model.phase is RecordingPhase.WAITING


def test_in_a_folder_that_cannot_be_written_nothing_is_started(model, client, qtbot):
    model.choices.set_folder('/proc/recordings')
    qtbot.waitUntil(lambda: '/proc' in model.choices.problem)
    model.start()
    assert '/proc' in messages_of(model)[0]
    assert model.phase is RecordingPhase.IDLE and client.commands == []


def test_the_run_ends_while_a_recording_starts(model, tasks, client, qtbot, session):
    client.gate.clear()
    model.start()
    run(session, None)
    client.gate.set()
    wait_for_line(tasks, 'recorder', qtbot)
    assert model.phase is RecordingPhase.OFF and client.commands == ['start']
    Path(client.path).touch()
    with qtbot.waitSignal(model.finished):
        model.take_end_of_run()


def test_the_run_is_ended_while_something_is_recorded(recording, tasks, client, qtbot, session):
    run(session, None)
    Path(client.path).touch()
    with qtbot.waitSignal(recording.finished) as signal:
        recording.take_end_of_run()
    assert signal.args == [client.path] and recording.state.finished.files == (client.path,)
    assert recording.phase is RecordingPhase.OFF
    with qtbot.assertNotEmitted(recording.finished):
        recording.take_end_of_run()
        wait_for_line(tasks, 'files', qtbot)


def test_a_bag_that_was_not_finished_is_told(recording, client, qtbot, session):
    run(session, None)
    with qtbot.waitSignal(recording.failed) as signal:
        recording.take_end_of_run()
    assert f'cell reindex {client.path}.active' in signal.args[0]


def test_settings_are_remembered(model, tasks, client):
    model.choices.choose_name(NameChoice.PREFIX)
    model.choices.set_prefix('run')
    other = RecordingModel(tasks, client, Session(), model)  # kept alive until its request is done
    other.choices.restore({**model.choices.settings(), 'unknown': 'x'})
    assert other.choices.settings() == model.choices.settings()
    other.choices.restore({'choice': 'nonsense'})
    assert other.choices.name_choice is NameChoice.PREFIX


def test_a_window_that_was_held_up_does_not_lose_the_recorder(recording, client):
    """Qt fires a timer only once if it was due several times while the thread was blocked."""
    for _ in range(5):
        recording._silence._timer.timeout.emit()
        recording.take_state(told('recording', files=(client.path,)))
    assert recording.phase is RecordingPhase.RECORDING and messages_of(recording) == []
