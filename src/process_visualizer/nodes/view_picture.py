# SPDX-License-Identifier: BSD-3-Clause
"""Waits until RViz shows everything, and takes a picture of the screen."""
from __future__ import annotations

import argparse
import subprocess
import sys
import threading
import time

import rosgraph
import rospy
from diagnostic_msgs.msg import DiagnosticArray

from process_visualizer.clients.rviz_view import DrawnView
from process_visualizer.ros_names import DISPLAY_STATUS_TOPIC

_MASTER_PERIOD_S = 0.2


class ViewWatcher(DrawnView):
    """Follows RViz's reports; needs an initialized rospy node."""

    def __init__(self) -> None:
        super().__init__()
        self._subscriber = rospy.Subscriber(DISPLAY_STATUS_TOPIC, DiagnosticArray, self.take)


def wait_for_master(timeout_s: float) -> bool:
    """Wait until the master answers, by asking five times a second, as nothing announces it."""
    asked = threading.Event()
    deadline = time.monotonic() + timeout_s
    while not rosgraph.is_master_online():
        if time.monotonic() > deadline:
            return False
        asked.wait(_MASTER_PERIOD_S)
    return True


def save_picture(path: str) -> None:
    """Save the whole screen ($DISPLAY) with ImageMagick.

    Raises:
        CalledProcessError: ImageMagick fails.
    """
    subprocess.run(['import', '-silent', '-window', 'root', path], check=True)


def main() -> int:
    """Run the command ``view_picture``; return its exit code."""
    parser = argparse.ArgumentParser(prog='view_picture', description=__doc__)
    parser.add_argument('picture', help='file to write, such as cell.png')
    parser.add_argument('--timeout', type=float, default=90.0, help='seconds to wait (%(default)s)')
    parser.add_argument('--delay', type=float, default=0.0,
                        help='seconds between the whole view and the picture (%(default)s)')
    options = parser.parse_args(rospy.myargv()[1:])
    if not wait_for_master(options.timeout):
        print(f'view_picture: no ROS master at {rosgraph.get_master_uri()}', file=sys.stderr)
        return 1
    rospy.init_node('view_picture', anonymous=True, disable_signals=True)
    watcher = ViewWatcher()
    drawn = watcher.wait_until_drawn(options.timeout)
    if drawn:
        time.sleep(options.delay)
    try:
        save_picture(options.picture)
    except (OSError, subprocess.CalledProcessError) as error:
        print(f'view_picture: cannot save {options.picture}: {error}', file=sys.stderr)
        return 1
    for problem in [] if drawn else watcher.problems():
        print(f'view_picture: {problem}', file=sys.stderr)
    return 0 if drawn else 1
