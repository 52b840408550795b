# SPDX-License-Identifier: BSD-3-Clause
"""joint_proc takes leave of the master without computing: it has real-time priority."""
from __future__ import annotations

import os
import signal
import subprocess
import time
from pathlib import Path
from xmlrpc.client import ServerProxy

from roslib.packages import find_node
from surroundings import suspended

from process_visualizer.launching.ros_api import is_registered, process_id_at
from process_visualizer.launching.ros_master import RosMaster

MEASURED_S = 1.0
NODE = '/arm/joint_proc'


def processor_s(pid: int) -> float:
    """The processor time that a process has used, in all its threads."""
    fields = Path(f'/proc/{pid}/stat').read_text().rpartition(')')[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf('SC_CLK_TCK')


def test_it_waits_for_a_master_that_is_busy(master: RosMaster) -> None:
    with ServerProxy(master.uri) as server:
        server.setParam('/test', f'{NODE}/joint_names', ['shoulder', 'elbow'])
    [program] = find_node('process_visualizer', 'joint_proc')
    node = subprocess.Popen([program, '__ns:=/arm', '_topic:=/q'])
    master_process = process_id_at(master.uri)
    try:
        deadline_s = time.monotonic() + 60.0
        while not is_registered(NODE):
            assert node.poll() is None and time.monotonic() < deadline_s
            time.sleep(0.1)
        with suspended(master_process):
            node.send_signal(signal.SIGINT)
            before_s = processor_s(node.pid)
            time.sleep(MEASURED_S)
            assert node.poll() is None
            assert processor_s(node.pid) - before_s < 0.2 * MEASURED_S
        assert node.wait(60.0) == 0
    finally:
        node.kill()
        node.wait()
