# SPDX-License-Identifier: BSD-3-Clause
"""Plays the drivers of the upper robot for a picture: moving, standing still, or pressed by a hand.

usage: robot_situation.py moving|standing|pressed    (until it is ended)
"""
from __future__ import annotations

import sys

import numpy as np
import rospy
from std_msgs.msg import Float32MultiArray

from sewing_cell.layout import UPPER

CENTER_M = np.array([-0.55, 0.25, 0.25])
RADIUS_M, SPEED_M_PER_S = 0.12, 0.25
FORCES_N = {'moving': (0.0, 0.0, 0.0), 'standing': (0.1, -0.1, 0.1),
            'pressed': (45.0 * np.cos(2.5), 45.0 * np.sin(2.5), 0.0)}


def main() -> None:
    """Publish joints, tool frame and force at 125 Hz: a circle at constant speed, or its center."""
    situation = sys.argv[1]
    rospy.init_node('robot_situation', anonymous=True)
    joints, tool, force = (rospy.Publisher(topic, Float32MultiArray, queue_size=10) for topic in (
        '/ur_rt_upper/q_act', '/ur_rt_upper/tcf', '/ft_upper/ft'))
    rate = rospy.Rate(125)
    while not rospy.is_shutdown():
        position = CENTER_M.copy()
        if situation == 'moving':
            angle = rospy.get_time() * SPEED_M_PER_S / RADIUS_M
            position += RADIUS_M * np.array([np.cos(angle), np.sin(angle), 0.0])
        joints.publish(data=UPPER.joints(position).tolist())
        tool.publish(data=[*UPPER.to_base(position), *UPPER.tool_vector])
        wrench = UPPER.to_force_frame(np.array(FORCES_N[situation]))
        force.publish(data=[*wrench, 0.0, 0.0, 0.0])
        try:
            rate.sleep()
        except rospy.ROSInterruptException:
            return


if __name__ == '__main__':
    main()
