"""A program that forks a roslaunch for each request.

Most of what roslaunch takes to start is the loading of its modules; here they are loaded once.
Requests come over the socket whose descriptor is the first argument: a byte with three descriptors
(see ``forked_process``). The program ends when the other end of the socket is closed, and the
kernel then interrupts every roslaunch that still runs.
"""
from __future__ import annotations

import array
import ctypes
import json
import os
import signal
import socket
import sys
from typing import List

import roslaunch
import roslaunch.parent  # noqa: F401 - loads what roslaunch would load later
import roslaunch.xmlloader  # noqa: F401

_PR_SET_PDEATHSIG = 1
_DESCRIPTORS = 3


def main() -> None:
    """Serve until the other end of the socket is closed."""
    with socket.socket(fileno=int(sys.argv[1])) as requests:
        signal.signal(signal.SIGCHLD, signal.SIG_IGN)  # the kernel forgets those that have ended
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
    """Fork; where the machine has no room for a process, the closed descriptors tell the client."""
    try:
        return os.fork()
    except OSError as error:
        print(f'no roslaunch can be started: {error}', file=sys.stderr)
        return -1


def _become_roslaunch(request: int, output: int, status: int) -> None:
    """Run roslaunch in a session of its own; its process id and exit code go to ``status``."""
    os.setsid()
    signal.signal(signal.SIGCHLD, signal.SIG_DFL)
    _end_with_parent()
    with os.fdopen(request, encoding='utf-8') as file:
        arguments, environment, folder = json.load(file)
    os.chdir(folder)
    os.dup2(output, 1)
    os.dup2(output, 2)
    os.close(output)
    os.environ.clear()
    os.environ.update(environment)
    os.write(status, f'{os.getpid()}\n'.encode())
    try:
        roslaunch.main(['roslaunch', *arguments])
        os.write(status, b'0\n')
    except SystemExit as end:
        os.write(status, f'{end.code if isinstance(end.code, int) else 1}\n'.encode())


def _end_with_parent() -> None:
    """Have the kernel interrupt this process when the server ends."""
    server = os.getppid()
    ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGINT)
    if os.getppid() != server:
        sys.exit('the server has ended')


if __name__ == '__main__':
    main()
