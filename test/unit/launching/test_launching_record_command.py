# SPDX-License-Identifier: BSD-3-Clause
"""The end of ``cell record``: its report and exit code."""
from __future__ import annotations

import argparse
import json
import signal
import threading
from pathlib import Path
from typing import Any, Callable, Iterator, List, Optional

import pytest
import rosbag
import rospy
from std_msgs.msg import String, UInt32

from process_visualizer.clients.bag_recorder import (
    RecorderError,
    RecorderUnreachable,
    RecordingOptions,
)
from process_visualizer.commands.record_command import RecordRun, add_record_options, record_options
from process_visualizer.msg import RecorderState

FULL = 'the recording was stopped, because less than 1 MiB are free in /bags'


class Recorder:
    """The parts of a recorder and its process that are used when a recording ends."""

    def __init__(self, bag: str) -> None:
        self.bag = bag
        self.exit_code: Optional[int] = None
        self.has_master = True
        self.asked: List[Any] = []
        self.states: List[Optional[RecorderState]] = []
        self.ended = threading.Event()
        self.on_start: Callable[[], None] = lambda: None
        self.on_wait: Callable[[], None] = lambda: None

    def wait_until_ready(self, _timeout_s: float) -> None:
        self.asked.append('ready')

    def wait_for(self, condition: Callable[[RecorderState], bool], _timeout_s: float
                 ) -> Optional[RecorderState]:
        """Return one more state per call; None if none has arrived in time."""
        self.on_wait()
        state = self.states.pop(0)
        self.asked.append('time')
        return state if state is not None and condition(state) else None

    def start(self, _options: RecordingOptions) -> str:
        self.asked.append('start')
        self.on_start()
        return self.bag

    def stop(self) -> List[str]:
        self.asked.append('stop')
        if not self.has_master:
            raise RecorderUnreachable('the master does not answer')
        return [self.bag]

    def poll(self) -> Optional[int]:
        return self.exit_code

    def send_signal(self, number: int) -> None:
        self.asked.append(number)
        self.ended.set()

    def wait(self) -> int:
        self.ended.wait()
        return 0


@pytest.fixture
def recorder(tmp_path: Path) -> Iterator[Recorder]:
    """A recorder that has recorded a bag."""
    path = str(tmp_path / 'seam.bag')
    with rosbag.Bag(path, 'w') as bag:
        for number in range(100):
            bag.write('/n', UInt32(number), rospy.Time(1000 + number))
        account = {'topics': {'/n': {'received': 100, 'dropped': 0}}, 'clock_jumps': []}
        bag.write('/process_visualizer/recording', String(json.dumps(account)), rospy.Time(1100))
    found = Recorder(path)
    yield found
    found.ended.set()


@pytest.fixture
def own_signals() -> Iterator[None]:
    """The command's signal handlers are removed after the test."""
    before = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


def run_of(recorder: Recorder, *words: str) -> RecordRun:
    """A run of the command that has not received a recorder state so far."""
    parser = argparse.ArgumentParser()
    add_record_options(parser)
    process: Any = recorder
    return RecordRun(process, record_options(parser.parse_args(['/n', *words])))


def started(recorder: Recorder, *words: str) -> RecordRun:
    """A run of the command that has received the state of a recorder that records."""
    run = run_of(recorder, *words)
    run.take_state(RecorderState(state=RecorderState.RECORDING, files=[recorder.bag]))
    return run


def finish(run: RecordRun, recorder: Recorder) -> int:
    client: Any = recorder
    return run.finish(client)


def test_one_that_is_stopped_ends_with_0(recorder: Recorder, capsys: Any) -> None:
    assert finish(started(recorder), recorder) == 0
    assert recorder.asked == ['stop']
    assert 'verdict: complete' in capsys.readouterr().out


def test_one_that_has_ended_by_itself_ends_with_1(recorder: Recorder, capsys: Any) -> None:
    run = started(recorder)
    run.take_state(RecorderState(state=RecorderState.IDLE, files=[recorder.bag],
                                 problems=['an older one', FULL], problem_count=1))
    assert finish(run, recorder) == 1
    assert recorder.asked == []  # there is nothing to stop
    told = capsys.readouterr()
    assert told.err == f'{FULL}\n'
    assert 'verdict: complete' in told.out


def test_the_first_simulated_time_is_waited_for(recorder: Recorder, own_signals: None,
                                                capsys: Any) -> None:
    run, client = run_of(recorder), recorder  # type: Any, Any
    recorder.states = [None, RecorderState(), RecorderState(stamp=rospy.Time(1000))]
    recorder.on_start = lambda: run.take_state(RecorderState(files=[recorder.bag]))  # has ended
    assert run.run(client, RecordingOptions(), True) == 1
    assert recorder.asked == ['ready', *3 * ['time'], 'start']
    assert [line.partition(' ')[0] for line in capsys.readouterr().out.splitlines()][:2] == [
        'waiting', 'recording']


def test_one_that_dies_before_the_first_simulated_time_is_told(recorder: Recorder,
                                                               own_signals: None) -> None:
    def die() -> None:
        recorder.exit_code = -signal.SIGKILL
        signal.raise_signal(signal.SIGTERM)  # the end of the process ends the wait in the same way

    run, client = run_of(recorder), recorder  # type: Any, Any
    recorder.states, recorder.on_wait = [None], die
    with pytest.raises(RecorderError, match='died before it recorded anything'):
        run.run(client, RecordingOptions(), True)


def test_without_a_master_it_is_stopped_by_a_signal(recorder: Recorder, capsys: Any) -> None:
    recorder.has_master = False
    assert finish(started(recorder, '-q'), recorder) == 0
    assert recorder.asked == ['stop', signal.SIGINT, signal.SIGCONT]
    assert capsys.readouterr().out == ''


def test_of_one_that_has_died_it_says_how_the_bag_is_repaired(recorder: Recorder) -> None:
    run = started(recorder)
    recorder.exit_code = -signal.SIGKILL
    with pytest.raises(RecorderError, match=f'has died; .* cell reindex {recorder.bag}.active'):
        finish(run, recorder)
