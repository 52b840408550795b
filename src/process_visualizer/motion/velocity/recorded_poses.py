# SPDX-License-Identifier: BSD-3-Clause
"""The poses of a part of a recording, and which part is needed next."""
from __future__ import annotations

from typing import List, NamedTuple, Optional, Sequence

import numpy as np

from process_visualizer.motion.rotations import Quaternion
from process_visualizer.motion.velocity.recorded_velocity import RecordedVelocity
from process_visualizer.motion.velocity.speed_series import measuring_times

MARGIN_S = 1.2
"""What lies further from a position has no part in its velocity: the greatest gap, and a window."""
AHEAD_S = 2.0  # real time by which poses are there before they are needed
BESIDE_S = 1.0  # of the recording, on either side of a position: for steps, and for turning round
LONGEST_S = 4.0  # that is read at once
_SLACK_S = 0.1  # of real time and of the recording: where playback is when that has been read


class Part(NamedTuple):
    """A part of a recording [s from its beginning]."""

    begin_s: float
    end_s: float

    def holds(self, part: 'Part') -> bool:
        """Return whether another part lies within this one."""
        return self.begin_s <= part.begin_s and part.end_s <= self.end_s

    def around(self, margin_s: float) -> 'Part':
        """Return the part that goes further by a margin on either side."""
        return Part(self.begin_s - margin_s, self.end_s + margin_s)

    def within(self, part: 'Part') -> 'Part':
        """Return what of this part lies within another one."""
        return Part(min(max(self.begin_s, part.begin_s), part.end_s),
                    max(min(self.end_s, part.end_s), part.begin_s))


class RecordedPose(NamedTuple):
    """A pose: when it was recorded and its stamp (NaN: none) [s from the beginning]."""

    recorded_s: float
    stamp_s: float
    position: Sequence[float]  # (3,) [m]
    quaternion: Quaternion


class RecordedPoses(NamedTuple):
    """All poses of a part of a recording, in the order of recording."""

    part: Part
    poses: List[RecordedPose]

    def joined(self, more: 'RecordedPoses') -> 'RecordedPoses':
        """Return them with those of a part that begins where this one ends, or ends there."""
        if more.part.begin_s < self.part.begin_s:
            return more.joined(self)
        new = [pose for pose in more.poses if pose.recorded_s > self.part.end_s]
        return RecordedPoses(Part(self.part.begin_s, more.part.end_s), self.poses + new)

    def only(self, part: Part) -> 'RecordedPoses':
        """Return those that lie within a part; all where that is another part altogether."""
        if part.begin_s >= self.part.end_s or part.end_s <= self.part.begin_s:
            return self
        part = self.part.within(part)
        return RecordedPoses(part, [pose for pose in self.poses
                                    if part.begin_s <= pose.recorded_s <= part.end_s])

    def velocity(self, window_s: float, period_s: Optional[float] = None) -> RecordedVelocity:
        """Return the velocity at each time of the part but at its margins.

        Given the period of a driver without stamps [s], it is that of the whole recording.
        """
        recorded_s, stamps_s = (np.array([pose[column] for pose in self.poses], float)
                                for column in (0, 1))
        positions = np.array([pose.position for pose in self.poses], float).reshape(-1, 3)
        quaternions = np.array([pose.quaternion for pose in self.poses], float).reshape(-1, 4)
        return RecordedVelocity(measuring_times(recorded_s, stamps_s, period_s), positions,
                                quaternions, window_s)


def needed_part(position_s: float, duration_s: float) -> Part:
    """Return what has to be known of a recording for the velocity at a position."""
    return Part(position_s, position_s).around(MARGIN_S).within(Part(0.0, duration_s))


def next_part(known: Optional[Part], position_s: float, speed: float,
              duration_s: float) -> Optional[Part]:
    """Return what is to be read next: what is needed first, then what will be soon.

    Args:
        known: what has been read; the answer lies beside it, or has to take its place.
        position_s: in the recording, which is as long as duration_s.
        speed: bag seconds per second; below 0 backwards, 0 while paused.
    """
    whole, needed = Part(0.0, duration_s), needed_part(position_s, duration_s)
    if known is None or known.begin_s > needed.end_s or known.end_s < needed.begin_s:
        return needed.around(_SLACK_S * (1.0 + abs(speed))).within(whole)
    for wanted in (needed, _wanted_part(needed, speed)):
        part = _beside(known, wanted.within(whole), speed)
        if part is not None:
            return part.within(whole)
    return None


def kept_part(position_s: float, speed: float) -> Part:
    """Return the part whose poses are worth keeping."""
    return _wanted_part(Part(position_s, position_s).around(MARGIN_S), speed).around(LONGEST_S)


def _wanted_part(needed: Part, speed: float) -> Part:
    ahead_s = AHEAD_S * speed
    return Part(needed.begin_s + min(ahead_s, -BESIDE_S), needed.end_s + max(ahead_s, BESIDE_S))


def _beside(known: Part, wanted: Part, speed: float) -> Optional[Part]:
    """Return what is beside the known part where that is too short; the side of play is first."""
    before = wanted.begin_s < known.begin_s
    if wanted.end_s > known.end_s and (speed >= 0.0 or not before):
        return Part(known.end_s, known.end_s + LONGEST_S)
    return Part(known.begin_s - LONGEST_S, known.begin_s) if before else None

