# SPDX-License-Identifier: BSD-3-Clause
"""The real ROS master of the launcher: started, used, ended, and cleaned up after a crash."""
from __future__ import annotations

import os
import signal
import socket
import subprocess
import sys
from pathlib import Path
from typing import Iterator, List

import pytest
from surroundings import marked_processes, wait_until, wait_until_alone

from process_visualizer.launching.ros_master import RosMaster, RosMasterError
from process_visualizer.launching.run_record import clean_up_crashed_runs

pytestmark = pytest.mark.usefixtures('own_surroundings')


@pytest.fixture
def master() -> Iterator[RosMaster]:
    """A master, ended after the test."""
    own = RosMaster()
    yield own
    own.stop()


def owned(mark: str) -> List[str]:
    """Return the running programs of a master."""
    return [line for line in marked_processes(mark) if 'rosmaster' in line or '--core' in line
            or 'rosout' in line]


def test_own_master(master: RosMaster, mark: str) -> None:
    assert master.is_online() is False
    assert master.ensure() is True
    assert master.is_online() is True
    assert master.ensure() is True
    assert len(owned(mark)) == 3
    master.stop()
    assert master.is_online() is False
    wait_until_alone(mark)
    assert master.ensure() is True  # and once more


def test_master_of_somebody_else_stays(master: RosMaster, mark: str) -> None:
    master.ensure()
    guest = RosMaster()
    assert guest.ensure() is False
    guest.stop()
    assert master.is_online() is True


def test_own_master_that_was_killed_is_replaced(master: RosMaster, mark: str) -> None:
    master.ensure()
    subprocess.run(['pkill', '-KILL', '-f', f'rosmaster.*-p {master.uri.rpartition(":")[2]}'],
                   check=True)
    assert master.is_online() is False
    assert master.ensure() is True
    assert master.is_online() is True
    assert len(owned(mark)) == 3


def test_port_that_is_taken_meanwhile(master: RosMaster, mark: str) -> None:
    """A process that listens, but has accepted no connection yet, occupies the port."""
    port = int(master.uri.rpartition(':')[2])
    with socket.create_server(('', port)), pytest.raises(RosMasterError, match='other than'):
        master.ensure()
    wait_until_alone(mark)


def test_master_ends_with_the_program(mark: str) -> None:
    script = ('import time\n'
              'from process_visualizer.launching.ros_master import RosMaster\n'
              'print(RosMaster().ensure(), flush=True)\n'
              'time.sleep(600)\n')
    program = subprocess.Popen([sys.executable, '-c', script], stdout=subprocess.PIPE, text=True)
    assert program.stdout is not None and program.stdout.readline() == 'True\n'
    program.kill()
    program.communicate()
    wait_until_alone(mark)


def test_next_start_cleans_up_after_a_crash(mark: str, tmp_path: Path) -> None:
    """The kernel does not help, as without setpriv, or when roslaunch is killed too."""
    script = ('import os, signal, sys\n'
              'from process_visualizer.launching.ros_master import RosMaster\n'
              'master = RosMaster()\n'
              'master.ensure()\n'
              'roslaunch = int(sys.stdin.readline())\n'
              'os.kill(roslaunch, signal.SIGKILL)\n'
              'os.waitpid(roslaunch, 0)\n'
              'os.kill(os.getpid(), signal.SIGKILL)\n')
    program = subprocess.Popen([sys.executable, '-c', script], stdin=subprocess.PIPE, text=True)
    wait_until(lambda: RosMaster().is_online(), 'the master')
    roslaunch = subprocess.run(['pgrep', '-P', str(program.pid), '-f', 'roslaunch'], check=True,
                               stdout=subprocess.PIPE, text=True).stdout
    program.communicate(roslaunch.split()[0] + '\n')
    assert program.returncode == -signal.SIGKILL
    assert owned(mark) != []
    assert len(clean_up_crashed_runs()) == 2
    wait_until_alone(mark)
    assert os.listdir(Path(os.environ['ROS_HOME'], 'process_visualizer', 'runs')) == []
