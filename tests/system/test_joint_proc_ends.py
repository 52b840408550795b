"""joint_proc takes leave of the master without computing: it has real-time priority."""
from __future__ import annotations

import os
import signal
import subprocess
import time
from pathlib import Path
from typing import Dict, Iterator
from xmlrpc.client import ServerProxy

import pytest

from process_visualizer.launching.node_watcher import is_registered
from process_visualizer.launching.ros_api import process_id_at
from process_visualizer.launching.ros_master import RosMaster

MEASURED_S = 1.0
NODE = '/arm/joint_proc'


@pytest.fixture
def master(ros_environment: Dict[str, str]) -> Iterator[RosMaster]:
    with pytest.MonkeyPatch.context() as patch:
        for name, value in ros_environment.items():
            patch.setenv(name, value)
        own = RosMaster()
        own.ensure()
        yield own
        own.stop()


def processor_s(pid: int) -> float:
    """The processor time that a process has used, in all its threads."""
    fields = Path(f'/proc/{pid}/stat').read_text().rpartition(')')[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf('SC_CLK_TCK')


def test_it_waits_for_a_master_that_is_busy(master: RosMaster) -> None:
    ServerProxy(master.uri).setParam('/test', f'{NODE}/joint_names', ['shoulder', 'elbow'])
    node = subprocess.Popen(['rosrun', 'process_visualizer', 'joint_proc', '__ns:=/arm',
                             '_topic:=/q'])
    master_process = process_id_at(master.uri)
    try:
        deadline_s = time.monotonic() + 20.0
        while not is_registered(NODE) and time.monotonic() < deadline_s:
            assert node.poll() is None
            time.sleep(0.1)
        os.kill(master_process, signal.SIGSTOP)
        node.send_signal(signal.SIGINT)
        before_s = processor_s(node.pid)
        time.sleep(MEASURED_S)
        assert node.poll() is None
        assert processor_s(node.pid) - before_s < 0.2 * MEASURED_S
        os.kill(master_process, signal.SIGCONT)
        assert node.wait(5.0) == 0
    finally:
        os.kill(master_process, signal.SIGCONT)
        node.kill()
        node.wait()
