# SPDX-License-Identifier: BSD-3-Clause
"""Publishes simulated time at 50 Hz: simulated_clock.py BEGIN_S SPEED (0 stands still)."""
from __future__ import annotations

import sys
import time

import rospy
from rosgraph_msgs.msg import Clock


def main() -> None:
    """Publish until it is ended."""
    begin_s, speed = map(float, sys.argv[1:3])
    rospy.init_node('simulated_clock', anonymous=True, disable_rostime=True)
    publisher = rospy.Publisher('/clock', Clock, queue_size=1)
    start_s = time.monotonic()
    while not rospy.is_shutdown():
        elapsed_s = time.monotonic() - start_s
        publisher.publish(rospy.Time.from_sec(begin_s + speed * elapsed_s))
        time.sleep(0.02)


if __name__ == '__main__':
    main()
