# SPDX-License-Identifier: BSD-3-Clause
"""Starts roslaunch faster than a command can: as forks of a program that has loaded it."""
from __future__ import annotations

import array
import contextlib
import json
import os
import socket
import subprocess
import sys
from typing import Any, Dict, Iterable, List, Mapping, NamedTuple, Optional

from process_visualizer.launching.forked_process import ForkedProcess
from process_visualizer.launching.process_scan import RUN_VARIABLE, end_processes
from process_visualizer.launching.run_record import RunRecord

_SERVER = 'process_visualizer.launching.roslaunch_server'
_END_TIMEOUT_S = 5.0


class _Fork(NamedTuple):
    """Our ends of the pipes of a fork: its request, its output, its status."""

    request: int
    output: int
    status: int


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
        self._loaded: Dict[str, _Fork] = {}

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

    def load(self, launch_file: str, environment: Mapping[str, str]) -> None:
        """Let a roslaunch load a file, and wait until ``start`` is called with the same file.

        Call ``discard`` after that. What cannot be loaded is told by the process that is started.
        """
        self.prepare()
        fork = self._fork()
        _write(fork.request, [launch_file, self._all_of({
            **environment, RUN_VARIABLE: self._record.run_id}), os.getcwd()])
        self._loaded[launch_file] = fork

    def discard(self) -> None:
        """End what has loaded a file and was not started."""
        for fork in self._loaded.values():
            _close(fork)
        self._loaded.clear()

    def start(self, arguments: List[str], environment: Mapping[str, str]) -> ForkedProcess:
        """Start a roslaunch.

        Of the command's arguments only the last is used, the launch file. Needs a running master.

        Raises:
            ChildProcessError: it cannot be started.
        """
        self.prepare()
        launch_file, variables = arguments[-1], self._all_of(environment)
        fork = self._loaded.pop(launch_file, None)
        if fork is None:
            fork = self._fork()
            _write(fork.request, [launch_file, variables, os.getcwd()])
        _write(fork.request, variables)
        os.close(fork.request)
        return ForkedProcess(fork.output, fork.status)

    def _all_of(self, environment: Mapping[str, str]) -> Dict[str, str]:
        return {**environment, **self._variables}

    def _fork(self) -> _Fork:
        """Let the server fork itself.

        Raises:
            ChildProcessError: the server has ended.
        """
        assert self._requests is not None
        request, output, status = (os.pipe() for _ in range(3))
        given = [request[0], output[1], status[1]]
        kept = _Fork(request[1], output[0], status[0])
        try:
            _send(self._requests, given)
        except OSError as error:
            _close(kept)
            raise ChildProcessError(f'roslaunch cannot be started: {error}') from None
        finally:
            _close(given)
        return kept

    def close(self) -> None:
        """End the server and everything it has forked."""
        self.discard()
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


def _close(descriptors: Iterable[int]) -> None:
    for descriptor in descriptors:
        os.close(descriptor)


def _write(descriptor: int, content: Any) -> None:
    """Write a line; the reader may be gone, which is noticed when its answer is read."""
    rest = json.dumps(content).encode() + b'\n'
    with contextlib.suppress(BrokenPipeError):
        while rest:
            rest = rest[os.write(descriptor, rest):]
