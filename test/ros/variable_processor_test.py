#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The variable processor with a real master: numbers of many types, stale and wrong data."""
from __future__ import annotations

import subprocess
import time
import unittest
from typing import Callable, Dict, List, Tuple

import genpy
import rospy
import rostest
from cloud_testing import Listener, log_listener, logged, wait_until
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import WrenchStamped
from rosgraph_msgs.msg import Log
from sensor_msgs.msg import Temperature
from std_msgs.msg import Bool, Float32, Float64, UInt8MultiArray
from visualization_msgs.msg import Marker, MarkerArray


class Odd(genpy.Message):
    """A message of a package that is not in the workspace."""

    _type, _md5sum, _has_header = 'odd_msgs/Odd', '0123456789abcdef0123456789abcdef', False
    _full_text = 'float32 data'
    __slots__ = ['data']
    _slot_types = ['float32']

    def serialize(self, buffer) -> None:
        """Write four bytes."""
        buffer.write(b'\x00\x00\x80\x3f')


def publisher(topic: str, message_class: type) -> rospy.Publisher:
    """Return a publisher that has its subscriber, the variable processor."""
    result = rospy.Publisher(topic, message_class, queue_size=10)
    wait_until(lambda: result.get_num_connections() > 0, f'a subscriber of {topic}')
    return result


def wrench(force_z: float) -> WrenchStamped:
    """Return a force [N]."""
    message = WrenchStamped()
    message.wrench.force.z = force_z
    return message


class VariableProcessorTest(unittest.TestCase):
    """Plays the sensors of an oven."""

    def setUp(self) -> None:
        self.listener = Listener('/oven/marker_array', MarkerArray)
        self.addCleanup(self.listener.__exit__)

    def markers(self) -> Dict[Tuple[str, int], Marker]:
        """Return what RViz would know of each marker."""
        return {(marker.ns, marker.id): marker for message in list(self.listener.messages)
                for marker in message.markers}

    def text(self, label: str) -> str:
        """Return the text of a variable without the blank lines of its block."""
        marker = self.markers().get((f'variable/{label}', 1))
        return marker.text.strip() if marker else ''

    def texts(self, label: str) -> List[str]:
        """Return all texts that there were of a variable."""
        return [marker.text.strip() for message in list(self.listener.messages)
                for marker in message.markers if (marker.ns, marker.id) == (f'variable/{label}', 1)]

    def arrow(self, label: str) -> Marker:
        """Return the arrow of a variable."""
        return self.markers()[f'variable/{label}', 0]

    def wait_for_text(self, label: str, text: str, send: Callable[[], None]) -> None:
        """Send until the text is there."""
        wait_until(lambda: self.text(label) == text, f'the text {text}', send)

    def test_two_variables_in_one_frame(self) -> None:
        temperature = publisher('/oven/temperature', Temperature)
        levels = publisher('/oven/levels', UInt8MultiArray)

        def send() -> None:
            temperature.publish(Temperature(temperature=45.5))
            levels.publish(UInt8MultiArray(data=b'\x01\x02\xfa'))
        self.wait_for_text('oven', 'oven 45.5 °C, 25.5 above 20', send)
        self.wait_for_text('level', 'level 250', send)
        oven, level = self.arrow('oven'), self.arrow('level')
        self.assertEqual((oven.type, oven.header.frame_id, oven.frame_locked),
                         (Marker.ARROW, 'oven/base', True))
        self.assertAlmostEqual(oven.scale.x, 0.255)
        self.assertAlmostEqual(level.scale.x, 0.25)
        texts = [self.markers()[f'variable/{label}', 1] for label in ('oven', 'level')]
        self.assertEqual(texts[0].pose, texts[1].pose)
        self.assertEqual([text.text.split('\n').index(' ') for text in texts], [1, 0])

    def test_below_the_offset_it_points_the_other_way(self) -> None:
        temperature = publisher('/oven/temperature', Temperature)
        self.wait_for_text('oven', 'oven -5.0 °C, 25.0 below 20',
                           lambda: temperature.publish(Temperature(temperature=-5.0)))
        turn = self.arrow('oven').pose.orientation  # x onto -z: a quarter about y
        for part, expected in zip((turn.x, turn.y, turn.z, turn.w), (0.0, 0.5**0.5, 0.0, 0.5**0.5)):
            self.assertAlmostEqual(part, expected, places=5)
        self.wait_for_text('oven', 'oven 20.0 °C, at 20',
                           lambda: temperature.publish(Temperature(temperature=20.0)))
        wait_until(lambda: self.arrow('oven').action == Marker.DELETE, 'no arrow at the offset')

    def test_a_field_of_a_group(self) -> None:
        press = publisher('/oven/press', WrenchStamped)
        self.wait_for_text('press', 'press -45.0 N', lambda: press.publish(wrench(-45.0)))
        turn = self.arrow('press').pose.orientation  # against -y: x onto y
        self.assertAlmostEqual(turn.z, 0.5**0.5, places=5)

    def test_text_only(self) -> None:
        door = publisher('/oven/door', Bool)
        self.wait_for_text('door open', 'door open 1', lambda: door.publish(True))
        self.wait_for_text('door open', 'door open 0', lambda: door.publish(False))
        self.assertEqual(self.arrow('door open').action, Marker.DELETE)

    def test_stopped_data_are_grey(self) -> None:
        stops = publisher('/oven/stops', Float64)
        self.wait_for_text('stops', 'stops 0.500 V', lambda: stops.publish(0.5))
        last_s = time.monotonic()
        wait_until(lambda: 'no data for' in self.text('stops'), 'stale data')
        self.assertLess(time.monotonic() - last_s, 3.0)  # on a busy machine; the node itself says
        self.assertIn('stops no data for 0.', ' '.join(self.texts('stops')))
        wait_until(lambda: self.text('stops').startswith('stops no data for 1.'), 'counting')
        color = self.arrow('stops').color
        self.assertTrue(color.r == color.g == color.b < 1.0)
        self.wait_for_text('stops', 'stops 0.250 V', lambda: stops.publish(0.25))
        self.assertEqual(self.arrow('stops').color.r, 1.0)

    def test_never_any_data(self) -> None:
        self.wait_for_text('never', 'never no data', lambda: None)

    def test_a_type_that_changes(self) -> None:
        first = publisher('/oven/changes', Float64)
        self.wait_for_text('changes', 'changes 0.750 V', lambda: first.publish(0.75))
        first.unregister()
        second = publisher('/oven/changes', Float32)
        self.wait_for_text('changes', 'changes -0.250 V', lambda: second.publish(-0.25))

    def test_wrong_field_is_named(self) -> None:
        with log_listener() as log:
            wrong = publisher('/oven/wrong', Temperature)
            wait_until(lambda: logged(log, Log.WARN, 'oven', '/oven/wrong', 'temprature',
                                      'header, temperature, variance', 'did you mean temperature?'),
                       'a warning', lambda: wrong.publish(Temperature()))
        self.wait_for_text('wrong', 'wrong no data', lambda: None)

    def test_unknown_type_is_named(self) -> None:
        with log_listener() as log:
            unknown = publisher('/oven/unknown', Odd)
            wait_until(lambda: logged(log, Log.WARN, 'oven', '/oven/unknown', 'odd_msgs/Odd'),
                       'a warning', lambda: unknown.publish(Odd()))
        self.wait_for_text('unknown', 'unknown no data', lambda: None)

    def test_nan_leaves_the_last_value(self) -> None:
        source = publisher('/oven/nan', Float32)
        self.wait_for_text('nan', 'nan 0.500 V', lambda: source.publish(0.5))
        with log_listener() as log:
            wait_until(lambda: logged(log, Log.WARN, 'oven', '/oven/nan', 'nan'), 'a warning',
                       lambda: source.publish(float('nan')))
        self.assertAlmostEqual(self.arrow('nan').scale.x, 0.5)
        self.wait_for_text('nan', 'nan 0.250 V', lambda: source.publish(0.25))

    def test_beyond_a_limit(self) -> None:
        watched = publisher('/oven/watched', Float32)
        with Listener('/diagnostics', DiagnosticArray) as diagnostics:
            def levels() -> List[int]:
                return [status.level for report in list(diagnostics.messages)
                        for status in report.status if 'limits of /oven/watched' in status.name]
            wait_until(lambda: DiagnosticStatus.ERROR in levels(), 'an alarm',
                       lambda: watched.publish(4.0))
            wait_until(lambda: levels()[-1] == DiagnosticStatus.OK, 'its end',
                       lambda: watched.publish(1.0))
        self.assertEqual(self.text('watched'), '')  # it is not shown

    def test_rate_of_the_markers(self) -> None:
        wait_until(lambda: bool(self.listener.messages), 'markers')
        before, begin_s = len(self.listener.messages), time.monotonic()
        rospy.sleep(2.0)
        arrived, duration_s = len(self.listener.messages) - before, time.monotonic() - begin_s
        self.assertLessEqual(arrived, 32 * duration_s)

    def test_wrong_parameters_end_the_node(self) -> None:
        node = subprocess.run(
            ['rosrun', 'process_visualizer', 'variable_proc', '__ns:=bad',
             '_variables:=[{topic: /a, frame: f, scale: long}]'],
            stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=30, check=False)
        self.assertEqual(node.returncode, 1)
        self.assertIn("/bad/variable_proc/variables[0]/scale: a number is expected, not 'long'",
                      node.stdout)
        self.assertEqual(len(node.stdout.strip().splitlines()), 1, node.stdout)


if __name__ == '__main__':
    rospy.init_node('variable_processor_test')
    rostest.rosrun('process_visualizer', 'variable_processor_test', VariableProcessorTest)
