"""The real window on a virtual screen, with a master, folders and settings of its own.

These tests have a process of their own: a process can be a ROS node only once.
"""
from __future__ import annotations

import os
import shutil
import socket
import subprocess
import tempfile
import uuid
from typing import Any, List

import pytest

MARK = 'GUI_TEST_MARK'
_STARTED: List[Any] = []


def pytest_configure(config: pytest.Config) -> None:
    """Start the screen before Qt is loaded."""
    folder = tempfile.mkdtemp(prefix='process_visualizer_gui_')
    reader, writer = os.pipe()
    screen = subprocess.Popen(
        ['Xvfb', '-displayfd', str(writer), '-screen', '0', '1600x1000x24', '-nolisten', 'tcp'],
        pass_fds=[writer], stderr=subprocess.DEVNULL)
    os.close(writer)
    with os.fdopen(reader) as numbers:
        display = ':' + numbers.readline().strip()
    _STARTED.extend([screen, folder])
    os.environ.update({
        'DISPLAY': display, 'QT_QPA_PLATFORM': 'xcb', 'LIBGL_ALWAYS_SOFTWARE': '1',
        'QT_X11_NO_MITSHM': '1', 'ROS_MASTER_URI': f'http://localhost:{_free_port()}',
        'ROS_HOME': os.path.join(folder, 'ros_home'), 'XDG_CONFIG_HOME': folder,
        'HOME_FOLDER': folder, MARK: uuid.uuid4().hex})


def pytest_unconfigure(config: pytest.Config) -> None:
    """End the screen; nothing of these tests stays behind."""
    screen, folder = _STARTED
    screen.terminate()
    screen.wait()
    shutil.rmtree(folder, ignore_errors=True)


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(('', 0))
        return int(probe.getsockname()[1])
