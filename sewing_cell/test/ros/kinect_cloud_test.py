#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""From the Kinect's images to the cropped, colored cloud: openni_play.launch and kinect_roi."""
from __future__ import annotations

import unittest
from queue import Queue

import numpy as np
import rospy
import rostest
import tf2_ros
from sensor_msgs.msg import CameraInfo, Image, PointCloud2

TIMEOUT_S = 60.0
OPTICAL_FRAME = 'camera_rgb_optical_frame'
WIDTH, HEIGHT = 640, 480
FOCAL_LENGTH, CENTER_X, CENTER_Y = 525.0, 319.5, 239.5
CENTER, HALF_EXTENTS = np.array([-0.56, -0.25, 0.05]), np.array([0.5, 0.4, 0.5])
DEPTH_M = 1.85  # about the distance of the sewing plane
COLOR = (10, 20, 30)


def make_image(encoding: str, pixels: np.ndarray) -> Image:
    """Return an image message of the optical frame; rows are the array's first axis."""
    image = Image(height=HEIGHT, width=WIDTH, encoding=encoding, step=pixels.nbytes // HEIGHT,
                  data=pixels.tobytes())
    image.header.frame_id = OPTICAL_FRAME
    return image


def make_camera_info() -> CameraInfo:
    """Return the intrinsics of a Kinect without distortion."""
    info = CameraInfo(height=HEIGHT, width=WIDTH, distortion_model='plumb_bob', D=[0.0] * 5)
    info.K = [FOCAL_LENGTH, 0, CENTER_X, 0, FOCAL_LENGTH, CENTER_Y, 0, 0, 1]
    info.R = np.eye(3).ravel().tolist()
    info.P = [FOCAL_LENGTH, 0, CENTER_X, 0, 0, FOCAL_LENGTH, CENTER_Y, 0, 0, 0, 1, 0]
    info.header.frame_id = OPTICAL_FRAME
    return info


def plane_points() -> np.ndarray:
    """Return the points of the image's pixels in the optical frame, (N, 3), m."""
    column, row = np.meshgrid(np.arange(WIDTH), np.arange(HEIGHT))
    return np.stack([(column - CENTER_X) / FOCAL_LENGTH * DEPTH_M,
                     (row - CENTER_Y) / FOCAL_LENGTH * DEPTH_M,
                     np.full(column.shape, DEPTH_M)], axis=-1).reshape(-1, 3)


def to_world(points: np.ndarray) -> np.ndarray:
    """Transform points (N, 3), m, from the optical frame into the world with /tf."""
    buffer = tf2_ros.Buffer()
    listener = tf2_ros.TransformListener(buffer)
    transform = buffer.lookup_transform(
        'world', OPTICAL_FRAME, rospy.Time(0), rospy.Duration(TIMEOUT_S)).transform
    listener.unregister()
    x, y, z, w = (getattr(transform.rotation, axis) for axis in 'xyzw')
    shift = np.array([getattr(transform.translation, axis) for axis in 'xyz'])
    vector = np.array([x, y, z])
    turned = points + 2 * np.cross(vector, np.cross(vector, points) + w * points)
    return turned + shift


class KinectCloudTest(unittest.TestCase):
    """Shows the Kinect a plane in front of it."""

    def setUp(self) -> None:
        depth_mm = np.full((HEIGHT, WIDTH), int(DEPTH_M * 1000), dtype='<u2')
        depth_mm[0, :] = 0  # not measured
        color = np.full((HEIGHT, WIDTH, 3), COLOR, dtype=np.uint8)
        self.outputs = [
            (rospy.Publisher(f'/camera/{topic}', type(message), queue_size=1), message)
            for topic, message in (('rgb/camera_info', make_camera_info()),
                                   ('rgb/image_color', make_image('rgb8', color)),
                                   ('depth_registered/image_raw', make_image('16UC1', depth_mm)))]

    def publish_until_cropped(self, topic: str = '/kinect/roi_points') -> PointCloud2:
        """Publish images ten times a second until a cloud is made from them; return it."""
        clouds: 'Queue[PointCloud2]' = Queue()
        begin = rospy.Time.now()
        subscriber = rospy.Subscriber(topic, PointCloud2, clouds.put)
        timer = rospy.Timer(rospy.Duration(0, 100_000_000), self.publish)
        try:
            cloud = clouds.get(timeout=TIMEOUT_S)
            while cloud.header.stamp < begin:  # of the previous test
                cloud = clouds.get(timeout=TIMEOUT_S)
            return cloud
        finally:
            timer.shutdown()
            timer.join()
            subscriber.unregister()

    def publish(self, _event: object) -> None:
        """Publish images with the same stamp."""
        now = rospy.Time.now()
        for publisher, message in self.outputs:
            message.header.stamp = now
            publisher.publish(message)

    def test_crops_to_the_covers(self) -> None:
        self.assert_cropped('/kinect/roi_points')

    def test_crops_in_a_process_of_its_own(self) -> None:
        self.assert_cropped('/own_process/cropped')

    def assert_cropped(self, topic: str) -> None:
        """Check the cloud on the topic."""
        cloud = self.publish_until_cropped(topic)
        self.assertLessEqual(cloud.header.stamp, rospy.Time.now())
        self.assertEqual(cloud.header.frame_id, OPTICAL_FRAME)
        self.assertTrue(cloud.is_dense)

        offsets = {field.name: field.offset for field in cloud.fields}
        table = np.frombuffer(cloud.data, np.uint8).reshape(cloud.width, cloud.point_step)
        blue_green_red = table[:, offsets['rgb']:offsets['rgb'] + 3]
        self.assertTrue((blue_green_red == COLOR[::-1]).all())

        points = table[:, :12].copy().view('<f4')
        inside = (np.abs(to_world(points) - CENTER) < HALF_EXTENTS + 1e-4).all(axis=1)
        self.assertTrue(inside.all())
        expected = (np.abs(to_world(plane_points()) - CENTER) < HALF_EXTENTS).all(axis=1).sum()
        self.assertGreater(expected, 10000)
        self.assertAlmostEqual(cloud.width, expected, delta=0.01 * expected)

    def test_defaults_can_be_seen_and_changed(self) -> None:
        self.publish_until_cropped()
        self.assertEqual(rospy.get_param('/kinect/kinect_roi/frame'), 'world')
        self.assertEqual(rospy.get_param('/kinect/kinect_roi/center'), CENTER.tolist())
        self.assertEqual(rospy.get_param('/kinect/kinect_roi/size'), (2 * HALF_EXTENTS).tolist())


if __name__ == '__main__':
    rospy.init_node('kinect_cloud_test')
    rostest.rosrun('sewing_cell', 'kinect_cloud_test', KinectCloudTest)
