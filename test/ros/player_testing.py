# SPDX-License-Identifier: BSD-3-Clause
"""Bags, players and listeners for the tests of the player."""
from __future__ import annotations

import io
import signal
import subprocess
import tempfile
import threading
from pathlib import Path
from types import TracebackType
from typing import Any, Callable, Dict, List, NamedTuple, Optional, Sequence, Tuple, Type

import genpy
import rosbag
import rospy
from geometry_msgs.msg import TransformStamped
from roslib.packages import find_node
from sensor_msgs.msg import CameraInfo, Image
from std_msgs.msg import Float32MultiArray, String
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import Marker

from process_visualizer.msg import PlayerState

BEGIN_S = 1_600_000_000
PLAYER = '/bag_player'
PROGRAM = find_node('process_visualizer', 'bag_player')[0]  # rosrun searches for a second


class Row(NamedTuple):
    """A message to be recorded: topic, time [ms from the beginning], content."""

    topic: str
    time_ms: int
    message: Any


def stamp(time_ms: float) -> genpy.Time:
    """A bag time."""
    return genpy.Time.from_sec(BEGIN_S) + genpy.Duration.from_sec(time_ms / 1000.0)


def cell_rows(length_ms: int = 1000) -> List[Row]:
    """A robot each 8 ms, images with their infos each 40 ms, transforms, a marker, a text."""
    rows = [Row('/text', 0, String('the cell')), Row('/text', length_ms // 2, String('changed'))]
    rows += [Row('/tcf', time_ms, Float32MultiArray(data=[time_ms / 1000.0]))
             for time_ms in range(0, length_ms + 1, 8)]
    for time_ms in range(4, length_ms, 40):
        image = Image(height=100, width=300, encoding='rgb8', step=900, data=bytes(90_000))
        image.header.stamp = stamp(time_ms - 3)
        rows += [Row('/image', time_ms, image),
                 Row('/info', time_ms + 1, CameraInfo(header=image.header))]
    for number, time_ms in enumerate((0, 200, 600)):
        rows.append(Row('/tf_static', time_ms, TFMessage([transform(f'fixed{number}', time_ms)])))
    for time_ms in range(0, length_ms, 100):
        rows.append(Row('/tf', time_ms, TFMessage([transform('moving', time_ms)])))
    marker = Marker(id=7, ns='seam', type=Marker.SPHERE)
    marker.header.frame_id = 'world'
    return sorted([*rows, Row('/marker', 300, marker)], key=lambda row: row.time_ms)


def transform(child: str, time_ms: int) -> TransformStamped:
    """A transform whose x [m] is its time [s]."""
    result = TransformStamped(child_frame_id=child)
    result.header.frame_id, result.header.stamp = 'world', stamp(time_ms)
    result.transform.translation.x = time_ms / 1000.0
    result.transform.rotation.w = 1.0
    return result


def write_bag(path: Path, rows: Sequence[Row], latched: Sequence[str] = ('/text', '/tf_static'),
              compression: str = 'none') -> str:
    """Write messages into a bag as `rosbag record` does."""
    with rosbag.Bag(str(path), 'w', compression=compression, chunk_threshold=100_000) as bag:
        for row in rows:
            header = {'topic': row.topic, 'type': row.message._type,
                      'md5sum': row.message._md5sum, 'callerid': '/recorded',
                      'message_definition': row.message._full_text,
                      'latching': '1' if row.topic in latched else '0'}
            bag.write(row.topic, row.message, stamp(row.time_ms), connection_header=header)
    return str(path)


def serialised(message: genpy.Message) -> bytes:
    """The bytes of a message."""
    buffer = io.BytesIO()
    message.serialize(buffer)
    return buffer.getvalue()


class Received(NamedTuple):
    """A message that came: when [s], topic, bytes, connection header."""

    time_s: float
    topic: str
    data: bytes
    header: Dict[str, str]


class Listener:
    """Everything that comes on some topics, in the order in which it comes."""

    def __init__(self, *topics: str) -> None:
        self.received: List[Received] = []
        self._changed = threading.Condition()
        self._subscribers = [rospy.Subscriber(topic, rospy.AnyMsg, self._receive, topic,
                                              tcp_nodelay=True) for topic in topics]

    def __enter__(self) -> Listener:
        return self

    def __exit__(self, kind: Optional[Type[BaseException]], error: Optional[BaseException],
                 traceback: Optional[TracebackType]) -> None:
        for subscriber in self._subscribers:
            subscriber.unregister()

    def of(self, topic: str) -> List[bytes]:
        """The messages of a topic."""
        with self._changed:
            return [it.data for it in self.received if it.topic == topic]

    def clear(self) -> None:
        """Forget what came."""
        with self._changed:
            del self.received[:]

    def wait_for(self, condition: Callable[[], bool], what: str, timeout_s: float = 20.0) -> None:
        """Wait until what has come fulfils a condition."""
        with self._changed:
            assert self._changed.wait_for(condition, timeout_s), \
                f'{what}: did not come; received: {[it.topic for it in self.received][-20:]}'

    def _receive(self, message: rospy.AnyMsg, topic: str) -> None:
        with self._changed:
            self.received.append(Received(rospy.get_time(), topic, message._buff,
                                          message._connection_header))
            self._changed.notify_all()


class Player:
    """A running bag_player; use it in a ``with``, which ends it."""

    def __init__(self, *arguments: str) -> None:
        self.process = subprocess.Popen(
            [PROGRAM, *arguments], stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        self.states: List[PlayerState] = []
        self._changed = threading.Condition()
        self._subscriber = rospy.Subscriber(f'{PLAYER}/state', PlayerState, self._receive)

    def __enter__(self) -> Player:
        return self

    def __exit__(self, kind: Optional[Type[BaseException]], error: Optional[BaseException],
                 traceback: Optional[TracebackType]) -> None:
        self._subscriber.unregister()
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGINT)
        self.process.communicate(timeout=20)

    def wait(self, timeout_s: float = 40.0) -> Tuple[int, str]:
        """Wait for the end; return exit code and output."""
        output, _ = self.process.communicate(timeout=timeout_s)
        return self.process.returncode, output

    def call(self, name: str, service: Type[Any], *arguments: Any) -> Any:
        """Call one of its services."""
        rospy.wait_for_service(f'{PLAYER}/{name}', 20.0)
        return rospy.ServiceProxy(f'{PLAYER}/{name}', service)(*arguments)

    def wait_for_state(self, condition: Callable[[PlayerState], bool], what: str) -> PlayerState:
        """Wait for a state that fulfils a condition, from now on."""
        with self._changed:
            del self.states[:-1]
            assert self._changed.wait_for(
                lambda: any(map(condition, self.states)), 20.0), f'{what}: {self.states[-1:]}'
            return next(filter(condition, self.states))

    def _receive(self, state: PlayerState) -> None:
        with self._changed:
            self.states.append(state)
            self._changed.notify_all()


def temporary_folder() -> 'tempfile.TemporaryDirectory[str]':
    """A folder for bags."""
    return tempfile.TemporaryDirectory(prefix='bag_player_test_')
