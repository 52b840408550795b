# SPDX-License-Identifier: BSD-3-Clause
"""A proxy of an X server, which delays the data of some connections."""
from __future__ import annotations

import array
import itertools
import os
import socket
import threading
import time
from pathlib import Path
from typing import Callable, List, Tuple

_SOCKET = '/tmp/.X11-unix/X{}'
_FIRST_NUMBER = 500
"""Number of the display; X servers that search for a free one begin at 0."""
_MAX_BYTES = 1 << 20
_FILES_SPACE = socket.CMSG_SPACE(16 * array.array('i').itemsize)


class SlowXConnection:
    """Another display of the X server of a display.

    ``delay_s`` returns the delay after which the server receives data of a connection, from the
    connection's number, which is 0 for the first one.
    """

    def __init__(self, display: str, delay_s: Callable[[int], float]) -> None:
        self._server = _SOCKET.format(display.lstrip(':'))
        self._delay_s = delay_s
        self._sockets: List[socket.socket] = []
        self._listener, number = _listener()
        self.display = f':{number}'
        threading.Thread(target=self._accept, daemon=True).start()

    @property
    def connections(self) -> int:
        """Return the number of connections so far."""
        return len(self._sockets) // 2

    def close(self) -> None:
        """End all connections."""
        for it in (self._listener, *self._sockets):
            _end(it)
        Path(_SOCKET.format(self.display[1:])).unlink()

    def _accept(self) -> None:
        while True:
            try:
                client = self._listener.accept()[0]
            except OSError:  # closed
                return
            server = socket.socket(socket.AF_UNIX)
            server.connect(self._server)
            for way in ((client, server, self._delay_s(self.connections)), (server, client, 0.0)):
                threading.Thread(target=_forward, args=way, daemon=True).start()
            self._sockets += [client, server]


def _listener() -> Tuple[socket.socket, int]:
    """Return a socket that listens as a display, and the number of the display."""
    listener = socket.socket(socket.AF_UNIX)
    for number in itertools.count(_FIRST_NUMBER):
        try:
            listener.bind(_SOCKET.format(number))
        except OSError:  # taken
            continue
        listener.listen()
        return listener, number
    raise AssertionError


def _forward(source: socket.socket, drain: socket.socket, delay_s: float) -> None:
    """Forward the data of one side, and files sent with it: shared memory."""
    try:
        while True:
            data, notes, _flags, _address = source.recvmsg(_MAX_BYTES, _FILES_SPACE)
            if not data:
                break
            time.sleep(delay_s)
            drain.sendall(data[drain.sendmsg([data], notes):])
            _close_files(notes)
    except OSError:  # one side has ended
        pass
    for it in (source, drain):
        _end(it)


def _close_files(notes: List[Tuple[int, int, bytes]]) -> None:
    for level, kind, content in notes:
        if (level, kind) == (socket.SOL_SOCKET, socket.SCM_RIGHTS):
            for file in array.array('i', content):
                os.close(file)


def _end(it: socket.socket) -> None:
    try:
        it.shutdown(socket.SHUT_RDWR)
    except OSError:  # the other side has ended before
        return
