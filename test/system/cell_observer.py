# SPDX-License-Identifier: BSD-3-Clause
"""Looks at a running simulated cell, as a program of its own; prints what it saw as JSON.

usage: cell_observer.py objects SECONDS    what was found in the clouds of so much time
       cell_observer.py fit CONFIG         Fit, from 20 mm and 2° beside the Kinect's place
       cell_observer.py played POSITIONS   what is found in a recording after jumps from playing to
                                           positions [s], and in all of it backwards
"""
from __future__ import annotations

import json
import math
import sys
import threading
from pathlib import Path
from typing import Dict, List

import numpy as np
import rospy
from sensor_msgs.msg import PointCloud2
from std_msgs.msg import Float32

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / 'bench'))
from fit import displaced

from process_visualizer.cell.model import Device, Pose
from process_visualizer.cell.xml_parser import XmlParser
from process_visualizer.clients.player_client import PlayerClient
from process_visualizer.clients.sensor_fit_client import fit_sensor
from process_visualizer.msg import DetectedObjects
from process_visualizer.robot.rotations import pose_difference
from process_visualizer.srv import SetFrame

CLOUD = '/camera/depth_registered/points'
OBJECTS = '/kinect/objects'
SEWS_M_PER_S = 0.01
TIMEOUT_S = 120.0


def watched(seconds: float) -> Dict[str, object]:
    """Return the number of clouds, and each object's positions and sizes while it was visible."""
    arrays: List[DetectedObjects] = []
    is_over = threading.Event()

    def take(array: DetectedObjects) -> None:
        arrays.append(array)
        if (array.header.stamp - arrays[0].header.stamp).to_sec() > seconds:
            is_over.set()

    subscriber = rospy.Subscriber(OBJECTS, DetectedObjects, take)
    assert is_over.wait(seconds + TIMEOUT_S)
    subscriber.unregister()
    found: Dict[int, List[object]] = {}
    for it in [it for array in arrays for it in array.objects if it.is_seen]:
        place, size = it.pose.position, it.size
        found.setdefault(it.number, []).append(
            {'place': [place.x, place.y, place.z], 'size': [size.x, size.y, size.z],
             'link': it.link, 'distance': it.distance})
    return {'clouds': len(arrays), 'objects': found}


def all_in(array: DetectedObjects) -> List[Dict[str, object]]:
    """Return all objects of a cloud, including hidden ones."""
    return [{'number': it.number,
             'place': [it.pose.position.x, it.pose.position.y, it.pose.position.z],
             'size': [it.size.x, it.size.y, it.size.z]} for it in array.objects]


class Played:
    """The objects in the recording that the player plays."""

    def __init__(self) -> None:
        """Wait for the player, and subscribe to the objects."""
        self._arrays: List[DetectedObjects] = []
        self._changed = threading.Condition()
        self._player = PlayerClient()
        self._player.wait_until_ready(TIMEOUT_S)
        rospy.wait_for_message(OBJECTS, DetectedObjects, TIMEOUT_S)
        rospy.Subscriber(OBJECTS, DetectedObjects, self._take)

    def at(self, position_s: float) -> List[Dict[str, object]]:
        """Return the first objects at a position; the robots move until it jumps there."""
        self._player.set_rate(1.0)
        self._player.play()
        assert self._player.wait_for(lambda it: not it.paused, TIMEOUT_S)
        self._wait_for_cloud(rospy.Time.now())
        self._player.pause()
        begin = rospy.Time.now()
        self._player.seek(position_s)
        return all_in(self._wait_for_cloud(begin))

    def backwards(self) -> List[List[Dict[str, object]]]:
        """Play all of it backwards; return the objects in each cloud."""
        state = self._player.state
        assert state is not None
        self._player.seek(state.duration - 0.1)
        self._player.set_rate(-1.0)
        begin = rospy.Time.now()
        self._player.play()
        assert self._player.wait_for(lambda it: it.position < 1.0, TIMEOUT_S)
        with self._changed:
            return [all_in(it) for it in self._since(begin)]

    def _wait_for_cloud(self, begin: rospy.Time) -> DetectedObjects:
        """Return the objects in the first cloud of a time or later."""
        with self._changed:
            assert self._changed.wait_for(lambda: bool(self._since(begin)), TIMEOUT_S)
            return self._since(begin)[0]

    def _since(self, begin: rospy.Time) -> List[DetectedObjects]:
        return [it for it in self._arrays if it.header.stamp >= begin]

    def _take(self, array: DetectedObjects) -> None:
        with self._changed:
            self._arrays.append(array)
            self._changed.notify_all()


def played(positions_s: List[float]) -> Dict[str, object]:
    """Return the objects at positions, and backwards."""
    recording = Played()
    return {'at': [recording.at(it) for it in positions_s], 'backwards': recording.backwards()}


def move(device: Device, pose: Pose) -> None:
    """Publish the pose of a device."""
    assert device.base is not None
    answer = rospy.ServiceProxy('/cell_frames/set_frame', SetFrame)(
        '', device.base.frame, pose.xyz, pose.ypr)
    assert answer.success, answer.message


def wait_until_it_sews() -> None:
    """Wait until it begins to sew: then no finished covers occlude the machine's table."""
    sews = True
    while sews:
        sews = rospy.wait_for_message('/feed_rate_est', Float32, TIMEOUT_S).data > SEWS_M_PER_S
    while not sews:
        sews = rospy.wait_for_message('/feed_rate_est', Float32, TIMEOUT_S).data > SEWS_M_PER_S


def fitted(config: str) -> Dict[str, object]:
    """Return the remaining displacement after Fit."""
    cell = XmlParser().parse(config)
    kinect = cell.device('kinect')
    assert kinect.base is not None
    for name in ('/sensor_fit/fit', '/cell_frames/set_frame'):
        rospy.wait_for_service(name, TIMEOUT_S)
    rospy.wait_for_message(CLOUD, PointCloud2, TIMEOUT_S)
    wait_until_it_sews()
    truth = kinect.base.pose
    move(kinect, displaced(truth, 0.02, math.radians(2.0), np.random.default_rng(5)))
    try:
        found = fit_sensor(kinect, cell.devices, cell.frame)
    finally:
        move(kinect, truth)
    rest = pose_difference(found.pose, truth)
    return {'shift_m': rest.distance_m, 'turn_deg': math.degrees(rest.angle_rad),
            'residual_m': found.residual_m}


def main() -> None:
    """Execute the command line."""
    rospy.init_node('cell_observer', anonymous=True)
    what, argument = sys.argv[1:3]
    if what == 'played':
        print(json.dumps(played([float(it) for it in argument.split(',')])))
    else:
        print(json.dumps(watched(float(argument)) if what == 'objects' else fitted(argument)))


if __name__ == '__main__':
    main()
