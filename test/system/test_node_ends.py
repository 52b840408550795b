# SPDX-License-Identifier: BSD-3-Clause
"""A node ends after SIGINT, even if something in rospy hangs."""
from __future__ import annotations

import signal
import subprocess
import sys
from typing import Dict

import pytest
from running import run_command
from surroundings import PATIENCE_S

from process_visualizer.launching.ros_master import RosMaster

TOPIC = '/feed_rate_est'
SIMULATOR = """
import logging
import threading
import rospy
from sewing_cell.simulator import main

def hang(*_):
    threading.Event().wait()

def in_thread(*calls):
    threading.Thread(target=lambda: [call() for call in calls], daemon=True).start()

{}
main()
"""
TROUBLES = {
    'well': '',
    'thread': 'threading.Thread(target=hang).start()',
    'shutdown': 'rospy.core.add_preshutdown_hook(hang)',
    'log': 'rospy.core.add_preshutdown_hook('
           'lambda _: in_thread(logging.StreamHandler().acquire, hang))',
    'output': 'rospy.core.add_preshutdown_hook(lambda _: print("x" * 1_000_000))'}
"""Code that makes a part of rospy hang; nothing reads the output."""


@pytest.mark.parametrize('trouble', TROUBLES.values(), ids=TROUBLES)
def test_simulator_ends(master: RosMaster, ros_environment: Dict[str, str],
                        trouble: str) -> None:
    node = subprocess.Popen([sys.executable, '-c', SIMULATOR.format(trouble)],
                            env=ros_environment, stdout=subprocess.PIPE)
    try:
        heard = run_command(ros_environment, 'timeout', '120', 'rostopic', 'echo', '-n', '20',
                            TOPIC)
        assert heard.returncode == 0 and node.poll() is None, heard.stdout
        node.send_signal(signal.SIGINT)
        assert node.wait(PATIENCE_S) == 0
    finally:
        node.kill()
        node.communicate()
