# SPDX-License-Identifier: BSD-3-Clause
"""Follows the live robots: finds the moment of the reference run that matches the present."""
from __future__ import annotations

import math
import queue
import threading
from typing import Any, Callable, Dict, List, Mapping, Optional, Sequence, Tuple

import numpy as np
import roslib.message
import rospy
from sensor_msgs.msg import JointState

from process_visualizer.bagio.number_places import FieldPath
from process_visualizer.curves.sending_habit import SendingHabit
from process_visualizer.msg import GhostEvent, GhostPhase
from process_visualizer.nodes.common.markers import RefreshRate
from process_visualizer.nodes.common.newest_message import RawMessage, decode
from process_visualizer.nodes.common.node_handle import NodeHandle
from process_visualizer.nodes.ghost.ghost_robot import GhostRobot
from process_visualizer.robot.kinematics import Placement
from process_visualizer.ros_names import GHOST_PHASE_TOPIC
from process_visualizer.runs.alignment.live_alignment import PERIOD_S, FollowedSpan, LiveAlignment
from process_visualizer.runs.event import Passages


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
        """Return whether joint states that were sent at a rate have stopped coming."""
        with self._lock:
            age_s = self._node.monotonic_s() - self._arrived_s
            return _ENDED_S < age_s < math.inf and age_s > self._habit.holds_for_s(_ENDED_S)

    def close(self) -> None:
        """Unsubscribe."""
        self._subscriber.unregister()


_ENDED_S = 5.0
"""Time without joints [s] after which the run may be anywhere, or over."""
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
"""Age of joints [s] from which they count as no longer sent, and the robots as at rest."""


class LiveFollower:
    """Finds the phase of the present run, and publishes it; runs in one thread."""

    def __init__(self, node: NodeHandle, robots: Sequence[GhostRobot],
                 joints: Mapping[str, LiveJoints], events: Sequence[GhostEvent],
                 span: Optional[FollowedSpan]) -> None:
        """Take the robots of the reference run, and the joints of the live robots by device.

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
        """Run in a thread of the event's topic."""
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
