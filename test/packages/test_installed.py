# SPDX-License-Identifier: BSD-3-Clause
"""The install space of the built workspace: every module is imported, every program started.

It is used as after a fresh login; nothing of the sources and of the devel space is in its
environment.
"""
from __future__ import annotations

import fcntl
import os
import re
import shutil
import signal
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path
from typing import Dict, Iterator, List, Set
from xmlrpc.client import ServerProxy

import pytest
import rosbag
from std_msgs.msg import String
from surroundings import (
    PATIENCE_S,
    SOFTWARE_GRAPHICS,
    end_marked_processes,
    free_port,
    marked_processes,
    virtual_screen,
    wait_until,
    wait_until_alone,
)

REPOSITORY = Path(__file__).parents[2]
SOURCES = [REPOSITORY / 'src', REPOSITORY / 'sewing_cell' / 'src']
FAULTS = re.compile('Traceback|Error:|Failed to load|could not be loaded|has died', re.IGNORECASE)
OTHERS = """
<launch>
  <include file="$(find process_visualizer)/launch/gui.launch">
    <arg name="config" value="$(find sewing_cell)/devices/simulated.xml"/>
  </include>
  <node pkg="nodelet" type="nodelet" name="manager" args="manager" output="screen"/>
  <node pkg="nodelet" type="nodelet" name="roi" output="screen"
        args="load process_visualizer/RoiFilter manager">
    <rosparam>{center: [0, 0, 0], size: [1, 1, 1]}</rosparam>
  </node>
  <node pkg="sewing_cell" type="kinect_roi" name="kinect_roi" output="screen">
    <rosparam>{center: [0, 0, 0], size: [1, 1, 1]}</rosparam>
  </node>
</launch>
"""


class InstallSpace:
    """An install space, and the programs started from it."""

    def __init__(self, folder: Path, home: Path) -> None:
        self.folder = folder
        self.home = home
        self.started: Set[str] = set()
        self.log = home / 'log.txt'

    def environment(self, **more: str) -> Dict[str, str]:
        """Return the environment after a fresh login and activation of the virtual environment."""
        path = f'{Path(sys.executable).parent}:/usr/sbin:/usr/bin:/sbin:/bin'
        return {'HOME': str(self.home), 'PATH': path, 'LANG': 'C.UTF-8', **more}

    def command(self, *words: str) -> List[str]:
        """Return a command that runs after its set-up file."""
        return ['bash', '-c', f'source {self.folder}/setup.bash && exec "$@"', 'installed', *words]

    def run(self, *words: str, **environment: str) -> str:
        """Run a command to its end; return its output."""
        done = subprocess.run(self.command(*words), env=self.environment(**environment), text=True,
                              cwd=self.home, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                              check=False)
        assert done.returncode == 0, done.stdout
        return done.stdout

    @contextmanager
    def running(self, *words: str, **environment: str) -> Iterator['subprocess.Popen[bytes]']:
        """Run a command until it is interrupted as by Ctrl-C; faults in its output fail."""
        mark = f'ROS_MASTER_URI={environment["ROS_MASTER_URI"]}'
        try:
            with self.log.open('wb') as log:
                process = subprocess.Popen(
                    self.command(*words), env=self.environment(**environment), cwd=self.home,
                    stdin=subprocess.DEVNULL, stdout=log, stderr=log, start_new_session=True)
            yield process
            self.started |= self._programs(mark)
            process.send_signal(signal.SIGINT)
            assert process.wait(PATIENCE_S) == 0, self.output()
            wait_until_alone(mark)
        finally:
            end_marked_processes(mark)
            print(self.output())  # pytest shows it on a failure
        assert not FAULTS.findall(self.output()), self.output()

    def output(self) -> str:
        """Return the output of the last running command."""
        return self.log.read_text(encoding='utf-8', errors='replace')

    def programs(self) -> Set[str]:
        """Return all programs that are installed for rosrun."""
        folders = [self.folder / 'lib' / name for name in ('process_visualizer', 'sewing_cell')]
        return {f'{path.parent.name}/{path.name}' for folder in folders for path in folder.iterdir()
                if path.is_file() and os.access(path, os.X_OK)}

    def _programs(self, mark: str) -> Set[str]:
        """Return the running ones of the installed programs."""
        commands = ' '.join(marked_processes(mark)).split()
        lib = f'{self.folder}/lib/'
        found = {word[len(lib):] for word in commands if word.startswith(lib)}
        if '__name:=kinect_roi' in commands:  # it becomes the program that loads its nodelet
            found.add('sewing_cell/kinect_roi')
        return found


@pytest.fixture(scope='module')
def installed(tmp_path_factory: pytest.TempPathFactory) -> InstallSpace:
    """The workspace of this test, installed below a folder of its own."""
    workspace = Path(os.environ['CMAKE_PREFIX_PATH'].split(':')[0]).parent
    root = tmp_path_factory.mktemp('root')
    with (workspace / 'install.lock').open('w') as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        for build in ('process_visualizer', 'process_visualizer/sewing_cell'):  # earlier sources
            shutil.rmtree(workspace / 'build' / build / 'lib', ignore_errors=True)
        done = subprocess.run(
            ['cmake', '-P', 'cmake_install.cmake'], cwd=workspace / 'build', text=True, check=False,
            env={'DESTDIR': str(root), 'PATH': '/usr/sbin:/usr/bin:/sbin:/bin', 'LANG': 'C.UTF-8'},
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    assert done.returncode == 0, done.stdout[-4000:]
    return InstallSpace(Path(f'{root}{workspace}/install'), tmp_path_factory.mktemp('home'))


def modules() -> List[str]:
    """Return all modules of both packages, by name."""
    return sorted('.'.join(path.relative_to(folder).with_suffix('').parts)
                  for folder in SOURCES for path in folder.rglob('*.py')
                  if path.name != '__init__.py')


def test_every_module_is_imported(installed: InstallSpace) -> None:
    program = ('import importlib, sys; '
               'print({importlib.import_module(name).__file__ for name in sys.argv[1:]})')
    files = installed.run(sys.executable, '-c', program, *modules())
    assert files.count(str(installed.folder)) == len(modules()), files


@pytest.fixture(scope='module')
def cell(installed: InstallSpace, tmp_path_factory: pytest.TempPathFactory) -> InstallSpace:
    """Run the simulated cell with RViz until everything is shown."""
    picture = tmp_path_factory.mktemp('picture') / 'cell.png'
    with virtual_screen() as display:
        environment = {**SOFTWARE_GRAPHICS, 'DISPLAY': display,
                       'ROS_MASTER_URI': f'http://localhost:{free_port()}'}
        config = installed.run('rospack', 'find', 'sewing_cell').strip() + '/devices/simulated.xml'
        with installed.running('rosrun', 'process_visualizer', 'cell', 'run', config,
                               **environment):
            installed.run('rosrun', 'process_visualizer', 'view_picture', '--timeout',
                          str(PATIENCE_S), str(picture), **environment)
            installed.started.add('process_visualizer/view_picture')
    assert picture.exists()
    return installed


@pytest.fixture(scope='module')
def everything(cell: InstallSpace) -> InstallSpace:
    """Also run what no simulated cell needs: the window, a nodelet, a recording."""
    launch, recording = cell.home / 'others.launch', cell.home / 'recording.bag'
    launch.write_text(OTHERS)
    with rosbag.Bag(str(recording), 'w') as bag:
        bag.write('text', String('text'))
    uri = f'http://localhost:{free_port()}'
    with cell.running('roslaunch', str(launch), ROS_MASTER_URI=uri, QT_QPA_PLATFORM='offscreen'):
        wait_until(lambda: {'/process_visualizer', '/kinect_roi'} <= nodes(uri), 'the nodes are up',
                   instead=cell.output)
        wait_until(lambda: '/roi/output' in topics(uri), 'the nodelet is loaded',
                   instead=cell.output)
        played = cell.run('rosrun', 'process_visualizer', 'bag_player', str(recording),
                          ROS_MASTER_URI=uri)
        assert not FAULTS.search(played), played
        cell.started.add('process_visualizer/bag_player')
    return cell


def test_every_program_was_started(everything: InstallSpace) -> None:
    assert everything.programs() - everything.started == set()


def test_launch_files_call_xacro(installed: InstallSpace) -> None:
    model = installed.run('rospack', 'find', 'sewing_cell').strip() + '/urdf/ur_rt_upper.urdf.xacro'
    assert 'ur_rt_upper/link0' in installed.run('xacro', model)


def nodes(uri: str) -> Set[str]:
    """Return the nodes that a master knows."""
    return {name for kind in state(uri) for _, names in kind for name in names}


def topics(uri: str) -> Set[str]:
    """Return the topics that nodes publish."""
    return {topic for topic, _ in state(uri)[0]}


def state(uri: str) -> List[List[List[object]]]:
    """Return the master's getSystemState; nothing if there is no master yet."""
    try:
        return ServerProxy(uri).getSystemState('/test')[2]  # type: ignore[index, return-value]
    except OSError:
        return [[], [], []]
