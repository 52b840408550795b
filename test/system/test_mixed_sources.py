# SPDX-License-Identifier: BSD-3-Clause
"""``cell run`` beside real drivers and players of bags: refused, or reported while it runs."""
from __future__ import annotations

import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any, Dict, Iterator

import pytest
import rosbag
import rosgraph
import rospy
from roslib.packages import find_node
from running import CellRun
from std_msgs.msg import Float64

from process_visualizer.launching.ros_master import RosMaster

PERIOD_S = 0.1
DEVICE = '''<device type="other" name="oven">
  <base frame="oven"/><topic ns="oven" name="heat"/>
</device>'''
DRIVER = """
import rospy, std_msgs.msg
rospy.init_node('oven_driver')
publisher = rospy.Publisher('/oven/heat', std_msgs.msg.Float64, queue_size=1)
rospy.spin()
"""


@pytest.fixture
def bag(tmp_path: Path) -> str:
    path = tmp_path / 'oven.bag'
    with rosbag.Bag(str(path), 'w') as written:
        for second in range(30):
            written.write('/oven/heat', Float64(second), rospy.Time(1000 + second))
    return str(path)


@pytest.fixture
def start(master: RosMaster, ros_environment: Dict[str, str]) -> Iterator[Any]:
    """Return a function that starts programs, which are ended after the test.

    It returns when they publish, and offer a service whose name ends with ``service``.
    """
    processes = []

    def begin(*command: str, service: str = '') -> 'subprocess.Popen[str]':
        process = subprocess.Popen(command, env=ros_environment, stdin=subprocess.DEVNULL,
                                   stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        processes.append(process)
        wait_for_publisher(process, service)
        return process

    yield begin
    for process in processes:
        process.terminate()
        process.communicate(timeout=40)


@pytest.fixture
def driver(start: Any) -> 'subprocess.Popen[str]':
    return start(sys.executable, '-c', DRIVER)


def wait_for_publisher(process: 'subprocess.Popen[str]', service: str,
                       timeout_s: float = 120.0) -> None:
    """Wait until a program publishes the topic and offers a service."""
    def is_there() -> bool:
        published, _, services = rosgraph.Master('/test').getSystemState()
        return '/oven/heat' in dict(published) and any(it.endswith(service) for it, _ in services)

    deadline = time.monotonic() + timeout_s
    while not is_there():
        assert process.poll() is None and time.monotonic() < deadline, 'it does not publish'
        time.sleep(PERIOD_S)


def check_refused(run: CellRun, *parts: str) -> None:
    assert run.wait() == 1
    assert all(part in run.text for part in parts), run.text
    assert 'starting' not in run.text and 'Traceback' not in run.text


def test_no_recording_is_played_beside_a_driver(driver, bag, write_config, run_cell) -> None:
    run = run_cell(write_config(DEVICE), '--no-rviz', '--mode', 'playback', '--bag', bag)
    check_refused(run, '/oven/heat is published by /oven_driver', 'Stop', '--prefix')


def test_real_time_is_not_mixed_with_rosbag_play(start, bag, write_config, run_cell) -> None:
    start(find_node('rosbag', 'play')[0], bag, '--quiet', '--loop', service='/pause_playback')
    run = run_cell(write_config(DEVICE), '--no-rviz')
    check_refused(run, '/oven/heat is published by /', 'which plays a recording')


def test_a_player_that_starts_beside_live_devices_is_told(driver, start, bag, write_config,
                                                          run_cell) -> None:
    run = run_cell(write_config(DEVICE), '--no-rviz')
    run.wait_for_line('/cell_frames: running')
    assert 'is published by' not in run.text
    with_player = start(find_node('process_visualizer', 'bag_player')[0], bag, '--loop')
    run.wait_for_line('/oven/heat is published by /bag_player, which plays a recording')
    assert with_player.poll() is None
    assert run.signal_and_wait(signal.SIGINT) == 0
