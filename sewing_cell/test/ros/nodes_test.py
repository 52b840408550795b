#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The simulator and the sewing machine as processes; test/unit tests their behavior."""

from __future__ import annotations

import json
import subprocess
import unittest
from queue import Queue
from typing import Any, Callable

import numpy as np
import rospy
import rostest
from dynamic_reconfigure.msg import Config, ConfigDescription
from roslib.packages import find_node
from sensor_msgs.msg import CameraInfo, Image
from std_msgs.msg import Float32, Float32MultiArray, String, UInt16
from visualization_msgs.msg import Marker, MarkerArray

from sewing_cell.cycle import SewingCycle
from sewing_cell.layout import UPPER

TOPICS = {
    "/ur_rt_upper/q_act": Float32MultiArray,
    "/ur_rt_upper/tcf": Float32MultiArray,
    "/ur_rt_lower/q_act": Float32MultiArray,
    "/ur_rt_lower/tcf": Float32MultiArray,
    "/ft_upper/ft": Float32MultiArray,
    "/ft_lower/ft": Float32MultiArray,
    "/edge_finder_upper": UInt16,
    "/edge_finder_lower": UInt16,
    "/feed_rate_est": Float32,
    "/camera/rgb/image_color": Image,
    "/camera/rgb/camera_info": CameraInfo,
    "/camera/depth_registered/image_raw": Image,
    "/camera/depth_registered/camera_info": CameraInfo,
    "/camera/driver/parameter_updates": Config,
    "/camera/driver/parameter_descriptions": ConfigDescription,
    "/simulator/truth": String,
}
TIMEOUT_S = 60.0


class Topic:
    """The messages of a topic, in order."""

    def __init__(self, name: str, message_class: type) -> None:
        self._arrived: Queue[Any] = Queue()
        self._subscriber = rospy.Subscriber(name, message_class, self._arrived.put)

    def next(self, wanted: Callable[[Any], bool] = lambda _message: True) -> Any:
        """Wait for a wanted message; fail if none comes in time."""
        while True:
            message = self._arrived.get(timeout=TIMEOUT_S)
            if wanted(message):
                return message

    def close(self) -> None:
        """Stop listening."""
        self._subscriber.unregister()


class NodesTest(unittest.TestCase):
    """Listens to the nodes that the launch file has started."""

    def test_every_topic_comes_with_its_type(self) -> None:
        topics = {name: Topic(name, kind) for name, kind in TOPICS.items()}
        first = {name: topic.next() for name, topic in topics.items()}
        for topic in topics.values():
            topic.close()
        joints = SewingCycle("poor", seed=5).joints(UPPER, np.arange(0, 200, 1 / 125))
        found = np.array(first["/ur_rt_upper/q_act"].data)
        self.assertLess(np.abs(joints - found).max(axis=1).min(), 1e-5)
        self.assertEqual(json.loads(first["/simulator/truth"].data)["fault"]["kind"], "friction")

    def test_the_sewing_machine_shows_its_sensors_beside_live_setpoints(self) -> None:
        markers = Topic("/sewing_machine/marker_array", MarkerArray)
        machine = markers.next(lambda it: it.markers[-1].type == Marker.MESH_RESOURCE)
        self.assertEqual(machine.markers[-1].header.frame_id, "sewing_machine/base")
        for setpoint, text in ((-100, "above -100"), (1000, "below 1000")):
            rospy.set_param("/sewing_machine/setpoint_upper", setpoint)
            markers.next(lambda it, words=text: any(words in each.text for each in it.markers))
        markers.close()

    def test_a_wrong_parameter_is_said_without_a_traceback(self) -> None:
        program = find_node("sewing_cell", "simulator")[0]
        run = subprocess.run(
            [program, "__name:=wrong", "_quality:=bad"],
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=TIMEOUT_S,
            check=False,
        )
        self.assertEqual(run.returncode, 1, run.stdout)
        self.assertIn("give one of good, poor", run.stdout)
        self.assertNotIn("Traceback", run.stdout)


if __name__ == "__main__":
    rospy.init_node("nodes_test")
    rostest.rosrun("sewing_cell", "nodes_test", NodesTest)
