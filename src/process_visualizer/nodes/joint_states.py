"""A robot's joint states for robot_state_publisher."""
from __future__ import annotations

import threading
from typing import Optional

import rospy
from sensor_msgs.msg import JointState

from process_visualizer.motion.joints import match_joints
from process_visualizer.nodes.markers import Pace
from process_visualizer.nodes.parameters import RobotParameters
from process_visualizer.nodes.playback import PlaybackFollower
from process_visualizer.nodes.robot_messages import JointPositions


class JointStates:
    """Publishes joint states, at most at a rate; the last one always.

    A state is published at once or not at all while others follow, so that thinning delays
    nothing. Drivers that send faster than a screen shows would otherwise cost each robot's
    processor and state publisher, and the master, which the latter asks for every state.
    """

    def __init__(self, parameters: RobotParameters, playback: PlaybackFollower) -> None:
        """Advertise."""
        self._parameters = parameters
        self._playback = playback
        self._pace = Pace(1.0 / parameters.joint_rate_hz)
        self._lock = threading.Lock()
        self._held: Optional[JointState] = None
        self._time_s: Optional[float] = None
        self._publisher = rospy.Publisher('joint_states', JointState, queue_size=10,
                                          tcp_nodelay=True)

    def take(self, joints: JointPositions) -> None:
        """Publish positions if it is time.

        Raises:
            ValueError: they do not fit the robot's joints.
        """
        now_s = rospy.get_time()
        names, positions = match_joints(self._parameters.robot_name, self._parameters.joint_names,
                                        joints.names, joints.positions)
        self._time_s = self._playback.clock.data_time_s(now_s)
        with self._lock:
            self._held = JointState(name=names, position=positions)
            if self._pace.is_due(now_s):
                self._publish(now_s)

    def flush(self, now_s: float) -> None:
        """Publish the last state if it was held back and no other has followed."""
        with self._lock:
            if self._held is not None and self._pace.is_due(now_s):
                self._publish(now_s)

    def age_s(self, data_s: float) -> Optional[float]:
        """Return since when [s] no state has come; None before the first one."""
        return None if self._time_s is None else max(data_s - self._time_s, 0.0)

    def _publish(self, now_s: float) -> None:
        assert self._held is not None
        self._held.header.stamp = rospy.Time.from_sec(now_s)
        self._publisher.publish(self._held)
        self._held = None
