# SPDX-License-Identifier: BSD-3-Clause
"""Starts roslaunch faster than a command can: as forks of a program that has loaded it."""
from __future__ import annotations

import array
import json
import os
import socket
import subprocess
import sys
from typing import List, Mapping, Optional

from process_visualizer.launching.forked_process import ForkedProcess
from process_visualizer.launching.process_scan import RUN_VARIABLE, end_processes
from process_visualizer.launching.run_record import RunRecord

_SERVER = 'process_visualizer.launching.roslaunch_server'
_END_TIMEOUT_S = 5.0


class RoslaunchForks:
    """The server; it is started when it is first needed, or again if it has ended.

    The environment of the server, and so of each roslaunch, has the mark of a record; that of a
    roslaunch's nodes has the mark given to ``start``. The server ends when this process ends, for
    whatever reason.
    """

    def __init__(self, niceness: int = 0, variables: Optional[Mapping[str, str]] = None) -> None:
        """Take what all processes have in common.

        Args:
            niceness: above 0 others have precedence (see nice(1)).
            variables: of their environment, beside those given to ``start``.
        """
        self._niceness, self._variables = niceness, dict(variables or {})
        self._record = RunRecord()
        self._server: Optional['subprocess.Popen[bytes]'] = None
        self._requests: Optional[socket.socket] = None

    def prepare(self) -> None:
        """Start the server if it is not running; return before it has loaded anything."""
        if self._server is not None and self._server.poll() is None:
            return
        self.close()
        self._record.write()
        ours, its = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        for end in (ours, its):  # whatever this process has as its default timeout
            end.setblocking(True)
        environment = {**os.environ, RUN_VARIABLE: self._record.run_id}
        with its:
            self._server = subprocess.Popen(
                ['nice', '-n', str(self._niceness), sys.executable, '-u', '-m', _SERVER,
                 str(its.fileno())], env=environment,
                pass_fds=[its.fileno()], stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                start_new_session=True, cwd='/')
        self._requests = ours

    def start(self, arguments: List[str], environment: Mapping[str, str]) -> ForkedProcess:
        """Start a roslaunch.

        Of the command's arguments only the last is used, the launch file. Needs a running master.

        Raises:
            ChildProcessError: it cannot be started.
        """
        self.prepare()
        assert self._requests is not None
        request, output, status = (os.pipe() for _ in range(3))
        given = [request[0], output[1], status[1]]
        kept = [request[1], output[0], status[0]]
        try:
            _send(self._requests, given)
        except OSError as error:
            _close(kept)
            raise ChildProcessError(f'roslaunch cannot be started: {error}') from None
        finally:
            _close(given)
        _write(request[1], json.dumps([arguments[-1], {**environment, **self._variables},
                                       os.getcwd()]))
        return ForkedProcess(output[0], status[0])

    def close(self) -> None:
        """End the server and everything it has forked."""
        if self._server is None or self._requests is None:
            return
        self._requests.close()
        try:
            self._server.wait(_END_TIMEOUT_S)
        except subprocess.TimeoutExpired:
            self._server.kill()
            self._server.wait()
        end_processes(self._record.run_id)
        self._record.remove()
        self._server = self._requests = None


def _send(requests: socket.socket, descriptors: List[int]) -> None:
    content = array.array('i', descriptors).tobytes()
    requests.sendmsg([b'+'], [(socket.SOL_SOCKET, socket.SCM_RIGHTS, content)])


def _close(descriptors: List[int]) -> None:
    for descriptor in descriptors:
        os.close(descriptor)


def _write(descriptor: int, text: str) -> None:
    """Write and close; the reader may be gone, which is noticed when its answer is read."""
    try:
        with os.fdopen(descriptor, 'w', encoding='utf-8') as file:
            file.write(text)
    except BrokenPipeError:
        return
