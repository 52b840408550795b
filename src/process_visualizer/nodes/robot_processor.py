# SPDX-License-Identifier: BSD-3-Clause
"""The robot processor: turns a robot's measurements into arrows and numbers."""
from __future__ import annotations

import math
import sys
import threading
from dataclasses import replace
from typing import Mapping, Optional, Tuple

import rospy
from geometry_msgs.msg import TwistStamped, Vector3, WrenchStamped
from sensor_msgs.msg import JointState
from visualization_msgs.msg import MarkerArray

from process_visualizer.nodes.common.complaints import Complaints, Patience
from process_visualizer.nodes.common.markers import RefreshRate, VectorSample
from process_visualizer.nodes.common.node_handle import (
    NodeHandle,
    PlaybackFollower,
    spin_to_end,
    start_node,
)
from process_visualizer.nodes.common.node_parameters import private_parameters
from process_visualizer.nodes.robot.frame_watch import FrameWatch
from process_visualizer.nodes.robot.message_reader import (
    WRENCH_DECODERS,
    DoubtfulMessage,
    StaticFrames,
    ToolPose,
    TopicReader,
    Wrench,
)
from process_visualizer.nodes.robot.restored_poses import RestoredPoses
from process_visualizer.nodes.robot.robot_display import RobotDisplay, ShownMotion
from process_visualizer.nodes.robot.tool_input import BaseFrames, ToolInput
from process_visualizer.nodes.robot.tool_placing import ToolPlacer
from process_visualizer.nodes.robot.twist_source import (
    RecordedJoints,
    RecordedMotion,
    RecordedReader,
    TwistSource,
)
from process_visualizer.parameters.reading import ParameterError
from process_visualizer.parameters.robot_parameters import (
    JOINT_LATENCIES,
    JOINT_OFFSETS,
    RobotParameters,
    TopicParameters,
    usable_latencies,
    usable_offsets,
)
from process_visualizer.robot.joints import JointMatching
from process_visualizer.robot.kinematics import Kinematics
from process_visualizer.robot.measuring_time import MeasuringTime
from process_visualizer.ros_names import ROBOT_PROC, TF_MESSAGE

ABOUT_RECORDING = 'recorded velocity'
LOG_PERIOD_S = 30.0
PATIENCE_S = 2.0  # before missing data is reported, as static transforms may arrive later
TICK_S = 0.1
_EQUAL_N = 2.0  # forces this close count as the same
_GROUPS = 20  # maximum number of groups of joints, each in its own message
CHAIN_S = 1.0  # time in which all transforms of a chain arrive


class RobotProcessor:
    """Republishes a robot's measurements as standard messages and shows them (thesis section 5.3).

    It publishes, for configured topics only: the tool's velocity as TwistStamped in the base frame,
    stamped with its own time; the force as WrenchStamped in the force frame; arrows and
    numbers for RViz. Joint states are published by joint_proc, in C++, so that drawing cannot
    delay them.

    Markers are published no faster than a screen can show them: together with the message that
    changes them, so that they are not late, or at the next tick of a slow timer, which also detects
    when data stops. While playback is paused, the state at the position is shown as soon as the
    player has reported the position.
    """

    def __init__(self, node: NodeHandle, parameters: RobotParameters) -> None:
        """Advertise, subscribe, and start the timer."""
        self._node, self._parameters = node, parameters
        self._playback = PlaybackFollower(node)
        self._complaints = Complaints(node, parameters.robot_name)
        model = robot_model(node, self._complaints)
        self._display = RobotDisplay(parameters, bool(model.links))
        static = StaticFrames(node, self._complaints)
        self._frames = FrameWatch(node, self._complaints, static, parameters.base_frame,
                                  model.links)
        self._tool = ToolPlacer(node, parameters, model, self._complaints, static)
        self._base_frames = BaseFrames(parameters, model, static, self._on_static)
        self._drawing = RefreshRate(1.0 / parameters.marker_rate_hz)
        self._lock = threading.Lock()  # each topic and the timer have their own threads
        self._pose: Optional[ToolPose] = None
        self._pose_time_s = self._came_s = 0.0
        self._shown_paused: Tuple[Tuple[float, ...], float] = ((), 0.0)
        self._force: Optional[VectorSample] = None
        self._force_topic = node.resolve(parameters.force_sensor.name)
        self._force_times = MeasuringTime()
        self._joints_time_s: Optional[float] = None
        self._joints_s = -math.inf
        self._patience, self._joints_patience = Patience(PATIENCE_S), Patience(PATIENCE_S)
        self._is_drawn_elsewhere = False
        self._tool_velocity = node.publisher('tool_velocity', TwistStamped)
        self._tool_force = node.publisher('tool_force', WrenchStamped)
        self._markers = node.publisher('marker_array', MarkerArray, queue_size=1)
        self._tool_by_joints = bool(parameters.joint_states.name and model.links
                                    and not parameters.tool_center_frame.name)
        joints = recorded_joints(node, parameters, model)
        self._restored = None if joints is None else RestoredPoses(node, joints, model)
        self._recorded = self._recording_of(parameters.tool_center_frame, model, joints)
        self._twist = TwistSource(node, self._recorded, parameters.velocity_window_s,
                                  parameters.stale_after_s, parameters.tool_center_frame.latency_s)
        if parameters.joint_states.name or model.links:
            node.subscribe('joint_states', JointState, self._on_joints, queue_size=_GROUPS)
        self._input = ToolInput(node, parameters, self._complaints, self._on_tool_pose, static,
                                self._on_static, self._base_frames, model)
        force = parameters.force_sensor
        if force.name:
            TopicReader(node, self._complaints, force.name, force.message_type, WRENCH_DECODERS,
                        self._on_wrench, lambda wrench: wrench.force, _EQUAL_N)
        if self._recorded is not None:
            self._recorded.start()
        self._timer = node.every(TICK_S, self._on_timer)

    def _recording_of(self, topic: TopicParameters, model: Kinematics,
                      joints: Optional[RecordedJoints]) -> Optional[RecordedMotion]:
        if not topic.name and not self._tool_by_joints:
            return None
        preroll_s = CHAIN_S if TF_MESSAGE in (topic.message_type, '') else 0.0
        reader = RecordedReader(
            self._node, topic.name, lambda message_type: self._input.decoder(message_type),
            joints, preroll_s)
        return RecordedMotion(self._node, reader, self._playback.clock,
                              self._parameters.velocity_window_s, self._on_playback,
                              topic.latency_s)

    def _on_joints(self, state: JointState) -> None:
        """Draw with the joint states that move the robot in RViz, so that arrows turn with it.

        They come from joint_proc, and may contain only some of the joints.
        """
        now_s = self._node.ros_s()
        positions, stamp_s = dict(zip(state.name, state.position)), state.header.stamp.to_sec()
        self._base_frames.take_joints(stamp_s, positions)
        if self._restored is not None:
            self._restored.take_joints(positions)
        with self._lock:
            self._joints_time_s = self._playback.clock.data_time_s(now_s)
            self._joints_s = now_s
            self._tool.take_joints(positions)
            self._came_s = self._node.wall_s()
            if self._tool_by_joints:
                self._take_tool_of_joints(positions, stamp_s, now_s)
            if not self._shows_position():
                self._draw(now_s, early_s=0.5 / self._parameters.marker_rate_hz)

    def _take_tool_of_joints(self, positions: Mapping[str, float], stamp_s: float,
                             now_s: float) -> None:
        """Note the tool's pose from the model; of groups with the same stamp, the first is used."""
        pose = self._tool.pose_of_joints(positions, stamp_s)
        if pose is None or (self._pose is not None and self._pose.stamp_s == stamp_s):
            return
        self._twist.add(pose, now_s)
        self._pose, self._pose_time_s = pose, self._playback.clock.data_time_s(now_s)
        if not self._shows_position():
            self._publish_velocity()

    def _joints_age_s(self, now_s: float) -> Optional[float]:
        """Return the time since the last joint states [s].

        It is infinite if they do not arrive at all: RViz then draws the robot at an arbitrary pose.
        It is None if they have no topic, or may still arrive.
        """
        if self._joints_time_s is None or not self._parameters.joint_states.name:
            return math.inf if self._is_drawn_elsewhere else None
        return self._playback.clock.age_s(self._joints_time_s, now_s)

    def _on_tool_pose(self, pose: ToolPose) -> None:
        now_s = self._node.ros_s()
        with self._lock:
            self._twist.add(pose, now_s)
            self._pose, self._pose_time_s = pose, self._playback.clock.data_time_s(now_s)
            self._came_s = self._node.wall_s()
            if not self._shows_position():  # otherwise the player's next state shows it
                self._publish_velocity()
                self._draw_data(now_s)
        if self._twist.doubts_stamps:
            raise DoubtfulMessage('its stamp is not later than the previous one; until the stamps '
                                  'advance again, the velocity is computed from the times of '
                                  'arrival')

    def _on_static(self) -> None:
        if self._recorded is not None:
            self._recorded.forget()

    def _on_playback(self) -> None:
        """While paused, show the state at a position, and again when its pose is sent again."""
        with self._lock:
            state = self._playback.clock.state
            if state is None or not self._shows_position() or not self._twist.is_known:
                return
            moment, (shown, shown_came_s) = (state.segment, state.position_s), self._shown_paused
            comes_again = shown_came_s < self._came_s <= state.stamp_s  # and was sent after that
            if moment != shown or comes_again:
                self._shown_paused = moment, self._came_s
                self._drawing.hurry()
                self._display.hurry()
                self._publish_velocity()
                self._draw(self._node.ros_s())

    def _shows_position(self) -> bool:
        """Return whether the display shows a recording at a position."""
        state = self._playback.clock.state
        return state is not None and state.paused and self._twist.is_recorded

    def _publish_velocity(self) -> None:
        if not self._tool_velocity.get_num_connections():
            return
        twist = self._twist.twist()
        if twist is not None:
            message = TwistStamped()
            message.header.stamp = twist.stamp
            message.header.frame_id = self._parameters.base_frame
            message.twist.linear, message.twist.angular = (Vector3(*twist.linear),
                                                           Vector3(*twist.angular))
            self._tool_velocity.publish(message)

    def _on_wrench(self, wrench: Wrench) -> None:
        now_s = self._node.ros_s()
        given = wrench.frame or self._parameters.force_sensor.parent_frame
        frame = self._base_frames.name(given) if given else self._parameters.force_frame
        drawn_frame, force = self._base_frames.drawn_force(frame, wrench.force)
        with self._lock:
            self._force = VectorSample(force, drawn_frame,
                                       self._playback.clock.data_time_s(now_s))
            self._frames.want(drawn_frame, self._parameters.force_sensor.name)
            self._draw_data(now_s)
        if self._tool_force.get_num_connections() > 0:
            measured_s = min(self._force_times.wall_s(wrench.stamp_s, now_s), now_s)
            self._publish_force(rospy.Time.from_sec(
                measured_s - self._parameters.force_sensor.latency_s), frame, wrench)

    def _publish_force(self, stamp: rospy.Time, frame: str, wrench: Wrench) -> None:
        message = WrenchStamped()
        message.header.stamp = stamp
        message.header.frame_id = frame
        message.wrench.force = Vector3(*wrench.force)
        message.wrench.torque = Vector3(*wrench.torque)
        self._tool_force.publish(message)

    def _on_timer(self) -> None:
        now_s = self._node.ros_s()
        with self._lock:
            self._twist.settle(now_s)
            self._frames.look()
            self._tool.look()
            self._look_at_recording()
            self._is_drawn_elsewhere = self._joints_patience.is_over(
                bool(self._parameters.joint_states.name) and self._joints_time_s is None,
                self._node.monotonic_s())
            self._draw(now_s)

    def _look_at_recording(self) -> None:
        """Complain if the recording lacks data for a velocity at the position."""
        problem = '' if self._recorded is None else self._recorded.problem
        if self._patience.is_over(bool(problem), self._node.monotonic_s()):
            self._complaints.state(ABOUT_RECORDING, 'no velocity is shown, as the recording does '
                                   f'not say where the tool is: {problem}',
                                   log_period_s=LOG_PERIOD_S)
        elif not problem:
            self._complaints.end(ABOUT_RECORDING)

    def _draw_data(self, now_s: float) -> None:
        """Draw received data, unless it is drawn together with joint states."""
        if not 0.0 <= now_s - self._joints_s < TICK_S:
            self._draw(now_s)

    def _draw(self, now_s: float, early_s: float = 0.0) -> None:
        """Publish the markers if they are due and there are subscribers.

        An empty list is published, too: it shows a waiting receiver that nothing more will follow.
        """
        if self._twist.is_awaited():
            return
        if self._twist.is_recorded and not self._twist.is_known:
            self._display.hurry()  # an old number must not stay visible
        if self._drawing.is_due(now_s, early_s) and self._markers.get_num_connections() > 0:
            clock = self._playback.clock
            data_s = clock.data_time_s(now_s)
            force = self._force and replace(
                self._force, time_s=data_s - clock.age_s(self._force.time_s, now_s))
            if not self._playback.has_begun(self._force_topic):
                force = None
            markers = self._display.markers(self._motion(data_s, now_s), force, data_s, now_s,
                                            self._joints_age_s(now_s))
            self._markers.publish(MarkerArray(markers))

    def _motion(self, data_s: float, now_s: float) -> Optional[ShownMotion]:
        if self._pose is None:
            return None
        twist, shown = self._twist.twist(), self._twist.shown()
        if twist is not None:
            self._tool.note_motion(math.hypot(*twist.linear), math.hypot(*twist.angular))
        pose_age_s = self._playback.clock.age_s(self._pose_time_s, now_s)
        joints_age_s = self._playback.clock.age_s(self._joints_time_s or 0.0, now_s)
        is_stale = max(pose_age_s, joints_age_s) >= self._parameters.stale_after_s
        place = self._tool.place(self._pose, is_stale)
        self._frames.want(place.frame, self._parameters.tool_center_frame.name
                          or self._parameters.joint_states.name)
        age_s = shown.age_s if self._twist.is_recorded else pose_age_s
        return ShownMotion(place, shown.velocity, data_s - age_s)


def robot_model(node: NodeHandle, complaints: Complaints) -> Kinematics:
    """Return the robot's model from the parameter robot_description; by default an empty one."""
    text = node.param('robot_description', '<robot />')
    try:
        return Kinematics(text)
    except (ValueError, TypeError) as error:
        name = node.resolve('robot_description')
        complaints.state(name, f'parameter {name}: a URDF is expected: {error}')
        return Kinematics()


def recorded_joints(node: NodeHandle, parameters: RobotParameters, model: Kinematics
                    ) -> Optional[RecordedJoints]:
    """Return the recorded joints of the robot; None if they have no topic.

    Offsets and latencies are those of the robot's joint_proc.
    """
    topics = (parameters.joint_states.name, *parameters.more_joint_states)
    if not topics[0] or not model.joint_names:
        return None
    offsets = usable_offsets(node.param(JOINT_OFFSETS, {}))
    matching = JointMatching(parameters.robot_name, model.joint_names, offsets,
                             parameters.link_prefix)
    latencies_s = usable_latencies(node.param(JOINT_LATENCIES, []), len(topics))
    return RecordedJoints(dict(zip(topics, latencies_s)), matching)


def main() -> None:
    """Run the node; it ends with status 1 when a parameter is wrong."""
    start_node(ROBOT_PROC)
    robot_name = rospy.get_namespace().strip('/')
    try:
        RobotProcessor(NodeHandle(), RobotParameters.read(private_parameters(), robot_name))
    except ParameterError as error:
        rospy.logfatal('%s', error)
        sys.exit(1)
    spin_to_end()
