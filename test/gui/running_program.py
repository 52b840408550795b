# SPDX-License-Identifier: BSD-3-Clause
"""The launcher as a program of its own, as a user starts it, and what it leaves behind."""
from __future__ import annotations

import os
import socket
import subprocess
import threading
import uuid
from pathlib import Path
from typing import Dict, List, Sequence, Set

import rosgraph
from surroundings import PATIENCE_S, end_marked_processes, free_port, marked_processes

MARK = 'GUI_PROGRAM_MARK'

SMALL_CELL = """<visualizer>
  <device type="other" name="sensors">
    <base frame="sensors/base" />
    <node ifstate="realtime" pkg="sewing_cell" type="simulator" name="simulator" ns="/">
      <param name="image_rate" value="0" />
      <param name="joint_rate" value="0" />
      <param name="force_rate" value="0" />
    </node>
    <topic name="edge_finder_upper" />
    <topic name="feed_rate_est" />
  </device>
  <device type="other" name="table">
    <base frame="table/base" />
    <node pkg="tf" type="static_transform_publisher" name="plate"
          args="0 0 0.7 0 0 0 table/base table/plate 100" />
  </device>
</visualizer>
"""
SMALL_CELL_NODES = {'/process_visualizer', '/bag_recorder', '/cell_frames', '/scene_watch',
                    '/simulator', '/view_relay', '/table/plate'}


class Surroundings:
    """An environment with a master port, folders and a mark of its own."""

    def __init__(self, folder: Path) -> None:
        self.config = folder / 'small.xml'
        self.config.write_text(SMALL_CELL)
        self.mark = uuid.uuid4().hex
        self.temporary = folder / 'tmp'
        self.temporary.mkdir()
        self.settings = folder / 'settings'
        self.port = free_port()
        self.uri = f'http://localhost:{self.port}'
        self.environment: Dict[str, str] = {
            **os.environ, MARK: self.mark, 'ROS_MASTER_URI': self.uri,
            'ROS_HOME': str(folder / 'ros_home'), 'XDG_CONFIG_HOME': str(self.settings),
            'TMPDIR': str(self.temporary)}

    def nodes(self) -> Set[str]:
        """Return the nodes that the master knows; none without a master."""
        try:
            state = rosgraph.Master('/test', self.uri).getSystemState()
        except OSError:
            return set()
        return {node for part in state for _, names in part for node in names}

    def processes(self) -> Set[str]:
        """Return the command lines of all processes that were started here and still run."""
        return marked_processes(f'{MARK}={self.mark}')

    def run_folders(self) -> Set[Path]:
        """Return the folders with generated files that launchers have made."""
        return set(self.temporary.glob('process_visualizer-*'))

    def is_master_there(self) -> bool:
        """Return whether anything listens at the master's port."""
        with socket.socket() as probe:
            return probe.connect_ex(('localhost', self.port)) == 0

    def call(self, service: str, request: str) -> str:
        """Call a service of a node, with the request as YAML; return the answer."""
        done = subprocess.run(['rosservice', 'call', service, request], env=self.environment,
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                              timeout=PATIENCE_S, check=True)
        return done.stdout

    def end_all(self) -> None:
        """End everything that a test has left."""
        end_marked_processes(f'{MARK}={self.mark}')


class Program:
    """A running launcher; its output is collected."""

    def __init__(self, command: Sequence[str], surroundings: Surroundings) -> None:
        self.process = subprocess.Popen(
            command, env=surroundings.environment, stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT, text=True, start_new_session=True)
        self.lines: List[str] = []
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()

    def says(self, part: str) -> bool:
        """Return whether it has written this."""
        return part in ''.join(self.lines)

    def end(self, number: int) -> int:
        """Send a signal and wait for the end; return the exit code."""
        self.process.send_signal(number)
        code = self.process.wait(PATIENCE_S)
        self._reader.join(PATIENCE_S)
        return code

    def _read(self) -> None:
        assert self.process.stdout is not None
        self.lines.extend(iter(self.process.stdout.readline, ''))


def gui(*words: str) -> List[str]:
    """Return the command that starts the window."""
    return ['rosrun', 'process_visualizer', 'gui', *words]
