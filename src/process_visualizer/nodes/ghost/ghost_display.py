# SPDX-License-Identifier: BSD-3-Clause
"""The node ghost: follows the player, and draws the robots of another run where they were then."""
from __future__ import annotations

import threading
from typing import List, Optional, Tuple

import numpy as np
import rospy
from visualization_msgs.msg import Marker, MarkerArray

from process_visualizer.clients.player_clock import PlaybackFollower
from process_visualizer.motion.joint_track import joint_track
from process_visualizer.msg import GhostArrow as GhostArrowMessage
from process_visualizer.msg import GhostRobot as GhostRobotMessage
from process_visualizer.nodes.common.process_end import spin_to_end, start_node
from process_visualizer.nodes.ghost.ghost_arrow import GhostArrow
from process_visualizer.nodes.ghost.ghost_robot import GhostRobot
from process_visualizer.ros_names import GHOST, GHOST_TOPIC
from process_visualizer.srv import ShowGhost, ShowGhostRequest, ShowGhostResponse

RATE_HZ = 30.0
_CALM_S = 0.25  # while nothing moves: before RViz takes the markers for dead


class GhostDisplay:
    """Publishes markers only while there is a ghost to be seen."""

    def __init__(self, playback: PlaybackFollower) -> None:
        """Advertise topic and service."""
        self._playback = playback
        self._lock = threading.Lock()
        self._robots: Tuple[GhostRobot, ...] = ()
        self._arrows: Tuple[GhostArrow, ...] = ()
        self._drawn: Tuple[Optional[float], float] = (None, -1.0)  # position, when
        self._is_drawn = False
        self._publisher = rospy.Publisher(GHOST_TOPIC, MarkerArray, queue_size=2, latch=True)
        self._publisher.publish(nothing())
        self._service = rospy.Service('~show', ShowGhost, self._on_show)
        self._timer = rospy.Timer(rospy.Duration(1.0 / RATE_HZ), self._draw, reset=True)

    def _on_show(self, request: ShowGhostRequest) -> ShowGhostResponse:
        try:
            robots = tuple(ghost_robot(it) for it in request.robots)
            arrows = tuple(ghost_arrow(it) for it in request.arrows)
        except ValueError as error:
            return ShowGhostResponse(False, str(error))
        with self._lock:
            self._robots, self._arrows, self._drawn = robots, arrows, (None, -1.0)
            self._publish(nothing())
        return ShowGhostResponse(True, '')

    def _draw(self, _event: object) -> None:
        with self._lock:
            if self._robots or self._arrows:
                self._draw_at(self._position_s(), rospy.get_time())

    def _position_s(self) -> Optional[float]:
        """The position in the recording; None without a player."""
        now_s, clock = rospy.get_time(), self._playback.clock
        present = clock.present(now_s) if clock.follows_player(now_s) else None
        return None if present is None else present.time_s

    def _draw_at(self, position_s: Optional[float], now_s: float) -> None:
        before, drawn_s = self._drawn
        if position_s == before and 0.0 <= now_s - drawn_s < _CALM_S:
            return
        self._drawn = position_s, now_s
        markers: List[Marker] = []
        if position_s is not None:
            markers = [it for robot in self._robots for it in robot.markers(position_s)]
            markers += [it for arrow in self._arrows
                        for it in [arrow.marker(self._robots, position_s)] if it is not None]
        if markers:
            self._publish(MarkerArray(markers))
        elif self._is_drawn:
            self._publish(nothing())

    def _publish(self, markers: MarkerArray) -> None:
        self._is_drawn = markers.markers[0].action == Marker.ADD
        self._publisher.publish(markers)


def nothing() -> MarkerArray:
    """Return what removes all that is drawn."""
    return MarkerArray([Marker(action=Marker.DELETEALL)])


def ghost_robot(message: GhostRobotMessage) -> GhostRobot:
    """Return a robot out of a message, with the model that is on the parameter server.

    Raises:
        ValueError: there is no model, or the numbers do not fit; the text names the device.
    """
    device = message.device
    urdf = rospy.get_param(f'/{device}/robot_description', None)
    if not isinstance(urdf, str):
        raise ValueError(f'{device}: there is no parameter /{device}/robot_description; launch '
                         'the device first')
    try:
        joints, times_s = tuple(message.joints), np.array(message.times)
        there = joint_track(joints, times_s, np.array(message.there))
        here = joint_track(joints, times_s, np.array(message.here)) if message.here else None
        return GhostRobot(device, urdf, message.tool, there, here)
    except ValueError as error:
        raise ValueError(f'{device}: {error}') from None


def ghost_arrow(message: GhostArrowMessage) -> GhostArrow:
    """Return an arrow out of a message.

    Raises:
        ValueError: the numbers do not fit; the text names the arrow.
    """
    x, y, z = message.foot
    try:
        vectors = joint_track(('x', 'y', 'z'), np.array(message.times), np.array(message.vectors))
    except ValueError as error:
        raise ValueError(f'{message.name}: {error}') from None
    return GhostArrow(message.name, message.frame, message.foot_frame, (x, y, z), vectors)


def main() -> None:
    """Run the node."""
    start_node(GHOST)
    GhostDisplay(PlaybackFollower())
    spin_to_end()
