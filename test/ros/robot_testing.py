# SPDX-License-Identifier: BSD-3-Clause
"""What the tests of the robot processor share: a tool that moves, and what is shown of it."""
from __future__ import annotations

import time
from typing import Callable, Dict, List, Tuple

import numpy as np
import rospy
import tf2_ros
from cloud_testing import Listener, wait_until
from std_msgs.msg import Float32MultiArray
from visualization_msgs.msg import Marker


def array(*values: float) -> Float32MultiArray:
    """Return the thesis' message for a quantity."""
    return Float32MultiArray(data=values)


def publisher(topic: str, message_class: type) -> rospy.Publisher:
    """Return a publisher that has its subscriber, the robot processor."""
    result = rospy.Publisher(topic, message_class, queue_size=10)
    wait_until(lambda: result.get_num_connections() > 0, f'a subscriber of {topic}')
    return result


def move(tool: rospy.Publisher, speed_m_per_s: float, duration_s: float) -> None:
    """Publish the pose of a tool that points down and moves along +y of the base, at 125 Hz."""
    end_s = time.monotonic() + duration_s
    move_while(lambda: time.monotonic() < end_s, tool, speed_m_per_s)


def move_while(condition: Callable[[], bool], tool: rospy.Publisher, speed_m_per_s: float) -> None:
    """The same, as long as a condition holds."""
    rate, start_s = rospy.Rate(125), time.monotonic()
    while condition():
        y = speed_m_per_s * (time.monotonic() - start_s)
        tool.publish(array(-0.6, y, 0.2, np.pi, 0.0, 0.0))
        rate.sleep()


def median_velocity(listener: Listener) -> np.ndarray:
    """Return the middle of the last velocities that were published."""
    linear = [message.twist.linear for message in listener.messages[-80:]]
    return np.median([[part.x, part.y, part.z] for part in linear], axis=0)


def last_markers(listener: Listener) -> Dict[Tuple[str, int], Marker]:
    """Return what RViz would know of each marker."""
    return {(marker.ns, marker.id): marker
            for message in list(listener.messages) for marker in message.markers}


def tool_position(buffer: tf2_ros.Buffer) -> List[float]:
    """Return where the tool is in tf; far away before it is there."""
    if not buffer.can_transform('r/link0', 'r/tool', rospy.Time()):
        return [np.inf] * 3
    position = buffer.lookup_transform('r/link0', 'r/tool', rospy.Time()).transform.translation
    return [position.x, position.y, position.z]
