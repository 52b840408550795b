"""Roslaunch as forks of a program that has it loaded; the forks are real."""
from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path
from typing import Dict, Iterator

import pytest
import yaml

from process_visualizer.launching.forked_process import ForkedProcess
from process_visualizer.launching.process_scan import (
    RUN_VARIABLE,
    processes_of_run,
    wait_until_gone,
)
from process_visualizer.launching.roslaunch_forks import RoslaunchForks

RUN_ID = f'unit-test-forks-{os.getpid()}'


@pytest.fixture(autouse=True)
def environment(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Dict[str, str]:
    """An address at which there is no master, and the mark of a run."""
    monkeypatch.setenv('ROS_HOME', str(tmp_path))
    monkeypatch.setenv('ROS_MASTER_URI', 'http://127.0.0.1:9')
    return {**os.environ, RUN_VARIABLE: RUN_ID}


@pytest.fixture
def forks() -> Iterator[RoslaunchForks]:
    """A server, closed in the end."""
    made = RoslaunchForks()
    yield made
    made.close()


@pytest.fixture
def launch_file(tmp_path: Path) -> str:
    """A launch file with a node and with a parameter that a command gives."""
    path = tmp_path / 'a b.launch'
    path.write_text(f'<launch><param name="mark" command="printenv {RUN_VARIABLE}"/>'
                    '<node pkg="p" type="t" name="n" ns="d"/></launch>')
    return str(path)


def finished(process: ForkedProcess) -> 'tuple[int, str]':
    assert process.stdout is not None
    with process.stdout as output:
        text = output.read()
    return process.wait(30), text


def waiting(forks: RoslaunchForks, environment: Dict[str, str], launch_file: str) -> ForkedProcess:
    """A roslaunch that waits for a master."""
    process = forks.start(['--wait', launch_file], environment)
    assert process.stdout is not None
    assert 'will wait' in process.stdout.readline()
    return process


def records(environment: Dict[str, str]) -> 'list[Path]':
    return list(Path(environment['ROS_HOME'], 'process_visualizer', 'runs').glob('*'))


def test_arguments_environment_output_and_exit_code(
        forks: RoslaunchForks, environment: Dict[str, str], launch_file: str) -> None:
    code, output = finished(forks.start(['--nodes', launch_file], environment))
    assert (code, output) == (0, '/d/n\n')
    code, output = finished(forks.start(['--dump-params', launch_file], environment))
    assert (code, yaml.safe_load(output)) == (0, {'/mark': f'{RUN_ID}\n'})


def test_in_a_process_whose_sockets_have_a_timeout(
        forks: RoslaunchForks, environment: Dict[str, str], launch_file: str) -> None:
    before = socket.getdefaulttimeout()
    socket.setdefaulttimeout(60.0)
    try:
        forks.prepare()
    finally:
        socket.setdefaulttimeout(before)
    for _ in range(2):  # the server waits for the second
        code, output = finished(forks.start(['--nodes', launch_file], environment))
        assert (code, output) == (0, '/d/n\n')


def test_error(forks: RoslaunchForks, environment: Dict[str, str], tmp_path: Path) -> None:
    (tmp_path / 'bad.launch').write_text('<launch>')
    code, output = finished(forks.start(['--nodes', f'{tmp_path}/bad.launch'], environment))
    assert (code, 'Invalid roslaunch XML syntax' in output) == (1, True)
    code, output = finished(forks.start(['--no-such-option'], environment))
    assert (code, 'no such option' in output) == (2, True)


def test_signals(forks: RoslaunchForks, environment: Dict[str, str], launch_file: str) -> None:
    process = waiting(forks, environment, launch_file)
    assert process.poll() is None
    with pytest.raises(subprocess.TimeoutExpired):
        process.wait(0.01)
    assert os.getsid(process.pid) == os.getpgid(process.pid) == process.pid
    process.kill()
    assert finished(process)[0] == -signal.SIGKILL == process.poll()
    process.send_signal(signal.SIGKILL)  # to nobody


def test_one_that_ends_does_not_end_the_others(forks: RoslaunchForks, environment: Dict[str, str],
                                               launch_file: str) -> None:
    one, two = (waiting(forks, environment, launch_file) for _ in range(2))
    one.kill()
    finished(one)
    assert two.poll() is None
    two.kill()
    finished(two)


def test_close_ends_everything(forks: RoslaunchForks, environment: Dict[str, str],
                               launch_file: str) -> None:
    process = waiting(forks, environment, launch_file)
    assert len(records(environment)) == 1
    forks.close()
    finished(process)
    assert records(environment) == []
    forks.close()


def test_every_roslaunch_carries_the_mark_of_the_record(
        forks: RoslaunchForks, environment: Dict[str, str], launch_file: str) -> None:
    """So that a program that was killed can be cleaned up after."""
    process = waiting(forks, environment, launch_file)
    (record,) = records(environment)
    assert process.pid in processes_of_run(record.stem)
    assert len(processes_of_run(record.stem)) == 2
    process.kill()
    finished(process)


def test_server_that_was_killed(forks: RoslaunchForks, environment: Dict[str, str],
                                launch_file: str) -> None:
    process = waiting(forks, environment, launch_file)
    (record,) = records(environment)
    (server,) = set(processes_of_run(record.stem)) - {process.pid}
    os.kill(server, signal.SIGKILL)
    finished(process)  # the kernel has interrupted it
    assert finished(forks.start(['--nodes', launch_file], environment)) == (0, '/d/n\n')


def test_nothing_survives_a_program_that_is_killed(environment: Dict[str, str],
                                                   launch_file: str) -> None:
    script = ('import os, sys, time\n'
              'from process_visualizer.launching.roslaunch_forks import RoslaunchForks\n'
              'process = RoslaunchForks().start(["--wait", sys.argv[1]], os.environ)\n'
              'print(process.stdout.readline(), flush=True)\n'
              'time.sleep(60)\n')
    program = subprocess.Popen([sys.executable, '-c', script, launch_file], env=environment,
                               stdout=subprocess.PIPE, text=True)
    assert program.stdout is not None and 'will wait' in program.stdout.readline()
    (record,) = records(environment)
    assert len(processes_of_run(record.stem)) == 2
    program.kill()
    program.communicate()
    assert wait_until_gone(record.stem, 10.0)


def test_preparing_takes_no_time(forks: RoslaunchForks) -> None:
    begin = time.monotonic()
    forks.prepare()
    forks.prepare()
    assert time.monotonic() - begin < 0.3


def test_environment_that_is_no_text(forks: RoslaunchForks, environment: Dict[str, str],
                                     launch_file: str) -> None:
    environment[RUN_VARIABLE] = 'x' * 100_000  # more than fits into a pipe
    environment['ODD'] = '\udcff'
    code, output = finished(forks.start(['--dump-params', launch_file], environment))
    assert (code, output.count('x')) == (0, 100_000)
