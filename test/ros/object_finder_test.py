#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The nodelet ObjectFinder: found objects, ignored points, and messages about bad input."""
from __future__ import annotations

import copy
import itertools
import unittest
from typing import Callable, List, Tuple

import numpy as np
import rospy
import rostest
import tf2_ros
from cloud_testing import Listener, log_listener, logged, make_cloud, wait_until
from geometry_msgs.msg import TransformStamped
from rosgraph_msgs.msg import Log
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import Header
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import Marker, MarkerArray

from process_visualizer.msg import DetectedObject, DetectedObjects, PlayerState, RestoredStamp

Box = Tuple[float, float, float, float, float, float]
"""Center x, y, height of the top, and sizes x, y, z, m."""
STAND = "<robot name='stand'><link name='stand'/></robot>"
THING: Box = (-0.5, 0.2, 0.15, 0.3, 0.2, 0.15)
OTHER: Box = (0.5, -0.5, 0.15, 0.3, 0.2, 0.15)
GOODS: Box = (0.6, 0.5, 0.1, 0.2, 0.2, 0.1)


def table_with(boxes: List[Box]) -> np.ndarray:
    """Return the points of boxes on a table, seen by a camera 2 m above, in its frame, in rows."""
    v, u = np.meshgrid(np.arange(-90, 90), np.arange(-120, 120), indexing='ij')
    rays = np.stack([u / 160.0, v / 160.0, np.ones_like(u)], axis=-1)
    depth = np.full(u.shape, 2.0)
    for x_m, y_m, top_m, *sizes in boxes:
        for height_m in np.linspace(top_m - sizes[2], top_m, 30):  # a pile of plates
            place = rays * (2.0 - height_m)
            on_plate = (np.abs(place[..., 0] - x_m) < sizes[0] / 2) \
                & (np.abs(-place[..., 1] - y_m) < sizes[1] / 2)
            depth = np.where(on_plate, 2.0 - height_m, depth)
    return rays * depth[..., None]


class ObjectFinderTest(unittest.TestCase):
    """Publishes clouds, and checks the objects that are found in them."""

    @classmethod
    def setUpClass(cls) -> None:
        cls.publisher = rospy.Publisher('/cloud', PointCloud2, queue_size=1)
        cls.player = rospy.Publisher('/bag_player/state', PlayerState, queue_size=1)
        cls.restored = rospy.Publisher('/tf_restored', TFMessage, queue_size=10)
        cls.broadcaster = tf2_ros.TransformBroadcaster()

    def setUp(self) -> None:
        rospy.set_param('/stand/robot_description', STAND)
        self.clouds = {}

    def publish(self, boxes: List[Box], change: Callable[[PointCloud2], None] = lambda _: None,
                arm_m: float = 0.0, pose_late_s: float = 0.0) -> None:
        """Publish a cloud, with the arm's link at x = ``arm_m`` above the table at its time.

        The link's pose can have a later stamp.
        """
        key = tuple(boxes)
        if key not in self.clouds:
            points = table_with(boxes)
            self.clouds[key] = make_cloud(points.reshape(-1, 3), 'camera')
            self.clouds[key].height, self.clouds[key].width = points.shape[:2]
            self.clouds[key].row_step = 16 * points.shape[1]
        cloud = copy.copy(self.clouds[key])
        cloud.header = Header(stamp=rospy.Time.now(), frame_id='camera')
        pose_stamp = cloud.header.stamp + rospy.Duration(pose_late_s)
        self.broadcaster.sendTransform(_arm_at(arm_m, pose_stamp))
        change(cloud)
        self.publisher.publish(cloud)

    def wait_for(self, condition: Callable[[DetectedObjects], bool], what: str, boxes: List[Box],
                 arm_m: float = 0.0) -> DetectedObjects:
        with Listener('/finder/objects', DetectedObjects) as found:
            wait_until(lambda: any(map(condition, found.messages[-1:])), what,
                       lambda: self.publish(boxes, arm_m=arm_m))
            return found.messages[-1]

    def first_since(self, begin: rospy.Time, found: Listener) -> DetectedObjects:
        def since() -> List[DetectedObjects]:
            return [it for it in found.messages if it.header.stamp >= begin]

        wait_until(lambda: bool(since()), 'the first cloud')
        return since()[0]

    def test_1_waits_for_models(self) -> None:
        rospy.delete_param('/stand/robot_description')
        with log_listener() as log:
            wait_until(lambda: logged(log, Log.WARN, '/cloud', '/stand/robot_description'),
                       'a warning about the model', lambda: self.publish([]))
        rospy.set_param('/stand/robot_description', STAND)
        self.wait_for(lambda found: not found.objects, 'nothing in a clear cell', [])

    def test_2_finds_what_nobody_modeled(self) -> None:
        found = self.wait_for(lambda found: len(found.objects) == 1, 'one object', [THING, GOODS])
        thing = found.objects[0]
        self.assertEqual(found.header.frame_id, 'world')
        sizes = sorted((thing.size.x, thing.size.y))
        np.testing.assert_allclose([*sizes, thing.size.z], [0.2, 0.3, 0.15], atol=0.015)
        np.testing.assert_allclose([thing.pose.position.x, thing.pose.position.y], [-0.5, 0.2],
                                   atol=0.015)
        self.assertEqual((thing.link, thing.level), ('arm/link', DetectedObject.WARN))
        # from the upper edge at x = -0.35, y = 0.1 to the arm's side at x = -0.1, z = 0.2
        self.assertAlmostEqual(thing.distance, np.hypot(0.25, 0.05), delta=0.02)

    def test_3_shows_markers_and_what_remains(self) -> None:
        with Listener('/finder/markers', MarkerArray) as markers, \
                Listener('/finder/unknown', PointCloud2) as unknown:
            wait_until(lambda: bool(unknown.messages) and any(
                len(array.markers) > 1 for array in markers.messages), 'markers and points',
                lambda: self.publish([THING, GOODS]))
            texts = [marker.text for array in markers.messages for marker in array.markers
                     if marker.type == Marker.TEXT_VIEW_FACING]
        self.assertRegex(texts[0], r'object \d+: \d+ x \d+ x \d+ cm\n0\.\d\d m to arm/link')
        cloud = unknown.messages[-1]
        places = np.frombuffer(cloud.data, '<f4').reshape(-1, 4)[:, :3]
        self.assertEqual(cloud.header.frame_id, 'camera')
        is_goods = (np.abs(places[:, 0] - 0.6) < 0.1) & (np.abs(places[:, 1] + 0.5) < 0.1)
        self.assertGreater(len(places), 10000)
        self.assertEqual(is_goods.sum(), 0)

    def test_4_nothing_survives_a_jump_in_a_recording(self) -> None:
        def other(found: DetectedObjects) -> List[int]:
            return [it.number for it in found.objects if it.pose.position.x > 0.0]

        self.wait_for(lambda found: len(found.objects) == 1, 'one object', [THING])
        self.wait_for(lambda found: bool(other(found)) and other(found)[0] > 1, 'the next number',
                      [OTHER])
        state = PlayerState(segment=3)

        def jump() -> None:
            self.player.publish(state)
            self.publish([OTHER])
            state.segment += 1

        with Listener('/finder/objects', DetectedObjects) as found:
            wait_until(lambda: any(other(it) == [1] for it in found.messages), 'the first number',
                       jump)

    def test_4_the_arm_jumps_with_the_recording(self) -> None:
        """The pose of the arm arrives shortly after the first cloud.

        That cloud may overtake the player's state, and is then evaluated again.
        """
        at_its_place = (0.3, 0.0, 0.4, 0.2, 0.2, 0.2)
        with Listener('/finder/objects', DetectedObjects) as found:
            wait_until(lambda: bool(found.messages), 'the cell before',
                       lambda: self.publish([], arm_m=-0.4))
            for segment in range(10, 16):
                self.publish([], arm_m=-0.4)
                begin = rospy.Time.now()
                self.player.publish(PlayerState(segment=segment, since=begin))
                self.publish([at_its_place], arm_m=0.3, pose_late_s=0.03)
                wait_until(lambda since=begin: any(
                    it.header.stamp >= since and not it.objects for it in found.messages),
                    'nothing but the arm')

    def test_4_a_cloud_at_rest_is_compared_with_the_arm_of_its_time(self) -> None:
        """While playback is paused, /tf has the arm at a later time than the cloud's."""
        on_arm = (0.3, 0.0, 0.4, 0.2, 0.2, 0.2)
        with Listener('/finder/objects', DetectedObjects) as found:
            wait_until(lambda: bool(found.messages) and not found.messages[-1].objects,
                       'the cell before', lambda: self.publish([], arm_m=-0.4))
            self.pause()
            for tell in itertools.permutations((self.tell_restored, self.tell_pose)):
                begin = rospy.Time.now()
                stamps: List[rospy.Time] = []
                self.publish([on_arm], lambda it, to=stamps: to.append(it.header.stamp),
                             arm_m=-0.4)
                for it in tell:
                    it(stamps[0])
                self.assertEqual(self.first_since(begin, found).objects, [])
        self.player.publish(PlayerState(segment=20))

    def test_4_a_cloud_at_rest_without_poses_is_not_left_out(self) -> None:
        """A robot without recorded joints must not hide objects."""
        with Listener('/finder/objects', DetectedObjects) as found:
            wait_until(lambda: bool(found.messages), 'a cell', lambda: self.publish([]))
            self.pause()
            begin = rospy.Time.now()
            self.publish([THING], lambda it: self.tell_restored(it.header.stamp))
            self.assertEqual(len(self.first_since(begin, found).objects), 1)
        self.player.publish(PlayerState(segment=20))

    def test_4_a_pose_of_the_end_of_time_ends_nothing(self) -> None:
        for secs in (0, 1, 2 ** 32 - 1):
            self.broadcaster.sendTransform(_arm_at(0.0, rospy.Time(secs)))
        self.player.publish(PlayerState(segment=40))
        self.wait_for(lambda _found: True, 'a good cloud afterwards', [])

    def test_4_a_cloud_without_poses_around_it_is_left_out(self) -> None:
        """Between two poses a second apart, the arm need not be on the straight line."""
        def later(cloud: PointCloud2, by_s: float) -> None:
            cloud.header.stamp += rospy.Duration(by_s)
            stamps.append(cloud.header.stamp)

        stamps: List[rospy.Time] = []
        with Listener('/finder/objects', DetectedObjects) as found:
            wait_until(lambda: bool(found.messages), 'the cell before',
                       lambda: self.publish([], arm_m=-0.4))
            self.publish([THING], lambda it: later(it, 1.0), arm_m=0.3, pose_late_s=1.1)
            self.publish([], lambda it: later(it, 1.2), arm_m=0.3, pose_late_s=1.2)
            wait_until(lambda: any(it.header.stamp == stamps[1] for it in found.messages),
                       'the cloud after the gap')
            self.assertNotIn(stamps[0], [it.header.stamp for it in found.messages])
        self.player.publish(PlayerState(segment=30))

    def pause(self) -> None:
        """Tell the finder that playback is paused: it then draws again without clouds."""
        with Listener('/finder/markers', MarkerArray) as drawn:
            wait_until(lambda: len(drawn.messages) > 2, 'markers without clouds',
                       lambda: self.player.publish(PlayerState(segment=20, paused=True)))

    def tell_restored(self, stamp: rospy.Time) -> None:
        self.player.publish(PlayerState(segment=20, paused=True,
                                        restored=[RestoredStamp(stamp=stamp)]))

    def tell_pose(self, stamp: rospy.Time) -> None:
        self.restored.publish(TFMessage([_arm_at(0.3, stamp)]))

    def test_5_complains_about_each_bad_input_and_lives(self) -> None:
        def big_endian(cloud: PointCloud2) -> None:
            cloud.is_bigendian = True

        def no_numbers(cloud: PointCloud2) -> None:
            cloud.data = np.full(len(cloud.data) // 4, np.nan, '<f4').tobytes()

        def nowhere(cloud: PointCloud2) -> None:
            cloud.header.frame_id = 'nowhere'

        for damage, level, word in ((big_endian, Log.ERROR, 'big-endian'),
                                    (no_numbers, Log.ERROR, 'sees nothing'),
                                    (nowhere, Log.WARN, 'nowhere')):
            self.check_complaint(damage, level, word)

    def check_complaint(self, damage: Callable[[PointCloud2], None], level: int,
                        word: str) -> None:
        with Listener('/finder/objects', DetectedObjects) as found, log_listener() as log:
            wait_until(lambda: logged(log, level, '/cloud', word), f'a sentence with {word}',
                       lambda: self.publish([], damage))
            self.assertEqual(found.messages, [])
        self.wait_for(lambda _found: True, 'a good cloud afterwards', [])


def _arm_at(x_m: float, stamp: rospy.Time) -> TransformStamped:
    transform = TransformStamped(child_frame_id='arm/link')
    transform.header.frame_id, transform.header.stamp = 'world', stamp
    transform.transform.translation.x, transform.transform.translation.z = x_m, 0.3
    transform.transform.rotation.w = 1.0
    return transform


if __name__ == '__main__':
    rospy.init_node('object_finder_test')
    rostest.rosrun('process_visualizer', 'object_finder_test', ObjectFinderTest)
