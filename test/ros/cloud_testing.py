# SPDX-License-Identifier: BSD-3-Clause
"""Shared code of the tests of the cloud nodes: clouds, a topic's messages, and waiting for them."""
from __future__ import annotations

import threading
import time
from typing import Any, Callable, List, Sequence

import numpy as np
import rospy
import tf2_ros
from geometry_msgs.msg import TransformStamped
from rosgraph_msgs.msg import Log
from sensor_msgs.msg import PointCloud2, PointField

TIMEOUT_S = 60.0
REPEAT_S = 0.05


def make_cloud(points: Sequence[Sequence[float]], frame_id: str, stamp_s: float = 1.0
               ) -> PointCloud2:
    """Return a cloud with the fields x, y, z (m) and rgb (the point's index)."""
    table = np.zeros(len(points), dtype='<f4,<f4,<f4,<u4')
    for index, point in enumerate(points):
        table[index] = (*point, index)
    cloud = PointCloud2(height=1, width=len(points), point_step=16, row_step=16 * len(points),
                        is_dense=True, data=table.tobytes())
    cloud.fields = [PointField(name=name, offset=4 * i, datatype=PointField.FLOAT32, count=1)
                    for i, name in enumerate(('x', 'y', 'z', 'rgb'))]
    cloud.header.frame_id = frame_id
    cloud.header.stamp = rospy.Time.from_sec(stamp_s)
    return cloud


def indices(cloud: PointCloud2) -> List[int]:
    """Return the rgb values of a cloud of `make_cloud`."""
    return np.frombuffer(cloud.data, dtype='<u4').reshape(-1, 4)[:, 3].tolist()


class Listener:
    """Collects a topic's messages while it is used as a context manager."""

    heard = threading.Condition()
    """Notified when any of them receives a message."""

    def __init__(self, topic: str, message_class: type) -> None:
        self.messages: List[Any] = []
        self._subscriber = rospy.Subscriber(topic, message_class, self._take)

    def __enter__(self) -> Listener:
        return self

    def __exit__(self, *_exception: object) -> None:
        self._subscriber.unregister()

    def _take(self, message: Any) -> None:
        with self.heard:
            self.messages.append(message)
            self.heard.notify_all()


def wait_until(condition: Callable[[], bool], what: str,
               meanwhile: Callable[[], None] = lambda: None) -> None:
    """Wait until listeners have received the expected messages; fail after TIMEOUT_S.

    `meanwhile` is called repeatedly until then.
    """
    end = time.monotonic() + TIMEOUT_S
    while not condition():
        assert not rospy.is_shutdown() and time.monotonic() < end, f'not within time: {what}'
        meanwhile()
        with Listener.heard:
            Listener.heard.wait_for(condition, REPEAT_S)


def send_fast_hand(broadcaster: tf2_ros.TransformBroadcaster, now: rospy.Time, x_m: float
                   ) -> None:
    """Let the frame "hand" be at x in the frame "camera" now, and far away before and after."""
    step = rospy.Duration(0, 4000000)
    broadcaster.sendTransform([_hand(now - step, 50.0), _hand(now, x_m), _hand(now + step, 50.0)])


def _hand(stamp: rospy.Time, x_m: float) -> TransformStamped:
    transform = TransformStamped(child_frame_id='hand')
    transform.header.frame_id = 'camera'
    transform.header.stamp = stamp
    transform.transform.translation.x = x_m
    transform.transform.rotation.w = 1.0
    return transform


def log_listener() -> Listener:
    """Listen to the log of all nodes."""
    return Listener('/rosout', Log)


def logged(log: Listener, level: int, *parts: str) -> bool:
    """Return whether a message of this level with all these parts was logged."""
    return any(message.level == level and all(part in message.msg for part in parts)
               for message in list(log.messages))
