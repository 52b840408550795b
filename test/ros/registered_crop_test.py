#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The nodelet RegisteredCrop: equal to depth_image_proc and RoiFilter, and robust."""
from __future__ import annotations

import unittest
from typing import Callable, List, NamedTuple, Tuple

import numpy as np
import rospy
import rostest
import tf2_ros
from cloud_testing import Listener, log_listener, logged, send_fast_hand, wait_until
from rosgraph_msgs.msg import Log
from sensor_msgs.msg import CameraInfo, Image, PointCloud2
from visualization_msgs.msg import Marker

WIDTH, HEIGHT = 160, 120
FOCAL_PX = 131.5
OUTPUT = '/crop/output'
PARAMETERS = {'frame': '/box', 'center': [0, 0, 1.5], 'size': [1.0, 0.8, 1.0]}


class Images(NamedTuple):
    """A camera's messages of one time."""

    depth: Image
    color: Image
    info: CameraInfo


def make_images(depth_encoding: str, color_encoding: str, stamp: rospy.Time) -> Images:
    """Return depths of 0.5 to 2.5 m with gaps, and random colors."""
    generator = np.random.RandomState(3)
    depth_mm = generator.randint(500, 2500, (HEIGHT, WIDTH)).astype('<u2')
    depth_mm[generator.rand(HEIGHT, WIDTH) < 0.1] = 0
    if depth_encoding == '32FC1':
        depths = np.where(depth_mm == 0, np.nan, depth_mm / 1000.0).astype('<f4')
    else:
        depths = depth_mm
    colors = generator.randint(0, 256, (HEIGHT, WIDTH, 1 if color_encoding == 'mono8' else 3))
    info = CameraInfo(height=HEIGHT, width=WIDTH, distortion_model='plumb_bob', D=[0.0] * 5)
    info.K = [FOCAL_PX, 0, 79.3, 0, FOCAL_PX, 60.7, 0, 0, 1]
    info.R = [1, 0, 0, 0, 1, 0, 0, 0, 1]
    info.P = [FOCAL_PX, 0, 79.3, 0, 0, FOCAL_PX, 60.7, 0, 0, 0, 1, 0]
    images = Images(_image(depth_encoding, depths),
                    _image(color_encoding, colors.astype('u1')), info)
    for message in images:
        message.header.frame_id = 'camera'
        message.header.stamp = stamp
    return images


def _image(encoding: str, pixels: np.ndarray) -> Image:
    return Image(height=HEIGHT, width=WIDTH, encoding=encoding, data=pixels.tobytes(),
                 step=pixels[0].nbytes)


class RegisteredCropTest(unittest.TestCase):
    """Publishes images and checks the output."""

    publishers: List[rospy.Publisher]

    @classmethod
    def setUpClass(cls) -> None:
        cls.publishers = [rospy.Publisher(topic, message_class, queue_size=1)
                          for topic, message_class in (('/depth', Image), ('/color', Image),
                                                       ('/camera_info', CameraInfo))]

    def setUp(self) -> None:
        rospy.set_param('/crop', {**rospy.get_param('/crop'), **PARAMETERS})

    def publish(self, change: Callable[[Images], None] = lambda _images: None,
                encodings: Tuple[str, str] = ('16UC1', 'rgb8')) -> None:
        images = make_images(*encodings, rospy.Time.now())
        change(images)
        for publisher, message in zip(self.publishers, images):
            publisher.publish(message)

    def wait_for_cloud(self, output: Listener) -> PointCloud2:
        """Publish good images until a new cloud arrives; return it."""
        del output.messages[:]
        wait_until(lambda: bool(output.messages), 'a cloud', self.publish)
        return output.messages[-1]

    def test_gives_the_points_of_the_long_way(self) -> None:
        for encodings in (('16UC1', 'rgb8'), ('32FC1', 'bgr8'), ('16UC1', 'mono8')):
            self.check_both_ways(encodings)

    def check_both_ways(self, encodings: Tuple[str, str]) -> None:
        with Listener(OUTPUT, PointCloud2) as short, \
                Listener('/roi_filter/output', PointCloud2) as long:
            wait_until(lambda: bool(_pairs(short, long)), f'clouds of {encodings} on both ways',
                       lambda: self.publish(encodings=encodings))
            for one, other in _pairs(short, long):
                one.header.seq = other.header.seq = 0
                self.assertEqual(one, other)
                self.assertGreater(one.width, 1000)
                self.assertLess(one.width, WIDTH * HEIGHT / 2)

    def test_subscribes_only_while_needed(self) -> None:
        wait_until(lambda: self._connections() == 0, 'not subscribed at first')
        with Listener(OUTPUT, PointCloud2):
            wait_until(lambda: self._connections() == 3, 'subscribed to all')
        wait_until(lambda: self._connections() == 0, 'not subscribed any more')

    def _connections(self) -> int:
        return sum(publisher.get_num_connections() for publisher in self.publishers)

    def test_is_where_a_moving_box_was_then(self) -> None:
        broadcaster = tf2_ros.TransformBroadcaster()
        rospy.set_param('/crop/frame', 'hand')
        rospy.set_param('/crop/center', [0, 0, 0])
        rospy.set_param('/crop/size', [0.4, 0.4, 4])

        def publish_beside_a_fast_hand() -> None:
            """Publish with the hand at x = 0.3 m at the images' time, else far away."""
            now = rospy.Time.now()
            send_fast_hand(broadcaster, now, 0.3)
            images = make_images('16UC1', 'rgb8', now)
            for publisher, message in zip(self.publishers, images):
                publisher.publish(message)

        with Listener('/crop/outline', Marker) as outline:
            wait_until(lambda: any(
                marker.header.frame_id == 'hand' and _extent(marker)[2] == (-2, 2)
                for marker in outline.messages), 'the box of the hand')
        with Listener(OUTPUT, PointCloud2) as output:
            wait_until(lambda: sum(it.width > 100 for it in output.messages) >= 5, 'clouds',
                       publish_beside_a_fast_hand)
        for cloud in output.messages:  # an empty one was taken more than a second later
            x_m = np.frombuffer(cloud.data, '<f4').reshape(-1, 8)[:, 0]
            self.assertTrue((np.abs(x_m - 0.3) < 0.2).all())

    def test_complains_about_each_bad_input_and_lives(self) -> None:
        def other_frame(images: Images) -> None:
            images.color.header.frame_id = 'other'

        def cut_off(images: Images) -> None:
            images.depth.data = images.depth.data[:-1]

        def no_focal_length(images: Images) -> None:
            images.info.K, images.info.P = [0] * 9, [0] * 12

        def nowhere(images: Images) -> None:
            for message in images:
                message.header.frame_id = 'nowhere'

        topics = ('/depth', '/color', '/camera_info')
        self.check_complaint(other_frame, Log.ERROR, *topics, "'other'")
        self.check_complaint(cut_off, Log.ERROR, *topics, 'cut off')
        self.check_complaint(no_focal_length, Log.ERROR, *topics, 'focal length')
        self.check_complaint(nowhere, Log.WARN, '/depth', 'nowhere')

    def check_complaint(self, damage: Callable[[Images], None], level: int, *words: str) -> None:
        with Listener(OUTPUT, PointCloud2) as output, log_listener() as log:
            wait_until(lambda: logged(log, level, *words), f'a message with {words}',
                       lambda: self.publish(damage))
            self.assertEqual(output.messages, [])
            self.wait_for_cloud(output)


def _pairs(first: Listener, second: Listener) -> List[Tuple[PointCloud2, PointCloud2]]:
    """Return the clouds of both with equal stamps."""
    return [(one, other) for one in list(first.messages) for other in list(second.messages)
            if one.header.stamp == other.header.stamp]


def _extent(marker: Marker) -> List[Tuple[float, float]]:
    return [(min(values), max(values))
            for values in ([getattr(point, axis) for point in marker.points] for axis in 'xyz')]


if __name__ == '__main__':
    rospy.init_node('registered_crop_test')
    rostest.rosrun('process_visualizer', 'registered_crop_test', RegisteredCropTest)
