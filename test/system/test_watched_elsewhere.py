# SPDX-License-Identifier: BSD-3-Clause
"""A cell viewed from another network: found, shown, lost and shown again."""
from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
from pathlib import Path
from typing import Callable, Dict, Iterator, Optional

import pytest
from running import CELL, CellRun
from ssh_server import home_with_key, no_ssh_server, ssh_server
from surroundings import PATIENCE_S, wait_until
from two_networks import CELL as CELL_ADDRESS
from two_networks import TwoNetworks, problem

OTHER_CLOCK = '''
#define _GNU_SOURCE
#include <dlfcn.h>
#include <time.h>
int clock_gettime(clockid_t clock, struct timespec *now) {
  static int (*real)(clockid_t, struct timespec *);
  if (!real) real = (int (*)(clockid_t, struct timespec *))dlsym(RTLD_NEXT, "clock_gettime");
  int result = real(clock, now);
  if (result == 0 && clock == CLOCK_REALTIME) now->tv_sec += 95;
  return result;
}
'''
"""The time of day is 95 s ahead; libfaketime would also change the clock of Python's waits."""
SSH_PORT, RELAY_PORT = 2222, 11411
DEVICES = '<device type="other" name="table"><base frame="table" xyz="0 0 0.5"/></device>'


@pytest.fixture(scope='module')
def networks() -> Iterator[TwoNetworks]:
    """Two namespaces; skip if there are none."""
    reason = problem()
    if reason:
        pytest.skip(reason)
    made = TwoNetworks()
    yield made
    made.close()


@pytest.fixture
def config(write_config: Callable[[str], Path]) -> str:
    return str(write_config(DEVICES))


def run(networks: TwoNetworks, namespace: str, environment: Dict[str, str],
        *arguments: str) -> CellRun:
    return CellRun(arguments, {**environment, 'ROS_MASTER_URI': 'http://localhost:11311'},
                   networks.command(namespace))


def end(*processes: Optional[CellRun]) -> None:
    for process in filter(None, processes):
        process.end()
        print(process.text)


def checked(networks: TwoNetworks, environment: Dict[str, str], master: str = CELL_ADDRESS,
            ) -> 'subprocess.CompletedProcess[str]':
    """Let the viewer find the reason for a failed connection."""
    return subprocess.run(
        networks.command(networks.viewer, CELL, 'view', '--check', '--master', master),
        env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False,
        timeout=PATIENCE_S)


def first_transform(networks: TwoNetworks, environment: Dict[str, str]) -> str:
    """Wait for /tf_static at the viewer's own master."""
    script = ('import rospy; from tf2_msgs.msg import TFMessage; '
              'rospy.init_node("listener", anonymous=True); '
              'print(rospy.wait_for_message("/tf_static", TFMessage))')
    return subprocess.run(networks.command(networks.viewer, sys.executable, '-c', script),
                          env=environment, stdout=subprocess.PIPE, text=True, check=True,
                          timeout=PATIENCE_S).stdout


def test_a_cell_is_watched_across_a_cut(networks: TwoNetworks, ros_environment: Dict[str, str],
                                        config: str) -> None:
    nothing = checked(networks, ros_environment)
    assert nothing.returncode == 1
    assert 'nothing listens on' in nothing.stdout
    cell = run(networks, networks.cell, ros_environment, 'run', config, '--no-rviz', '--remote')
    viewer = None
    try:
        cell.wait_for_line('/view_relay: running')
        viewer = run(networks, networks.viewer, ros_environment, 'view', '--no-rviz', '--master',
                     CELL_ADDRESS)
        uri = re.search(r'http://\S+', viewer.wait_for_line('ROS_MASTER_URI='))
        assert uri is not None
        viewer.wait_for_line('ready')
        own = {**ros_environment, 'ROS_MASTER_URI': uri[0], 'ROS_HOSTNAME': 'localhost'}
        assert 'child_frame_id: "table"' in first_transform(networks, own)
        networks.is_cut = True
        viewer.wait_for_line('no connection to')
        networks.is_cut = False
        viewer.wait_for_line('connected again')
        assert viewer.signal_and_wait(signal.SIGINT) == 0
        port = uri[0].rpartition(':')[2].strip('/')
        assert not Path(ros_environment['ROS_HOME'], f'roscore-{port}.pid').exists()
        assert Path(os.devnull).is_char_device(), 'roscore removes the file that it is given'
        assert 'exited' not in cell.text  # the cell has not noticed
    finally:
        end(viewer, cell)


def test_a_cell_that_is_started_again_with_another_port_is_seen_again(
        networks: TwoNetworks, ros_environment: Dict[str, str], config: str) -> None:
    """Its ROS master reports the port, if it can be reached."""
    with_master = {**ros_environment, 'ROS_IP': CELL_ADDRESS}
    cell = run(networks, networks.cell, with_master, 'run', config, '--no-rviz', '--remote')
    viewer = again = None
    try:
        cell.wait_for_line('/view_relay: running')
        viewer = run(networks, networks.viewer, ros_environment, 'view', '--no-rviz', '--master',
                     CELL_ADDRESS)
        viewer.wait_for_line('ready')
        assert cell.signal_and_wait(signal.SIGINT) == 0
        viewer.wait_for_line('no connection to')
        assert 'connected again' not in viewer.text
        again = run(networks, networks.cell, with_master, 'run', config, '--no-rviz',
                    '--remote', '--ports', '11450-11459')
        viewer.wait_for_line('connected again')
        assert viewer.signal_and_wait(signal.SIGINT) == 0
    finally:
        end(viewer, cell, again)


def test_clocks_that_are_apart_are_told(networks: TwoNetworks, ros_environment: Dict[str, str],
                                        config: str, tmp_path: Path) -> None:
    source, library = tmp_path / 'clock.c', tmp_path / 'clock.so'
    source.write_text(OTHER_CLOCK, encoding='utf-8')
    subprocess.run(['cc', '-shared', '-fPIC', '-o', str(library), str(source), '-ldl'], check=True)
    cell = run(networks, networks.cell, ros_environment, 'run', config, '--no-rviz', '--remote')
    viewer = None
    try:
        cell.wait_for_line('/view_relay: running')
        later = {**ros_environment, 'LD_PRELOAD': str(library)}
        viewer = run(networks, networks.viewer, later, 'view', '--no-rviz', '--master',
                     CELL_ADDRESS)
        assert 'the clocks are 1 min 35 s apart: this one is ahead of that of the cell' in \
            viewer.wait_for_line('the clocks are')
        viewer.wait_for_line('ready')
        assert viewer.signal_and_wait(signal.SIGINT) == 0
    finally:
        end(viewer, cell)


def test_a_cell_with_the_address_of_another_computer_says_so(
        networks: TwoNetworks, ros_environment: Dict[str, str], config: str) -> None:
    wrong = {**ros_environment, 'ROS_IP': '10.77.30.99'}
    cell = run(networks, networks.cell, wrong, 'run', config, '--no-rviz', '--remote')
    try:
        cell.wait_for_line('ROS_IP is 10.77.30.99, which is not an address of this computer')
        assert checked(networks, ros_environment).returncode == 1
    finally:
        end(cell)


def test_a_cell_for_its_own_computer_is_watched_through_a_tunnel(
        networks: TwoNetworks, ros_environment: Dict[str, str], config: str,
        tmp_path: Path) -> None:
    if no_ssh_server():
        pytest.skip(no_ssh_server())
    home = home_with_key(tmp_path / 'home', CELL_ADDRESS, SSH_PORT)
    cell = run(networks, networks.cell, ros_environment, 'run', config, '--no-rviz')
    viewer = tunnel = None
    try:
        cell.wait_for_line('/view_relay: running')
        assert checked(networks, ros_environment).returncode == 1
        with ssh_server(networks.command(networks.cell), home, SSH_PORT):
            tunnel = subprocess.Popen(networks.command(
                networks.viewer, 'ssh', '-N', '-p', str(SSH_PORT), '-i', str(home / '.ssh/id_rsa'),
                '-o', f'UserKnownHostsFile={home}/.ssh/known_hosts',
                '-L', f'{RELAY_PORT}:localhost:{RELAY_PORT}', CELL_ADDRESS))
            master = f'localhost:{RELAY_PORT}'
            wait_until(lambda: checked(networks, ros_environment, master).returncode == 0,
                       'the tunnel is there')
            viewer = run(networks, networks.viewer, ros_environment, 'view', '--no-rviz',
                         '--master', master)
            viewer.wait_for_line('ready')
            assert viewer.signal_and_wait(signal.SIGINT) == 0
    finally:
        end(viewer, cell)
        if tunnel is not None:
            tunnel.terminate()
            tunnel.wait(PATIENCE_S)
