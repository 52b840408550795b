# SPDX-License-Identifier: BSD-3-Clause
"""The velocity of a tool at any time of a recording: a function of the recording and the time."""
from __future__ import annotations

from bisect import bisect_right
from typing import Callable, List, NamedTuple, Optional, Tuple

import numpy as np

from process_visualizer.motion.rotations import Triple
from process_visualizer.motion.velocity.slope_windows import SlopeWindows, segments, slope_windows
from process_visualizer.motion.velocity.speed_series import WINDOW_S
from process_visualizer.motion.velocity.velocity_estimator import GAP_S, slope_of_rotations


class _Place(NamedTuple):
    """A time between the middles of two windows, or at one of them (then it stands twice)."""

    before: int
    after: int
    share: float  # of the latter


class RecordedVelocity:
    """The velocity at a time of a recording, from the poses before and after it.

    It is the slope over a window of which the time is the middle: those of speed_series.speeds,
    so a timeline's curve says the same, and between their middles on the straight line. Where
    poses begin or end (at an end of the recording, or at a gap) it is the part of the window that
    is there; further than half a window away from them there is no velocity.
    """

    def __init__(self, times_s: np.ndarray, positions: np.ndarray,
                 quaternions: Optional[np.ndarray] = None, window_s: float = WINDOW_S) -> None:
        """Take poses.

        Args:
            times_s: when they were measured (n,), rising, see speed_series.measuring_times.
            positions: (n, 3) [m].
            quaternions: (n, 4) x y z w, of any length but zero; without them there is no angular
                velocity.
            window_s: [s].
        """
        self._window_s = window_s
        self._times_s = times_s
        gap_s = max(GAP_S, 2.0 * window_s)
        segment = segments(times_s, gap_s)
        self._begins_s, self._ends_s = _bounds(times_s, segment)
        self._moving = slope_windows(times_s, positions, window_s, gap_s)
        self._turning: Optional[SlopeWindows] = None
        if quaternions is not None:
            self._quaternions = quaternions
            self._turning = slope_windows(times_s, np.hstack((positions, quaternions)), window_s,
                                          gap_s)

    def velocity(self, time_s: float) -> Optional[Triple]:
        """Return the velocity (3,) [m/s] in the frame of the poses; None where there is none."""
        windows = self._moving
        return self._between(windows, time_s, lambda window: windows.slope[window])

    def angular_velocity(self, time_s: float) -> Optional[Triple]:
        """Return the angular velocity (3,) [rad/s] in the frame of the poses; None as above."""
        windows = self._turning
        if windows is None:
            return None
        return self._between(windows, time_s,
                             lambda window: np.array(self._slope_of_rotations(windows, window)))

    def age_s(self, time_s: float) -> Optional[float]:
        """Return how long before a time [s] the last pose was measured; None before the first."""
        count = bisect_right(self._times_s, time_s)
        return time_s - float(self._times_s[count - 1]) if count else None

    def _between(self, windows: SlopeWindows, time_s: float,
                 slope: Callable[[int], np.ndarray]) -> Optional[Triple]:
        place = self._place(windows, time_s)
        if place is None:
            return None
        value = slope(place.before)
        if place.share:
            value = value + place.share * (slope(place.after) - value)
        x, y, z = value.tolist()
        return x, y, z

    def _place(self, windows: SlopeWindows, time_s: float) -> Optional[_Place]:
        after = bisect_right(windows.middle_s, time_s)
        near = [window for window in (after - 1, after) if 0 <= window < len(windows.middle_s)]
        if len(near) == 2 and windows.segment[near[0]] == windows.segment[near[1]]:
            begin_s, end_s = windows.middle_s[near]
            return _Place(near[0], near[1], float((time_s - begin_s) / (end_s - begin_s)))
        return next((_Place(window, window, 0.0) for window in near
                     if self._is_near(int(windows.segment[window]), time_s)), None)

    def _is_near(self, segment: int, time_s: float) -> bool:
        half_s = 0.5 * self._window_s
        return self._begins_s[segment] - half_s <= time_s <= self._ends_s[segment] + half_s

    def _slope_of_rotations(self, windows: SlopeWindows, window: int) -> Triple:
        rows = windows.rows[windows.first[window]:windows.behind[window]]
        return slope_of_rotations(self._times_s[rows].tolist(), self._quaternions[rows].tolist())


def _bounds(times_s: np.ndarray, segment: np.ndarray) -> Tuple[List[float], List[float]]:
    """Return the first and the last time of each segment."""
    ends = np.flatnonzero(np.diff(segment))
    begins = np.concatenate(([0], ends + 1)) if len(segment) else ends
    ends = np.append(ends, len(segment) - 1) if len(segment) else ends
    return times_s[begins].tolist(), times_s[ends].tolist()
