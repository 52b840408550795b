"""The robot processor: from a robot's measurements to joint states, arrows and numbers."""
from __future__ import annotations

import sys
from typing import Callable, Dict, List, Optional

import numpy as np
import rospy
from geometry_msgs.msg import TwistStamped, Vector3, WrenchStamped
from sensor_msgs.msg import JointState
from visualization_msgs.msg import MarkerArray

from process_visualizer.motion.joints import match_joints, movable_joints
from process_visualizer.motion.velocity import ScaledClock, VelocityEstimator
from process_visualizer.nodes.live_number import LiveNumber
from process_visualizer.nodes.markers import VectorSample
from process_visualizer.nodes.message_reader import Decoder, Quantity, TopicReader
from process_visualizer.nodes.parameters import (
    ParameterError,
    RobotParameters,
    TopicParameters,
    private_parameters,
    read_robot_parameters,
)
from process_visualizer.nodes.robot_display import RobotDisplay, ToolMotion
from process_visualizer.nodes.robot_messages import (
    JOINT_DECODERS,
    POSE_DECODERS,
    WRENCH_DECODERS,
    JointPositions,
    ToolPose,
    Wrench,
)

PLAYBACK_RATE = '/process_visualizer/playback_rate'


class RobotProcessor:
    """Republishes a robot's measurements as standard messages and shows them (thesis section 5.3).

    Each quantity whose topic is configured: joint states for robot_state_publisher, as received;
    the tool's velocity as TwistStamped in the base frame (its angular part is not estimated and
    zero); the force as WrenchStamped in the force frame; arrows and numbers for RViz at the rate
    of a screen.
    """

    def __init__(self, parameters: RobotParameters) -> None:
        """Advertise, subscribe, and start the timer of the markers."""
        self._parameters = parameters
        self._clock = ScaledClock()
        self._playback_rate = LiveNumber(PLAYBACK_RATE, 1.0)
        window_s = parameters.velocity_window_s
        self._estimator = VelocityEstimator(window_s, gap_s=max(1.0, 2.0 * window_s))
        self._display = RobotDisplay(parameters)
        self._motion: Optional[ToolMotion] = None
        self._force: Optional[VectorSample] = None
        self._joint_states = rospy.Publisher('joint_states', JointState, queue_size=10,
                                             tcp_nodelay=True)
        self._tool_velocity = rospy.Publisher('tool_velocity', TwistStamped, queue_size=10)
        self._tool_force = rospy.Publisher('tool_force', WrenchStamped, queue_size=10)
        self._markers = rospy.Publisher('marker_array', MarkerArray, queue_size=1)
        self._subscribe(parameters.joint_states, JOINT_DECODERS, self._on_joints)
        self._subscribe(parameters.tool_center_frame, POSE_DECODERS, self._on_tool_pose)
        self._subscribe(parameters.force_sensor, WRENCH_DECODERS, self._on_wrench)
        self._timer = rospy.Timer(rospy.Duration(1.0 / parameters.marker_rate_hz),
                                  self._on_timer, reset=True)

    def _subscribe(self, topic: TopicParameters, decoders: Dict[str, Decoder[Quantity]],
                   callback: Callable[[Quantity], None]) -> None:
        if topic.name:
            TopicReader(self._parameters.robot_name, topic.name, topic.message_type,
                        decoders, callback)

    def _on_joints(self, joints: JointPositions) -> None:
        message = JointState()
        message.name, message.position = match_joints(
            self._parameters.robot_name, self._parameters.joint_names,
            joints.names, joints.positions)
        message.header.stamp = rospy.Time.now()
        self._joint_states.publish(message)

    def _on_tool_pose(self, pose: ToolPose) -> None:
        if pose.frame not in ('', self._parameters.base_frame):
            raise ValueError(f'its frame is {pose.frame}, and the base frame '
                             f'{self._parameters.base_frame} is expected')
        now_s = rospy.get_time()
        time_s = self._clock.advance(now_s, self._playback_rate.value())
        self._estimator.add(time_s, pose.position)
        velocity = self._estimator.velocity()
        self._motion = ToolMotion(pose, velocity, now_s)
        if velocity is not None and self._tool_velocity.get_num_connections() > 0:
            self._publish_velocity(rospy.Time.from_sec(now_s), velocity)

    def _publish_velocity(self, stamp: rospy.Time, velocity: np.ndarray) -> None:
        message = TwistStamped()
        message.header.stamp = stamp
        message.header.frame_id = self._parameters.base_frame
        message.twist.linear = Vector3(*velocity)
        self._tool_velocity.publish(message)

    def _on_wrench(self, wrench: Wrench) -> None:
        frame, now_s = wrench.frame or self._parameters.force_frame, rospy.get_time()
        self._force = VectorSample(wrench.force, frame, now_s)
        if self._tool_force.get_num_connections() > 0:
            self._publish_force(rospy.Time.from_sec(now_s), frame, wrench)

    def _publish_force(self, stamp: rospy.Time, frame: str, wrench: Wrench) -> None:
        message = WrenchStamped()
        message.header.stamp = stamp
        message.header.frame_id = frame
        message.wrench.force = Vector3(*wrench.force)
        message.wrench.torque = Vector3(*wrench.torque)
        self._tool_force.publish(message)

    def _on_timer(self, _event: rospy.timer.TimerEvent) -> None:
        if self._markers.get_num_connections() == 0:
            return
        markers = self._display.markers(self._motion, self._force, rospy.get_time())
        if markers:
            self._markers.publish(MarkerArray(markers))


def model_joints() -> List[str]:
    """Return the joints of the model in robot_description; none where there is no model."""
    urdf = rospy.get_param('robot_description', '')
    if not urdf:
        return []
    try:
        return movable_joints(urdf)
    except ValueError as error:
        raise ParameterError(
            f'parameter {rospy.resolve_name("robot_description")}: {error}') from None


def main() -> None:
    """Run the node; it ends with status 1 when a parameter is wrong."""
    rospy.init_node('robot_proc')
    robot_name = rospy.get_namespace().strip('/')
    try:
        RobotProcessor(
            read_robot_parameters(private_parameters(), robot_name, model_joints()))
    except ParameterError as error:
        rospy.logfatal('%s', error)
        sys.exit(1)
    rospy.spin()
