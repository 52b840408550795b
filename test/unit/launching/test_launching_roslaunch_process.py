# SPDX-License-Identifier: BSD-3-Clause
"""A child that stands in for roslaunch: how it is started and stopped."""
from __future__ import annotations

import os
import signal
from pathlib import Path
from typing import Callable, Iterator, List

import pytest

from process_visualizer.launching.roslaunch_process import RoslaunchProcess
from process_visualizer.launching.run_record import RUN_VARIABLE, processes_of_run

RUN_ID = f'unit-test-{os.getpid()}'
Start = Callable[[str], RoslaunchProcess]


@pytest.fixture
def start(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Start]:
    """Starts a shell script under the name roslaunch; stops what is left of it."""
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
