# SPDX-License-Identifier: BSD-3-Clause
"""joint_proc unregisters from the master without computing: it has real-time priority."""
from __future__ import annotations

import signal
import subprocess
import threading
from pathlib import Path
from socketserver import ThreadingMixIn
from typing import Any, Dict, Iterator, Tuple
from xmlrpc.client import ServerProxy
from xmlrpc.server import SimpleXMLRPCServer

import pytest
from roslib.packages import find_node
from surroundings import PATIENCE_S, wait_until

from process_visualizer.launching.ros_master import RosMaster

NODE = '/arm/joint_proc'


class BusyMaster(ThreadingMixIn, SimpleXMLRPCServer):
    """Forwards calls to the master, but delays answers to unregistration until released."""

    daemon_threads = True

    def __init__(self, uri: str) -> None:
        super().__init__(('localhost', 0), logRequests=False, allow_none=True)
        self._master_uri = uri
        self.uri = f'http://localhost:{self.server_address[1]}'
        self.subscribed, self.left, self.may_answer = (threading.Event() for _ in range(3))

    def _dispatch(self, method: str, arguments: Tuple[Any, ...]) -> Any:
        # before, roscpp's own services for loggers are replaced
        if self.subscribed.is_set() and method.startswith('unregister'):
            self.left.set()
            self.may_answer.wait(PATIENCE_S)
        with ServerProxy(self._master_uri) as master:
            answer = getattr(master, method)(*arguments)
        if (method, arguments[1:2]) == ('registerSubscriber', ('/q',)):
            self.subscribed.set()
        return answer


@pytest.fixture
def busy(master: RosMaster) -> Iterator[BusyMaster]:
    """A master that is busy during the test."""
    server = BusyMaster(master.uri)
    thread = threading.Thread(target=server.serve_forever, kwargs={'poll_interval': 0.05})
    thread.start()
    yield server
    server.may_answer.set()
    server.shutdown()
    thread.join()
    server.server_close()


def sleeps(pid: int) -> bool:
    """Return whether all threads of a process wait for something; proc(5)."""
    states = {path.read_text().rpartition(')')[2].split()[0]
              for path in Path(f'/proc/{pid}/task').glob('*/stat')}
    return states == {'S'}


def test_it_waits_for_a_master_that_is_busy(busy: BusyMaster,
                                            ros_environment: Dict[str, str]) -> None:
    with ServerProxy(busy.uri) as server:
        server.setParam('/test', f'{NODE}/joint_names', ['shoulder', 'elbow'])
    [program] = find_node('process_visualizer', 'joint_proc')
    node = subprocess.Popen([program, '__ns:=/arm', '_topic:=/q'],
                            env={**ros_environment, 'ROS_MASTER_URI': busy.uri})
    try:
        assert busy.subscribed.wait(PATIENCE_S)
        node.send_signal(signal.SIGINT)
        assert busy.left.wait(PATIENCE_S)
        wait_until(lambda: sleeps(node.pid), 'it waits for the answer')
        assert node.poll() is None
        busy.may_answer.set()
        assert node.wait(PATIENCE_S) == 0
    finally:
        node.kill()
        node.wait()
