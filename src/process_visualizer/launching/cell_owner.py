# SPDX-License-Identifier: BSD-3-Clause
"""The owner of a ROS master's cell: the process of a node, and its user."""
from __future__ import annotations

import os
import pwd
import time
from http.client import HTTPException
from pathlib import Path
from typing import NamedTuple, Optional
from urllib.parse import urlparse
from xmlrpc.client import Error

import rosgraph
from rosgraph.network import is_local_address

from process_visualizer.launching.ros_api import (
    CALLER_ID,
    PATIENT_TIMEOUT_S,
    MasterClient,
    is_registered,
    process_id_at,
)
from process_visualizer.launching.run_record import folder_of_run, start_time
from process_visualizer.ros_names import CELL_FRAMES, SCENE_WATCH


class CellOwner(NamedTuple):
    """A launcher; ``folder`` contains the generated files of its cell.

    ``user``, ``since_s`` (since the epoch) and ``folder`` are set only if it runs on this computer.
    """

    master_uri: str
    process_id: int
    computer: str
    user: str = ''
    since_s: Optional[float] = None
    folder: str = ''

    @property
    def text(self) -> str:
        """A sentence about the owner."""
        who = f' of {self.user}' if self.user else ''
        where = '' if self.user else f' on {self.computer}'
        since = '' if self.since_s is None else \
            time.strftime(', since %H:%M', time.localtime(self.since_s))
        return (f'Another launcher (process {self.process_id}{who}{where}{since}) controls the '
                f'cell on the ROS master {self.master_uri}')


def cell_owner(node: str) -> Optional[CellOwner]:
    """Return the owner if another process answers as the node with this name, else None.

    The master still knows a node that has ended without unregistering. Takes at most 6 s.
    """
    try:
        uri = MasterClient(CALLER_ID, timeout_s=PATIENT_TIMEOUT_S).lookupNode(f'/{node}')
        pid = process_id_at(uri)
    except (rosgraph.MasterException, OSError, HTTPException, Error, ValueError):
        return None
    computer = urlparse(uri).hostname or ''
    if not is_local_address(computer) or start_time(pid) is None:
        return CellOwner(rosgraph.get_master_uri(), pid, computer)
    if pid == os.getpid():
        return None
    return CellOwner(rosgraph.get_master_uri(), pid, computer, _user(pid), _since_s(pid),
                     folder_of_run(pid))


def _user(pid: int) -> str:
    """Return the name of a process's user, or the user id if there is no name."""
    try:
        number = os.stat(f'/proc/{pid}').st_uid
    except OSError:
        return ''
    try:
        return pwd.getpwuid(number).pw_name
    except KeyError:
        return f'user {number}'


def _since_s(pid: int) -> Optional[float]:
    """Return the start time of a process [s since the epoch]."""
    ticks = start_time(pid)
    booted = [line.split()[1] for line in Path('/proc/stat').read_text().splitlines()
              if line.startswith('btime ')]
    if ticks is None or not booted:
        return None
    return float(booted[0]) + int(ticks) / os.sysconf('SC_CLK_TCK')


# Detection of another cell: ROS ends a node when another node with the same name starts.

CELL_NODES = (f'/{SCENE_WATCH}', f'/{CELL_FRAMES}')
"""Nodes that run in every cell, and only in a cell."""


class OtherCell(Exception):
    """Another cell is running on the master; the text has the evidence and the remedy."""


def refuse_other_cell() -> None:
    """Raise OtherCell if a cell is running on the master; takes at most 6 s."""
    node = next((name for name in CELL_NODES if is_registered(name)), None)
    if node is not None:
        raise OtherCell('another cell is already running on the master '
                        f'{rosgraph.get_master_uri()} '
                        f'({node} answers); ROS would end its nodes and its recording. To '
                        'watch it: "rosrun process_visualizer cell view". To run another one, '
                        'stop it first, or set ROS_MASTER_URI to another port')
