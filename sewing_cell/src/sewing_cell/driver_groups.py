# SPDX-License-Identifier: BSD-3-Clause
"""The simulated drivers: groups of topics that are published together, at one rate each."""

from __future__ import annotations

import json
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict
from functools import partial
from typing import NamedTuple, Optional

import numpy as np
import rospy
from dynamic_reconfigure.msg import Config, ConfigDescription
from sensor_msgs.msg import CameraInfo, Image
from std_msgs.msg import Float32, Float32MultiArray, String, UInt16

from process_visualizer.nodes.common.node_handle import NodeHandle
from sewing_cell import camera_messages, layout, pinhole
from sewing_cell.camera import Camera, Lookahead
from sewing_cell.cycle import SewingCycle
from sewing_cell.faults import FaultyCycle
from sewing_cell.layout import ARMS, Arm
from sewing_cell.scene import INTRUDERS

_QUEUE_SIZE, _IMAGE_QUEUE_SIZE = 50, 3


class ArrayTopic:
    """A topic of std_msgs/Float32MultiArray; its message object is reused."""

    def __init__(self, node: NodeHandle, name: str) -> None:
        self._publisher = node.publisher(
            name, Float32MultiArray, queue_size=_QUEUE_SIZE, tcp_nodelay=True
        )
        self._message = Float32MultiArray()

    def publish(self, values: list[float]) -> None:
        """Publish ``values`` without a layout, as the robots' drivers do."""
        self._message.data = values
        self._publisher.publish(self._message)


class JointDriver:
    """Joint angles and tool frame of both robots."""

    def __init__(self, node: NodeHandle, cycle: SewingCycle, rate_hz: float) -> None:
        self._robots = [
            (
                ArrayTopic(node, f"ur_rt_{arm.name}/q_act"),
                ArrayTopic(node, f"ur_rt_{arm.name}/tcf"),
                Lookahead(partial(self._rows, cycle, arm), rate_hz),
            )
            for arm in ARMS
        ]

    @staticmethod
    def _rows(cycle: SewingCycle, arm: Arm, times_s: np.ndarray) -> np.ndarray:
        return np.hstack([cycle.joints(arm, times_s), cycle.tool_frame(arm, times_s)])

    def __call__(self, tick: int, _late_s: float = 0.0) -> None:
        """Publish message number ``tick`` of every topic."""
        for joints, tool_frame, rows in self._robots:
            row = rows(tick)
            joints.publish(row[:6])
            tool_frame.publish(row[6:])
        for _, _, rows in self._robots:
            rows(tick + 1)


class ForceDriver:
    """The force sensors of both robots."""

    def __init__(self, node: NodeHandle, cycle: SewingCycle, rate_hz: float) -> None:
        self._sensors = [
            (
                ArrayTopic(node, f"ft_{arm.name}/ft"),
                Lookahead(partial(cycle.wrench, arm), rate_hz),
            )
            for arm in ARMS
        ]

    def __call__(self, tick: int, _late_s: float = 0.0) -> None:
        """Publish message number ``tick`` of every topic."""
        for topic, rows in self._sensors:
            topic.publish(rows(tick))


class MachineDriver:
    """The sewing machine's edge sensors and feed rate."""

    def __init__(self, node: NodeHandle, cycle: SewingCycle, rate_hz: float) -> None:
        self._edges = [
            (
                node.publisher(f"edge_finder_{arm.name}", UInt16, queue_size=_QUEUE_SIZE),
                Lookahead(partial(cycle.edge, arm), rate_hz),
            )
            for arm in ARMS
        ]
        self._feed_rate = node.publisher("feed_rate_est", Float32, queue_size=_QUEUE_SIZE)
        self._feed_rates = Lookahead(cycle.feed_rate, rate_hz)

    def __call__(self, tick: int, _late_s: float = 0.0) -> None:
        """Publish message number ``tick`` of every topic."""
        for publisher, readings in self._edges:
            publisher.publish(readings(tick))
        self._feed_rate.publish(self._feed_rates(tick))


class Kinect(NamedTuple):
    """A simulated Kinect: its namespace, and the position of its color camera in ``world`` [m]."""

    camera: str
    place: np.ndarray


KINECTS = (
    Kinect(camera_messages.CAMERA, pinhole.POSITION),
    Kinect("camera_2", pinhole.position(layout.SECOND_CAMERA_XYZ)),
)


class KinectDriver:
    """Color and registered depth images with their camera infos, and the driver's parameters.

    Images are drawn only for subscribers.  The first one follows when the static background is
    ready; the other drivers and the infos do not wait for it.
    """

    def __init__(self, node: NodeHandle, cycle: SewingCycle, rate_hz: float, seed: int,
                 kinect: Kinect, intruder: Optional[str] = None) -> None:
        self._node, camera = node, kinect.camera
        placed = None if intruder is None else INTRUDERS[intruder]
        pool = ThreadPoolExecutor(1, "draw")
        self.camera = pool.submit(Camera, cycle, rate_hz, seed, kinect.place, placed)
        """Draw the images; done when the static background has been drawn."""
        pool.shutdown(wait=False)
        self._info = camera_messages.camera_info(camera)
        self._color = camera_messages.image("rgb8", 3, camera)
        self._depth = camera_messages.image("16UC1", 2, camera)
        self._info_publishers = [
            node.publisher(f"{camera}/{name}/camera_info", CameraInfo, queue_size=_QUEUE_SIZE)
            for name in ("rgb", "depth_registered")
        ]
        self._color_publisher = _image_publisher(node, f"{camera}/rgb/image_color")
        self._depth_publisher = _image_publisher(node, f"{camera}/depth_registered/image_raw")
        driver = f"{camera}/driver"
        _latch(node, f"{driver}/parameter_updates", camera_messages.driver_config())
        _latch(node, f"{driver}/parameter_descriptions", camera_messages.driver_description())

    def __call__(self, tick: int, late_s: float = 0.0) -> None:
        """Publish frame number ``tick``: images and infos are stamped with its due time."""
        stamp = self._node.now() - rospy.Duration.from_sec(late_s)
        self._info.header.stamp = stamp
        for publisher in self._info_publishers:
            publisher.publish(self._info)
        publishers = (self._color_publisher, self._depth_publisher)
        if self.camera.done() and any(it.get_num_connections() for it in publishers):
            self._publish_images(stamp, tick)

    def _publish_images(self, stamp: rospy.Time, tick: int) -> None:
        frame = self.camera.result().render(tick)
        for publisher, message, pixels in (
            (self._color_publisher, self._color, frame.color),
            (self._depth_publisher, self._depth, frame.depth),
        ):
            message.header.stamp = stamp
            camera_messages.set_pixels(message, pixels)
            publisher.publish(message)


def publish_truth(node: NodeHandle, cycle: FaultyCycle) -> None:
    """Publish the fault as ground truth for its detection; no device lists this topic."""
    text = json.dumps({"fault": asdict(cycle.fault), "period_s": cycle.schedule.period_s})
    _latch(node, "simulator/truth", String(text))


def _image_publisher(node: NodeHandle, name: str) -> rospy.Publisher:
    return node.publisher(name, Image, queue_size=_IMAGE_QUEUE_SIZE)


def _latch(node: NodeHandle, name: str, message: Config | ConfigDescription | String) -> None:
    """Publish the only message of a topic, which late subscribers also receive."""
    node.publisher(name, type(message), queue_size=1, latch=True).publish(message)
