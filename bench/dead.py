# SPDX-License-Identifier: BSD-3-Clause
"""Measures how soon the scene reports that a process was stopped or killed.

usage: bench/run dead [--pictures FOLDER]

The simulated sewing cell runs with RViz. Each process that draws is stopped (SIGSTOP) and
continued; then each is killed (SIGKILL). The program measures when the text that names it appears,
and when its last marker disappears.
"""
from __future__ import annotations

import argparse
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import Dict, Optional
from xmlrpc.client import ServerProxy

import rosgraph
import rospy
from visualization_msgs.msg import MarkerArray

from process_visualizer.health.node_pulse import ENDED, SILENT
from process_visualizer.nodes.common.markers import LIFETIME_S
from process_visualizer.nodes.view_picture import ViewWatcher, wait_for_master

NODES = {
    '/ur_rt_upper/robot_proc': '/ur_rt_upper/marker_array',
    '/ur_rt_lower/robot_state_publisher': '', '/ur_rt_lower/joint_proc': '',
    '/sewing_machine/sewing_machine': '/sewing_machine/marker_array',
    '/camera/camera_nodelet_manager': '', '/kinect/depth_proc': ''}
"""The stopped nodes, and their topics of markers."""
_TIMEOUT_S = 10.0
_SHARE_OVER_S = 5.0
_PICTURE_AFTER_S = 1.5  # RViz needs a moment on a busy machine
_OLD = 's old'  # of a cloud whose filter, in the camera's nodelet manager, has ended


class Words:
    """The texts in the scene, and the arrival times of markers."""

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._texts: Dict[str, str] = {}
        self.last_s: Dict[str, float] = {}
        rospy.Subscriber('/scene_watch/marker_array', MarkerArray, self._take)
        for topic in filter(None, NODES.values()):
            rospy.Subscriber(topic, MarkerArray, self._note, callback_args=topic)

    def wait(self, device: str, *wanted: str) -> float:
        """Wait for the text about a device; return its arrival time. Raises RuntimeError."""
        with self._changed:
            if not self._changed.wait_for(
                    lambda: all(word in self._texts.get(device, '') for word in wanted),
                    _TIMEOUT_S):
                raise RuntimeError(f'{device}: {wanted} is not said, but {self._texts}')
            return time.monotonic()

    def forget(self) -> None:
        with self._changed:
            self._texts.clear()

    def _take(self, array: MarkerArray) -> None:
        with self._changed:
            self._texts = {marker.ns: marker.text for marker in array.markers}
            self._changed.notify_all()

    def _note(self, _array: MarkerArray, topic: str) -> None:
        self.last_s[topic] = time.monotonic()


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--pictures', help='a folder for pictures of the scene')
    folder = parser.parse_args().pictures
    cell = Path(subprocess.run(['rospack', 'find', 'sewing_cell'], check=True, text=True,
                               stdout=subprocess.PIPE).stdout.strip()) / 'devices/simulated.xml'
    output = Path(os.environ['ROS_HOME']) / 'cell'
    subprocess.run(['rosrun', 'process_visualizer', 'cell', 'generate', str(cell), '--output',
                    str(output)], check=True, stdout=subprocess.DEVNULL)
    launch = subprocess.Popen(['roslaunch', '--disable-title', str(output / 'cell.launch')],
                              stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
                              start_new_session=True)
    try:
        wait_for_master(60)
        rospy.init_node('dead', disable_signals=True)
        words, watcher = Words(), ViewWatcher()
        if not watcher.wait_until_drawn(60):
            print('\n'.join(watcher.problems()), file=sys.stderr)
            return 1
        time.sleep(3.0)  # the watch has asked every node
        print(f'scene_watch takes {100.0 * _share(_process_of("/scene_watch")):.1f} % of a core\n')
        print('| process | stopped, s | killed, s | its markers go, s |\n|---|---|---|---|')
        stopped = {name: _measure(words, name, signal.SIGSTOP, folder) for name in NODES}
        for name in NODES:
            killed_s, gone_s = _measure(words, name, signal.SIGKILL, folder)
            gone = '' if gone_s is None else f'{gone_s:.2f}'
            print(f'| {name} | {stopped[name][0]:.2f} | {killed_s:.2f} | {gone} |', flush=True)
    finally:
        launch.send_signal(signal.SIGINT)
        launch.wait(60)
    return 0


def _process_of(node: str) -> int:
    process: int = ServerProxy(rosgraph.Master('/dead').lookupNode(node)).getPid('/dead')[2]
    return process


def _share(process: int) -> float:
    """Return the share of a core that a process takes for some seconds."""
    def used_s() -> float:
        fields = Path(f'/proc/{process}/stat').read_text().rsplit(')', 1)[1].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf('SC_CLK_TCK')
    before_s, begin_s = used_s(), time.monotonic()
    time.sleep(_SHARE_OVER_S)
    return (used_s() - before_s) / (time.monotonic() - begin_s)


def _measure(words: Words, name: str, how: signal.Signals,
             folder: Optional[str]) -> 'tuple[float, Optional[float]]':
    """Delays [s] of the text and of the last marker's end."""
    pid = _process_of(name)
    words.forget()
    _, device, node = name.replace('/camera/', '/kinect/').split('/')
    os.kill(pid, how)
    begin_s = time.monotonic()
    try:
        if node == 'camera_nodelet_manager':
            said_s = words.wait(device, _OLD)
        else:
            said_s = words.wait(device, f'{node} {SILENT if how == signal.SIGSTOP else ENDED}')
        gone_s = words.last_s[NODES[name]] + LIFETIME_S - begin_s if NODES[name] else None
        if folder:
            time.sleep(_PICTURE_AFTER_S)
            path = Path(folder) / f'{node}_{how.name}.png'
            subprocess.run(['import', '-window', 'root', str(path)], check=True)
    finally:
        if how == signal.SIGSTOP:
            os.kill(pid, signal.SIGCONT)
            time.sleep(1.5)
    return said_s - begin_s, gone_s


if __name__ == '__main__':
    sys.exit(main())
