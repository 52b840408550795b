# SPDX-License-Identifier: BSD-3-Clause
"""Roslaunch as real forks of a program that has loaded it."""
from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
import threading
from pathlib import Path
from typing import Any, Dict, Iterator, List, Tuple
from xmlrpc.server import SimpleXMLRPCServer

import pytest
from surroundings import PATIENCE_S, wait_until

from process_visualizer.launching.roslaunch_process import ForkedProcess, RoslaunchForks
from process_visualizer.launching.run_record import (
    RUN_VARIABLE,
    end_processes,
    processes_of_run,
    start_time,
    wait_until_gone,
)

RUN_ID = f'unit-test-forks-{os.getpid()}'


class Master(SimpleXMLRPCServer):
    """The parts of a ROS master that a roslaunch without nodes needs; keeps its parameters."""

    def __init__(self) -> None:
        super().__init__(('127.0.0.1', 0), logRequests=False, allow_none=True)
        self.uri = f'http://127.0.0.1:{self.server_address[1]}'
        self.parameters: Dict[str, Any] = {'/run_id': 'run'}
        self.register_multicall_functions()
        self.register_function(lambda caller: (1, '', 1), 'getPid')
        self.register_function(lambda caller: (1, '', self.uri), 'getUri')
        self.is_asked, self.may_answer = threading.Event(), threading.Event()
        self.may_answer.set()
        self.register_function(self.parameter, 'getParam')
        self.register_function(lambda caller, name: (1, '', name in self.parameters), 'hasParam')
        self.register_function(self.set_parameter, 'setParam')

    def parameter(self, _caller: str, name: str) -> Tuple[int, str, Any]:
        """Return a parameter once the master may answer."""
        self.is_asked.set()
        self.may_answer.wait()
        return int(name in self.parameters), '', self.parameters.get(name, 0)

    def set_parameter(self, _caller: str, name: str, value: Any) -> Tuple[int, str, int]:
        """Set a parameter."""
        self.parameters[name] = value
        return 1, '', 0


@pytest.fixture(scope='module')
def master() -> Iterator[Master]:
    """A running master."""
    server = Master()
    thread = threading.Thread(target=server.serve_forever, kwargs={'poll_interval': 0.02})
    thread.start()
    yield server
    server.shutdown()
    thread.join()
    server.server_close()


@pytest.fixture(autouse=True)
def environment(master: Master, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Dict[str, str]:
    """The address of the master, and the mark of a run."""
    monkeypatch.setenv('ROS_HOME', str(tmp_path))
    monkeypatch.setenv('ROS_MASTER_URI', master.uri)
    return {**os.environ, RUN_VARIABLE: RUN_ID}


@pytest.fixture
def forks() -> Iterator[RoslaunchForks]:
    """A server, closed at the end."""
    made = RoslaunchForks()
    yield made
    made.close()
    end_processes(RUN_ID)


@pytest.fixture
def launch_file(tmp_path: Path) -> str:
    """A launch file with a parameter that a command gives."""
    path = tmp_path / 'a b.launch'
    path.write_text(f'<launch><param name="/mark" command="printenv {RUN_VARIABLE}"/></launch>')
    return str(path)


@pytest.fixture
def endless(tmp_path: Path) -> str:
    """A launch file whose parameter command never ends."""
    path = tmp_path / 'endless.launch'
    path.write_text('<launch><param name="never" command="sleep 600"/></launch>')
    return str(path)


def finished(process: ForkedProcess) -> 'tuple[int, str]':
    assert process.stdout is not None
    with process.stdout as output:
        text = output.read()
    return process.wait(PATIENCE_S), text


def exit_code(process: ForkedProcess) -> int:
    """Wait for the end without the output, which processes of a dead roslaunch may keep open."""
    assert process.stdout is not None
    process.stdout.close()
    return process.wait(PATIENCE_S)


def records(environment: Dict[str, str]) -> 'list[Path]':
    return list(Path(environment['ROS_HOME'], 'process_visualizer', 'runs').glob('*'))


def test_file_environment_output_and_exit_code(
        forks: RoslaunchForks, environment: Dict[str, str], launch_file: str, master: Master
        ) -> None:
    code, output = finished(forks.start(['--option', launch_file], environment))
    assert (code, 'No processes to monitor' in output) == (0, True)
    assert master.parameters['/mark'] == f'{RUN_ID}\n'


def test_a_file_that_is_loaded_ahead_is_launched_when_it_is_started(
        forks: RoslaunchForks, environment: Dict[str, str], tmp_path: Path, master: Master
        ) -> None:
    loaded = tmp_path / 'loaded'
    path = tmp_path / 'ahead.launch'
    path.write_text(f'<launch><param name="/ahead" command="touch {loaded}"/></launch>')
    forks.load(str(path), environment)
    wait_until(loaded.exists, 'it is loaded')
    path.write_text('<launch/>')  # too late
    assert '/ahead' not in master.parameters
    code, output = finished(forks.start(['--option', str(path)], environment))
    assert (code, 'No processes to monitor' in output) == (0, True)
    assert '/ahead' in master.parameters
    assert finished(forks.start([str(path)], environment))[0] == 0, 'loaded anew'


def test_what_is_loaded_ahead_and_not_started_ends(
        forks: RoslaunchForks, environment: Dict[str, str], launch_file: str, endless: str) -> None:
    for path in (launch_file, endless):
        forks.load(path, environment)
    (record,) = records(environment)
    wait_until(lambda: len(processes_of_run(record.stem)) >= 3, 'both are loaded')
    assert finished(forks.start([launch_file], environment))[0] == 0
    forks.discard()
    forks.close()
    assert processes_of_run(record.stem) == []


def test_loaded_ones_end_when_they_are_discarded(
        forks: RoslaunchForks, environment: Dict[str, str], launch_file: str) -> None:
    forks.load(launch_file, environment)
    (record,) = records(environment)
    forks.discard()
    wait_until(lambda: len(processes_of_run(record.stem)) == 1, 'only the server is left')


def test_errors_of_a_file_that_is_loaded_ahead(
        forks: RoslaunchForks, environment: Dict[str, str], tmp_path: Path) -> None:
    path = tmp_path / 'bad.launch'
    path.write_text('<launch>')
    forks.load(str(path), environment)
    code, output = finished(forks.start([str(path)], environment))
    assert (code, 'RLException: Invalid roslaunch XML syntax' in output) == (1, True)


def test_in_a_process_whose_sockets_have_a_timeout(
        forks: RoslaunchForks, environment: Dict[str, str], launch_file: str) -> None:
    before = socket.getdefaulttimeout()
    socket.setdefaulttimeout(60.0)
    try:
        forks.prepare()
    finally:
        socket.setdefaulttimeout(before)
    for _ in range(2):  # the server waits for the second one
        assert finished(forks.start([launch_file], environment))[0] == 0


def test_errors(forks: RoslaunchForks, environment: Dict[str, str], tmp_path: Path) -> None:
    for text, message in [
            ('<launch>', 'Invalid roslaunch XML syntax'), ('<launch><param/></launch>', 'param'),
            ('<launch><include file="$(find no_such_package)/x"/></launch>', 'no_such_package')]:
        (tmp_path / 'bad.launch').write_text(text)
        code, output = finished(forks.start([f'{tmp_path}/bad.launch'], environment))
        assert code == 1
        assert message in output.partition('RLException: ')[2] and 'Traceback' not in output


def test_no_master(forks: RoslaunchForks, environment: Dict[str, str], launch_file: str) -> None:
    environment['ROS_MASTER_URI'] = 'http://127.0.0.1:9'
    code, output = finished(forks.start([launch_file], environment))
    assert (code, 'RLException: there is no ROS master at http://127.0.0.1:9' in output) == (
        1, True)


def test_signals(forks: RoslaunchForks, environment: Dict[str, str], endless: str) -> None:
    process = forks.start([endless], environment)
    assert process.poll() is None
    with pytest.raises(subprocess.TimeoutExpired):
        process.wait(0.01)
    assert os.getsid(process.pid) == os.getpgid(process.pid) == process.pid
    process.kill()
    assert exit_code(process) == -signal.SIGKILL == process.poll()
    process.send_signal(signal.SIGKILL)  # no process is left to receive it


def test_one_that_ends_does_not_end_the_others(forks: RoslaunchForks, environment: Dict[str, str],
                                               endless: str) -> None:
    one, two = (forks.start([endless], environment) for _ in range(2))
    one.kill()
    exit_code(one)
    assert two.poll() is None
    two.kill()
    exit_code(two)


def test_close_ends_everything(forks: RoslaunchForks, environment: Dict[str, str],
                               endless: str) -> None:
    process = forks.start([endless], environment)
    assert len(records(environment)) == 1
    forks.close()
    exit_code(process)
    assert records(environment) == []
    forks.close()


def test_every_roslaunch_carries_the_mark_of_the_record(
        forks: RoslaunchForks, environment: Dict[str, str], endless: str) -> None:
    """So that the processes of a killed program can be cleaned up."""
    process = forks.start([endless], environment)
    (record,) = records(environment)
    assert process.pid in processes_of_run(record.stem)
    process.kill()
    exit_code(process)


def test_server_that_was_killed(forks: RoslaunchForks, environment: Dict[str, str],
                                endless: str, launch_file: str) -> None:
    process = forks.start([endless], environment)
    (record,) = records(environment)
    server = min(processes_of_run(record.stem), key=start_time_of)
    os.kill(server, signal.SIGKILL)
    exit_code(process)  # interrupted by the kernel
    assert finished(forks.start([launch_file], environment))[0] == 0


def test_server_that_was_killed_while_a_roslaunch_begins(
        forks: RoslaunchForks, environment: Dict[str, str], endless: str, master: Master) -> None:
    """roslaunch itself takes an interrupt for a master that does not answer, and continues."""
    master.is_asked.clear()
    master.may_answer.clear()
    try:
        process = forks.start([endless], environment)
        (record,) = records(environment)
        server = min(processes_of_run(record.stem), key=start_time_of)
        assert master.is_asked.wait(PATIENCE_S)
        os.kill(server, signal.SIGKILL)
        wait_until(lambda: start_time(server) is None, 'the end of the server')
    finally:
        master.may_answer.set()
    exit_code(process)


def start_time_of(pid: int) -> int:
    return int(start_time(pid) or 0)


def test_nothing_survives_a_program_that_is_killed(environment: Dict[str, str],
                                                   endless: str) -> None:
    script = ('import os, sys, time\n'
              'from process_visualizer.launching.roslaunch_process import RoslaunchForks\n'
              'process = RoslaunchForks().start([sys.argv[1]], os.environ)\n'
              'print(process.poll() is None, flush=True)\n'
              'time.sleep(600)\n')
    program = subprocess.Popen([sys.executable, '-c', script, endless], env=environment,
                               stdout=subprocess.PIPE, text=True)
    assert program.stdout is not None and program.stdout.readline() == 'True\n'
    (record,) = records(environment)
    program.kill()
    program.communicate()
    assert wait_until_gone(record.stem, PATIENCE_S)


def test_preparing_does_not_wait_until_the_server_has_loaded_anything(
        forks: RoslaunchForks, environment: Dict[str, str], launch_file: str, tmp_path: Path,
        monkeypatch: pytest.MonkeyPatch) -> None:
    gate = tmp_path / 'gate'
    os.mkfifo(str(gate))
    (tmp_path / 'roslaunch.py').write_text(
        f'import sys\nopen("{gate}").close()\nsys.path.remove("{tmp_path}")\n'
        'del sys.modules["roslaunch"]\nimport roslaunch\n')
    monkeypatch.setenv('PYTHONPATH', f'{tmp_path}:{os.environ["PYTHONPATH"]}')
    opened: List[int] = []
    too_late = threading.Timer(PATIENCE_S, lambda: opened.append(os.open(str(gate), os.O_RDWR)))
    too_late.start()
    for _ in range(2):
        forks.prepare()
    assert not opened
    too_late.cancel()
    opened.append(os.open(str(gate), os.O_RDWR))
    assert finished(forks.start([launch_file], environment))[0] == 0
    os.close(opened[0])


def test_environment_that_is_no_text(forks: RoslaunchForks, environment: Dict[str, str],
                                     launch_file: str, master: Master) -> None:
    environment[RUN_VARIABLE] = 'x' * 100_000  # too long for a pipe
    environment['ODD'] = '\udcff'
    assert finished(forks.start([launch_file], environment))[0] == 0
    assert master.parameters['/mark'] == 'x' * 100_000 + '\n'
