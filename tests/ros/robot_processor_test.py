#!/usr/bin/env python3
"""The robot processor with a real master: right numbers, bad input, playback rate, wrong start."""
from __future__ import annotations

import subprocess
import time
import unittest
from typing import Any, Callable, Dict, List, Sequence, Tuple

import numpy as np
import rospy
import rostest
import tf2_ros
from cloud_testing import TIMEOUT_S, Listener, log_listener, logged, wait_until
from geometry_msgs.msg import (
    PoseStamped,
    TransformStamped,
    TwistStamped,
    WrenchStamped,
)
from rosgraph_msgs.msg import Log
from sensor_msgs.msg import JointState
from std_msgs.msg import Float32MultiArray, String
from visualization_msgs.msg import Marker, MarkerArray

from process_visualizer.motion.rotations import rotated
from process_visualizer.msg import PlayerState

RATE_PARAMETER = '/process_visualizer/playback_rate'


def array(*values: float) -> Float32MultiArray:
    """Return the thesis' message for a quantity."""
    return Float32MultiArray(data=values)


def publisher(topic: str, message_class: type) -> rospy.Publisher:
    """Return a publisher that has its subscriber, the robot processor."""
    result = rospy.Publisher(topic, message_class, queue_size=10)
    wait_until(lambda: result.get_num_connections() > 0, f'a subscriber of {topic}')
    return result


def move(tool: rospy.Publisher, speed_m_per_s: float, duration_s: float) -> None:
    """Publish the pose of a tool that points down and moves along +y of the base, at 125 Hz."""
    end_s = time.monotonic() + duration_s
    move_while(lambda: time.monotonic() < end_s, tool, speed_m_per_s)


def move_while(condition: Callable[[], bool], tool: rospy.Publisher, speed_m_per_s: float) -> None:
    """The same, as long as a condition holds."""
    rate, start_s = rospy.Rate(125), time.monotonic()
    while condition():
        y = speed_m_per_s * (time.monotonic() - start_s)
        tool.publish(array(-0.6, y, 0.2, np.pi, 0.0, 0.0))
        rate.sleep()


def median_velocity(listener: Listener) -> np.ndarray:
    """Return the middle of the last velocities that were published."""
    linear = [message.twist.linear for message in listener.messages[-80:]]
    return np.median([[part.x, part.y, part.z] for part in linear], axis=0)


def arrow_foot(buffer: tf2_ros.Buffer, arrow: Marker) -> List[float]:
    """Return where RViz draws the foot of an arrow now, in the base frame."""
    found = buffer.lookup_transform('r/link0', arrow.header.frame_id, arrow.header.stamp).transform
    turn, place, foot = found.rotation, found.translation, arrow.pose.position
    turned = rotated((turn.x, turn.y, turn.z, turn.w), (foot.x, foot.y, foot.z))
    return [turned[0] + place.x, turned[1] + place.y, turned[2] + place.z]


def player_state(position_s: float, rate: float, segment: int, paused: bool = False
                 ) -> PlayerState:
    """Return what a player says now."""
    return PlayerState(stamp=rospy.Time.now(), position=position_s, rate=rate, segment=segment,
                       paused=paused)


def play(states: rospy.Publisher, tool: rospy.Publisher, position_s: float, rate: float,
         segment: int) -> float:
    """Play 2 s (wall) of a tool that moves at 0.1 m/s along +y; return the position [s]."""
    start_s, ticker, tick = time.monotonic(), rospy.Rate(125), 0
    now_s = position_s
    while time.monotonic() < start_s + 2.0:
        now_s = position_s + rate * (time.monotonic() - start_s)
        if tick % 10 == 0:
            states.publish(player_state(now_s, rate, segment))
        tool.publish(array(-0.6, 0.1 * now_s, 0.2, np.pi, 0.0, 0.0))
        ticker.sleep()
        tick += 1
    return now_s


def transform(parent: str, child: str, x: float, z: float) -> TransformStamped:
    """Return a transform of now without rotation."""
    message = TransformStamped(child_frame_id=child)
    message.header.frame_id, message.header.stamp = parent, rospy.Time.now()
    message.transform.translation.x, message.transform.translation.z = x, z
    message.transform.rotation.w = 1.0
    return message


def last_markers(listener: Listener) -> Dict[Tuple[str, int], Marker]:
    """Return what RViz would know of each marker."""
    return {(marker.ns, marker.id): marker
            for message in list(listener.messages) for marker in message.markers}


def tool_position(buffer: tf2_ros.Buffer) -> List[float]:
    """Return where the tool is in tf; far away before it is there."""
    if not buffer.can_transform('r/link0', 'r/tool', rospy.Time()):
        return [np.inf] * 3
    position = buffer.lookup_transform('r/link0', 'r/tool', rospy.Time()).transform.translation
    return [position.x, position.y, position.z]


class RobotProcessorTest(unittest.TestCase):
    """Plays the drivers of two robots."""

    def setUp(self) -> None:
        rospy.set_param(RATE_PARAMETER, 1.0)

    def test_joint_states_move_the_model(self) -> None:
        joints = publisher('/r/q_act', Float32MultiArray)
        buffer = tf2_ros.Buffer()
        tf2_ros.TransformListener(buffer)
        with Listener('/r/joint_states', JointState) as states:
            start = rospy.Time.now()
            wait_until(lambda: bool(states.messages)
                       and np.allclose(tool_position(buffer), [0.0, 0.75, 0.3], atol=1e-6),
                       'the tool in tf', lambda: joints.publish(array(np.pi / 2, 0.25)))
            state = states.messages[-1]
        self.assertEqual(state.name, ['r/turn', 'r/slide'])
        np.testing.assert_allclose(state.position, [np.pi / 2, 0.25], atol=1e-6)
        self.assertTrue(start <= state.header.stamp <= rospy.Time.now())

    def test_velocity_of_a_moving_tool(self) -> None:
        tool = publisher('/r/tcf', Float32MultiArray)
        with Listener('/r/tool_velocity', TwistStamped) as velocities, \
                Listener('/r/marker_array', MarkerArray) as arrays:
            move(tool, 0.1, 2.0)
            markers = last_markers(arrays)
            arrived = len(arrays.messages)
        np.testing.assert_allclose(median_velocity(velocities), [0.0, 0.1, 0.0], atol=0.005)
        self.assertEqual(velocities.messages[-1].header.frame_id, 'r/link0')
        self.assertLessEqual(arrived, 66)  # 30 Hz
        arrow = markers['velocity', 0]
        self.assertEqual((arrow.header.frame_id, arrow.frame_locked), ('r/tool', True))
        rotation = arrow.pose.orientation  # the tool's y axis is against the base's
        np.testing.assert_allclose([rotation.x, rotation.y, rotation.z, rotation.w],
                                   [0.0, 0.0, -np.sqrt(0.5), np.sqrt(0.5)], atol=0.02)
        self.assertRegex(markers['velocity', 1].text, r'^v 0\.1\d\d m/s|^v 0\.09\d m/s')

    def test_standing_tool_has_no_arrow_and_a_stopped_driver_is_shown(self) -> None:
        tool = publisher('/r/tcf', Float32MultiArray)
        with Listener('/r/marker_array', MarkerArray) as arrays:
            move(tool, 0.0, 1.0)
            markers = last_markers(arrays)
            self.assertEqual(markers['velocity', 0].action, Marker.DELETE)
            self.assertIn('v 0.000 m/s', markers['velocity', 1].text)
            wait_until(lambda: 'v no data for 2' in last_markers(arrays)['velocity', 1].text,
                       'a text that says since when there is no data')

    def test_stopped_drivers_are_shown_within_a_second(self) -> None:
        joints, tool = publisher('/r/q_act', Float32MultiArray), publisher('/r/tcf',
                                                                           Float32MultiArray)
        grey_s: Dict[str, float] = {}

        def note(message: MarkerArray) -> None:
            for marker in message.markers:
                grey = marker.color.r == marker.color.g == marker.color.b
                told = marker.type == Marker.ARROW or 'no data for' in marker.text
                if grey and told and marker.ns in ('velocity', 'joints'):
                    grey_s.setdefault(f'{marker.ns} {marker.type}', time.monotonic())
        subscriber = rospy.Subscriber('/r/marker_array', MarkerArray, note)
        for _ in range(3):
            joints.publish(array(0.1, 0.2))
            move(tool, 0.1, 0.7)
            joints.publish(array(0.1, 0.2))
            grey_s.clear()
            last_s = time.monotonic()
            wait_until(lambda: len(grey_s) == 3, 'the grey arrow, its number, and the joints')
            self.assertLess(max(grey_s.values()) - last_s, 1.0, grey_s)
            self.assertGreater(min(grey_s.values()) - last_s, 0.5, grey_s)
        subscriber.unregister()

    def test_arrow_and_tool_are_at_one_place_at_every_moment(self) -> None:
        joints, tool = publisher('/r/q_act', Float32MultiArray), publisher('/r/tcf',
                                                                           Float32MultiArray)
        buffer = tf2_ros.Buffer()
        tf2_ros.TransformListener(buffer)
        distances: List[float] = []

        def measure(message: MarkerArray) -> None:
            arrow = message.markers[0]
            if arrow.ns == 'velocity' and np.isfinite(tool_position(buffer)[0]):
                foot = np.array(arrow_foot(buffer, arrow))
                distances.append(float(np.linalg.norm(foot - tool_position(buffer))))

        subscriber = rospy.Subscriber('/r/marker_array', MarkerArray, measure)
        rate = rospy.Rate(125)
        for step in range(400):
            joints.publish(array(step * 0.01, 0.25))
            tool.publish(array(0.75 * np.cos(step * 0.01), 0.75 * np.sin(step * 0.01), 0.3,
                               0.0, 0.0, step * 0.01))
            rate.sleep()
        subscriber.unregister()
        self.assertGreater(len(distances), 50)
        # tf may bring one state (12 mm) between the two look-ups of this test.
        self.assertLess(np.quantile(distances, 0.9), 1e-9)

    def test_angular_velocity(self) -> None:
        tool = publisher('/r/tcf', Float32MultiArray)
        rate, start_s = rospy.Rate(125), time.monotonic()
        with Listener('/r/tool_velocity', TwistStamped) as velocities:
            while time.monotonic() < start_s + 1.5:
                tool.publish(array(0.5, 0.0, 0.2, 0.0, 0.0, 0.8 * (time.monotonic() - start_s)))
                rate.sleep()
        found = [message.twist.angular.z for message in velocities.messages[-80:]]
        self.assertAlmostEqual(float(np.median(found)), 0.8, delta=0.04)
        age = velocities.messages[-1].header.stamp.to_sec()
        self.assertLess(age, rospy.get_time() - 0.03)  # the middle of the window

    def test_tool_frame_from_tf(self) -> None:
        static, moving = tf2_ros.StaticTransformBroadcaster(), tf2_ros.TransformBroadcaster()
        static.sendTransform(transform('f/flange', 'f/tip', 0.0, 0.25))
        rate, start_s = rospy.Rate(60), time.monotonic()
        with Listener('/f/tool_velocity', TwistStamped) as velocities, \
                Listener('/f/marker_array', MarkerArray) as arrays:
            while time.monotonic() < start_s + 3.0:
                moving.sendTransform(transform('f/base', 'f/flange',
                                               0.1 * (time.monotonic() - start_s), 0.0))
                rate.sleep()
        np.testing.assert_allclose(median_velocity(velocities), [0.1, 0.0, 0.0], atol=0.005)
        self.assertEqual(velocities.messages[-1].header.frame_id, 'f/base')
        self.assertEqual(last_markers(arrays)['velocity', 0].header.frame_id, 'f/tool')

    def test_playback_follows_the_player(self) -> None:
        tool = publisher('/p/tcf', Float32MultiArray)
        states = publisher('/p/player_state', PlayerState)
        position, segment = 10.0, 0
        with Listener('/p/tool_velocity', TwistStamped) as velocities:
            for rate in (0.5, 4.0, -1.0):
                del velocities.messages[:]
                position = play(states, tool, position, rate, segment)
                np.testing.assert_allclose(median_velocity(velocities), [0.0, 0.1, 0.0],
                                           atol=0.01)
            del velocities.messages[:]
            play(states, tool, 500.0, 1.0, 1)
        speeds = [abs(message.twist.linear.y) for message in velocities.messages]
        self.assertLess(max(speeds), 0.3)  # 49 m away within a moment, and no spike

    def test_data_is_not_stale_while_playback_is_paused(self) -> None:
        tool = publisher('/p/tcf', Float32MultiArray)
        states = publisher('/p/player_state', PlayerState)
        with Listener('/p/marker_array', MarkerArray) as arrays:
            position = play(states, tool, 10.0, 1.0, 2)
            rate, paused_s = rospy.Rate(20), time.monotonic()
            while time.monotonic() < paused_s + 2.5:
                states.publish(player_state(position, 1.0, 2, paused=True))
                rate.sleep()
            self.assertRegex(last_markers(arrays)['velocity', 1].text, r'^v 0\.\d\d\d m/s')
            wait_until(lambda: 'no data' in last_markers(arrays)['velocity', 1].text,
                       'a stale velocity once the player is gone')

    def test_joint_states_that_stop_are_shown(self) -> None:
        joints = publisher('/p/joints', JointState)
        with Listener('/p/marker_array', MarkerArray) as arrays:
            joints.publish(JointState(name=['a'], position=[0.5]))
            wait_until(lambda: ('joints', 1) in last_markers(arrays)
                       and 'joints no data for' in last_markers(arrays)['joints', 1].text,
                       'a text that there are no joint states')
            wait_until(lambda: last_markers(arrays)['joints', 1].action == Marker.DELETE,
                       'the end of the text', lambda: joints.publish(
                           JointState(name=['a'], position=[0.5])))

    def test_every_joint_state_of_a_slow_driver_and_the_last_of_a_fast_one(self) -> None:
        joints = publisher('/s/joints', JointState)
        with Listener('/s/joint_states', JointState) as states:
            rate, start_s = rospy.Rate(500), time.monotonic()
            for step in range(1000):
                joints.publish(JointState(name=['b'], position=[step * 1e-3]))
                rate.sleep()
            wait_until(lambda: bool(states.messages)
                       and states.messages[-1].position[0] == 0.999, 'the last joint state')
            self.assertLess(len(states.messages), 44 * (time.monotonic() - start_s) + 2)
            del states.messages[:]
            rate = rospy.Rate(20)
            for _ in range(20):
                joints.publish(JointState(name=['b'], position=[0.5]))
                rate.sleep()
            wait_until(lambda: len(states.messages) == 20, 'every joint state')

    def test_stamps_that_stand_still_are_named(self) -> None:
        pose, sent = publisher('/s/pose', PoseStamped), PoseStamped()
        sent.header.frame_id, sent.pose.orientation.w = 'base', 1.0
        sent.header.stamp = rospy.Time.now()
        with log_listener() as log:
            for _ in range(3):
                pose.publish(sent)
            wait_until(lambda: logged(log, Log.WARN, 's: ', '/s/pose', 'stamp'),
                       'a warning about the stamps', lambda: pose.publish(sent))

    def test_force(self) -> None:
        force = publisher('/ft/ft', Float32MultiArray)
        with Listener('/r/tool_force', WrenchStamped) as wrenches, \
                Listener('/r/marker_array', MarkerArray) as arrays:
            wait_until(lambda: ('force', 1) in last_markers(arrays) and bool(wrenches.messages),
                       'a force', lambda: force.publish(array(0.0, 0.0, 45.0, 0.1, 0.2, 0.3)))
            markers = last_markers(arrays)
        wrench = wrenches.messages[-1]
        self.assertEqual(wrench.header.frame_id, 'r/force')
        self.assertEqual((wrench.wrench.force.z, round(wrench.wrench.torque.y, 6)), (45.0, 0.2))
        self.assertEqual(markers['force', 0].header.frame_id, 'r/force')
        self.assertAlmostEqual(markers['force', 0].scale.x, 0.6)  # the upper limit
        self.assertIn('F 45.0 N', markers['force', 1].text)

    def test_playback_rate_scales_the_time_while_it_changes(self) -> None:
        tool = publisher('/r/tcf', Float32MultiArray)
        with Listener('/r/tool_velocity', TwistStamped) as velocities:
            for rate in (2.0, -1.0, 0.5):
                rospy.set_param(RATE_PARAMETER, rate)
                velocities.messages.clear()
                # 1.5 s; on a loaded machine longer, as the last 80 are to be of this rate
                end_s = time.monotonic() + TIMEOUT_S
                move_while(lambda at=end_s: len(velocities.messages) < 187
                           and time.monotonic() < at, tool, 0.1)
                self.assertAlmostEqual(median_velocity(velocities)[1], 0.1 / rate, delta=0.02)

    def test_bad_input_is_named_and_left_out(self) -> None:
        joints = publisher('/r/q_act', Float32MultiArray)
        bad: List[Tuple[Any, str]] = [
            (array(0.1), '2 values are expected'), (array(float('nan'), 0.0), 'NaN'),
            (array(), '2 values are expected')]
        with log_listener() as log, Listener('/r/joint_states', JointState) as states:
            for message, problem in bad:
                wait_until(lambda p=problem: logged(log, Log.WARN, 'r: ', '/r/q_act', p),
                           f'a warning: {problem}', lambda m=message: joints.publish(m))
                log.messages.clear()
            wait_until(lambda: any(it.position == (np.float32(0.1), np.float32(0.2))
                                   for it in list(states.messages)), 'joint states',
                       lambda: joints.publish(array(0.1, 0.2)))
            for state in states.messages:  # one of the test before may still be on its way
                self.assertEqual(len(state.position), 2)
                self.assertTrue(np.isfinite(state.position).all())

    def test_joint_arrays_without_their_padding(self) -> None:
        joints = publisher('/r/q_act', Float32MultiArray)
        padded = array(9.0, 0.3, 0.15)
        padded.layout.data_offset = 1
        with Listener('/r/joint_states', JointState) as states:
            wait_until(lambda: any(it.position == (np.float32(0.3), np.float32(0.15))
                                   for it in list(states.messages)), 'joint states',
                       lambda: joints.publish(padded))

    def test_standard_messages(self) -> None:
        joints = publisher('/s/joints', JointState)
        pose, wrench = publisher('/s/pose', PoseStamped), publisher('/s/wrench', WrenchStamped)
        sent_pose, sent_wrench = PoseStamped(), WrenchStamped()
        sent_pose.header.frame_id = 'base'
        sent_pose.pose.orientation.w = 1.0
        sent_wrench.wrench.force.x = 3.0

        def send() -> None:
            joints.publish(JointState(name=['b', 'other', 'a'], position=[0.5, 7.0, 1.0]))
            pose.publish(sent_pose)
            wrench.publish(sent_wrench)

        with Listener('/s/joint_states', JointState) as states, \
                Listener('/s/marker_array', MarkerArray) as arrays, \
                Listener('/s/tool_force', WrenchStamped) as forces:
            wait_until(lambda: ('velocity', 1) in last_markers(arrays)
                       and ('force', 0) in last_markers(arrays) and bool(states.messages)
                       and bool(forces.messages), 'everything', send)
        self.assertEqual((states.messages[0].name, list(states.messages[0].position)),
                         (['s/b', 's/a'], [0.5, 1.25]))  # with the offset of a
        self.assertEqual(forces.messages[0].header.frame_id, 's/tool')

    def test_wrong_types_are_named(self) -> None:
        array_force = publisher('/w/wrench', Float32MultiArray)
        text = publisher('/w/pose', String)
        array_joints = publisher('/w/joints', Float32MultiArray)
        with log_listener() as log:
            wait_until(lambda: logged(log, Log.WARN, 'w: ', '/w/joints', 'Float32MultiArray'),
                       'a warning about the type', lambda: array_joints.publish(array(1)))
            wait_until(lambda: logged(log, Log.WARN, 'w: ', '/w/wrench', 'Float32MultiArray'),
                       'a warning about the type', lambda: array_force.publish(array(1, 2, 3)))
            wait_until(lambda: logged(log, Log.WARN, '/w/pose', 'std_msgs/String'),
                       'a warning about the type', lambda: text.publish(String('x')))

    def test_wrong_parameters_end_the_node_with_a_message(self) -> None:
        rospy.set_param('/broken', '<robot>')
        rospy.set_param('/one', '<robot name="t"><joint name="a" type="revolute"/></robot>')
        for node, arguments, problem in (
                ('robot_proc', ['_marker_rate:=-1'], 'marker_rate: a number above 0'),
                ('robot_proc', ['_arrows/force/color:=red'], 'color: three or four numbers'),
                ('joint_proc', [], 'topic: the topic of the joints is expected'),
                ('joint_proc', ['_topic:=q'], 'joint_names: the names of'),
                ('joint_proc', ['_topic:=q', '_joint_rate:=fast'], 'joint_rate: a number'),
                ('joint_proc', ['_topic:=q', '_joint_rate:=9', '_joint_offsets/b:=1',
                                'robot_description:=/one'],
                 'an offset of b'),
                ('joint_proc', ['_topic:=q', '_joint_rate:=9', 'robot_description:=/broken'],
                 'the URDF is not XML')):
            status, output = run_node(node, ['__ns:=/t', *arguments])
            self.assertEqual(status, 1, output)
            self.assertIn(problem, output)
            self.assertNotIn('Traceback', output)


def run_node(node: str, arguments: Sequence[str]) -> Tuple[int, str]:
    """Return status and output of a processor that ends at once."""
    process = subprocess.run(['rosrun', 'process_visualizer', node, *arguments],
                             stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=60)
    return process.returncode, process.stdout.decode()


if __name__ == '__main__':
    rospy.init_node('robot_processor_test')
    rostest.rosrun('process_visualizer', 'robot_processor_test', RobotProcessorTest)
