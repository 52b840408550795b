# SPDX-License-Identifier: BSD-3-Clause
"""A recorder for a test: its process, its client, its folder, and the content of its bags."""
from __future__ import annotations

import itertools
import os
import signal
import subprocess
import tempfile
import threading
import time
from types import TracebackType
from typing import Any, List, Optional, Tuple, Type

import rosbag
import rospy
from rosgraph_msgs.msg import Clock
from roslib.packages import find_node
from std_msgs.msg import UInt32

from process_visualizer.clients.bag_recorder import BagRecorder, RecordingOptions

TIMEOUT_S = 60.0
_names = itertools.count()


def new_topic() -> str:
    """Return a topic that no other test uses."""
    return f'/recorder_test/topic_{next(_names)}'


def rostopic_pub(topic: str) -> 'subprocess.Popen[bytes]':
    """Run a process that publishes at 50 Hz."""
    return subprocess.Popen(['rostopic', 'pub', '-r', '50', topic, 'std_msgs/UInt32', '1'],
                            stdout=subprocess.DEVNULL)


class Subscription(rospy.SubscribeListener):
    """Knows when a publisher has a subscriber: from then on all messages arrive."""

    def __init__(self) -> None:
        self._begun = threading.Event()

    def peer_subscribe(self, topic_name: str, topic_publish: object, peer_publish: object) -> None:
        """Called by rospy."""
        self._begun.set()

    def wait(self) -> None:
        """Wait until there is a subscriber."""
        assert self._begun.wait(TIMEOUT_S), 'nobody has subscribed'


class Stream:
    """Publishes growing numbers at 200 Hz until it is closed."""

    def __init__(self, topic: str) -> None:
        self.publisher = rospy.Publisher(topic, UInt32, queue_size=10000)
        self._end = threading.Event()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def __enter__(self) -> Stream:
        return self

    def __exit__(self, *_: object) -> None:
        self._end.set()
        self._thread.join()
        self.publisher.unregister()

    def _run(self) -> None:
        number, begin_s = 0, time.monotonic()
        while not self._end.wait(max(0.0, begin_s + number * 0.005 - time.monotonic())):
            self.publisher.publish(number)
            number += 1


class SimulatedTime:
    """Publishes a simulated time that runs at the machine's rate; use it in a ``with``."""

    begin_ns = 1_600_000_000 * 10 ** 9

    def __init__(self) -> None:
        self.end_ns = self.begin_ns
        self._publisher = rospy.Publisher('/clock', Clock, queue_size=10)
        self._end = threading.Event()
        self._thread = threading.Thread(target=self._run)

    def __enter__(self) -> SimulatedTime:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._end.set()
        self._thread.join()
        self._publisher.unregister()

    def _run(self) -> None:
        while not self._end.wait(0.01):
            self.end_ns += 10_000_000
            self._publisher.publish(rospy.Time(*divmod(self.end_ns, 10 ** 9)))


class RecorderUnderTest:
    """Starts a recorder with parameters; use it in a ``with``. Its bags go into ``folder``."""

    _count = 0

    def __init__(self, *prefix: str, folder: str = '', node: str = '',
                 **parameters: object) -> None:
        type(self)._count += 1
        self.node = node or f'/recorder_{type(self)._count}'
        self._temporary = tempfile.TemporaryDirectory(prefix='recorder_test_')
        self.folder = folder or os.path.join(self._temporary.name, 'bags')
        parameters = {'minimum_free_megabytes': 0, 'recent_duration': 0,
                      'connection_timeout': TIMEOUT_S, **parameters}
        for name, value in parameters.items():
            rospy.set_param(f'{self.node}/{name}', value)
        self.process = subprocess.Popen(
            [*prefix, find_node('process_visualizer', 'bag_recorder')[0],
             f'__name:={self.node[1:]}'])
        self.client = BagRecorder(node=self.node)

    def __enter__(self) -> RecorderUnderTest:
        self.client.wait_until_ready(TIMEOUT_S)
        return self

    def __exit__(self, kind: Optional[Type[BaseException]], error: Optional[BaseException],
                 traceback: Optional[TracebackType]) -> None:
        self.client.close()
        self.end(signal.SIGKILL)
        self._temporary.cleanup()

    def end(self, number: int) -> int:
        """Send a signal if it still runs; return the exit code."""
        if self.process.poll() is None:
            self.process.send_signal(number)
        return self.process.wait(TIMEOUT_S)

    def start(self, *topics: str, **options: Any) -> str:
        """Start a recording into the folder."""
        return self.client.start(RecordingOptions(topics=topics, folder=self.folder, **options))

    def files(self) -> List[str]:
        """Return the names in the folder."""
        return sorted(os.listdir(self.folder)) if os.path.isdir(self.folder) else []


def wait_for_count(recorder: RecorderUnderTest, topic: str, count: int) -> bool:
    """Wait until this many messages of a topic have been recorded."""
    return recorder.client.wait_for(
        lambda state: any(it.name == topic and it.messages >= count for it in state.topics),
        TIMEOUT_S) is not None


def contents(path: str, topic: str) -> List[Tuple[Any, float]]:
    """Return the messages of a topic with their times, read by rosbag."""
    with rosbag.Bag(path) as bag:
        return [(message, time.to_sec()) for _, message, time in bag.read_messages([topic])]


def numbers(path: str, topic: str) -> List[int]:
    """Return the numbers in a topic of type std_msgs/UInt32."""
    return [message.data for message, _ in contents(path, topic)]


def message_count(path: str, topic: Optional[str] = None) -> int:
    """Return the number of messages that rosbag counts in a bag, of one topic or of all."""
    with rosbag.Bag(path) as bag:
        return int(bag.get_message_count(topic))
