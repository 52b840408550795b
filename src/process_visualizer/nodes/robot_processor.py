"""The robot processor: from a robot's measurements to arrows and numbers."""
from __future__ import annotations

import sys
import threading
from typing import Any, Callable, Dict, List, Optional
from xml.etree import ElementTree

import rospy
from geometry_msgs.msg import TwistStamped, Vector3, WrenchStamped
from visualization_msgs.msg import MarkerArray

from process_visualizer.motion.measuring_time import MeasuringTime
from process_visualizer.motion.recorded_times import Told
from process_visualizer.motion.tool_velocity import ToolVelocity
from process_visualizer.nodes.frame_reader import TF_MESSAGE, FrameReader
from process_visualizer.nodes.frame_watch import FrameWatch
from process_visualizer.nodes.live_number import LiveNumber
from process_visualizer.nodes.markers import Pace, VectorSample
from process_visualizer.nodes.message_reader import (
    Decoder,
    DoubtfulMessage,
    Quantity,
    TopicReader,
)
from process_visualizer.nodes.parameters import (
    ParameterError,
    RobotParameters,
    TopicParameters,
    private_parameters,
    read_robot_parameters,
)
from process_visualizer.nodes.playback import PlaybackFollower
from process_visualizer.nodes.process_end import spin_to_end
from process_visualizer.nodes.recorded_times import RecordedTimesFollower
from process_visualizer.nodes.robot_display import RobotDisplay, ToolMotion
from process_visualizer.nodes.robot_messages import (
    POSE_DECODERS,
    WRENCH_DECODERS,
    ToolPose,
    Wrench,
)

PLAYBACK_RATE = '/process_visualizer/playback_rate'
TICK_S = 0.1


class RobotProcessor:
    """Republishes a robot's measurements as standard messages and shows them (thesis section 5.3).

    Each quantity whose topic is configured: the tool's velocity as TwistStamped in the base frame,
    stamped with the time it belongs to; the force as WrenchStamped in the force frame; arrows and
    numbers for RViz. Joint states are published by joint_proc, in C++, so that nothing that is
    drawn can hold them up.

    What a screen shows is published no faster than a screen can show it: with the message that
    brings it, so that it is not late, or with the next tick of a slow timer, which also notices
    that nothing comes any more.
    """

    def __init__(self, parameters: RobotParameters) -> None:
        """Advertise, subscribe, and start the timer."""
        self._parameters = parameters
        self._playback = PlaybackFollower()
        self._playback_rate = LiveNumber(PLAYBACK_RATE, 1.0)
        self._tool_times = MeasuringTime()
        self._velocity = ToolVelocity(self._playback.clock, parameters.velocity_window_s)
        self._display = RobotDisplay(parameters)
        self._frames = FrameWatch(parameters.robot_name, parameters.base_frame, model_links())
        self._drawing = Pace(1.0 / parameters.marker_rate_hz)
        self._lock = threading.Lock()  # each topic has its thread, and so has the timer
        self._pose: Optional[ToolPose] = None
        self._pose_time_s = 0.0
        self._force: Optional[VectorSample] = None
        self._joints_time_s: Optional[float] = None
        self._tool_velocity = rospy.Publisher('tool_velocity', TwistStamped, queue_size=10)
        self._tool_force = rospy.Publisher('tool_force', WrenchStamped, queue_size=10)
        self._markers = rospy.Publisher('marker_array', MarkerArray, queue_size=1)
        self._watch_joints(parameters.joint_states)
        self._subscribe_tool(parameters.tool_center_frame)
        self._subscribe(parameters.force_sensor, WRENCH_DECODERS, self._on_wrench)
        self._timer = rospy.Timer(rospy.Duration(TICK_S), self._on_timer, reset=True)

    def _subscribe(self, topic: TopicParameters, decoders: Dict[str, Decoder[Quantity]],
                   callback: Callable[[Quantity], None]) -> None:
        if topic.name:
            TopicReader(self._parameters.robot_name, topic.name, topic.message_type,
                        decoders, callback)

    def _watch_joints(self, topic: TopicParameters) -> None:
        """Notice when the joint processor publishes no joint states any more."""
        if topic.name:
            rospy.Subscriber('joint_states', rospy.AnyMsg, self._on_joints, queue_size=1)

    def _on_joints(self, _message: Any) -> None:
        self._joints_time_s = self._playback.data_time_s()

    def _joints_age_s(self, data_s: float) -> Optional[float]:
        return None if self._joints_time_s is None else max(data_s - self._joints_time_s, 0.0)

    def _subscribe_tool(self, topic: TopicParameters) -> None:
        parameters = self._parameters
        if topic.message_type == TF_MESSAGE:
            FrameReader(parameters.robot_name, topic.name, parameters.base_frame,
                        topic.frame or parameters.tool_frame, self._on_tool_pose)
        else:
            self._subscribe(topic, POSE_DECODERS, self._on_tool_pose)
            if topic.name:
                RecordedTimesFollower(topic.name, self._on_told)

    def _on_tool_pose(self, pose: ToolPose) -> None:
        if pose.frame not in ('', self._parameters.base_frame):
            raise ValueError(f'its frame is {pose.frame}, and the base frame '
                             f'{self._parameters.base_frame} is expected')
        now_s = rospy.get_time()
        wall_s = self._tool_times.wall_s(pose.stamp_s, now_s)
        with self._lock:
            self._velocity.add(now_s, wall_s, pose.position, pose.quaternion,
                               self._playback_rate.value(), pose.checksum)
            self._pose, self._pose_time_s = pose, self._playback.clock.data_time_s(now_s)
            self._frames.want(self._parameters.tool_frame, self._parameters.tool_center_frame.name)
            if self._tool_velocity.get_num_connections() > 0:
                self._publish_velocity()
            self._draw(now_s)
        if self._tool_times.standing and not self._playback.clock.follows_player(now_s):
            raise DoubtfulMessage('its stamp is not later than the one before; until the stamps go '
                                  'on, the velocity is computed from the times of arrival')

    def _on_told(self, coming: List[Told]) -> None:
        with self._lock:
            self._velocity.tell(rospy.get_time(), coming)

    def _publish_velocity(self) -> None:
        velocity, turning = self._velocity.velocity(), self._velocity.angular_velocity()
        if velocity is None or turning is None:
            return
        message = TwistStamped()
        message.header.stamp = rospy.Time.from_sec(self._velocity.wall_s())
        message.header.frame_id = self._parameters.base_frame
        message.twist.linear, message.twist.angular = Vector3(*velocity), Vector3(*turning)
        self._tool_velocity.publish(message)

    def _on_wrench(self, wrench: Wrench) -> None:
        frame, now_s = wrench.frame or self._parameters.force_frame, rospy.get_time()
        with self._lock:
            self._force = VectorSample(wrench.force, frame,
                                       self._playback.clock.data_time_s(now_s))
            self._frames.want(frame, self._parameters.force_sensor.name)
            self._draw(now_s)
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
        now_s = rospy.get_time()
        with self._lock:
            self._velocity.settle(now_s)
            self._frames.look()
            self._draw(now_s)

    def _draw(self, now_s: float) -> None:
        """Publish the markers if it is time for them and somebody looks."""
        if self._drawing.is_due(now_s) and self._markers.get_num_connections() > 0:
            data_s = self._playback.clock.data_time_s(now_s)
            markers = self._display.markers(self._motion(), self._force, data_s, now_s,
                                            self._joints_age_s(data_s))
            if markers:
                self._markers.publish(MarkerArray(markers))

    def _motion(self) -> Optional[ToolMotion]:
        if self._pose is None:
            return None
        return ToolMotion(self._pose, self._velocity.velocity(), self._pose_time_s)


def model_links() -> List[str]:
    """Return the links of the robot's model, the parameter robot_description; none without one."""
    text = rospy.get_param('robot_description', '<robot />')
    try:
        return [link.get('name', '') for link in ElementTree.fromstring(text).findall('link')]
    except (ElementTree.ParseError, TypeError) as error:
        rospy.logwarn('parameter %s: a URDF is expected: %s',
                      rospy.resolve_name('robot_description'), error)
        return []


def main() -> None:
    """Run the node; it ends with status 1 when a parameter is wrong."""
    rospy.init_node('robot_proc')
    robot_name = rospy.get_namespace().strip('/')
    try:
        RobotProcessor(read_robot_parameters(private_parameters(), robot_name))
    except ParameterError as error:
        rospy.logfatal('%s', error)
        sys.exit(1)
    spin_to_end()
