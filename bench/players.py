# SPDX-License-Identifier: BSD-3-Clause
"""The compared players, and the ROS master they need."""
from __future__ import annotations

import contextlib
import os
import signal
import subprocess
from pathlib import Path
from typing import Dict, Iterator, List, Sequence
from urllib.parse import urlsplit

from process_visualizer.nodes.view_picture import wait_for_master

PEER, OURS = 'rosbag play', 'process_visualizer'
ORDINARY = 'process_visualizer as an ordinary user'
"""The player without real-time priority; root gives up its capability for that."""
_PLAYER = ['rosrun', 'process_visualizer', 'bag_player']
COMMANDS: Dict[str, List[str]] = {
    PEER: ['rosrun', 'rosbag', 'play'], OURS: _PLAYER,
    ORDINARY: ['setpriv', '--bounding-set=-sys_nice', *_PLAYER]}
_MASTER_TIMEOUT_S = 30.0


@contextlib.contextmanager
def ros_master() -> Iterator[None]:
    """A ROS master at ROS_MASTER_URI."""
    port = str(urlsplit(os.environ['ROS_MASTER_URI']).port)
    with _ended(subprocess.Popen(['roscore', '-p', port], stdout=subprocess.DEVNULL)):
        if not wait_for_master(_MASTER_TIMEOUT_S):
            raise RuntimeError('the ROS master does not answer')
        yield


@contextlib.contextmanager
def playing(player: str, bag: Path, options: Sequence[str]) -> Iterator['subprocess.Popen[bytes]']:
    """A player of a bag; it has a keyboard, which nobody uses."""
    command = [*COMMANDS[player], '-q', *options, str(bag)]
    with _ended(subprocess.Popen(command, stdin=subprocess.PIPE,
                                 stdout=subprocess.DEVNULL)) as process:
        yield process


@contextlib.contextmanager
def _ended(process: 'subprocess.Popen[bytes]') -> Iterator['subprocess.Popen[bytes]']:
    with process:
        try:
            yield process
        finally:
            if process.poll() is None:
                process.send_signal(signal.SIGINT)
                process.wait()
