# SPDX-License-Identifier: BSD-3-Clause
"""Follows the live robots: which moment of the reference belongs to now, and what they differ."""
from __future__ import annotations

import math
import queue
from typing import List, Mapping, Optional, Sequence, Tuple

import numpy as np
import rospy

from process_visualizer.motion.kinematics import Placement
from process_visualizer.msg import GhostEvent, GhostPhase
from process_visualizer.nodes.common.node_handle import NodeHandle
from process_visualizer.nodes.ghost.event_watch import EventWatch
from process_visualizer.nodes.ghost.ghost_robot import GhostRobot
from process_visualizer.nodes.ghost.live_joints import LiveJoints
from process_visualizer.ros_names import GHOST_PHASE_TOPIC
from process_visualizer.runs.alignment.live_alignment import PERIOD_S, LiveAlignment, Span

_MOST_ROWS = 20_000
_OLD_S = 0.2
"""Joints that are older do not come any longer: the robots stand still as far as is known."""


class LiveFollower:
    """Finds the phase of the run that goes on, and publishes it; runs in one thread."""

    def __init__(self, node: NodeHandle, robots: Sequence[GhostRobot],
                 joints: Mapping[str, LiveJoints], events: Sequence[GhostEvent],
                 span: Optional[Span]) -> None:
        """Take the robots of the reference, and the joints of the live ones by device.

        Raises:
            ValueError: no robot has a tool that can be followed, or an event is none.
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
        """Return the moment of the reference [s] that belongs to now; None: to none."""
        while not self._seen.empty():
            self._alignment.take_event(*self._seen.get())
        self._moment_s = self._measured_s(now_s)
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
        """Return the time of the robots' known position; it goes back only with the clock."""
        stamp_s = max(it.stamp_s for it in self._joints.values())
        moment_s = stamp_s if now_s - _OLD_S < stamp_s <= now_s else now_s
        return max(moment_s, self._moment_s) if self._moment_s <= now_s else moment_s

    def close(self) -> None:
        """Listen and publish no longer."""
        for watch in self._watches:
            watch.close()
        for joints in self._joints.values():
            joints.close()
        self._publisher.unregister()


def reference_places(robots: Sequence[GhostRobot]) -> Tuple[np.ndarray, float]:
    """Return where the tools are (n, 3 k) [m], each in its robot's root, and the period [s].

    A long reference has a longer period.
    """
    duration_s = max((it.end_s for it in robots), default=0.0)
    period_s = max(PERIOD_S, duration_s / _MOST_ROWS)
    times_s = period_s * np.arange(int(duration_s / period_s) + 1)
    return np.array([np.concatenate([tool_position(robot.tool(time_s)) for robot in robots])
                     for time_s in times_s.tolist()]), period_s


def tool_position(place: Optional[Placement]) -> np.ndarray:
    """Return a position (3,) [m]; NaN if it is not known."""
    return np.full(3, np.nan) if place is None else np.array(place.position)
