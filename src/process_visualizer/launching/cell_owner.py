# SPDX-License-Identifier: BSD-3-Clause
"""The owner of a ROS master's cell: the node of its name, and who started it."""
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
    AskedMaster,
    is_registered,
    process_id_at,
)
from process_visualizer.launching.run_record import folder_of_run, start_time
from process_visualizer.ros_names import CELL_FRAMES, SCENE_WATCH


class CellOwner(NamedTuple):
    """A launcher. ``user``, ``since_s`` (since the epoch) and ``folder`` only if it runs here.

    ``folder`` has the generated files of what it has launched.
    """

    master_uri: str
    process_id: int
    computer: str
    user: str = ''
    since_s: Optional[float] = None
    folder: str = ''

    @property
    def text(self) -> str:
        """The owner of the cell, in words."""
        who = f' of {self.user}' if self.user else ''
        where = '' if self.user else f' on {self.computer}'
        since = '' if self.since_s is None else \
            time.strftime(', since %H:%M', time.localtime(self.since_s))
        return (f'Another launcher (process {self.process_id}{who}{where}{since}) controls the '
                f'cell on the ROS master {self.master_uri}')


def cell_owner(node: str) -> Optional[CellOwner]:
    """Return who has the cell if another process is the node of this name, and answers.

    The master still knows a node that has ended without unregistering. Takes at most 6 s.
    """
    try:
        uri = AskedMaster(CALLER_ID, timeout_s=PATIENT_TIMEOUT_S).lookupNode(f'/{node}')
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
    """The name of the user whose process it is, or the number of one without a name."""
    try:
        number = os.stat(f'/proc/{pid}').st_uid
    except OSError:
        return ''
    try:
        return pwd.getpwuid(number).pw_name
    except KeyError:
        return f'user {number}'


def _since_s(pid: int) -> Optional[float]:
    """Return when it was started [s since the epoch]."""
    ticks = start_time(pid)
    booted = [line.split()[1] for line in Path('/proc/stat').read_text().splitlines()
              if line.startswith('btime ')]
    if ticks is None or not booted:
        return None
    return float(booted[0]) + int(ticks) / os.sysconf('SC_CLK_TCK')


# Detection of another cell: ROS ends a node when another of the same name starts.

_NODES = (f'/{SCENE_WATCH}', f'/{CELL_FRAMES}')
"""They run with every cell, and only with a cell."""


class OtherCell(Exception):
    """Another cell is running on the master; says how it was detected, and what to do."""


def refuse_other_cell() -> None:
    """Raise OtherCell if a cell is running on the master; takes at most 6 s."""
    node = next((name for name in _NODES if is_registered(name)), None)
    if node is not None:
        raise OtherCell('another cell is already running on the master '
                        f'{rosgraph.get_master_uri()} '
                        f'({node} answers); ROS would end its nodes and its recording. To '
                        'watch it: "rosrun process_visualizer cell view". To run another one, '
                        'stop it first, or set ROS_MASTER_URI to another port')
