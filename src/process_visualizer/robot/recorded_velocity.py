# SPDX-License-Identifier: BSD-3-Clause
"""The velocity of a tool at any time of a recording, and over the whole recording."""
from __future__ import annotations

from bisect import bisect_right
from typing import Callable, Iterator, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from process_visualizer.robot.late_arrivals import SILENCE_S
from process_visualizer.robot.measuring_time import certain_rows, measuring_times
from process_visualizer.robot.rotations import Quaternion, Triple
from process_visualizer.robot.velocity import GAP_S, TIE_S, slope_of_rotations

# Least-squares slopes over the windows of a whole series, as in VelocityEstimator.

_BLOCK = 4096  # windows: few enough for the precision of running sums


class SlopeWindows(NamedTuple):
    """Windows of a series, in order of their times; one row per window.

    ``rows`` (k,) are the samples that are not ignored. A window has the samples from ``first`` (m,)
    to before ``behind`` (m,), which are indices of ``rows``, and belongs to a ``segment`` (m,) of
    the series. ``middle_s`` (m,) is the mean of its times; ``slope`` (m, d) belongs to its values.
    """

    rows: np.ndarray
    first: np.ndarray
    behind: np.ndarray
    segment: np.ndarray
    middle_s: np.ndarray
    slope: np.ndarray


def segments(times_s: np.ndarray, gap_s: float = GAP_S) -> np.ndarray:
    """Return the segment number (n,) of each time; a gap above gap_s begins a new segment."""
    return np.concatenate(([0], np.cumsum(np.diff(times_s) > gap_s)))[:len(times_s)]


def slope_windows(times_s: np.ndarray, values: np.ndarray, window_s: float,
                  gap_s: float = GAP_S) -> SlopeWindows:
    """Return the windows that end with each sample, and shorter ones at the end of a segment.

    They are as long as those of VelocityEstimator, at least half of ``window_s``. A repeated value
    is ignored for up to half a window; no window extends over a gap of more than gap_s.

    Args:
        times_s: (n,), ascending.
        values: (n, d).
        window_s, gap_s: [s].
    """
    rows = np.flatnonzero(_without_repetitions(times_s, values, 0.5 * window_s - TIE_S))
    segment = segments(times_s, gap_s)[rows]
    times_s, values = times_s[rows], values[rows]
    first, behind = _window_bounds(times_s, segment, window_s)
    parts = [_slopes(times_s, values, first[block], behind[block]) for block in _blocks(len(first))]
    middle_s, slope = (np.concatenate(column) for column in zip(*parts))
    return SlopeWindows(rows, first, behind, segment[first], middle_s, slope)


def _without_repetitions(times_s: np.ndarray, values: np.ndarray, hold_s: float) -> np.ndarray:
    """Return a mask of the samples that are not ignored; see VelocityEstimator."""
    kept = np.ones(len(times_s), bool)
    repeated = np.flatnonzero((values[1:] == values[:-1]).all(axis=1)) + 1
    times = times_s[repeated].tolist()
    last_s, last_row = 0.0, -1
    for row, time_s in zip(repeated.tolist(), times):
        if row - 1 != last_row:  # new repetitions, of the sample before
            last_s = float(times_s[row - 1])
        if time_s - last_s < hold_s:
            kept[row] = False
        else:
            last_s = time_s
        last_row = row
    return kept


def _window_bounds(times_s: np.ndarray, segment: np.ndarray,
                   window_s: float) -> Tuple[np.ndarray, np.ndarray]:
    """Return the first sample (m,) of each window that is long enough, and the one behind it."""
    first = np.searchsorted(times_s, times_s - window_s + TIE_S, side='right') - 1
    first = np.maximum(first, np.searchsorted(segment, segment, side='left'))
    behind = np.searchsorted(segment, segment, side='right')
    # After the windows that end with each sample, those that begin later than the last of them.
    begin_late = np.flatnonzero(np.arange(len(times_s)) > first[behind - 1])
    order = np.argsort(np.concatenate((np.arange(len(times_s)), behind[begin_late] - 1)),
                       kind='stable')
    first = np.concatenate((first, begin_late))[order]
    behind = np.concatenate((np.arange(len(times_s)) + 1, behind[begin_late]))[order]
    known = times_s[behind - 1] - times_s[first] >= 0.5 * window_s - TIE_S
    return first[known], behind[known]


def _blocks(count: int) -> Iterator[slice]:
    """Yield the rows of all windows in blocks, at least one."""
    for start in range(0, max(count, 1), _BLOCK):
        yield slice(start, min(start + _BLOCK, count))


def _slopes(times_s: np.ndarray, values: np.ndarray, first: np.ndarray,
            behind: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """Return the mean times (m,) and slopes (m, d) of some windows."""
    if not len(first):
        return np.empty(0), np.empty((0, values.shape[1]))
    origin, end = int(first[0]), int(behind[-1])
    lever = times_s[origin:end] - times_s[origin]
    moved = values[origin:end] - values[origin]
    count = (behind - first).astype(float)
    sums = _window_sums(np.column_stack((lever, lever * lever, moved,
                                         lever[:, np.newaxis] * moved)),
                        first - origin, behind - origin)
    width = values.shape[1]
    inertia = sums[:, 1] - sums[:, 0] ** 2 / count
    leaning = sums[:, 2 + width:] - sums[:, 2:2 + width] * (sums[:, 0] / count)[:, np.newaxis]
    return times_s[origin] + sums[:, 0] / count, leaning / inertia[:, np.newaxis]


def _window_sums(columns: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    total = np.concatenate((np.zeros((1, columns.shape[1])), np.cumsum(columns, axis=0)))
    result: np.ndarray = total[high] - total[low]
    return result


WINDOW_S = 0.2


_MAX_POSITION_M = 1e8
"""Beyond the size of the Earth."""


def speeds(times_s: np.ndarray, positions: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """Return times [s] (m,) and speeds [m/s] (m,), as in RecordedVelocity.

    A speed is the least-squares slope of positions over a window of WINDOW_S, at its mean time.
    Positions that no tool can have are left out: a damaged message would set the scale of a curve.

    Args:
        times_s: (n,), ascending.
        positions: (n, 3) [m].
    """
    is_possible = (np.abs(positions) < _MAX_POSITION_M).all(axis=1)
    if not is_possible.all():
        times_s, positions = times_s[is_possible], positions[is_possible]
    windows = slope_windows(times_s, positions, WINDOW_S)
    return windows.middle_s, np.sqrt((windows.slope * windows.slope).sum(axis=1))


class _Place(NamedTuple):
    """A time between the middles of two windows, or at a single window (before equals after)."""

    before: int
    after: int
    share: float  # weight of the window after


class RecordedVelocity:
    """The velocity at a time of a recording, from the poses before and after that time.

    The velocity is the slope over a window with the time in its middle: the windows are those of
    ``speeds``, so a timeline's curve agrees, with linear interpolation between their middles. Where
    poses begin or end (at an end of the recording, or at a gap), the existing part of the window is
    used; more than half a window away from poses there is no velocity.
    """

    def __init__(self, times_s: np.ndarray, positions: np.ndarray,
                 quaternions: Optional[np.ndarray] = None, window_s: float = WINDOW_S) -> None:
        """Initialize with poses.

        Args:
            times_s: the measuring times (n,), ascending; see ``measuring_times``.
            positions: (n, 3) [m].
            quaternions: (n, 4) x y z w, of any length but zero; without them there is no angular
                velocity.
            window_s: [s].
        """
        self._window_s = window_s
        self._times_s = times_s
        gap_s = max(GAP_S, 2.0 * window_s)
        segment = segments(times_s, gap_s)
        self._begins_s, self._ends_s = _segment_bounds(times_s, segment)
        self._moving = slope_windows(times_s, positions, window_s, gap_s)
        self._turning: Optional[SlopeWindows] = None
        if quaternions is not None:
            self._quaternions = quaternions
            self._turning = slope_windows(times_s, np.hstack((positions, quaternions)), window_s,
                                          gap_s)

    def velocity(self, time_s: float) -> Optional[Triple]:
        """Return the velocity (3,) [m/s] in the frame of the poses; None without one."""
        windows = self._moving
        return self._between(windows, time_s, lambda window: windows.slope[window])

    def angular_velocity(self, time_s: float) -> Optional[Triple]:
        """Return the angular velocity (3,) [rad/s] in the frame of the poses; None without one."""
        windows = self._turning
        if windows is None:
            return None
        return self._between(windows, time_s,
                             lambda window: np.array(self._slope_of_rotations(windows, window)))

    def age_s(self, time_s: float) -> Optional[float]:
        """Return the age [s] of the last pose at a time [s]; None before the first pose."""
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


_AFTER_S = 1e-6
"""Time after the last row of a segment at which the values become NaN."""


def velocity_rows(times_s: np.ndarray, positions: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    """Return times [s] (n,) and velocities (n, 3) for linear interpolation.

    The velocities are those of RecordedVelocity; NaN without one.
    """
    gap_s = max(GAP_S, 2.0 * WINDOW_S)
    windows = slope_windows(times_s, positions, WINDOW_S, gap_s)
    segment = segments(times_s, gap_s)
    parts: List[Tuple[np.ndarray, np.ndarray]] = []
    for number in np.unique(windows.segment).tolist():
        inside, own = windows.segment == number, times_s[segment == number]
        middle_s, slope = windows.middle_s[inside], windows.slope[inside]
        begin_s = min(own[0] - 0.5 * WINDOW_S, middle_s[0])
        end_s = max(own[-1] + 0.5 * WINDOW_S, middle_s[-1])
        parts.append((np.concatenate(([begin_s], middle_s, [end_s, end_s + _AFTER_S])),
                      np.vstack((slope[:1], slope, slope[-1:], np.full((1, 3), np.nan)))))
    if not parts:
        return np.empty(0), np.empty((0, 3))
    joined_s, slopes = (np.concatenate(column) for column in zip(*parts))
    return np.maximum.accumulate(joined_s), slopes


def _segment_bounds(times_s: np.ndarray, segment: np.ndarray) -> Tuple[List[float], List[float]]:
    """Return the first and the last time of each segment."""
    ends = np.flatnonzero(np.diff(segment))
    begins = np.concatenate(([0], ends + 1)) if len(segment) else ends
    ends = np.append(ends, len(segment) - 1) if len(segment) else ends
    return times_s[begins].tolist(), times_s[ends].tolist()


MARGIN_S = SILENCE_S + 1.2
"""Maximum distance of poses from a position whose velocity they affect: a silence, poses that
arrived after it, and a window."""
AHEAD_S = 2.0  # real time by which poses are read before they are needed
BESIDE_S = 1.0  # of the recording, on either side of a position: for steps and reversals
MAX_S = 4.0  # maximum part read at once
_SLACK_S = 0.1  # of real time and of the recording: progress of playback during reading


class PosePart(NamedTuple):
    """A part of a recording [s from its beginning]."""

    begin_s: float
    end_s: float

    def holds(self, part: 'PosePart') -> bool:
        """Return whether another part lies within this one."""
        return self.begin_s <= part.begin_s and part.end_s <= self.end_s

    def around(self, margin_s: float) -> 'PosePart':
        """Return the part extended by a margin on either side."""
        return PosePart(self.begin_s - margin_s, self.end_s + margin_s)

    def within(self, part: 'PosePart') -> 'PosePart':
        """Return this part limited to another one."""
        return PosePart(min(max(self.begin_s, part.begin_s), part.end_s),
                        max(min(self.end_s, part.end_s), part.begin_s))


class RecordedPose(NamedTuple):
    """A pose with its time of recording and its stamp (NaN: none) [s from the beginning]."""

    recorded_s: float
    stamp_s: float
    position: Sequence[float]  # (3,) [m]
    quaternion: Quaternion


class RecordedPoses(NamedTuple):
    """The poses of a part of a recording, in order of recording."""

    part: PosePart
    poses: List[RecordedPose]

    def joined(self, more: 'RecordedPoses') -> 'RecordedPoses':
        """Return the poses of this part and of an adjacent one, before or after it."""
        if more.part.begin_s < self.part.begin_s:
            return more.joined(self)
        new = [pose for pose in more.poses if pose.recorded_s > self.part.end_s]
        return RecordedPoses(PosePart(self.part.begin_s, more.part.end_s), self.poses + new)

    def only(self, part: PosePart) -> 'RecordedPoses':
        """Return the poses within a part, or all poses if the part does not overlap this one."""
        if part.begin_s >= self.part.end_s or part.end_s <= self.part.begin_s:
            return self
        part = self.part.within(part)
        return RecordedPoses(part, [pose for pose in self.poses
                                    if part.begin_s <= pose.recorded_s <= part.end_s])

    def velocity(self, window_s: float, period_s: Optional[float] = None) -> RecordedVelocity:
        """Return the velocity, which is valid in the part except at its margins.

        ``period_s`` is the period of a driver without stamps over the whole recording [s].
        """
        recorded_s, stamps_s = (np.array([pose[column] for pose in self.poses], float)
                                for column in (0, 1))
        positions = np.array([pose.position for pose in self.poses], float).reshape(-1, 3)
        quaternions = np.array([pose.quaternion for pose in self.poses], float).reshape(-1, 4)
        times_s = measuring_times(recorded_s, stamps_s, period_s)
        rows = certain_rows(recorded_s, stamps_s, period_s, self.part.begin_s)
        return RecordedVelocity(times_s[rows], positions[rows], quaternions[rows], window_s)


def needed_part(position_s: float, duration_s: float) -> PosePart:
    """Return the part of a recording that is needed for the velocity at a position."""
    return PosePart(position_s, position_s).around(MARGIN_S).within(PosePart(0.0, duration_s))


def next_part(known: Optional[PosePart], position_s: float, speed: float,
              duration_s: float) -> Optional[PosePart]:
    """Return the part to read next: first the needed part, then that needed soon.

    Args:
        known: the part already read; the result is adjacent to it, or replaces it.
        position_s: position in the recording, whose length is duration_s.
        speed: bag seconds per second; below 0 backwards, 0 while paused.
    """
    whole, needed = PosePart(0.0, duration_s), needed_part(position_s, duration_s)
    if known is None or known.begin_s > needed.end_s or known.end_s < needed.begin_s:
        return needed.around(_SLACK_S * (1.0 + abs(speed))).within(whole)
    for wanted in (needed, _wanted_part(needed, speed)):
        part = _beside(known, wanted.within(whole), speed)
        if part is not None:
            return part.within(whole)
    return None


def kept_part(position_s: float, speed: float) -> PosePart:
    """Return the part whose poses should be kept."""
    return _wanted_part(PosePart(position_s, position_s).around(MARGIN_S), speed).around(MAX_S)


def _wanted_part(needed: PosePart, speed: float) -> PosePart:
    ahead_s = AHEAD_S * speed
    return PosePart(needed.begin_s + min(ahead_s, -BESIDE_S), needed.end_s + max(ahead_s, BESIDE_S))


def _beside(known: PosePart, wanted: PosePart, speed: float) -> Optional[PosePart]:
    """Return the part adjacent to a known one that is too short, in playback direction first."""
    before = wanted.begin_s < known.begin_s
    if wanted.end_s > known.end_s and (speed >= 0.0 or not before):
        return PosePart(known.end_s, known.end_s + MAX_S)
    return PosePart(known.begin_s - MAX_S, known.begin_s) if before else None
