# SPDX-License-Identifier: BSD-3-Clause
"""Waits until RViz shows everything, and takes a picture of the screen."""
from __future__ import annotations

import argparse
import subprocess
import sys
import threading
import time
from typing import Dict, List, Optional

import rosgraph
import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus

from process_visualizer.ros_names import DISPLAY_STATUS_TOPIC

_MASTER_PERIOD_S = 0.2
_FRAMES_AFTER_OK = 5
"""Frames that must have been drawn since every display is OK: a second of a software renderer."""


class ViewWatcher:
    """Follows RViz's report on its displays (published by the display DisplayStatus)."""

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._report: Optional[DiagnosticArray] = None
        self._frames_when_ok: Optional[int] = None
        self._subscriber = rospy.Subscriber(DISPLAY_STATUS_TOPIC, DiagnosticArray, self._take)

    def wait_until_drawn(self, timeout_s: float) -> bool:
        """Wait until all displays are OK and were drawn five times."""
        with self._changed:
            return self._changed.wait_for(self._is_drawn, timeout_s)

    def wait_until_ok(self, timeout_s: float) -> bool:
        """Wait until all displays are OK."""
        with self._changed:
            return self._changed.wait_for(lambda: self._frames_when_ok is not None, timeout_s)

    def problems(self) -> List[str]:
        """The displays that are not OK, one line for each."""
        with self._changed:
            if self._report is None:
                return [f'nothing was received on {DISPLAY_STATUS_TOPIC}: is RViz running '
                        'with a generated configuration?']
            return [f'{status.name}: {status.message}' for status in self._report.status
                    if status.level != DiagnosticStatus.OK]

    def _take(self, report: DiagnosticArray) -> None:
        with self._changed:
            self._report = report
            all_ok = all(status.level == DiagnosticStatus.OK for status in report.status)
            if not all_ok:
                self._frames_when_ok = None
            elif self._frames_when_ok is None:
                self._frames_when_ok = self._frames()
            self._changed.notify_all()

    def _is_drawn(self) -> bool:
        return (self._frames_when_ok is not None
                and self._frames() >= self._frames_when_ok + _FRAMES_AFTER_OK)

    def _frames(self) -> int:
        if self._report is None:
            return 0
        values: Dict[str, str] = {item.key: item.value for item in self._report.status[0].values}
        return int(values['frames'])


def wait_for_master(timeout_s: float) -> bool:
    """Wait until the master answers; nothing announces it, so ask five times a second."""
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
    """The command ``view_picture``; returns its exit code."""
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
