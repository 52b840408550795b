#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The node sensor_fit fits the sewing cell's Kinect, and refuses impossible requests."""
from __future__ import annotations

import math
import os
import sys
import unittest
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, ClassVar

import numpy as np
import rospy
import rostest
from geometry_msgs.msg import Pose, Quaternion, Vector3
from sensor_msgs.msg import PointCloud2
from visualization_msgs.msg import Marker

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / 'bench'))
from fit import displaced
from still_cell import CLOUD, StillCell

from process_visualizer.cell.model import BaseFrame, Device, RegionOfInterest
from process_visualizer.clients.sensor_fit_client import FitError, fit_sensor
from process_visualizer.robot.rotations import pose_difference
from process_visualizer.srv import FitSensor

PICTURE = 120  # 4 s: the upper robot brings covers
TIMEOUT_S = 30.0


class SensorFitTest(unittest.TestCase):
    """Has a cell that stands still, with frames and cloud as of a running one."""

    stage: ClassVar[StillCell]

    @classmethod
    def setUpClass(cls) -> None:
        rospy.wait_for_service('/sensor_fit/fit', TIMEOUT_S)
        cls.stage = StillCell()
        cls.stage.show(PICTURE)

    def setUp(self) -> None:
        self.stage.move_sensor(self.stage.truth)

    def lost(self) -> Device:
        """Return a device with a model of unknown pose."""
        rospy.set_param('/simulator/robot_description',
                        '<robot name="a"><link name="lost"><visual><geometry><box size="1 1 1"/>'
                        '</geometry></visual></link></robot>')
        model = self.stage.cell.device('cell_stand').model
        return replace(self.stage.cell.device('simulator'), model=model)

    def refusal(self, sensor: Device, *names: str) -> str:
        devices = [it for it in self.stage.cell.devices if not names or it.name in names]
        with self.assertRaises(FitError) as refused:
            fit_sensor(sensor, devices, self.stage.cell.frame)
        return str(refused.exception)

    def test_it_is_found_from_20_mm_and_2_degrees_away(self) -> None:
        pose = displaced(self.stage.truth, 0.02, math.radians(2.0), np.random.default_rng(7))
        self.stage.move_sensor(pose)
        found = fit_sensor(self.stage.sensor, [*self.stage.cell.devices[:-1], self.lost()],
                           self.stage.cell.frame)
        rest = pose_difference(found.pose, self.stage.truth)
        self.assertLess(rest.distance_m, 0.001)
        self.assertLess(math.degrees(rest.angle_rad), 0.1)
        self.assertLess(found.residual_m, 0.002)
        self.assertLess(found.residual_m, found.before_m / 5.0)
        self.assertEqual(found.left_out, ('lost',))

    def test_without_models(self) -> None:
        self.assertIn('has a model', self.refusal(self.stage.sensor, 'simulator'))

    def test_a_cloud_that_does_not_hang_on_the_frame(self) -> None:
        base = self.stage.sensor.base
        assert base is not None
        other = replace(self.stage.sensor, base=BaseFrame('sewing_machine/base', base.pose,
                                                          base.location))
        self.assertIn('is not attached to sewing_machine/base', self.refusal(other))

    def test_a_sensor_without_a_cloud(self) -> None:
        silent = replace(self.stage.sensor, name='silent', topics=())
        self.assertIn('publishes no cloud', self.refusal(silent))

    def test_a_cropped_cloud_without_models_says_what_to_do(self) -> None:
        whole = rospy.wait_for_message(CLOUD, PointCloud2, TIMEOUT_S)
        corner = PointCloud2(header=whole.header, height=40, width=640, point_step=12,
                             row_step=7680, fields=whole.fields, data=whole.data[:40 * 7680])
        publisher = rospy.Publisher('/cropped/points', PointCloud2, latch=True, queue_size=1)
        publisher.publish(corner)
        cropped = replace(self.stage.sensor, name='cropped', topics=())
        advice = 'make the box larger'
        self.assertNotIn(advice, self.refusal(cropped))
        here = self.stage.sensor.location
        box = RegionOfInterest('world', (0.0, 0.0, 0.0), (0.3, 0.3, 0.3), here)
        self.assertIn(advice, self.refusal(replace(cropped, roi=box)))

    def test_a_broken_cloud(self) -> None:
        whole = rospy.wait_for_message(CLOUD, PointCloud2, TIMEOUT_S)
        broken = PointCloud2(header=whole.header, height=480, width=640, point_step=12,
                             row_step=7680, fields=whole.fields, data=b'short')
        publisher = rospy.Publisher('/broken', PointCloud2, latch=True, queue_size=1)
        publisher.publish(broken)
        topic = replace(self.stage.sensor.topics[0], name='/broken')
        self.assertIn('cut off', self.refusal(replace(self.stage.sensor, topics=(topic,))))

    def test_models_that_do_harm_are_refused(self) -> None:
        """A request may name any mesh, and give models any size."""
        fit = rospy.ServiceProxy('/sensor_fit/fit', FitSensor)
        base = self.stage.sensor.base
        assert base is not None

        def refusal(**changes: Any) -> str:
            model = Marker(type=Marker.CUBE, scale=Vector3(1.0, 1.0, 1.0))
            model.header.frame_id = 'world'
            for name, value in changes.items():
                setattr(model, name, value)
            answer = fit(CLOUD, base.frame, 'world', [model])
            self.assertFalse(answer.success)
            return str(answer.message)

        with TemporaryDirectory() as folder:
            pipe, deep = Path(folder, 'a.stl'), Path(folder, 'a.dae')
            os.mkfifo(pipe)
            deep.write_text('<node>' * 100_000)
            for address, reason in (
                    ('http://localhost:1/a.stl', 'neither with package:// nor with file:///'),
                    (f'file://{pipe}', 'is not a file'),
                    (f'file://{deep}', 'nested more than 200 deep')):
                self.assertIn(reason, refusal(type=Marker.MESH_RESOURCE, mesh_resource=address))
        self.assertIn('no numbers', refusal(scale=Vector3(math.nan, 1.0, 1.0)))
        self.assertIn('length 1', refusal(
            pose=Pose(orientation=Quaternion(1e6, 1e6, 0.0, 1.0))))
        self.assertIn('1000000 characters', fit('x' * 1_000_000, base.frame, 'world', []).message)


if __name__ == '__main__':
    rospy.init_node('sensor_fit_test')
    rostest.rosrun('process_visualizer', 'sensor_fit_test', SensorFitTest)
