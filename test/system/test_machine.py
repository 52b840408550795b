# SPDX-License-Identifier: BSD-3-Clause
"""A device whose nodes run on another computer (``<device machine>``), reached by SSH."""
from __future__ import annotations

import os
import shlex
import signal
import subprocess
import sys
from pathlib import Path
from typing import Dict, Iterator

import pytest
from running import CellRun
from ssh_server import home_with_key, no_ssh_server, ssh_server
from surroundings import PATIENCE_S, wait_until
from two_networks import CELL as CELL_ADDRESS
from two_networks import VIEWER as FAR_ADDRESS
from two_networks import TwoNetworks, problem

PORT = 2222
MASTER_URI = f'http://{CELL_ADDRESS}:11311'
CONFIGURATION = '''<visualizer>
  <machine name="far" address="{address}" ssh-port="{port}" env-loader="{loader}"/>
  <device type="other" name="oven" machine="far">
    <base frame="oven" xyz="0 0 0.5"/>
    <variable topic="heat" frame="oven" scale="0.1"/>
  </device>
</visualizer>
'''
LOOK = '''
import rosgraph, rospy
from std_msgs.msg import Float32
from visualization_msgs.msg import MarkerArray
rospy.init_node('look', anonymous=True)
heat = rospy.Publisher('/heat', Float32, queue_size=1)
rospy.Timer(rospy.Duration(0.05), lambda _event: heat.publish(42.5))
while True:
    markers = rospy.wait_for_message('/oven/marker_array', MarkerArray).markers
    texts = [it.text for it in markers if '42.5' in it.text]
    if texts:
        break
print(texts[0].replace(chr(10), ' '))
print(rosgraph.Master('/look').lookupNode('/oven/variable_proc'))
'''


@pytest.fixture(scope='module')
def networks() -> Iterator[TwoNetworks]:
    """Two namespaces; skip if there are none."""
    reason = problem() or no_ssh_server()
    if reason:
        pytest.skip(reason)
    made = TwoNetworks()
    yield made
    made.close()


@pytest.fixture
def home(tmp_path: Path) -> Path:
    """A home folder with an accepted key, and a known host."""
    return home_with_key(tmp_path / 'home', FAR_ADDRESS, PORT)


@pytest.fixture
def far_computer(networks: TwoNetworks, home: Path, tmp_path: Path,
                 ros_environment: Dict[str, str]) -> Iterator[Path]:
    """An SSH server in the other namespace; yields the script that sets up ROS there."""
    loader = tmp_path / 'env.sh'
    loader.write_text('#!/bin/sh\n' + ''.join(
        f'export {name}={shlex.quote(value)}\n' for name, value in ros_environment.items()
        if name.isidentifier() and name not in ('HOME', 'PWD', 'ROS_MASTER_URI'))
        + f'export ROS_IP={FAR_ADDRESS}\nexec "$@"\n', encoding='utf-8')
    loader.chmod(0o755)
    with ssh_server(networks.command(networks.viewer), home, PORT):
        yield loader


def processes_of(networks: TwoNetworks, namespace: str, name: str) -> 'list[str]':
    found = subprocess.run(['ip', 'netns', 'pids', namespace], stdout=subprocess.PIPE, text=True,
                           check=True).stdout.split()
    return [it for it in found
            if name.encode() in Path(f'/proc/{it}/cmdline').read_bytes()]


def test_the_nodes_of_a_device_run_on_its_machine(
        networks: TwoNetworks, far_computer: Path, home: Path, tmp_path: Path,
        ros_environment: Dict[str, str]) -> None:
    config = tmp_path / 'cell.xml'
    config.write_text(CONFIGURATION.format(address=FAR_ADDRESS, port=PORT, loader=far_computer),
                      encoding='utf-8')
    environment = {**ros_environment, 'HOME': str(home), 'ROS_MASTER_URI': MASTER_URI,
                   'ROS_IP': CELL_ADDRESS}
    cell = CellRun(['run', str(config), '--no-rviz'], environment,
                   networks.command(networks.cell))
    try:
        cell.wait_for_line('/view_relay: running')
        seen = subprocess.run(
            networks.command(networks.cell, sys.executable, '-c', LOOK), env=environment,
            stdout=subprocess.PIPE, text=True, check=True, timeout=PATIENCE_S)
        assert '42.5' in seen.stdout and f'http://{FAR_ADDRESS}:' in seen.stdout
        assert processes_of(networks, networks.viewer, 'variable_proc')
        assert not processes_of(networks, networks.cell, 'variable_proc')
        assert cell.signal_and_wait(signal.SIGINT) == 0
        wait_until(lambda: not processes_of(networks, networks.viewer, 'variable_proc'),
                   'the node there ends, too')
    finally:
        cell.end()
        print(cell.text)


def test_a_machine_whose_link_is_cut_does_not_keep_the_cell_from_ending(
        networks: TwoNetworks, far_computer: Path, home: Path, tmp_path: Path,
        ros_environment: Dict[str, str]) -> None:
    config = tmp_path / 'cell.xml'
    config.write_text(CONFIGURATION.format(address=FAR_ADDRESS, port=PORT, loader=far_computer),
                      encoding='utf-8')
    cell = CellRun(['run', str(config), '--no-rviz', '--remote'],
                   {**ros_environment, 'HOME': str(home), 'ROS_MASTER_URI': MASTER_URI,
                    'ROS_IP': CELL_ADDRESS}, networks.command(networks.cell))
    try:
        cell.wait_for_line('/view_relay: running')
        wait_until(lambda: processes_of(networks, networks.viewer, 'variable_proc'),
                   'the node there')
        networks.is_cut = True
        assert cell.signal_and_wait(signal.SIGINT) == 0
        where = f'/oven/variable_proc on far ({FAR_ADDRESS})'
        assert f'no answer: {where}; waiting' in cell.text
        assert f'could not be stopped: {where}' in cell.text
        assert not processes_of(networks, networks.cell, 'ros')
    finally:
        networks.is_cut = False
        cell.end()
        print(cell.text)
        for name in ('roslaunch', 'variable_proc'):  # still running there, as reported
            for pid in processes_of(networks, networks.viewer, name):
                os.kill(int(pid), signal.SIGKILL)


def test_a_machine_that_cannot_be_reached_is_named(
        networks: TwoNetworks, far_computer: Path, home: Path, tmp_path: Path,
        ros_environment: Dict[str, str]) -> None:
    config = tmp_path / 'cell.xml'
    config.write_text(CONFIGURATION.format(address=FAR_ADDRESS, port=PORT + 1,
                                           loader=far_computer), encoding='utf-8')
    cell = CellRun(['run', str(config), '--no-rviz', '--remote'],
                   {**ros_environment, 'HOME': str(home), 'ROS_MASTER_URI': MASTER_URI,
                    'ROS_IP': CELL_ADDRESS}, networks.command(networks.cell))
    try:
        assert cell.wait() == 1
        assert 'failed to launch on far' in cell.text
    finally:
        cell.end()
