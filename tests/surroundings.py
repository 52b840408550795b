"""What a test needs of its own: a port for a master, and a screen."""
from __future__ import annotations

import os
import socket
import subprocess
from contextlib import contextmanager
from typing import Iterator

SOFTWARE_GRAPHICS = {'LIBGL_ALWAYS_SOFTWARE': '1', 'QT_X11_NO_MITSHM': '1'}
"""The environment of programs that draw on a virtual screen."""


def free_port() -> int:
    """A port at which nobody listens."""
    with socket.socket() as probe:
        probe.bind(('', 0))
        return int(probe.getsockname()[1])


@contextmanager
def virtual_screen() -> Iterator[str]:
    """A screen of 1600x1000 pixels; yields its display name."""
    reader, writer = os.pipe()
    process = subprocess.Popen(
        ['Xvfb', '-displayfd', str(writer), '-screen', '0', '1600x1000x24', '-nolisten', 'tcp'],
        pass_fds=[writer], stderr=subprocess.DEVNULL, start_new_session=True)
    os.close(writer)
    try:
        with os.fdopen(reader) as numbers:
            yield ':' + numbers.readline().strip()
    finally:
        process.terminate()
        process.wait()
