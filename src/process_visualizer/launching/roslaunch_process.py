# SPDX-License-Identifier: BSD-3-Clause
"""Runs roslaunch as a child in its own session."""
from __future__ import annotations

import os
import shutil
import signal
import subprocess
from typing import IO, Callable, Dict, List, Mapping, Optional, Sequence, Union
from urllib.parse import urlparse

from process_visualizer.launching.forked_process import ForkedProcess
from process_visualizer.launching.process_scan import (
    RUN_VARIABLE,
    continue_processes,
    end_processes,
    names_of,
    processes_of_run,
)

_SIGINT_TIMEOUT_S = 30.0
_SIGTERM_TIMEOUT_S = 5.0
_LOCAL = {'ROS_HOSTNAME': 'localhost'}
"""ROS's libraries listen at 127.0.0.1 then, otherwise at every address."""
_NAMED = {'ROS_IP', 'ROS_HOSTNAME'}
_LOCAL_HOSTS = ('localhost', '127.0.0.1', '::1')
_TELL_PERIOD_S = 5.0


Child = Union['subprocess.Popen[str]', ForkedProcess]
Start = Callable[[List[str], Mapping[str, str]], Child]
"""Starts roslaunch with arguments and an environment, in its own session."""


def start_roslaunch(arguments: List[str], environment: Mapping[str, str]) -> Child:
    """Start the command roslaunch."""
    return subprocess.Popen(
        [*dying_with_parent(), 'roslaunch', *arguments], env=environment,
        stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
        start_new_session=True, text=True, errors='replace')


def start_for_this_computer(arguments: List[str], environment: Mapping[str, str]) -> Child:
    """Start the command roslaunch so that master and nodes listen to this computer only."""
    return start_roslaunch(arguments, {**environment, **_LOCAL})


def is_for_this_computer(master_uri: str, environment: Mapping[str, str]) -> bool:
    """Return whether a master at that address can be meant for this computer only."""
    return urlparse(master_uri).hostname in _LOCAL_HOSTS and not _NAMED & {
        name for name, value in environment.items() if value}


class RoslaunchProcess:
    """A roslaunch process; its nodes carry the mark of ``run_id`` in their environment.

    roslaunch gives each node 15 s for SIGINT and 2 s for SIGTERM, so stopping takes its time. If
    this process is killed, the kernel interrupts roslaunch, which then stops its nodes.
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
        """The exit code, or None while it runs."""
        return self._process.poll()

    def wait(self) -> int:
        """Wait for the end of roslaunch; returns its exit code."""
        return self._process.wait()

    def stop(self, tell: Callable[[str], None] = lambda text: None) -> List[int]:
        """Stop roslaunch and everything it started; return the ids of remaining orphans.

        What somebody has stopped with SIGSTOP goes on, so that a recorder finishes its bag.
        ``tell`` hears every 5 s what has not ended yet.
        """
        for number, timeout_s in ((signal.SIGINT, _SIGINT_TIMEOUT_S),
                                  (signal.SIGTERM, _SIGTERM_TIMEOUT_S)):
            if self._ends_on(number, timeout_s, tell):
                break
        else:
            self._process.kill()
            self._process.wait()
        return end_processes(self._run_id)

    def _ends_on(self, number: int, timeout_s: float, tell: Callable[[str], None]) -> bool:
        if self.exit_code() is None:
            self._process.send_signal(number)
            continue_processes(self._run_id)
        while timeout_s > 0.0:
            try:
                self._process.wait(min(timeout_s, _TELL_PERIOD_S))
                return True
            except subprocess.TimeoutExpired:
                timeout_s -= _TELL_PERIOD_S
                left = sorted(set(names_of(processes_of_run(self._run_id))))
                tell(f'waiting for the end of {", ".join(left)}')
        return False


def launch_environment(master_uri: Optional[str] = None) -> Dict[str, str]:
    """The environment of a roslaunch, but for the mark of its run; None is the usual master."""
    environment = {**os.environ, 'PYTHONUNBUFFERED': '1'}
    if master_uri is not None:
        environment['ROS_MASTER_URI'] = master_uri
    return environment


def dying_with_parent() -> List[str]:
    """The command that lets the kernel interrupt a process when its parent dies, if any."""
    setpriv = shutil.which('setpriv')
    return [setpriv, '--pdeathsig', 'INT', '--'] if setpriv else []
