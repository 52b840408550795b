#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Every generated display type of RViz subscribes, receives messages and draws them."""
from __future__ import annotations

import contextlib
import os
import re
import subprocess
import tempfile
import unittest
from typing import Callable, Dict, Iterator, List
from xmlrpc.client import ServerProxy

import rosgraph
import rospkg
import rospy
import rostest
from cloud_testing import Listener
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from display_data import DisplayData
from display_places import DEVICE, ORIGIN, ROBOT, drawn_pixels, frames, topic, view_text
from surroundings import SOFTWARE_GRAPHICS, virtual_screen
from tf2_ros import StaticTransformBroadcaster

from process_visualizer.cell.elements import DISPLAY_TYPES
from process_visualizer.nodes.view_picture import save_picture
from process_visualizer.ros_names import DISPLAY_STATUS_TOPIC

WITHIN_S = 120.0
WITH_TOPIC = [name for name, it in DISPLAY_TYPES.items() if it.message_type]
MIN_PIXELS = 5
"""The arrows of Debian 13's RViz have 8 to 10 pixels."""
UNDRAWN_BEFORE_1_14_5 = ('AccelStamped', 'TwistStamped', 'WrenchStamped')
"""RViz 1.14.4 of Debian 11 receives them, reports no error, and draws nothing."""
SAYS = {  # the status by which a display reports a received message
    'RobotModel': ('robotmodel', 'Ok: '), 'TF': ('tf', 'Ok: Transform OK'),
    'Map': ('Message', 'Ok: Map received'), 'Camera': ('Image', r'Ok: [1-9]\d* images received'),
    'Image': ('Image', r'Ok: [1-9]\d* images received'),
    'DepthCloud': ('Depth Map', r'Ok: [1-9]\d* depth maps received'),
    **{name: ('Topic', r'Ok: [1-9]\d* messages received') for name in WITH_TOPIC
       if DISPLAY_TYPES[name].topic_key == 'Topic' and name != 'Map'}}

Report = Dict[str, DiagnosticStatus]


@contextlib.contextmanager
def rviz(view: str) -> Iterator[None]:
    """RViz on a screen of its own, of which this process can take pictures."""
    with virtual_screen() as screen:
        os.environ['DISPLAY'] = screen
        environment = {**os.environ, **SOFTWARE_GRAPHICS, 'DISABLE_ROS1_EOL_WARNINGS': '1'}
        command = ['rosrun', 'process_visualizer', 'rviz', '-d', view, '__name:=rviz']
        process = subprocess.Popen(command, env=environment)
        try:
            yield
        finally:
            process.terminate()
            process.wait()


def values(status: DiagnosticStatus) -> Dict[str, str]:
    """Return a status' values by key."""
    return {pair.key: pair.value for pair in status.values}


def says_received(name: str, report: Report) -> bool:
    """Return whether the display's status reports a received message."""
    entry, pattern = SAYS.get(name, ('enabled', 'true'))
    return re.match(pattern, values(report[name]).get(entry, '')) is not None


class Reports:
    """RViz's reports of its displays."""

    def __init__(self, listener: Listener) -> None:
        self._listener = listener

    def newest(self) -> Report:
        """Return the newest report by display; {} before the first."""
        messages: List[DiagnosticArray] = self._listener.messages
        return {status.name: status for status in messages[-1].status} if messages else {}

    def wait(self, condition: Callable[[Report], bool]) -> Report:
        """Return the first report that fulfills the condition, or the last one in time."""
        with Listener.heard:
            Listener.heard.wait_for(lambda: bool(self.newest()) and condition(self.newest()),
                                    WITHIN_S)
        return self.newest()

    def stand_still(self) -> bool:
        """Return whether nothing is drawn from the next report to the third one after it."""
        begin, messages = len(self._listener.messages), self._listener.messages
        with Listener.heard:
            Listener.heard.wait_for(lambda: len(messages) >= begin + 4, WITHIN_S)
        frames = [values(status)['frames'] for message in messages[begin:]
                  for status in message.status if status.name == 'rviz']
        return len(frames) >= 4 and len(set(frames)) == 1

    def wait_for_frames(self) -> None:
        """Wait until everything that has been reported is drawn."""
        first = int(values(self.newest()['rviz'])['frames'])
        self.wait(lambda report: int(values(report['rviz'])['frames']) > first + 5)


class RvizDisplaysTest(unittest.TestCase):
    """One RViz with all displays, before and after messages are published for them."""

    silent: Report
    shown: Report
    silent_pixels: Dict[str, int]
    shown_pixels: Dict[str, int]
    received: Dict[str, int]

    @classmethod
    def setUpClass(cls) -> None:
        with contextlib.ExitStack() as stack:
            folder = stack.enter_context(tempfile.TemporaryDirectory())
            broadcaster = StaticTransformBroadcaster()
            robot_less = [it for it in frames() if it.child_frame_id != 'robotmodel']
            broadcaster.sendTransform(robot_less)
            rospy.set_param(topic('RobotModel'), ROBOT)
            with open(f'{folder}/all.rviz', 'w', encoding='utf-8') as file:
                file.write(view_text(folder))
            stack.enter_context(rviz(f'{folder}/all.rviz'))
            reports = Reports(stack.enter_context(Listener(DISPLAY_STATUS_TOPIC, DiagnosticArray)))
            cls._look(reports, broadcaster, f'{folder}/view.png')

    @classmethod
    def _look(cls, reports: Reports, broadcaster: StaticTransformBroadcaster,
              picture: str) -> None:
        reports.wait(lambda report: all(name in report for name in DISPLAY_TYPES))
        reports.wait_for_frames()
        cls.silent = reports.newest()
        save_picture(picture)
        cls.silent_pixels = drawn_pixels(picture)
        broadcaster.sendTransform(frames())
        data = DisplayData(f'/{DEVICE}')
        cls.shown = reports.wait(lambda report: all(
            report[name].level == DiagnosticStatus.OK and says_received(name, report)
            for name in DISPLAY_TYPES))
        reports.wait_for_frames()
        cls.received = received_messages()
        save_picture(picture)
        cls.shown_pixels = drawn_pixels(picture)
        data.close()

    def test_says_that_nothing_was_received(self) -> None:
        for name in WITH_TOPIC:
            with self.subTest(name):
                if name == 'InteractiveMarkers':  # RViz waits silently for a server
                    continue
                self.assertEqual(self.silent[name].level, DiagnosticStatus.WARN, self.silent[name])
                self.assertRegex(self.silent[name].message, '(?i): no .+ received')

    def test_nothing_is_drawn_of_what_was_not_received(self) -> None:
        for name in WITH_TOPIC:
            with self.subTest(name):
                self.assertLess(self.silent_pixels[name], MIN_PIXELS)

    def test_a_link_without_a_place_is_not_drawn(self) -> None:
        for name in ('RobotModel', ORIGIN):
            with self.subTest(name):
                self.assertLess(self.silent_pixels[name], MIN_PIXELS)

    def test_receives_messages(self) -> None:
        for name in WITH_TOPIC:
            with self.subTest(name):
                self.assertGreater(self.received.get(topic(name), 0), 0)

    def test_status_says_so(self) -> None:
        for name in DISPLAY_TYPES:
            with self.subTest(name):
                self.assertTrue(says_received(name, self.shown), self.shown[name])
                self.assertEqual(self.shown[name].level, DiagnosticStatus.OK, self.shown[name])

    def test_draws_at_its_place(self) -> None:
        version = tuple(map(int, rospkg.RosPack().get_manifest('rviz').version.split('.')))
        undrawn = UNDRAWN_BEFORE_1_14_5 if version < (1, 14, 5) else ()
        for name in DISPLAY_TYPES:
            with self.subTest(name):
                if name in undrawn:
                    continue
                self.assertGreaterEqual(self.shown_pixels[name], MIN_PIXELS)


def received_messages() -> Dict[str, int]:
    """Return the number of messages that RViz has received by topic, as its node reports it."""
    uri = rosgraph.Master('/rviz_displays_test').lookupNode('/rviz')
    subscriptions = ServerProxy(uri).getBusStats('/rviz_displays_test')[1]
    return {name: sum(link[2] for link in links) for name, links in subscriptions}


if __name__ == '__main__':
    rospy.init_node('rviz_displays_test')
    rostest.rosrun('process_visualizer', 'rviz_displays_test', RvizDisplaysTest)
