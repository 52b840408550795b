# SPDX-License-Identifier: BSD-3-Clause
"""A cell watched from another network: it is found, seen, lost and seen again."""
from __future__ import annotations

import re
import signal
import subprocess
import sys
from typing import Dict, Iterator

import pytest
from running import CELL, CellRun
from surroundings import PATIENCE_S
from two_networks import CELL as CELL_ADDRESS
from two_networks import TwoNetworks, problem

DEVICES = '<device type="other" name="table"><base frame="table" xyz="0 0 0.5"/></device>'


@pytest.fixture(scope='module')
def networks() -> Iterator[TwoNetworks]:
    """Two namespaces, or why there are none."""
    reason = problem()
    if reason:
        pytest.skip(reason)
    made = TwoNetworks()
    yield made
    made.close()


def run(networks: TwoNetworks, namespace: str, environment: Dict[str, str],
        *arguments: str) -> CellRun:
    return CellRun(arguments, {**environment, 'ROS_MASTER_URI': 'http://localhost:11311'},
                   networks.command(namespace))


def first_transform(networks: TwoNetworks, environment: Dict[str, str]) -> str:
    """Wait for /tf_static at the viewer's own master."""
    script = ('import rospy; from tf2_msgs.msg import TFMessage; '
              'rospy.init_node("listener", anonymous=True); '
              'print(rospy.wait_for_message("/tf_static", TFMessage))')
    return subprocess.run(networks.command(networks.viewer, sys.executable, '-c', script),
                          env=environment, stdout=subprocess.PIPE, text=True, check=True,
                          timeout=PATIENCE_S).stdout


def test_a_cell_is_watched_across_a_cut(networks: TwoNetworks, ros_environment: Dict[str, str],
                                        write_config: 'object') -> None:
    config = str(write_config(DEVICES))  # type: ignore[operator]
    nothing = subprocess.run(
        networks.command(networks.viewer, CELL, 'view', '--check', '--master', CELL_ADDRESS),
        env=ros_environment, stderr=subprocess.PIPE, text=True, check=False, timeout=PATIENCE_S)
    assert nothing.returncode == 1
    assert 'nothing listens on' in nothing.stderr
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
        assert 'exited' not in cell.text  # the cell has not noticed
    finally:
        for process in filter(None, (viewer, cell)):
            process.end()
            print(process.text)
