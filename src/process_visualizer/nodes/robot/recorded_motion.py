# SPDX-License-Identifier: BSD-3-Clause
"""The tool's velocity at the position of playback, read from the recording ahead of time."""
from __future__ import annotations

import math
import threading
from typing import Callable, NamedTuple, Optional, Tuple

from process_visualizer.clients.service_connection import ServiceUnreachable
from process_visualizer.motion.playback_clock import PlaybackClock
from process_visualizer.motion.rotations import Triple
from process_visualizer.motion.velocity.recorded_poses import (
    Part,
    RecordedPoses,
    kept_part,
    needed_part,
    next_part,
)
from process_visualizer.motion.velocity.recorded_velocity import RecordedVelocity
from process_visualizer.msg import PlayerState
from process_visualizer.nodes.common.markers import Pace
from process_visualizer.nodes.common.node_handle import NodeHandle
from process_visualizer.nodes.robot.recorded_reading import Reading, RecordedReader
from process_visualizer.playback.timeline import MAX_RATE
from process_visualizer.ros_names import PLAYER_STATE_TOPIC

MOMENT_S = 0.05  # in which an operator does not see that a number has not changed yet
_RETRY_S, _WARNING_S = 1.0, 10.0


class RecordedMoment(NamedTuple):
    """A position of playback, its wall time [s], and the velocities around it."""

    position_s: float
    wall_s: float
    around: RecordedVelocity

    def velocity(self) -> Optional[Triple]:
        """Return the velocity (3,) [m/s] in the base frame; None if the tool has none."""
        return self.around.velocity(self.position_s)

    def angular_velocity(self) -> Optional[Triple]:
        """Return the angular velocity (3,) [rad/s] in the base frame; None as above."""
        return self.around.angular_velocity(self.position_s)

    def age_s(self) -> Optional[float]:
        """Return the age of the last pose [s of the recording]; None before the first."""
        return self.around.age_s(self.position_s)


class _Known(NamedTuple):
    poses: RecordedPoses
    velocity: RecordedVelocity


class RecordedMotion:
    """Keeps the poses around the position of playback.

    A worker reads them with the player's service ~read: first the poses needed for the position,
    then those ahead. So a velocity depends only on the recording and the position, not on earlier
    messages or arrival times.
    """

    def __init__(self, node: NodeHandle, reader: RecordedReader, clock: PlaybackClock,
                 window_s: float, on_change: Callable[[], None]) -> None:
        """Prepare; `start` begins to follow the player.

        Args:
            node: its connection to ROS.
            reader: reads the poses.
            clock: the clock of the player's states.
            window_s: the window of the slopes [s].
            on_change: called, in various threads, with each state of the player, and when more is
                known.
        """
        self._node, self._reader = node, reader
        self._clock = clock
        self._window_s = window_s
        self._on_change = on_change
        self._lock = threading.Lock()
        self._recording: Tuple[object, ...] = ()  # begin, duration, files, topics
        self._duration_s = 0.0
        self._is_played: Optional[bool] = None  # not known yet
        self._known: Optional[_Known] = None
        self._problem = ''
        self._retry_s = 0.0
        self._awaited_s = math.inf
        self._warnings = Pace(_WARNING_S)
        self._worker = node.worker(self._read, 'recorded poses')

    def start(self) -> None:
        """Begin to follow the player."""
        self._node.subscribe(PLAYER_STATE_TOPIC, PlayerState, self._take_state)

    def is_in_charge(self) -> bool:
        """Return whether a player plays the poses, or may play them."""
        return self._is_played is not False and self._clock.follows_player(self._node.wall_s())

    @property
    def problem(self) -> str:
        """Return why the recording cannot give a velocity; '' if it can."""
        return self._problem if self.is_in_charge() else ''

    def is_awaited(self) -> bool:
        """Return whether the velocity at the position will be known in a moment."""
        if not self.is_in_charge() or self.moment() is not None:
            self._awaited_s = math.inf
            return False
        self._awaited_s = min(self._awaited_s, self._node.monotonic_s())
        return self._node.monotonic_s() < self._awaited_s + MOMENT_S

    def moment(self) -> Optional[RecordedMoment]:
        """Return the moment at the present position; None while it is not known."""
        wall_s = self._node.wall_s()
        bag, known = self._clock.present(wall_s), self._known
        if bag is None or known is None:
            return None
        position_s = self._within(bag.time_s)
        if not known.poses.part.holds(needed_part(position_s, self._duration_s)):
            return None
        return RecordedMoment(position_s, wall_s, known.velocity)

    def forget(self) -> None:
        """Read everything again, as messages have another meaning now."""
        with self._lock:
            self._recording = ()

    def _take_state(self, state: PlayerState) -> None:
        recording = (state.begin, state.duration, *state.files,
                     *(topic.name for topic in state.topics))
        with self._lock:
            if recording != self._recording:
                self._recording, self._duration_s = recording, state.duration
                self._is_played = self._known = None
        self._worker.wake()
        self._on_change()

    def _within(self, position_s: float) -> float:
        return min(max(position_s, 0.0), self._duration_s)

    def _read(self) -> Optional[float]:
        """Read the part that is needed next, and go on (0 s) until none is."""
        with self._lock:
            recording, part = self._recording, self._next_part()
        if part is None:
            return None
        self._extend(recording, part)
        return 0.0

    def _next_part(self) -> Optional[Part]:
        bag = self._clock.present(self._node.wall_s())
        if (bag is None or not self._recording or self._node.monotonic_s() < self._retry_s
                or not self.is_in_charge()):
            return None
        known = None if self._known is None else self._known.poses.part
        return next_part(known, self._within(bag.time_s), _bounded(bag.rate), self._duration_s)

    def _extend(self, recording: Tuple[object, ...], part: Part) -> None:
        try:
            reading = self._reader.read(Part(round(part.begin_s, 9), round(part.end_s, 9)))
        except ServiceUnreachable as error:
            now_s = self._node.monotonic_s()
            # not for the first time: the player may just have ended
            if self._retry_s and self._warnings.is_due(now_s):
                self._node.warn(f'{self._reader.topic}: its recorded velocities are not known: '
                                f'{error}')
            self._retry_s = now_s + _RETRY_S
            return
        self._retry_s = 0.0
        known = None if reading is None else self._joined(reading)
        with self._lock:
            if self._recording is recording:
                self._is_played, self._known = reading is not None, known
                self._problem = '' if reading is None else reading.problem
        self._on_change()

    def _joined(self, reading: Reading) -> _Known:
        poses, before = reading.poses, self._known
        if before is not None and (before.poses.part.end_s == poses.part.begin_s
                                   or before.poses.part.begin_s == poses.part.end_s):
            poses = before.poses.joined(poses)
        bag = self._clock.present(self._node.wall_s())
        if bag is not None:
            poses = poses.only(kept_part(self._within(bag.time_s), _bounded(bag.rate)))
        return _Known(poses, poses.velocity(self._window_s, reading.period_s))


def _bounded(rate: float) -> float:
    """Return the rate for which poses are read ahead; at higher ones velocities may be missing."""
    return min(max(rate, -MAX_RATE), MAX_RATE)
