# SPDX-License-Identifier: BSD-3-Clause
"""The launcher as a program: its end, what is left when it is killed, and bad surroundings."""
from __future__ import annotations

import os
import signal
import socket
from pathlib import Path
from typing import Any, Callable, Iterator, List

import pytest
import rosbag
from genpy import Time
from running_program import SMALL_CELL_NODES, Program, Surroundings, gui
from std_msgs.msg import Float64
from surroundings import wait_until

from process_visualizer.bagio.catalog import read_catalog
from process_visualizer.bagio.reindex import reindex
from process_visualizer.gui.app.settings import Settings

Start = Callable[..., Program]


@pytest.fixture
def around(tmp_path: Path) -> Iterator[Surroundings]:
    made = Surroundings(tmp_path)
    yield made
    made.end_all()


@pytest.fixture
def start(around: Surroundings) -> Iterator[Start]:
    """Starts a launcher, with the command for it."""
    started: List[Program] = []

    def start_one(command: List[str]) -> Program:
        started.append(Program(command, around))
        return started[-1]

    yield start_one
    for program in started:
        if program.process.poll() is None:
            program.process.kill()
            program.process.wait()


def wait_until_launched(around: Surroundings, program: Program) -> None:
    wait_until(lambda: around.nodes() >= SMALL_CELL_NODES, 'all nodes are up',
               instead=lambda: (around.nodes(), program.lines))


def record(around: Surroundings, folder: Path, name: str = 'taken') -> Path:
    """Let the recorder record; return the bag once it has messages."""
    bag = folder / f'{name}.bag'
    active = folder / f'{name}.bag.active'
    around.call('/bag_recorder/start',
                f'{{topics: [/feed_rate_est, /tf], folder: "{folder}", name: {name}}}')
    wait_until(lambda: active.is_file() and active.stat().st_size > 10_000, 'it records',
               instead=lambda: list(folder.iterdir()))
    return bag


def wait_until_alone(around: Surroundings) -> None:
    wait_until(lambda: not around.processes(), 'nothing is left', instead=around.processes)


def test_interrupted_while_recording(around: Surroundings, start: Start, tmp_path: Path) -> None:
    program = start(gui(str(around.config), '--launch'))
    wait_until_launched(around, program)
    bag = record(around, tmp_path)
    second_launcher_is_refused(around, start)
    assert program.end(signal.SIGINT) == 0, program.lines
    assert read_catalog([str(bag)]).duration_s > 0.0
    assert not list(tmp_path.glob('*.active'))
    assert not around.is_master_there()
    assert around.processes() == set()
    assert not program.says('Traceback'), ''.join(program.lines)


def second_launcher_is_refused(around: Surroundings, start: Start) -> None:
    second = start(gui(str(around.config), '--launch'))
    wait_until(lambda: second.says('Another launcher (process '), 'it is refused',
               instead=lambda: second.lines)
    assert second.process.poll() is None
    assert second.end(signal.SIGTERM) == 0, second.lines
    assert around.nodes() >= SMALL_CELL_NODES


def test_killed_while_recording(around: Surroundings, start: Start, tmp_path: Path) -> None:
    program = start(gui(str(around.config), '--launch'))
    wait_until_launched(around, program)
    bag = record(around, tmp_path)
    program.process.kill()
    wait_until_alone(around)
    if not bag.exists():
        bag = Path(reindex(f'{bag}.active').path)
    assert read_catalog([str(bag)]).duration_s > 0.0
    starts_again_after_more_was_killed(around, start, tmp_path)


def starts_again_after_more_was_killed(around: Surroundings, start: Start, folder: Path) -> None:
    """With roslaunch killed too, only the next launcher can end the nodes."""
    [left] = around.run_folders()
    program = start(gui(str(around.config), '--launch'))
    wait_until_launched(around, program)
    assert len(around.run_folders() - {left}) == 1 and not left.exists()
    for line in sorted(around.processes()):
        if 'launching.roslaunch_server' in line or 'roslaunch --' in line:
            os.kill(int(line.split()[0]), signal.SIGSTOP)
    program.process.kill()
    for line in around.processes():
        if 'launching.roslaunch_server' in line or 'roslaunch --' in line:
            os.kill(int(line.split()[0]), signal.SIGKILL)
    assert any('simulator' in line for line in around.processes())
    again = start(gui(str(around.config), '--launch'))
    wait_until(lambda: again.says('A launcher that was not closed properly left'), 'it says so',
               instead=lambda: again.lines)
    wait_until_launched(around, again)
    assert sum('__name:=simulator' in line for line in around.processes()) == 1
    assert len(around.run_folders()) == 1
    terminated_while_recording(around, again, record(around, folder, 'second'))


def terminated_while_recording(around: Surroundings, program: Program, bag: Path) -> None:
    assert program.end(signal.SIGTERM) == 0, program.lines
    assert read_catalog([str(bag)]).duration_s > 0.0
    assert not list(bag.parent.glob('second*.active'))
    assert around.processes() == set()
    assert around.run_folders() == set()


def test_started_by_roslaunch(around: Surroundings, start: Start, tmp_path: Path) -> None:
    """A bag selects playback; a requested mode replaces the last one."""
    path = str(tmp_path / 'seam.bag')
    with rosbag.Bag(path, 'w') as bag:
        bag.write('/feed_rate_est', Float64(0.1), Time(1000))
    roslaunch_and_interrupt(around, start, f'bag:={path}')
    assert remembered(around, 'mode') == 'playback'
    assert remembered(around, 'bag')['recent'] == [[path]]
    roslaunch_and_interrupt(around, start, 'mode:=realtime')
    assert remembered(around, 'mode') == 'realtime'


def roslaunch_and_interrupt(around: Surroundings, start: Start, argument: str) -> None:
    program = start(['roslaunch', '--skip-log-check', 'process_visualizer', 'gui.launch',
                     f'config:={around.config}', argument])
    wait_until(lambda: '/process_visualizer' in around.nodes(), 'the window is a node',
               instead=lambda: program.lines)
    program.end(signal.SIGINT)
    wait_until_alone(around)
    assert not program.says('Traceback'), ''.join(program.lines)


def remembered(around: Surroundings, name: str) -> Any:
    """Return a setting that the window saved when it was closed."""
    path = around.settings / 'process_visualizer' / 'launcher.conf'
    return Settings(str(path)).value(name)


def test_port_of_the_master_is_taken(around: Surroundings, start: Start) -> None:
    with socket.socket() as other:
        other.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        other.bind(('localhost', around.port))
        other.listen()
        program = start(gui(str(around.config), '--launch'))
        wait_until(lambda: program.says('something other than a ROS master listens at '
                                        f'{around.uri}'), 'it says so',
                   instead=lambda: program.lines)
        assert program.process.poll() is None
        assert program.end(signal.SIGTERM) == 0, program.lines
    assert around.processes() == set()


def test_mode_and_recording_outlive_a_kill(around: Surroundings, start: Start,
                                           tmp_path: Path) -> None:
    path = str(tmp_path / 'seam.bag')
    with rosbag.Bag(path, 'w') as bag:
        bag.write('/feed_rate_est', Float64(0.1), Time(1000))
    program = start(gui(str(around.config), '--bag', path))
    wait_until(lambda: remembered(around, 'bag') == {'recent': [[path]], 'open': [path]},
               'it is stored', instead=lambda: (remembered(around, 'bag'), program.lines))
    program.end(signal.SIGKILL)
    assert remembered(around, 'mode') == 'playback'
