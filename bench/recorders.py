# SPDX-License-Identifier: BSD-3-Clause
"""The compared recorders: each is started, records the given topics, and is stopped."""
from __future__ import annotations

import os
import signal
import subprocess
from pathlib import Path
from typing import Dict, List, NamedTuple, Sequence

import rosbag
import rospy
from roslib.packages import find_node

from process_visualizer.clients.bag_recorder import BagRecorder, RecordingOptions

_TICKS_PER_S = os.sysconf('SC_CLK_TCK')
_TIMEOUT_S = 60.0


class Cost(NamedTuple):
    """CPU time in s, and maximum resident memory in MB, of a process so far."""

    cpu_s: float
    memory_mb: float


class OwnRecorder:
    """The node bag_recorder."""

    name = 'bag_recorder'

    def __init__(self, path: str, topics: Sequence[str]) -> None:
        self.process = subprocess.Popen([_program('process_visualizer', 'bag_recorder'),
                                         '_recent_duration:=0'])
        self._client = BagRecorder()
        self._client.wait_until_ready(_TIMEOUT_S)
        self._options = RecordingOptions(tuple(topics), folder=os.path.dirname(path),
                                         name=os.path.basename(path))

    def start(self) -> None:
        """Return when every topic is connected."""
        self._client.start(self._options)

    def stop(self) -> None:
        """Return when everything is written."""
        self._client.stop()
        self._client.close()
        _interrupt(self.process)


class RosbagRecord:
    """`rosbag record`; it does not report when it is ready, so the load waits."""

    name = 'rosbag record'

    def __init__(self, path: str, topics: Sequence[str]) -> None:
        self.process = subprocess.Popen(
            [_program('rosbag', 'record'), '-O', path, *topics],
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)

    def start(self) -> None:
        """It records from its start on."""

    def stop(self) -> None:
        """Return when everything is written."""
        _interrupt(self.process)


def cost(process: 'subprocess.Popen[bytes]') -> Cost:
    """Read the cost of a running process from the kernel's accounting."""
    fields = Path(f'/proc/{process.pid}/stat').read_text().rsplit(') ', 1)[1].split()
    status = Path(f'/proc/{process.pid}/status').read_text().splitlines()
    peak_kb = next(int(line.split()[1]) for line in status if line.startswith('VmHWM'))
    return Cost((int(fields[11]) + int(fields[12])) / _TICKS_PER_S, peak_kb / 1e3)


def message_counts(path: str) -> Dict[str, int]:
    """Return the number of messages in a bag by topic."""
    with rosbag.Bag(path) as bag:
        topics = bag.get_type_and_topic_info().topics
        return {topic: it.message_count for topic, it in topics.items()}


def topics_of_load(cameras: int) -> List[str]:
    """Return the topics that `record_load` publishes."""
    topics = [f'/{kind}_{robot}/{name}' for robot in ('upper', 'lower')
              for kind, name in (('ur_rt', 'q_act'), ('ur_rt', 'tcf'), ('ft', 'ft'))]
    for number in range(1, cameras + 1):
        camera = '/camera' if number == 1 else f'/camera{number}'
        topics += [f'{camera}/{name}' for name in (
            'rgb/image_color', 'rgb/camera_info', 'depth_registered/image_raw',
            'depth_registered/camera_info')]
    return topics


def load_program() -> str:
    """Build the load, which is not part of the ordinary build, and return its path."""
    devel = os.environ['CMAKE_PREFIX_PATH'].split(':')[0]
    subprocess.run(['cmake', '--build', os.path.join(os.path.dirname(devel), 'build'), '--target',
                    'record_load'], check=True, stdout=subprocess.DEVNULL)
    return os.path.join(devel, 'lib', 'process_visualizer', 'record_load')


def _program(package: str, name: str) -> str:
    found = find_node(package, name)
    if not found:
        raise SystemExit(f'{package} has no program {name}: build it first')
    return str(found[0])


def _interrupt(process: 'subprocess.Popen[bytes]') -> None:
    process.send_signal(signal.SIGINT)
    if process.wait(_TIMEOUT_S) != 0:
        rospy.logerr('%s ended with code %d', process.args, process.returncode)
