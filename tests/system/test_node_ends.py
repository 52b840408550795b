"""A node ends soon after SIGINT, whatever hangs in rospy."""
from __future__ import annotations

import signal
import subprocess
import sys
import time
from typing import Dict, Iterator

import pytest

from process_visualizer.launching.node_watcher import is_registered
from process_visualizer.launching.ros_master import RosMaster

LONGEST_S = 2.0
SIMULATOR = """
import threading
import rospy
from sewing_cell.simulator import main
{}
main()
"""
STUCK_THREAD = 'threading.Thread(target=threading.Event().wait).start()'
STUCK_SHUTDOWN = 'rospy.core.add_preshutdown_hook(lambda reason: threading.Event().wait())'


@pytest.fixture(scope='module')
def master(ros_environment: Dict[str, str]) -> Iterator[Dict[str, str]]:
    """A master; yields the environment of its nodes."""
    with pytest.MonkeyPatch.context() as patch:
        for name, value in ros_environment.items():
            patch.setenv(name, value)
        own = RosMaster()
        own.ensure()
        yield ros_environment
        own.stop()


@pytest.mark.parametrize(
    'trouble', ['', STUCK_THREAD, STUCK_SHUTDOWN], ids=['well', 'thread', 'shutdown'])
def test_simulator_ends_in_time(master: Dict[str, str], trouble: str) -> None:
    node = subprocess.Popen([sys.executable, '-c', SIMULATOR.format(trouble)], env=master)
    try:
        deadline_s = time.monotonic() + 20.0
        while not is_registered('/simulator') and time.monotonic() < deadline_s:
            assert node.poll() is None
            time.sleep(0.1)
        time.sleep(1.0)  # it publishes, and the master's rosout has connected
        node.send_signal(signal.SIGINT)
        assert node.wait(LONGEST_S) == 0
    finally:
        node.kill()
        node.wait()
