# SPDX-License-Identifier: BSD-3-Clause
"""Looks at a running simulated cell, as a program of its own; prints what it saw as JSON.

usage: cell_observer.py objects SECONDS    what was found in the clouds of some time
       cell_observer.py fit CONFIG         Fit, from 20 mm and 2° beside the Kinect's place
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
from process_visualizer.clients.sensor_fit_client import fit_sensor
from process_visualizer.motion.pose_difference import pose_difference
from process_visualizer.msg import DetectedObjects
from process_visualizer.srv import SetFrame

CLOUD = '/camera/depth_registered/points'
OBJECTS = '/kinect/objects'
SEWS_M_PER_S = 0.01
TIMEOUT_S = 60.0


def watched(seconds: float) -> Dict[str, object]:
    """Return the number of clouds, and of each object its places and sizes when it was seen."""
    arrays: List[DetectedObjects] = []
    rospy.wait_for_message(OBJECTS, DetectedObjects, TIMEOUT_S)
    subscriber = rospy.Subscriber(OBJECTS, DetectedObjects, arrays.append)
    threading.Event().wait(seconds)
    subscriber.unregister()
    found: Dict[int, List[object]] = {}
    for it in [it for array in arrays for it in array.objects if it.is_seen]:
        place, size = it.pose.position, it.size
        found.setdefault(it.number, []).append(
            {'place': [place.x, place.y, place.z], 'size': [size.x, size.y, size.z],
             'link': it.link, 'distance': it.distance})
    return {'clouds': len(arrays), 'objects': found}


def move(device: Device, pose: Pose) -> None:
    """Say where a device is."""
    assert device.base is not None
    answer = rospy.ServiceProxy('/cell_frames/set_frame', SetFrame)(
        '', device.base.frame, pose.xyz, pose.ypr)
    assert answer.success, answer.message


def wait_until_it_sews() -> None:
    """Wait for a moment at which it begins: then no finished covers hide the machine's table."""
    sews = True
    while sews:
        sews = rospy.wait_for_message('/feed_rate_est', Float32, TIMEOUT_S).data > SEWS_M_PER_S
    while not sews:
        sews = rospy.wait_for_message('/feed_rate_est', Float32, TIMEOUT_S).data > SEWS_M_PER_S


def fitted(config: str) -> Dict[str, object]:
    """Return what is left of the displacement after Fit."""
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
    """Do what the command line says."""
    rospy.init_node('cell_observer', anonymous=True)
    what, argument = sys.argv[1:3]
    print(json.dumps(watched(float(argument)) if what == 'objects' else fitted(argument)))


if __name__ == '__main__':
    main()
