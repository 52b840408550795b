# SPDX-License-Identifier: BSD-3-Clause
"""Measures the delay from the last message until a robot and a variable are shown without data.

usage: bench/run stale [--times 20]

Drivers send for a moment, 125 times a second, and stop. The delay ends when the gray arrow, and
the number with the age of the data, arrive at a subscriber.
"""
from __future__ import annotations

import argparse
import os
import random
import signal
import subprocess
import sys
import threading
import time
from contextlib import ExitStack, contextmanager
from typing import Dict, Iterator

import numpy as np
import rospy
from std_msgs.msg import Float32, Float32MultiArray
from visualization_msgs.msg import Marker, MarkerArray

from process_visualizer.nodes.common.markers import ARROW_ID, TEXT_ID
from process_visualizer.nodes.view_picture import wait_for_master

RATE_HZ = 125.0
_TIMEOUT_S = 20.0
_NODES = (
    ('robot_proc', '_topics/tool_center_frame/name:=/r/tcf', '_topics/joint_states/name:=/r/q',
     '_topics/force_sensor/name:=/r/ft'),
    ('joint_proc', '_topic:=/r/q'),
    ('variable_proc', '_variables:=[{topic: /r/heat, frame: r, label: heat}]'))
_KINDS = {ARROW_ID: 'arrow', TEXT_ID: 'number'}


class Watch:
    """Records when each arrow and number of a topic became gray."""

    def __init__(self, topic: str) -> None:
        self._changed = threading.Condition()
        self._grey_s: Dict[str, float] = {}
        self._subscriber = rospy.Subscriber(topic, MarkerArray, self._take, tcp_nodelay=True)

    def wait(self, count: int) -> Dict[str, float]:
        """Wait until a number of them are gray; return the times when they became gray."""
        with self._changed:
            if not self._changed.wait_for(lambda: len(self._grey_s) >= count, _TIMEOUT_S):
                raise RuntimeError(f'only these are grey: {sorted(self._grey_s)}')
            return dict(self._grey_s)

    def _take(self, array: MarkerArray) -> None:
        now_s = time.monotonic()
        with self._changed:
            for marker in array.markers:
                name = f'{marker.ns} {_KINDS[marker.id]}'
                grey = marker.color.r == marker.color.g == marker.color.b
                if marker.action == Marker.DELETE or not grey:
                    self._grey_s.pop(name, None)
                else:
                    self._grey_s.setdefault(name, now_s)
            self._changed.notify_all()


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--times', type=int, default=20)
    times = parser.parse_args().times
    with ExitStack() as stack:
        stack.enter_context(_running('roscore', '-p', os.environ['ROS_MASTER_URI'].split(':')[-1]))
        wait_for_master(30)
        rospy.init_node('stale_benchmark', disable_signals=True)
        rospy.set_param('/r/joint_proc/joint_names', ['r/a'])
        for node, *arguments in _NODES:
            stack.enter_context(_running('rosrun', 'process_visualizer', node, '__ns:=r',
                                         *arguments))
        rows = _measure(times)
    print(f'{times} times\n\n| | median, s | largest, s |\n|---|---|---|')
    for name, delays in rows.items():
        print(f'| {name} | {np.median(delays):.2f} | {max(delays):.2f} |')
    return 0


@contextmanager
def _running(*command: str) -> Iterator[None]:
    process = subprocess.Popen(command, stdout=subprocess.DEVNULL, start_new_session=True)
    try:
        yield
    finally:
        process.send_signal(signal.SIGINT)
        process.wait(_TIMEOUT_S)


def _measure(times: int) -> Dict[str, 'list[float]']:
    """Delays [s] of each arrow and number."""
    watch = Watch('/r/marker_array')
    publishers = {name: rospy.Publisher(f'/r/{name}', kind, queue_size=10) for name, kind in (
        ('q', Float32MultiArray), ('tcf', Float32MultiArray), ('ft', Float32MultiArray),
        ('heat', Float32))}
    while not all(publisher.get_num_connections() for publisher in publishers.values()):
        time.sleep(0.1)  # the nodes start
    rows: Dict[str, 'list[float]'] = {}
    for _ in range(times):
        last_s = _send(publishers, 1.5 + random.random())
        # arrow and number of velocity, force and variable; of the joints a number only
        for name, grey_s in watch.wait(7).items():
            rows.setdefault(name, []).append(grey_s - last_s)
    return rows


def _send(publishers: Dict[str, rospy.Publisher], duration_s: float) -> float:
    """Send for some time; return the time of the last messages."""
    rate, begin_s = rospy.Rate(RATE_HZ), time.monotonic()
    now_s = begin_s
    while now_s < begin_s + duration_s:
        now_s = time.monotonic()
        publishers['q'].publish(data=[0.5])
        publishers['tcf'].publish(data=[0.5, 0.2 * (now_s - begin_s), 0.2, 0.0, 0.0, 0.0])
        publishers['ft'].publish(data=[0.0, 0.0, 20.0])
        publishers['heat'].publish(data=0.5)
        rate.sleep()
    return now_s


if __name__ == '__main__':
    sys.exit(main())
