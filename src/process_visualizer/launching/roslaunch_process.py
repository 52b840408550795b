# SPDX-License-Identifier: BSD-3-Clause
"""roslaunch as a child process in its own session, and the other computers in its launch file."""
from __future__ import annotations

import array
import contextlib
import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import (
    IO,
    Any,
    Callable,
    Dict,
    Iterable,
    Iterator,
    List,
    Mapping,
    NamedTuple,
    Optional,
    Sequence,
    Tuple,
    Union,
)
from urllib.parse import urlparse
from xml.etree import ElementTree

from process_visualizer.launching.run_record import (
    RUN_VARIABLE,
    RunRecord,
    continue_processes,
    end_processes,
    names_of,
    processes_of_run,
)


class ForkedProcess:
    """A roslaunch forked by the server, with the interface of Popen; ``pid`` is its process id.

    ``output`` and ``status`` are the read ends of its pipes.

    Raises:
        ChildProcessError: the server has not started the process.
    """

    def __init__(self, output: int, status: int) -> None:
        self.stdout: Optional[IO[str]] = os.fdopen(output, encoding='utf-8', errors='replace')
        self._status = os.fdopen(status, encoding='ascii')
        first = self._status.readline()
        if not first:
            self.stdout.close()
            self._status.close()
            raise ChildProcessError('roslaunch cannot be started')
        self.pid = int(first)
        self._code = -int(signal.SIGKILL)  # unless the process reports another code
        self._ended = threading.Event()
        threading.Thread(target=self._follow, name='follow roslaunch', daemon=True).start()

    def poll(self) -> Optional[int]:
        """Return the exit code, or None while the process runs."""
        return self._code if self._ended.is_set() else None

    def wait(self, timeout: Optional[float] = None) -> int:
        """Wait for the end; return the exit code, or raise subprocess.TimeoutExpired."""
        if not self._ended.wait(timeout):
            raise subprocess.TimeoutExpired('roslaunch', timeout or 0.0)
        return self._code

    def send_signal(self, number: int) -> None:
        """Send a signal if the process still runs."""
        if not self._ended.is_set():
            os.kill(self.pid, number)

    def kill(self) -> None:
        """Send SIGKILL if the process still runs."""
        self.send_signal(signal.SIGKILL)

    def _follow(self) -> None:
        """Read the status pipe until the process ends: nodes do not inherit the pipe."""
        with self._status as status:
            for line in status:
                self._code = int(line)
        self._ended.set()


_SIGINT_TIMEOUT_S = 30.0
_SIGTERM_TIMEOUT_S = 5.0
_LOCAL = {'ROS_HOSTNAME': 'localhost'}
"""Makes ROS's libraries listen at 127.0.0.1; otherwise they listen at every address."""
_NAMED = {'ROS_IP', 'ROS_HOSTNAME'}
_LOCAL_HOSTS = ('localhost', '127.0.0.1', '::1')
_TELL_PERIOD_S = 5.0
_FAR_S = 1.0
"""Time in which roslaunch normally ends; after it, other computers are checked."""
_LOST_PERIOD_S = 3.0
_CORE = {'rosmaster', 'rosout'}
"""Processes that roslaunch ends last."""


Child = Union['subprocess.Popen[str]', ForkedProcess]
Start = Callable[[List[str], Mapping[str, str]], Child]
"""Starts roslaunch in its own session, with arguments and an environment."""


def start_roslaunch(arguments: List[str], environment: Mapping[str, str]) -> Child:
    """Start the command roslaunch."""
    return subprocess.Popen(
        [*dying_with_parent(), 'roslaunch', *arguments], env=environment,
        stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
        start_new_session=True, text=True, errors='replace')


def start_for_this_computer(arguments: List[str], environment: Mapping[str, str]) -> Child:
    """Start the command roslaunch, with a master and nodes that listen only to this computer."""
    return start_roslaunch(arguments, {**environment, **_LOCAL})


def is_for_this_computer(master_uri: str, environment: Mapping[str, str]) -> bool:
    """Return whether a master at an address is for this computer only."""
    return urlparse(master_uri).hostname in _LOCAL_HOSTS and not _NAMED & {
        name for name, value in environment.items() if value}


class RoslaunchProcess:
    """A roslaunch process; its nodes have the mark ``run_id`` in their environment.

    roslaunch gives each node 15 s after SIGINT and 2 s after SIGTERM, so stopping may take a while.
    If this process is killed, the kernel interrupts roslaunch, which then stops its nodes.
    """

    def __init__(self, arguments: Sequence[str], run_id: str,
                 start: Start = start_roslaunch, master_uri: Optional[str] = None) -> None:
        environment = {**launch_environment(master_uri), RUN_VARIABLE: run_id}
        self._run_id = run_id
        self._process = start(['--no-summary', '--disable-title', '--skip-log-check', *arguments],
                              environment)

    @property
    def output(self) -> IO[str]:
        """The output of roslaunch and of the nodes with output to the screen."""
        assert self._process.stdout is not None
        return self._process.stdout

    def exit_code(self) -> Optional[int]:
        """Return the exit code, or None while roslaunch runs."""
        return self._process.poll()

    def wait(self) -> int:
        """Wait for the end of roslaunch; return its exit code."""
        return self._process.wait()

    def stop(self, tell: Callable[[str], None] = lambda text: None,
             far: Sequence[FarComputer] = ()) -> List[int]:
        """Stop roslaunch and everything it started; return the ids of the orphans that were ended.

        Processes stopped by SIGSTOP are continued, so that a recorder finishes its bag. ``tell``
        is called every 5 s with the processes that have not ended yet. roslaunch would wait minutes
        for a computer whose link is down: ``far`` computers that do not answer are reported at
        once, and abandoned when everything on this computer has ended.
        """
        for number, timeout_s in ((signal.SIGINT, _SIGINT_TIMEOUT_S),
                                  (signal.SIGTERM, _SIGTERM_TIMEOUT_S)):
            lost = self._wait_after(number, timeout_s, tell, far)
            if lost or self.exit_code() is not None:
                break
        if self.exit_code() is None:
            self._process.kill()
            self._process.wait()
        for computer in lost:
            tell(f'could not be stopped: {computer}, which does not answer; end it there, or '
                 'restart that computer')
        return end_processes(self._run_id)

    def _wait_after(self, number: int, timeout_s: float, tell: Callable[[str], None],
                    far: Sequence[FarComputer]) -> List[FarComputer]:
        """Send a signal and wait for the end; return the silent computers if nothing else is left.

        roslaunch may give up on them by itself.
        """
        if self.exit_code() is None:
            self._process.send_signal(number)
            continue_processes(self._run_id)
        if far and self._has_ended(_FAR_S):
            return []
        without_answer = silent(far)
        for computer in without_answer:
            tell(f'no answer: {computer}; waiting some seconds for its end')
        period_s = _LOST_PERIOD_S if without_answer else _TELL_PERIOD_S
        while timeout_s > 0.0 and not self._has_ended(min(timeout_s, period_s)):
            timeout_s -= period_s
            left = processes_of_run(self._run_id)
            names = set(names_of([it for it in left if it != self._process.pid]))
            lost = silent(far) if names <= _CORE else []
            if lost:
                return lost
            tell(f'waiting for the end of {", ".join(sorted(set(names_of(left))))}')
        return silent(without_answer) if without_answer else []

    def _has_ended(self, timeout_s: float) -> bool:
        try:
            self._process.wait(timeout_s)
            return True
        except subprocess.TimeoutExpired:
            return False


def launch_environment(master_uri: Optional[str] = None) -> Dict[str, str]:
    """Return the environment of a roslaunch without the mark of its run; None: the usual master."""
    environment = {**os.environ, 'PYTHONUNBUFFERED': '1'}
    if master_uri is not None:
        environment['ROS_MASTER_URI'] = master_uri
    return environment


def dying_with_parent() -> List[str]:
    """Return the command prefix by which the kernel interrupts a process when its parent dies.

    The prefix is empty if setpriv is not installed.
    """
    setpriv = shutil.which('setpriv')
    return [setpriv, '--pdeathsig', 'INT', '--'] if setpriv else []


_SERVER = 'process_visualizer.launching.roslaunch_server'
_END_TIMEOUT_S = 5.0


class _Fork(NamedTuple):
    """Our ends of a fork's pipes: request, output and status."""

    request: int
    output: int
    status: int


class RoslaunchForks:
    """The server ``roslaunch_server``, started when first needed, and again if it has ended.

    The environment of the server, and so of each roslaunch, has the mark of a record; that of a
    roslaunch's nodes has the mark given to ``start``. The server ends with this process, for
    whatever reason.
    """

    def __init__(self, niceness: int = 0, variables: Optional[Mapping[str, str]] = None) -> None:
        """Initialize with the common settings of all processes.

        Args:
            niceness: above 0, other processes have precedence (see nice(1)).
            variables: environment variables in addition to those given to ``start``.
        """
        self._niceness, self._variables = niceness, dict(variables or {})
        self._record = RunRecord()
        self._server: Optional['subprocess.Popen[bytes]'] = None
        self._requests: Optional[socket.socket] = None
        self._loaded: Dict[str, _Fork] = {}

    def prepare(self) -> None:
        """Start the server if it is not running; return before its modules are loaded."""
        if self._server is not None and self._server.poll() is None:
            return
        self.close()
        self._record.write()
        ours, its = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        for end in (ours, its):  # independent of this process's default timeout
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
        """Make a roslaunch load a file and wait for ``start`` with the same file.

        Call ``discard`` afterwards. The process returned by ``start`` reports loading errors.
        """
        self.prepare()
        fork = self._fork()
        _write(fork.request, [launch_file, self._all_of({
            **environment, RUN_VARIABLE: self._record.run_id}), os.getcwd()])
        self._loaded[launch_file] = fork

    def discard(self) -> None:
        """End the processes that have loaded a file, but were not started."""
        for fork in self._loaded.values():
            _close(fork)
        self._loaded.clear()

    def start(self, arguments: List[str], environment: Mapping[str, str]) -> ForkedProcess:
        """Start a roslaunch; a master must be running.

        Only the last of the command's arguments is used: the launch file.

        Raises:
            ChildProcessError: roslaunch cannot be started.
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
        """Make the server fork itself.

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
        """End the server and all its forks."""
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
    """Write a line; a closed pipe is noticed later, when the answer is read."""
    rest = json.dumps(content).encode() + b'\n'
    with contextlib.suppress(BrokenPipeError):
        while rest:
            rest = rest[os.write(descriptor, rest):]


_ANSWER_S = 1.5
_SSH_PORT = 22


class FarComputer(NamedTuple):
    """A ``<machine>`` and the nodes that run on it."""

    name: str
    address: str
    port: int
    nodes: Tuple[str, ...]

    def __str__(self) -> str:
        """Return nodes and computer in words."""
        return f'{", ".join(self.nodes) or "what runs"} on {self.name} ({self.address})'


def far_computers(launch_file: str) -> List[FarComputer]:
    """Return the computers in a generated launch file; none if it cannot be read."""
    try:
        root = ElementTree.fromstring(Path(launch_file).read_bytes())
    except (OSError, ElementTree.ParseError):
        return []
    nodes: Dict[str, List[str]] = {}
    for machine, node in _nodes_by_machine(root, '/'):
        nodes.setdefault(machine, []).append(node)
    return [FarComputer(name, element.get('address', ''), _port(element.get('ssh-port', '')),
                        tuple(nodes.get(name, ())))
            for element in root.iter('machine') for name in [element.get('name', '')]]


def _nodes_by_machine(element: ElementTree.Element, namespace: str) -> Iterator[Tuple[str, str]]:
    for child in element:
        if child.tag == 'group':
            yield from _nodes_by_machine(child, f'{namespace}{child.get("ns", "").strip("/")}/'
                                         .replace('//', '/'))
        elif child.tag == 'node':
            yield child.get('machine', ''), namespace + child.get('name', '')


def _port(text: str) -> int:
    return int(text) if text.isdecimal() else _SSH_PORT


def silent(computers: Sequence[FarComputer]) -> List[FarComputer]:
    """Return the computers that do not answer; takes a few seconds at most.

    A refused connection counts as an answer. A computer whose address only SSH knows is not
    returned.
    """
    if not computers:
        return []
    with ThreadPoolExecutor(len(computers), 'ask computer') as pool:
        return [it for it, answers in zip(computers, pool.map(_answers, computers)) if not answers]


def _answers(computer: FarComputer) -> bool:
    try:
        with socket.create_connection((computer.address, min(computer.port, 65535)), _ANSWER_S):
            return True
    except (ConnectionRefusedError, socket.gaierror, UnicodeError):
        return True
    except OSError:
        return False
