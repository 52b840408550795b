# SPDX-License-Identifier: BSD-3-Clause
"""The node ghost: the robots of another run, in step with the player or with the live robots."""
from __future__ import annotations

import threading
from typing import Any, Callable, Dict, List, Optional, Tuple

import numpy as np
from visualization_msgs.msg import Marker, MarkerArray

from process_visualizer.msg import GhostArrow as GhostArrowMessage
from process_visualizer.msg import GhostRobot as GhostRobotMessage
from process_visualizer.nodes.common.node_handle import (
    NodeHandle,
    PlaybackFollower,
    spin_to_end,
    start_node,
)
from process_visualizer.nodes.ghost.ghost_robot import GhostArrow, GhostRobot, Joints
from process_visualizer.nodes.ghost.live_follower import LiveFollower, LiveJoints
from process_visualizer.robot.joints import joint_track
from process_visualizer.ros_names import GHOST, GHOST_TOPIC
from process_visualizer.runs.alignment.live_alignment import FollowedSpan
from process_visualizer.srv import (
    FollowGhost,
    FollowGhostRequest,
    FollowGhostResponse,
    ShowGhost,
    ShowGhostRequest,
    ShowGhostResponse,
)

RATE_HZ = 30.0
_CALM_S = 0.25  # redraw period while nothing moves, before RViz removes the markers
_BEHIND_S = 0.5
"""Maximum lag of a robot's picture [s]; a picture further behind has stopped, as no joints come.
The limit grows with the rate of fast playback."""


class GhostDisplay:
    """Publishes markers only while there is a ghost to be seen."""

    def __init__(self, node: NodeHandle) -> None:
        """Advertise the topic and the services."""
        self._node, self._playback = node, PlaybackFollower(node)
        self._lock = threading.Lock()
        self._robots: Tuple[GhostRobot, ...] = ()
        self._arrows: Tuple[GhostArrow, ...] = ()
        self._joints: Tuple[LiveJoints, ...] = ()  # of the robots beside a recording's ghost
        self._drawn: Tuple[Optional[float], float] = (None, -1.0)  # position, and when [s]
        self._is_drawn = False
        self._publisher = node.publisher(GHOST_TOPIC, MarkerArray, queue_size=2, latch=True)
        self._publisher.publish(nothing())
        self._follower: Optional[LiveFollower] = None
        self._is_visible = True
        node.serve('~show', ShowGhost, self._on_show)
        node.serve('~follow', FollowGhost, self._on_follow)
        node.every(1.0 / RATE_HZ, self._draw)

    def _on_show(self, request: ShowGhostRequest) -> ShowGhostResponse:
        try:
            robots = tuple(self._robot(it, recorded_joints(it)) for it in request.robots)
            arrows = tuple(ghost_arrow(it) for it in request.arrows)
        except ValueError as error:
            return ShowGhostResponse(False, str(error))
        joints = tuple(LiveJoints(self._node, it.device) for it in robots)
        self._take(robots, arrows, None, True, joints)
        return ShowGhostResponse(True, '')

    def _on_follow(self, request: FollowGhostRequest) -> FollowGhostResponse:
        joints: Dict[str, LiveJoints] = {}
        span = FollowedSpan(request.begin, request.end) if request.begin and request.end else None
        try:
            for device in dict.fromkeys(it.device for it in request.robots):
                joints[device] = LiveJoints(self._node, device)
            robots = tuple(self._robot(it, joints[it.device]) for it in request.robots)
            follower = None if not robots else LiveFollower(
                self._node, robots, joints, request.events, span)
        except ValueError as error:
            for it in joints.values():
                it.close()
            return FollowGhostResponse(False, str(error))
        self._take(robots, (), follower, request.visible)
        return FollowGhostResponse(True, '')

    def _take(self, robots: Tuple[GhostRobot, ...], arrows: Tuple[GhostArrow, ...],
              follower: Optional[LiveFollower], is_visible: bool,
              joints: Tuple[LiveJoints, ...] = ()) -> None:
        with self._lock:
            before, self._follower, self._is_visible = self._follower, follower, is_visible
            unused, self._joints = self._joints, joints
            self._robots, self._arrows, self._drawn = robots, arrows, (None, -1.0)
            self._publish(nothing())
        if before is not None:
            before.close()
        for it in unused:
            it.close()

    def _robot(self, message: GhostRobotMessage, here: Optional[Joints]) -> GhostRobot:
        """Return the robot of a message, with its model from the parameter server.

        Raises:
            ValueError: there is no model, or the numbers do not fit; the text names the device.
        """
        device = message.device
        urdf = self._node.param(f'/{device}/robot_description')
        if not isinstance(urdf, str):
            raise ValueError(f'{device}: there is no parameter /{device}/robot_description; '
                             'launch the device first')
        return _named(device, lambda: GhostRobot(device, urdf, message.tool, joint_track(
            tuple(message.joints), np.array(message.times), np.array(message.there)), here))

    def _draw(self) -> None:
        with self._lock:
            if self._robots or self._arrows:
                now_s = self._node.ros_s()
                follower = self._follower
                time_s = self._position_s(now_s) if follower is None else follower.time_s(now_s)
                self._draw_at(time_s if self._is_visible else None, now_s)

    def _position_s(self, now_s: float) -> Optional[float]:
        """Return the recording's position at which RViz draws the robots; None without a player.

        On a busy computer it lags behind the player: the picture waits for several programs.
        """
        clock = self._playback.clock
        present = clock.present(now_s) if clock.follows_player(now_s) else None
        if present is None:
            return None
        stamp_s = max((it.stamp_s for it in self._joints), default=0.0)
        drawn = clock.bag_time(stamp_s) if stamp_s and present.rate else None
        if drawn is None or drawn.segment != present.segment:
            return present.time_s
        behind_s = abs(present.time_s - drawn.time_s)
        return drawn.time_s if behind_s <= _BEHIND_S * max(abs(present.rate), 1.0) \
            else present.time_s

    def _draw_at(self, position_s: Optional[float], now_s: float) -> None:
        before, drawn_s = self._drawn
        if position_s == before and 0.0 <= now_s - drawn_s < _CALM_S:
            return
        self._drawn = position_s, now_s
        markers: List[Marker] = []
        if position_s is not None:
            markers = [marker for robot in self._robots for marker in robot.markers(position_s)]
            arrows = [arrow.marker(self._robots, position_s) for arrow in self._arrows]
            markers += [marker for marker in arrows if marker is not None]
        if markers:
            self._publish(MarkerArray(markers))
        elif self._is_drawn:
            self._publish(nothing())

    def _publish(self, markers: MarkerArray) -> None:
        self._is_drawn = markers.markers[0].action == Marker.ADD
        self._publisher.publish(markers)


def nothing() -> MarkerArray:
    """Return the message that removes all markers."""
    return MarkerArray([Marker(action=Marker.DELETEALL)])


def recorded_joints(message: GhostRobotMessage) -> Optional[Joints]:
    """Return the joints of the run that is played; None if there are none.

    Raises:
        ValueError: the numbers do not fit; the text names the device.
    """
    return _named(message.device, lambda: joint_track(
        tuple(message.joints), np.array(message.times), np.array(message.here))) \
        if message.here else None


def _named(device: str, make: Callable[[], Any]) -> Any:
    try:
        return make()
    except ValueError as error:
        raise ValueError(f'{device}: {error}') from None


def ghost_arrow(message: GhostArrowMessage) -> GhostArrow:
    """Return the arrow of a message.

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
    GhostDisplay(NodeHandle())
    spin_to_end()
