# SPDX-License-Identifier: BSD-3-Clause
"""A program that forks a roslaunch for each request.

Half of roslaunch's start time is spent on loading its modules; here they are loaded only once. The
rest is spent on two processes that determine versions for the parameters of roscore, which a part
of a cell does not need.

Requests arrive on the socket whose descriptor is the first argument: a byte with three descriptors
(see ``RoslaunchForks``). The first descriptor delivers two lines: what to load, and then, perhaps
later, the environment for launching. The program ends when the other end of the socket is closed;
the kernel then interrupts every roslaunch that is still running.
"""
from __future__ import annotations

import array
import ctypes
import json
import logging
import os
import signal
import socket
import sys
from typing import IO, Dict, List, NoReturn

import rosgraph
import roslaunch
import rospkg
from roslaunch.config import ROSLaunchConfig
from roslaunch.core import RLException, printerrlog
from roslaunch.loader import LoadException
from roslaunch.parent import ROSLaunchParent
from roslaunch.rlutil import get_or_generate_uuid
from roslaunch.xmlloader import XmlLoader, XmlParseException

_PR_SET_PDEATHSIG = 1
_DESCRIPTORS = 3


def main() -> None:
    """Serve until the other end of the socket is closed."""
    with socket.socket(fileno=int(sys.argv[1])) as requests:
        signal.signal(signal.SIGCHLD, signal.SIG_IGN)  # no zombies of ended children
        while True:
            descriptors = _next_request(requests)
            if not descriptors:
                return
            if _fork() == 0:
                break
            for descriptor in descriptors:
                os.close(descriptor)
    _become_roslaunch(*descriptors)


def _next_request(requests: socket.socket) -> List[int]:
    descriptors = array.array('i')
    size = _DESCRIPTORS * descriptors.itemsize
    _, ancillary, _, _ = requests.recvmsg(1, socket.CMSG_SPACE(size))
    for _, _, content in ancillary:
        descriptors.frombytes(content)
    return list(descriptors)


def _fork() -> int:
    """Fork; on failure, return -1, and the client sees the closed descriptors."""
    try:
        return os.fork()
    except OSError as error:
        print(f'no roslaunch can be started: {error}', file=sys.stderr)
        return -1


def _become_roslaunch(request: int, output: int, status: int) -> None:
    """Run roslaunch in its own session; write process id and exit code to ``status``."""
    os.setsid()
    signal.signal(signal.SIGCHLD, signal.SIG_DFL)
    # This holds until roslaunch's process monitor handles interrupts. As exceptions they would be
    # lost, because roslaunch often continues after any exception.
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    _end_with_parent()
    os.dup2(output, 1)
    os.dup2(output, 2)
    os.close(output)
    os.write(status, f'{os.getpid()}\n'.encode())
    with os.fdopen(request, encoding='utf-8') as file:
        code = _launch(file)
    os.write(status, f'{code}\n'.encode())
    _end(code)


def _launch(request: IO[str]) -> int:
    """Launch a file like the command roslaunch; return the exit code."""
    launch_file, environment, folder = json.loads(request.readline())
    os.chdir(folder)
    _take_environment(environment)
    try:
        if not rosgraph.is_master_online():
            raise RLException(f'there is no ROS master at {rosgraph.get_master_uri()}')
        run_id = get_or_generate_uuid(None, False)
        roslaunch.configure_logging(run_id)
        parent = _Parent(run_id, [launch_file], show_summary=False)
        parent.prepare()
        start = request.readline()
        if not start:
            _end(0)  # not needed; the output is not read
        _take_environment(json.loads(start))
        parent.start()
        parent.spin()
    except (RLException, rospkg.ResourceNotFound, ValueError) as error:
        printerrlog(f'RLException: {error}')
        return 1
    return 0


def _take_environment(environment: Dict[str, str]) -> None:
    os.environ.clear()
    os.environ.update(environment)


def _end(code: int) -> NoReturn:
    """Exit at once: the exit handlers of rospy and Python wait a third of a second for threads."""
    logging.shutdown()
    sys.stdout.flush()
    sys.stderr.flush()
    os._exit(code)


class _Parent(ROSLaunchParent):
    """Loads a launch file without roscore's own, which the running master has already loaded."""

    def prepare(self) -> None:
        """Prepare everything before the first node.

        Raises:
            RLException: the file is wrong.
        """
        self._load_config()
        self._start_pm()
        self._start_server()

    def _load_config(self) -> None:
        self.config = ROSLaunchConfig()
        loader = XmlLoader()
        loader.ignore_unset_args = False
        try:
            for launch_file in self.roslaunch_files:
                loader.load(launch_file, self.config, verbose=False)
        except (XmlParseException, LoadException) as error:
            raise RLException(error) from None
        self.config.assign_machines()


def _end_with_parent() -> None:
    """Make the kernel interrupt this process when the server ends."""
    server = os.getppid()
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGINT)
    if os.getppid() != server:
        sys.exit('the server has ended')


if __name__ == '__main__':
    main()
