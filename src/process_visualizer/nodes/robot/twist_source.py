# SPDX-License-Identifier: BSD-3-Clause
"""The source of the tool's velocity: received poses, or the recording that is played."""
from __future__ import annotations

from typing import NamedTuple, Optional

import rospy

from process_visualizer.motion.rotations import Triple
from process_visualizer.motion.velocity.measuring_time import MeasuringTime
from process_visualizer.motion.velocity.tool_velocity import ToolVelocity
from process_visualizer.nodes.common.live_number import LiveNumber
from process_visualizer.nodes.common.node_handle import NodeHandle
from process_visualizer.nodes.robot.recorded_motion import RecordedMotion
from process_visualizer.nodes.robot.robot_messages import ToolPose
from process_visualizer.ros_names import PLAYBACK_RATE

_STANDING: Triple = (0.0, 0.0, 0.0)


class Twist(NamedTuple):
    """Velocity (3,) [m/s] and angular velocity (3,) [rad/s], in the base frame, and their time."""

    linear: Triple
    angular: Triple
    stamp: rospy.Time


class ShownVelocity(NamedTuple):
    """The velocity (3,) [m/s] to show, None for none, and the age of its last pose [s]."""

    velocity: Optional[Triple]
    age_s: float = 0.0


class TwistSource:
    """The tool's velocity: live from received poses, in playback from the recording.

    In playback only the position counts, not the received poses. If the recording has no velocity
    at the position, as poses are missing there, none is shown; after ``stale_after_s`` the display
    says for how long.
    """

    def __init__(self, node: NodeHandle, recorded: Optional[RecordedMotion], window_s: float,
                 stale_after_s: float) -> None:
        """``recorded`` reads the recording, if there is a topic."""
        self._node, self._recorded = node, recorded
        self._live = ToolVelocity(window_s)
        self._times = MeasuringTime()
        self._rate = LiveNumber(node, PLAYBACK_RATE, 1.0)
        self._stale_after_s = stale_after_s
        self._last_recorded: Optional[Triple] = None

    @property
    def is_recorded(self) -> bool:
        """Return whether the recording is the source."""
        return self._recorded is not None and self._recorded.is_in_charge()

    @property
    def is_known(self) -> bool:
        """Return whether the recording is known at the position, with or without a velocity."""
        return self._recorded is not None and self._recorded.moment() is not None

    @property
    def doubts_stamps(self) -> bool:
        """Return whether the last pose's stamp was not later than the previous one, and matters."""
        return self._times.standing and not self.is_recorded

    def add(self, pose: ToolPose, now_s: float) -> None:
        """Add a received pose."""
        wall_s = self._times.wall_s(pose.stamp_s, now_s)
        if not self.is_recorded:
            self._last_recorded = None
            self._live.add(now_s, wall_s, pose.position, pose.quaternion, self._rate.value())

    def settle(self, now_s: float) -> None:
        """Use the poses that have waited for long enough."""
        self._live.settle(now_s)

    def is_awaited(self) -> bool:
        """Return whether it will be known in a moment, so that nothing should be drawn now."""
        return self._recorded is not None and self._recorded.is_awaited()

    def twist(self) -> Optional[Twist]:
        """Return the present velocities; None if there are none."""
        if self._recorded is not None and self._recorded.is_in_charge():
            moment = self._recorded.moment()
            return None if moment is None else _twist(
                moment.velocity(), moment.angular_velocity(), self._stamp_s(moment.wall_s))
        return _twist(self._live.velocity(), self._live.angular_velocity(), self._live.wall_s())

    def shown(self) -> ShownVelocity:
        """Return the velocity to show at present."""
        if self._recorded is None or not self._recorded.is_in_charge():
            return ShownVelocity(self._live.velocity() or self._last_recorded)
        moment = self._recorded.moment()
        if moment is None:
            return ShownVelocity(None)
        self._last_recorded, age_s = moment.velocity(), moment.age_s() or 0.0
        if self._last_recorded is None and age_s > self._stale_after_s:
            return ShownVelocity(_STANDING, age_s)
        return ShownVelocity(self._last_recorded, age_s)

    def _stamp_s(self, wall_s: float) -> float:
        """A wall time [s] that has just been read, as ROS time.

        Without simulated time it is the same. Reading the clock again would add the time that the
        thread had to wait in between, at 4x four times.
        """
        return wall_s if self._node.is_wall_clock() else self._node.ros_s()


def _twist(linear: Optional[Triple], angular: Optional[Triple],
           stamp_s: float) -> Optional[Twist]:
    if linear is None or angular is None:
        return None
    return Twist(linear, angular, rospy.Time.from_sec(stamp_s))
