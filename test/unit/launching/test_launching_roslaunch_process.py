# SPDX-License-Identifier: BSD-3-Clause
"""A child process instead of roslaunch: start and stop."""
from __future__ import annotations

import os
import signal
import socket
from pathlib import Path
from typing import Callable, Iterator, List

import pytest

from process_visualizer.launching import roslaunch_process
from process_visualizer.launching.roslaunch_process import (
    FarComputer,
    RoslaunchProcess,
    far_computers,
    silent,
)
from process_visualizer.launching.run_record import RUN_VARIABLE, processes_of_run

RUN_ID = f'unit-test-{os.getpid()}'
Start = Callable[[str], RoslaunchProcess]


@pytest.fixture
def start(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Start]:
    """Starts a shell script under the name roslaunch; stops remaining processes."""
    started: List[RoslaunchProcess] = []
    monkeypatch.setenv('PATH', os.pathsep.join([str(tmp_path), os.environ['PATH']]))

    def begin(script: str) -> RoslaunchProcess:
        path = tmp_path / 'roslaunch'
        path.write_text(f'#!/bin/sh\n{script}\n')
        path.chmod(0o755)
        started.append(RoslaunchProcess(['a b.launch'], RUN_ID))
        return started[-1]

    yield begin
    for process in started:
        process.stop()
        process.output.close()


def test_command_and_environment(start: Start) -> None:
    process = start(f'for word in "$@"; do echo "$word"; done; echo ${RUN_VARIABLE}; '
                    'echo to standard error >&2')
    assert process.output.read().splitlines() == [
        '--no-summary', '--disable-title', '--skip-log-check', 'a b.launch', RUN_ID,
        'to standard error']
    assert process.wait() == 0


def test_output_that_is_not_text(start: Start) -> None:
    assert start("printf 'a\\377b\\n'").output.read() == 'a\ufffdb\n'


def test_exit_code(start: Start) -> None:
    process = start('read line; exit 3')  # standard input is empty
    assert process.wait() == 3
    assert process.exit_code() == 3


def test_stop_after_the_end(start: Start) -> None:
    process = start('exit 0')
    process.wait()
    assert process.stop() == []
    assert process.stop() == []


def test_first_signal_is_an_interrupt(start: Start) -> None:
    process = start("trap 'echo interrupted; exit 5' INT; echo ready; while :; do sleep 0.05; done")
    assert process.output.readline() == 'ready\n'
    assert process.exit_code() is None
    assert process.stop() == []
    assert (process.output.read(), process.exit_code()) == ('interrupted\n', 5)


def test_what_roslaunch_leaves_behind_is_ended(start: Start) -> None:
    process = start('setsid sleep 60 >/dev/null & echo $!; exit 0')
    orphan = int(process.output.readline())
    process.wait()
    assert process.stop() == [orphan]
    assert processes_of_run(RUN_ID) == []


def test_child_is_not_interrupted_with_the_terminal(start: Start) -> None:
    """Ctrl-C reaches the foreground group; the child leads a group of its own."""
    process = start('echo $$; exec sleep 60')
    pid = int(process.output.readline())
    assert os.getsid(pid) == os.getpgid(pid) == pid != os.getpgrp()
    os.kill(pid, signal.SIGTERM)
    assert process.wait() == -signal.SIGTERM


@pytest.mark.parametrize('script', [
    "trap '' INT TERM; echo ready; exec sleep 1000",
    "trap 'sleep 0.5; exit 0' INT; echo ready; while :; do sleep 0.05; done"])
def test_a_computer_that_does_not_answer_is_told_and_left(
        start: Start, monkeypatch: pytest.MonkeyPatch, script: str) -> None:
    """roslaunch itself waits for minutes, or gives up without a message."""
    far = FarComputer('far', '10.0.0.9', 22, ('/oven/driver',))
    for name in ('_FAR_S', '_LOST_PERIOD_S'):
        monkeypatch.setattr(roslaunch_process, name, 0.1)
    monkeypatch.setattr(roslaunch_process, 'silent', list)
    told: List[str] = []
    process = start(script)
    assert process.output.readline() == 'ready\n'
    assert process.stop(told.append, [far]) == []
    assert [it.partition(': ')[::2] for it in told if not it.startswith('waiting')] == [
        ('no answer', '/oven/driver on far (10.0.0.9); waiting some seconds for its end'),
        ('could not be stopped', '/oven/driver on far (10.0.0.9), which does not answer; end it '
                                 'there, or restart that computer')]


def test_the_computers_of_a_launch_file(tmp_path: Path) -> None:
    path = tmp_path / 'a.launch'
    path.write_text('<launch><machine name="far" address="10.0.0.9" ssh-port="2222"/>'
                    '<machine name="near" address="b"/><node name="here"/><group ns="oven">'
                    '<node name="driver" machine="far"/></group></launch>')
    assert far_computers(str(path)) == [FarComputer('far', '10.0.0.9', 2222, ('/oven/driver',)),
                                        FarComputer('near', 'b', 22, ())]
    assert far_computers(str(tmp_path)) == []


def test_a_computer_that_refuses_does_answer() -> None:
    with socket.create_server(('127.0.0.1', 0)) as there:
        port = there.getsockname()[1]
        open_ = FarComputer('far', '127.0.0.1', port, ())
        assert silent([open_]) == []
    assert silent([open_, open_._replace(address='no name')]) == []
