# SPDX-License-Identifier: BSD-3-Clause
"""Makes a cell, and a recording of a person who walks in: FOLDER CLOUDS.

The standard input is the line printed by walk_in_clouds.
"""
from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import rosbag
import rospy
from sensor_msgs.msg import JointState, PointCloud2, PointField
from std_msgs.msg import Header

from process_visualizer.robot.rotations import ypr_from_matrix

RATE_HZ, BEGIN_S, LATE_S = 10.0, 1.8e9, 0.04
FIELDS = [PointField(name, 4 * number, PointField.FLOAT32, 1) for number, name in enumerate('xyz')]
JOINTS = [f'j{number}' for number in range(6)]


def main() -> None:
    """Write cell.xml and walk_in.bag beside arm.urdf in the folder."""
    width, height, *pose = map(float, sys.stdin.read().split())  # ends when everything is written
    folder, clouds = Path(sys.argv[1]), np.fromfile(sys.argv[2], np.float32)
    matrix = np.reshape(pose, (3, 4))
    xyz = ' '.join(f'{it:.6f}' for it in matrix[:, 3])
    ypr = ' '.join(f'{it:.6f}' for it in ypr_from_matrix(matrix[:, :3]))
    (folder / 'cell.xml').write_text(
        '<visualizer><device type="robot" name="arm"><model path="arm.urdf"/>'
        '<base frame="l0" xyz="0 0 0"/><topic name="joint_states" type="joint_states"/></device>'
        f'<device type="depth_sensor" name="kinect"><base frame="eye" xyz="{xyz}" ypr="{ypr}"/>'
        '<topic ns="kinect" name="cloud" type="pointcloud"/>'
        '<objects warn="1.0" stop="0.5" xyz="0 0 1.05" size="3.6 3.6 2.3"/></device></visualizer>')
    frames = clouds.reshape(-1, 1 + 3 * int(width * height))
    with rosbag.Bag(str(folder / 'walk_in.bag'), 'w') as bag:
        for number, frame in enumerate(frames):
            stamp = rospy.Time.from_sec(BEGIN_S + number / RATE_HZ)
            bag.write('/joint_states', JointState(Header(stamp=stamp), JOINTS, [frame[0]] * 6,
                                                  [], []), stamp)
            bag.write('/kinect/cloud', PointCloud2(
                Header(stamp=stamp, frame_id='eye'), int(height), int(width), FIELDS, False, 12,
                12 * int(width), frame[1:].tobytes(), False),
                stamp + rospy.Duration.from_sec(LATE_S))


if __name__ == '__main__':
    main()
