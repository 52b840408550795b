# SPDX-License-Identifier: BSD-3-Clause
"""No node of the running cell gets the port of a replay's master before the replay starts."""
from __future__ import annotations

import contextlib
import socket
from unittest import mock
from urllib.parse import urlparse

import pytest

from process_visualizer.launching.replay_cell import ReplayCell


def test_the_port_of_its_master_is_held() -> None:
    cell = ReplayCell(mock.Mock())
    port = urlparse(cell.master_uri).port
    with contextlib.closing(socket.socket()) as other, pytest.raises(OSError):
        other.bind(('', port))
    cell.stop()
    with contextlib.closing(socket.socket()) as other:
        other.bind(('', port))
