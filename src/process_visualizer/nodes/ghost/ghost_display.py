# SPDX-License-Identifier: BSD-3-Clause
"""The node ghost: shows the robots of another run, in step with the player or the live robots."""
from __future__ import annotations

import math
import queue
import threading
from typing import Any, Callable, Dict, List, Mapping, Optional, Sequence, Tuple

import numpy as np
import roslib.message
import rospy
from sensor_msgs.msg import JointState
from visualization_msgs.msg import Marker, MarkerArray

from process_visualizer.bagio.number_places import FieldPath
from process_visualizer.health.staleness import SendingHabit
from process_visualizer.msg import GhostArrow as GhostArrowMessage
from process_visualizer.msg import GhostEvent, GhostPhase
from process_visualizer.msg import GhostRobot as GhostRobotMessage
from process_visualizer.nodes.common.markers import RefreshRate
from process_visualizer.nodes.common.newest_message import RawMessage, decode
from process_visualizer.nodes.common.node_handle import (
    NodeHandle,
    PlaybackFollower,
    spin_to_end,
    start_node,
)
from process_visualizer.nodes.ghost.ghost_robot import GhostArrow, GhostRobot, Joints
from process_visualizer.robot.joints import joint_track
from process_visualizer.robot.kinematics import Placement
from process_visualizer.ros_names import GHOST, GHOST_PHASE_TOPIC, GHOST_TOPIC
from process_visualizer.runs.alignment.live_alignment import PERIOD_S, FollowedSpan, LiveAlignment
from process_visualizer.runs.event import Passages
from process_visualizer.srv import (
    FollowGhost,
    FollowGhostRequest,
    FollowGhostResponse,
    ShowGhost,
    ShowGhostRequest,
    ShowGhostResponse,
)

RATE_HZ = 30.0
_CALM_S = 0.25  # redraw period while nothing moves, so that RViz does not remove the markers
_BEHIND_S = 0.5
"""Maximum lag of a robot's picture [s]; a picture further behind has stopped, because no joints
arrive. The limit increases with the rate of fast playback."""


class GhostDisplay:
    """Publishes markers, but only while there is a ghost to show."""

    def __init__(self, node: NodeHandle) -> None:
        """Advertise the topic and the services."""
        self._node, self._playback = node, PlaybackFollower(node)
        self._lock = threading.Lock()
        self._robots: Tuple[GhostRobot, ...] = ()
        self._arrows: Tuple[GhostArrow, ...] = ()
        self._joints: Tuple[LiveJoints, ...] = ()  # of the robots beside the ghost in playback
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
        """Return the recording position at which RViz draws the robots; None without a player.

        On a busy computer it lags behind the player, because the picture depends on several
        programs.
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
    """Return the joints of the played run; None if there are none.

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


class LiveJoints:
    """Subscribes to the joint states that move the robot's picture, to keep the ghost in step."""

    def __init__(self, node: NodeHandle, device: str) -> None:
        """Subscribe."""
        self._node, self._lock = node, threading.Lock()
        self._habit, self._arrived_s = SendingHabit(), -math.inf
        self._positions: Dict[str, float] = {}
        self.stamp_s = 0.0
        """Stamp of the last joint states [s]; 0 before the first ones, or without a stamp."""
        self._subscriber = node.subscribe(f'/{device}/joint_states', JointState, self._take,
                                          queue_size=10)

    def _take(self, message: JointState) -> None:
        with self._lock:
            self._arrived_s = self._node.monotonic_s()
            self._habit.add(self._arrived_s)
        self.stamp_s = message.header.stamp.to_sec()
        self._positions = {**self._positions, **dict(zip(message.name, message.position))}

    def at(self, _time_s: float) -> Optional[Dict[str, float]]:
        """Return the positions [rad or m] by joint; None before the first ones."""
        return self._positions or None

    @property
    def has_ended(self) -> bool:
        """Return whether joint states that were sent at a rate have stopped arriving."""
        with self._lock:
            age_s = self._node.monotonic_s() - self._arrived_s
            return _ENDED_S < age_s < math.inf and age_s > self._habit.holds_for_s(_ENDED_S)

    def close(self) -> None:
        """Unsubscribe."""
        self._subscriber.unregister()


_ENDED_S = 5.0
"""Time without joints [s] after which the phase of the run is unknown, or the run over."""
_LOG_PERIOD_S = 10.0


class EventWatch:
    """Checks each message of an event's topic."""

    def __init__(self, node: NodeHandle, event: GhostEvent, on_event: Callable[[str], None]
                 ) -> None:
        """Subscribe; ``on_event`` is called with the event's name, in a thread of the topic.

        Raises:
            ValueError: the field is not a valid path.
        """
        self._node, self._event, self._on_event = node, event, on_event
        self._path = FieldPath(event.field)
        self._passages = Passages(event.threshold, event.is_above, event.hysteresis)
        self._log = RefreshRate(_LOG_PERIOD_S)
        self._subscriber = node.subscribe(event.topic, rospy.AnyMsg, self._take, queue_size=100)

    def _take(self, message: Any) -> None:
        header = message._connection_header
        raw = RawMessage(header['type'], header['md5sum'], message._buff, 0.0)
        try:
            message_class = roslib.message.get_message_class(header['type'])
            number = self._path.number(decode(raw, message_class))
        except ValueError as error:
            if self._log.is_due(self._node.monotonic_s()):
                self._node.warn(f'the event "{self._event.name}" is not seen: '
                                f'{self._event.topic}: {error}')
            return
        if self._passages.take(number):
            self._on_event(self._event.name)

    def close(self) -> None:
        """Unsubscribe."""
        self._subscriber.unregister()


_MAX_ROWS = 20_000
_STALE_AFTER_S = 0.2
"""Age of joints [s] from which they count as no longer sent, and the robots as being at rest."""


class LiveFollower:
    """Finds the phase of the present run and publishes it; for use by one thread."""

    def __init__(self, node: NodeHandle, robots: Sequence[GhostRobot],
                 joints: Mapping[str, LiveJoints], events: Sequence[GhostEvent],
                 span: Optional[FollowedSpan]) -> None:
        """Initialize with the reference run's robots, and the live robots' joints by device.

        Raises:
            ValueError: no robot has a tool that can be followed, or an event is invalid.
        """
        self._node, self._robots, self._joints = node, robots, joints
        self._seen: 'queue.SimpleQueue[Tuple[str, float]]' = queue.SimpleQueue()
        places, period_s = reference_places(robots)
        if not np.isfinite(places).any():
            raise ValueError('no robot of the reference has a tool whose place is known')
        self._alignment = LiveAlignment(places, {it.name: tuple(it.times) for it in events}, span,
                                        period_s)
        self._moment_s = 0.0
        self._watches: List[EventWatch] = []
        self._publisher = node.publisher(GHOST_PHASE_TOPIC, GhostPhase, queue_size=2)
        try:
            for event in events:
                self._watches.append(EventWatch(node, event, self._on_event))
        except ValueError:
            self.close()
            raise

    def _on_event(self, name: str) -> None:
        """Note an event; runs in a thread of the event's topic."""
        self._seen.put((name, self._node.ros_s()))

    def time_s(self, now_s: float) -> Optional[float]:
        """Return the moment of the reference run [s] that corresponds to now; None if unknown."""
        while not self._seen.empty():
            self._alignment.take_event(*self._seen.get())
        self._moment_s = self._measured_s(now_s)
        if all(it.has_ended for it in self._joints.values()):
            self._alignment.lose()
        else:
            self._alignment.advance(self._moment_s, np.concatenate([
                tool_position(robot.tool_at(self._joints[robot.device].at(now_s)))
                for robot in self._robots]))
        phase_s = self._alignment.phase_s
        self._publisher.publish(GhostPhase(
            stamp=rospy.Time.from_sec(self._moment_s), known=phase_s is not None,
            reference=math.nan if phase_s is None else phase_s,
            elapsed=self._alignment.elapsed_s, behind=self._alignment.behind_s))
        return phase_s

    def _measured_s(self, now_s: float) -> float:
        """Return the time of the last known positions; it goes back only with the clock."""
        stamp_s = max(it.stamp_s for it in self._joints.values())
        moment_s = stamp_s if now_s - _STALE_AFTER_S < stamp_s <= now_s else now_s
        return max(moment_s, self._moment_s) if self._moment_s <= now_s else moment_s

    def close(self) -> None:
        """Stop listening and publishing."""
        for watch in self._watches:
            watch.close()
        for joints in self._joints.values():
            joints.close()
        self._publisher.unregister()


def reference_places(robots: Sequence[GhostRobot]) -> Tuple[np.ndarray, float]:
    """Return the tools' positions (n, 3 k) [m], each in its robot's root, and the period [s].

    A long reference run has a longer period.
    """
    duration_s = max((it.end_s for it in robots), default=0.0)
    period_s = max(PERIOD_S, duration_s / _MAX_ROWS)
    times_s = period_s * np.arange(int(duration_s / period_s) + 1)
    return np.array([np.concatenate([tool_position(robot.tool(time_s)) for robot in robots])
                     for time_s in times_s.tolist()]), period_s


def tool_position(place: Optional[Placement]) -> np.ndarray:
    """Return a position (3,) [m]; NaN if unknown."""
    return np.full(3, np.nan) if place is None else np.array(place.position)
