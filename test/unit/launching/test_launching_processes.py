# SPDX-License-Identifier: BSD-3-Clause
"""Processes of a run are found by their mark, ended, and stored in a file."""
from __future__ import annotations

import glob
import json
import os
import signal
import subprocess
import sys
import uuid
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Callable, Dict, Iterator, List

import pytest

from process_visualizer.launching.run import LaunchRun
from process_visualizer.launching.run_record import (
    RUN_VARIABLE,
    RunRecord,
    clean_up_crashed_runs,
    end_processes,
    new_run_folder,
    processes_of_run,
    start_time,
    wait_until_gone,
)

Start = Callable[..., 'subprocess.Popen[str]']
STUBBORN = ('import signal, sys, time\nsignal.signal(signal.SIGTERM, signal.SIG_IGN)\n'
            'print("ready", flush=True)\ntime.sleep(60)\n')


@pytest.fixture(autouse=True)
def ros_home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The folder for run records."""
    monkeypatch.setenv('ROS_HOME', str(tmp_path))
    return tmp_path / 'process_visualizer' / 'runs'


@pytest.fixture
def run_id() -> str:
    """The mark of a run."""
    return uuid.uuid4().hex


@pytest.fixture
def start() -> Iterator[Start]:
    """Starts processes with a mark; kills the remaining ones at the end."""
    started: List['subprocess.Popen[str]'] = []

    def begin(mark: str, *command: str) -> 'subprocess.Popen[str]':
        environment: Dict[str, str] = {**os.environ, RUN_VARIABLE: mark}
        process = subprocess.Popen(command or ('sleep', '60'), env=environment, text=True,
                                   stdout=subprocess.PIPE, start_new_session=True)
        started.append(process)
        while not Path(f'/proc/{process.pid}/environ').read_bytes():
            os.sched_yield()  # it has not quite begun
        return process

    yield begin
    for process in started:
        process.kill()
        process.communicate()


def record_of(run: str, folder: Path, owner: object) -> Path:
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f'{run}.json'
    path.write_text(owner if isinstance(owner, str) else json.dumps(owner))
    return path


def gone_pid() -> int:
    process = subprocess.Popen(['true'])
    process.wait()
    return process.pid


def test_processes_are_found_by_their_mark(start: Start, run_id: str) -> None:
    mine, other = start(run_id), start(f'{run_id}x')
    assert processes_of_run(run_id) == [mine.pid]
    assert processes_of_run(f'{run_id}x') == [other.pid]
    assert processes_of_run(run_id[:-1]) == []


def test_grandchildren_are_found(start: Start, run_id: str) -> None:
    shell = start(run_id, 'sh', '-c', 'setsid sleep 60 & echo $!; wait')
    assert shell.stdout is not None
    grandchild = int(shell.stdout.readline())
    assert sorted(processes_of_run(run_id)) == sorted([shell.pid, grandchild])
    assert sorted(end_processes(run_id)) == sorted([shell.pid, grandchild])
    assert processes_of_run(run_id) == []


def test_who_executes_program_after_program_is_found_at_every_moment(start: Start,
                                                                     run_id: str) -> None:
    process = start(run_id, 'sh', '-c', 'exec sh -c "$0" "$0"', 'exec sh -c "$0" "$0"')
    assert [processes_of_run(run_id) for _ in range(100)] == [[process.pid]] * 100


def test_own_process_does_not_count(run_id: str) -> None:
    code = ('from process_visualizer.launching.run_record import processes_of_run\n'
            f'print(processes_of_run("{run_id}"))')
    found = subprocess.run([sys.executable, '-c', code], stdout=subprocess.PIPE, text=True,
                           env={**os.environ, RUN_VARIABLE: run_id}, check=True, timeout=30)
    assert found.stdout == '[]\n'


def test_dead_process_that_nobody_has_waited_for_does_not_count(start: Start, run_id: str) -> None:
    process = start(run_id)
    process.kill()
    os.waitid(os.P_PID, process.pid, os.WEXITED | os.WNOWAIT)
    assert processes_of_run(run_id) == []


def test_end_of_nothing(run_id: str) -> None:
    assert end_processes(run_id) == []
    assert wait_until_gone(run_id, 0.0) is True


def test_processes_get_the_chance_to_end_by_themselves(start: Start, run_id: str) -> None:
    process = start(run_id)
    assert end_processes(run_id) == [process.pid]
    assert process.wait(60) == -signal.SIGTERM


def test_waiting_has_an_end(start: Start, run_id: str) -> None:
    process = start(run_id)
    assert wait_until_gone(run_id, 0.1) is False
    assert process.poll() is None


def test_stubborn_process_is_killed(start: Start, run_id: str) -> None:
    process = start(run_id, sys.executable, '-c', STUBBORN)
    assert process.stdout is not None and process.stdout.readline() == 'ready\n'
    assert end_processes(run_id) == [process.pid]
    assert process.wait(60) == -signal.SIGKILL


def test_start_time() -> None:
    first, again = start_time(os.getpid()), start_time(os.getpid())
    assert first == again and first is not None and first.isdigit()
    assert start_time(gone_pid()) is None


def test_ended_process_whose_parent_does_not_ask_has_none() -> None:
    process = subprocess.Popen(['true'])
    os.waitid(os.P_PID, process.pid, os.WEXITED | os.WNOWAIT)
    assert start_time(process.pid) is None
    process.wait()


def test_record_names_its_owner(ros_home: Path) -> None:
    record = RunRecord()
    record.write()
    (path,) = ros_home.iterdir()
    assert path.name == f'{record.run_id}.json'
    assert json.loads(path.read_text()) == {
        'pid': os.getpid(), 'start_time': start_time(os.getpid()), 'folder': '',
        'is_replay': False}
    record.remove()
    record.remove()
    assert list(ros_home.iterdir()) == []


def test_runs_have_marks_of_their_own() -> None:
    assert RunRecord().run_id != RunRecord().run_id


def test_nothing_to_clean_up() -> None:
    assert clean_up_crashed_runs() == []


def test_living_run_is_left_alone(start: Start, ros_home: Path) -> None:
    record = RunRecord()
    record.write()
    process = start(record.run_id)
    assert clean_up_crashed_runs() == []
    assert process.poll() is None
    assert len(list(ros_home.iterdir())) == 1


@pytest.mark.parametrize('owner', [
    lambda: {'pid': gone_pid(), 'start_time': '1'},
    lambda: {'pid': os.getpid(), 'start_time': '1'},  # the process id is used again
    lambda: {'pid': gone_pid(), 'start_time': None},
    lambda: {'pid': os.getpid()}, lambda: [], lambda: '', lambda: '{"pid":', lambda: 'null'])
def test_crashed_run_is_cleaned_up(owner: Callable[[], object], start: Start, run_id: str,
                                   ros_home: Path) -> None:
    left, other = start(run_id), start('another')
    record_of(run_id, ros_home, owner())
    assert clean_up_crashed_runs() == [left.pid]
    assert left.wait(60) == -signal.SIGTERM
    assert other.poll() is None
    assert list(ros_home.iterdir()) == []


def test_owner_that_really_crashed(start: Start, ros_home: Path) -> None:
    """A program that starts a run and is killed, as by the kernel when memory runs out."""
    code = ('import os, subprocess, time\n'
            'from process_visualizer.launching.run_record import RUN_VARIABLE\n'
            'from process_visualizer.launching.run_record import RunRecord\n'
            'record = RunRecord()\n'
            'record.write()\n'
            'node = subprocess.Popen(["sleep", "60"], start_new_session=True,\n'
            '                        env={**os.environ, RUN_VARIABLE: record.run_id})\n'
            'print(node.pid, flush=True)\n'
            'time.sleep(60)\n')
    owner = start('owner', sys.executable, '-c', code)
    assert owner.stdout is not None
    node = int(owner.stdout.readline())
    assert clean_up_crashed_runs() == []
    owner.kill()
    owner.wait()
    assert clean_up_crashed_runs() == [node]
    assert list(ros_home.iterdir()) == []


@pytest.mark.parametrize('name, is_left', [
    ('process_visualizer-abc', False), ('my_documents', True), ('process_visualizer', True)])
def test_folder_of_a_crashed_run_is_removed(name: str, is_left: bool, ros_home: Path,
                                            tmp_path: Path) -> None:
    folder = tmp_path / name
    folder.mkdir()
    (folder / 'cell.launch').write_text('<launch/>')
    record_of('a', ros_home, {'pid': gone_pid(), 'start_time': '1', 'folder': str(folder)})
    assert clean_up_crashed_runs() == []
    assert folder.exists() == is_left


def test_folder_of_a_living_run_stays(ros_home: Path) -> None:
    folder = new_run_folder()
    record = RunRecord()
    record.write(folder)
    clean_up_crashed_runs()
    assert os.path.isdir(folder)
    os.rmdir(folder)
    record.remove()


def test_a_record_that_is_being_written_is_of_a_living_run(ros_home: Path) -> None:
    record = RunRecord()
    record.write()
    with ThreadPoolExecutor(1) as thread:
        writing = thread.submit(lambda: [record.write() for _ in range(1000)])
        while not writing.done():
            clean_up_crashed_runs()
            assert len(list(ros_home.glob('*.json'))) == 1
    record.remove()


def test_other_files_are_left_alone(ros_home: Path) -> None:
    ros_home.mkdir(parents=True)
    (ros_home / 'notes.txt').write_text('mine')
    assert clean_up_crashed_runs() == []
    assert [path.name for path in ros_home.iterdir()] == ['notes.txt']


def test_a_run_that_cannot_be_noted_leaves_no_folder(
        ros_home: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    temporary = tmp_path / 'temporary'
    temporary.mkdir()
    monkeypatch.setattr('tempfile.tempdir', str(temporary))
    ros_home.parent.write_text('no folder')
    with pytest.raises(OSError, match='ROS_HOME'):
        RunRecord().begin()
    assert not list(temporary.iterdir())
    ros_home.parent.unlink()
    assert Path(RunRecord().begin()).parent == temporary


def test_a_run_that_cannot_be_noted_leaves_no_open_log(tmp_path: Path,
                                                       monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / 'file').touch()
    monkeypatch.setenv('ROS_HOME', str(tmp_path / 'file'))
    with pytest.raises(OSError) as refused:
        LaunchRun(str(tmp_path / 'a.launch'), print)
    assert refused.value.__traceback__ is not None  # it still refers to the failed run
    opened = [os.path.realpath(it) for it in glob.glob('/proc/self/fd/*')]
    assert str(tmp_path / 'roslaunch.log') not in opened
