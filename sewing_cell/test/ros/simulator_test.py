#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The simulator publishes every driver topic of the cell with its type, rate and stamps."""

from __future__ import annotations

import json
import os
import subprocess
import time
import unittest
from threading import Condition

import numpy as np
import rospy
import rostest
from dynamic_reconfigure.msg import Config, ConfigDescription
from sensor_msgs.msg import CameraInfo, Image
from std_msgs.msg import Float32, Float32MultiArray, String, UInt16

from sewing_cell.arms import LOWER, UPPER
from sewing_cell.cycle import SewingCycle
from sewing_cell.kinematics import forward

TOPICS = {
    "/ur_rt_upper/q_act": (Float32MultiArray, 125),
    "/ur_rt_upper/tcf": (Float32MultiArray, 125),
    "/ur_rt_lower/q_act": (Float32MultiArray, 125),
    "/ur_rt_lower/tcf": (Float32MultiArray, 125),
    "/ft_upper/ft": (Float32MultiArray, 94),
    "/ft_lower/ft": (Float32MultiArray, 94),
    "/edge_finder_upper": (UInt16, 50),
    "/edge_finder_lower": (UInt16, 50),
    "/feed_rate_est": (Float32, 50),
    "/camera/rgb/image_color": (Image, 30),
    "/camera/rgb/camera_info": (CameraInfo, 30),
    "/camera/depth_registered/image_raw": (Image, 30),
    "/camera/depth_registered/camera_info": (CameraInfo, 30),
}
SECONDS = 4
COLOUR, DEPTH = "/camera/rgb/image_color", "/camera/depth_registered/image_raw"
INFOS = ("/camera/rgb/camera_info", "/camera/depth_registered/camera_info")


class Listener:
    """Keeps what comes on one topic, and when."""

    def __init__(self, name: str, message_class: type, largest: int) -> None:
        self.times_s: list[float] = []
        self.messages: list = []
        self._largest, self._condition = largest, Condition()
        self._subscriber = rospy.Subscriber(name, message_class, self._keep, tcp_nodelay=True)

    def _keep(self, message: object) -> None:
        with self._condition:
            self.times_s.append(time.monotonic())
            if len(self.messages) < self._largest:
                self.messages.append(message)
            self._condition.notify_all()

    def wait_for(self, count: int, timeout_s: float) -> bool:
        """Wait until ``count`` messages have come; False when they do not."""
        with self._condition:
            return self._condition.wait_for(lambda: len(self.times_s) >= count, timeout_s)

    def close(self) -> None:
        """Stop listening."""
        self._subscriber.unregister()


def listen(name: str, count: int, largest: int = 10000) -> Listener:
    """A listener that has heard ``count`` messages of a topic."""
    listener = Listener(name, TOPICS[name][0], largest)
    heard = listener.wait_for(count, 20)
    listener.close()
    assert heard, f"{name}: {len(listener.times_s)} messages instead of {count}"
    return listener


class SimulatorTest(unittest.TestCase):
    """Listens to the simulator that the launch file has started."""

    def test_every_topic_has_its_type(self) -> None:
        for name in TOPICS:
            listen(name, 1)
        published = dict(rospy.get_published_topics())
        for name, (message_class, _) in TOPICS.items():
            self.assertEqual(published[name], message_class._type, name)

    def test_every_topic_has_its_rate(self) -> None:
        images = (COLOUR, DEPTH)
        for names in ([name for name in TOPICS if name not in images], images):
            listeners = {name: Listener(name, TOPICS[name][0], largest=0) for name in names}
            for name, listener in listeners.items():
                self.assertTrue(listener.wait_for(SECONDS * TOPICS[name][1], 3 * SECONDS), name)
            for name, listener in listeners.items():
                listener.close()
                self.assert_rate(listener.times_s, TOPICS[name][1], name)

    def assert_rate(self, times_s: list[float], rate_hz: float, name: str) -> None:
        """The mean rate is within 10 % of what it shall be."""
        achieved_hz = (len(times_s) - 1) / (times_s[-1] - times_s[0])
        self.assertAlmostEqual(achieved_hz, rate_hz, delta=0.1 * rate_hz, msg=name)

    def test_images_and_infos_of_a_frame_have_one_stamp(self) -> None:
        names = (COLOUR, DEPTH, *INFOS)
        listeners = [Listener(name, TOPICS[name][0], 1000) for name in names]
        for listener in listeners:
            self.assertTrue(listener.wait_for(30, 20))
            listener.close()
        stamps = [{m.header.stamp for m in listener.messages} for listener in listeners]
        common = set.intersection(*stamps)
        newest_start = max(min(each) for each in stamps)
        oldest_end = min(max(each) for each in stamps)
        for each in stamps:
            shared_span = {stamp for stamp in each if newest_start <= stamp <= oldest_end}
            self.assertGreaterEqual(len(common), 0.9 * len(shared_span))
        self.assertGreater(len(common), 15)

    def test_images_are_as_the_infos_say(self) -> None:
        info = listen(INFOS[1], 1).messages[0]
        for name, encoding, pixel in ((COLOUR, "rgb8", 3), (DEPTH, "16UC1", 2)):
            image = listen(name, 1).messages[0]
            self.assertEqual(image.encoding, encoding)
            self.assertEqual((image.width, image.height), (info.width, info.height))
            self.assertEqual(image.step, pixel * image.width)
            self.assertEqual(len(image.data), image.step * image.height)
            self.assertEqual(image.header.frame_id, "camera_rgb_optical_frame")
        self.assertEqual(info.header.frame_id, "camera_rgb_optical_frame")
        self.assertEqual(info.K[0], 525.0)

    def test_joints_are_those_of_the_seed(self) -> None:
        """Every message is, to float32, the cycle at a multiple of 8 ms."""
        cycle = SewingCycle("poor", seed=5)
        times = np.arange(0, 200, 1 / 125)
        for arm in (UPPER, LOWER):
            expected = cycle.joints(arm, times)
            for message in listen(f"/ur_rt_{arm.name}/q_act", 5).messages:
                distance = np.abs(expected - np.array(message.data)).max(axis=1)
                self.assertLess(distance.min(), 1e-5)

    def test_tool_frames_agree_with_the_joints(self) -> None:
        """The two topics of one tick carry the same pose."""
        joints = Listener("/ur_rt_lower/q_act", Float32MultiArray, 300)
        frames = Listener("/ur_rt_lower/tcf", Float32MultiArray, 300)
        self.assertTrue(joints.wait_for(200, 20) and frames.wait_for(200, 20))
        positions = np.array([message.data[:3] for message in frames.messages])
        for message in joints.messages[50:100]:
            position = forward(np.array(message.data))[:3, 3]
            self.assertLess(np.linalg.norm(positions - position, axis=1).min(), 1e-5)

    def test_sensors_are_in_range(self) -> None:
        for message in listen("/edge_finder_upper", 20).messages:
            self.assertTrue(0 <= message.data <= 511)
        for message in listen("/feed_rate_est", 20).messages:
            self.assertTrue(0.0 <= message.data <= 0.1)
        for message in listen("/ft_lower/ft", 20).messages:
            self.assertEqual(len(message.data), 6)

    def test_driver_parameters_are_latched(self) -> None:
        name = "/camera/driver/parameter_"
        config = rospy.wait_for_message(name + "updates", Config, 10)
        description = rospy.wait_for_message(name + "descriptions", ConfigDescription, 10)
        self.assertEqual([each.name for each in config.ints], ["data_skip"])
        self.assertEqual([each.name for each in config.bools], ["depth_registration"])
        names = [each.name for each in description.groups[0].parameters]
        self.assertEqual(names, ["data_skip", "depth_registration"])

    def test_what_is_wrong_is_told_on_a_topic_of_its_own(self) -> None:
        command = ["rosrun", "sewing_cell", "simulator", "__name:=faulty", "__ns:=faulty"]
        rates = [f"_{name}_rate:=0" for name in ("joint", "force", "sensor", "image")]
        fault = ["_fault:=friction", "_fault_cycle:=2", "_fault_start:=8.5", "_seed:=3"]
        with subprocess.Popen([*command, *rates, *fault], env=os.environ) as process:
            try:
                text = rospy.wait_for_message("/faulty/simulator/truth", String, 20).data
            finally:
                process.terminate()
        truth = json.loads(text)["fault"]
        self.assertEqual((truth["kind"], truth["cycle"], truth["start_s"]), ("friction", 2, 8.5))
        self.assertNotIn("/simulator/truth", dict(rospy.get_published_topics()))

    def test_a_wrong_parameter_is_said_without_a_traceback(self) -> None:
        for parameter, wanted in (
            ("_quality:=bad", "good, poor"),
            ("_joint_rate:=-1", "0 (off)"),
            ("_seed:=many", "whole number"),
            ("_period:=1", "12 to 120"),
            ("_fault:=rust", "edge_drift, friction"),
            ("_fault_cycle:=first", "whole number"),
        ):
            command = ["rosrun", "sewing_cell", "simulator", "__name:=wrong", parameter]
            run = subprocess.run(
                command, capture_output=True, text=True, timeout=30, env=os.environ, check=False
            )
            rospy.delete_param("/wrong")
            self.assertEqual(run.returncode, 1, parameter)
            self.assertIn(wanted, run.stdout + run.stderr)
            self.assertNotIn("Traceback", run.stdout + run.stderr)


if __name__ == "__main__":
    rospy.init_node("simulator_test")
    rostest.rosrun("sewing_cell", "simulator_test", SimulatorTest)
