# SPDX-License-Identifier: BSD-3-Clause
"""RViz starts on a computer so busy that the X server reacts late to its windows."""
from __future__ import annotations

import subprocess
from pathlib import Path
from typing import Dict

import pytest
from slow_x_connection import SlowXConnection
from surroundings import PATIENCE_S

from process_visualizer.launching.ros_master import RosMaster

VIEW = Path(__file__).parents[1] / 'ros' / 'display_status.rviz'
LATE_S = 0.1


@pytest.mark.parametrize('slow', [1, 2])
def test_rviz_starts_if_one_of_its_connections_is_slow(
        slow: int, master: RosMaster, screen: str, ros_environment: Dict[str, str]) -> None:
    """On connection 2 OGRE creates its windows: the RViz of the package rviz would end."""
    connections = SlowXConnection(screen, lambda it: LATE_S if it == slow else 0.0)
    command = ['rosrun', 'process_visualizer', 'rviz', '-d', str(VIEW), '__name:=rviz']
    rviz = subprocess.Popen(command, env={**ros_environment, 'DISPLAY': connections.display})
    try:
        # Published by the display that reports the others, after the first frame.
        subprocess.run(['rostopic', 'echo', '-n', '2', '/rviz/display_status'], check=True,
                       env=ros_environment, stdout=subprocess.DEVNULL, timeout=PATIENCE_S)
        assert rviz.poll() is None
        assert connections.connections > slow
    finally:
        rviz.terminate()
        rviz.wait(PATIENCE_S)
        connections.close()
