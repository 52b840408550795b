# SPDX-License-Identifier: BSD-3-Clause
"""Finds the moment of the reference at which the live cell is; None outside of runs."""
from __future__ import annotations

import math
from typing import List, Mapping, NamedTuple, Optional, Sequence

import numpy as np

_NOISE_M = 0.005
"""Distance of tools that is usual at the same moment of two good runs."""
_MAX_DISTANCES = 9.0
"""Maximum squared distance, in squares of the noise: larger distances show no more."""
_UNEVEN = 0.05
"""Cost of skipping a row, or of staying at one."""
_EVENT = 4.0 * _UNEVEN
"""Cost per row between an event of the run and the same event of the reference."""
_CLEAR = 0.6 * _MAX_DISTANCES
"""Extra cost from which another alignment is clearly wrong: a single position can decide this."""
_SAME_S = 0.25
"""Rows closer together than this need not be distinguished to know where a run is [s]."""
_FURTHEST_S = 3.0
"""Maximum distance of an event that counts [s]; beyond it, the distance no longer matters."""


class PhaseTracker:
    """Tracker of the row of the reference at which a run is now, by its position and its events.

    Online time warping (Dixon 2005): for each row, it knows the cost of the best alignment that
    ends there. Alignments never go back; rows that are skipped or stayed at cost a little, so that
    a pause of the run or of the reference is recognized.
    """

    def __init__(self, reference: np.ndarray, period_s: float) -> None:
        """Set the positions (n, d) [m] of the reference at even times; NaN where unknown.

        Unknown positions are interpolated: a row that fits any position would hold the run there.
        """
        self._reference = _filled(reference)
        self._halves = _half_steps(self._reference)
        self._squares = np.maximum(np.einsum('ij,ij->i', self._halves, self._halves), 1e-18)
        self._period_s = period_s
        self._rows = np.arange(len(reference), dtype=float)
        self._costs = np.zeros(len(reference))
        self._left_s = 0.0
        self._row = 0

    @property
    def duration_s(self) -> float:
        """Return the time of the reference's last row [s]."""
        return self._period_s * (len(self._rows) - 1)

    @property
    def phase_s(self) -> float:
        """Return the time of the reference [s] that the run has reached."""
        return self._period_s * self._row + self._left_s

    @property
    def is_decided(self) -> bool:
        """Return whether the run is clearly at this row, which is before the reference's end."""
        other = np.abs(self._rows - self._row) * self._period_s > _SAME_S
        is_clear = self._costs[self._row] + _CLEAR < self._costs[other].min(initial=np.inf)
        return bool(is_clear) and self.phase_s + _SAME_S < self.duration_s

    def restart(self) -> None:
        """Forget where the run was: it may be anywhere."""
        self._costs = np.zeros(len(self._rows))
        self._left_s = 0.0

    def begin_at(self, time_s: float) -> None:
        """Put the run at a time of the reference [s], and nowhere else."""
        self._costs = np.full(len(self._rows), np.inf)
        self._left_s, self._row = 0.0, self._nearest(time_s)
        self._costs[self._row] = 0.0

    def take_event(self, times_s: Sequence[float]) -> None:
        """Process an event of the run, given the times [s] at which the reference has it."""
        away = np.full(len(self._rows), np.inf)
        for time_s in times_s:
            away = np.minimum(away, np.abs(self._rows - self._nearest(time_s)))
        if len(times_s):
            self._costs += _EVENT * np.minimum(away, _FURTHEST_S / self._period_s)
            self._row = int(self._costs.argmin())

    def advance(self, elapsed_s: float, place: np.ndarray) -> None:
        """Process the run's position (d,) [m], NaN where unknown, and the time since the last."""
        self._left_s += elapsed_s
        rows = math.floor(self._left_s / self._period_s + 0.5)
        if rows < 1:
            return
        self._left_s -= rows * self._period_s
        rows = min(rows, len(self._rows))
        costs = self._moved(rows) + rows * self._distances(place)
        self._costs = costs - costs.min()
        self._row = int(self._costs.argmin())

    def distance_m(self, place: np.ndarray, time_s: float) -> float:
        """Return the distance of a position from the reference's at a time; NaN if unknown."""
        away = place - self._reference[self._nearest(time_s)]
        away = away[np.isfinite(away)]
        return float(np.sqrt(np.sum(away * away))) if len(away) else math.nan

    def _nearest(self, time_s: float) -> int:
        return int(min(max(round(time_s / self._period_s), 0), len(self._rows) - 1))

    def _moved(self, rows: int) -> np.ndarray:
        """Return the cost of reaching each row, ``rows`` further on at an even pace."""
        before = np.concatenate((np.full(rows, np.inf), self._costs[:-rows]))
        before[-1] = min(before[-1], self._costs[-rows:].min())  # the reference has ended
        passed = np.minimum.accumulate(before - _UNEVEN * self._rows) + _UNEVEN * self._rows
        for stayed in range(1, rows + 1):
            later = self._costs[:len(self._costs) - rows + stayed]
            passed[rows - stayed:] = np.minimum(passed[rows - stayed:], later + _UNEVEN * stayed)
        result: np.ndarray = passed
        return result

    def _distances(self, place: np.ndarray) -> np.ndarray:
        """Return squared distances to the piece of the path at each row, in squares of the noise.

        So it does not matter where exactly on the path the rows are.
        """
        away = place - self._reference
        away[~np.isfinite(away)] = 0.0
        share = (np.einsum('ij,ij->i', away, self._halves) / self._squares).clip(-1.0, 1.0)
        away -= share[:, np.newaxis] * self._halves
        result: np.ndarray = np.minimum(np.einsum('ij,ij->i', away, away) / _NOISE_M ** 2,
                                        _MAX_DISTANCES)
        return result


def _filled(places: np.ndarray) -> np.ndarray:
    """Return the positions (n, d), interpolated where unknown; a column without any stays."""
    rows, columns = np.arange(len(places)), []
    for column in places.T:
        known = np.isfinite(column)
        columns.append(np.interp(rows, rows[known], column[known]) if known.any() else column)
    return np.stack(columns, axis=1)


def _half_steps(places: np.ndarray) -> np.ndarray:
    """Return half of the mean step around each row (n, d); 0 where unknown."""
    around = np.concatenate((places[:1], places, places[-1:]))
    halves: np.ndarray = np.nan_to_num((around[2:] - around[:-2]) / 4.0)
    return halves


PERIOD_S = 0.02
_NEAR_M, _FAR_M = 0.1, 0.2
_LOST_S = 2.0
"""Time after which a robot far from the reference is doing something else [s]."""
_MAX_STRETCH = 1.5
"""Maximum duration of what follows the end event, as a multiple of the reference's."""
_WRONG_S = 1.0
"""A shorter step back in the reference is noise; a longer one corrects an error [s]."""
_LATE_S = 0.5
"""Maximum age of a position compared with the last event [s]; beyond it, the clock was set back."""
_UNSEEN_S, _RESUMES_S = 0.3, 0.5
"""Minimum gap in the positions in which an event may come unnoticed, and time after the gap in
which such an event is noticed [s]."""
_AT_END_S = 0.5
"""Time at the end of the reference after which a run without a known begin or end is over [s]."""
_MAX_GAP_S = 5.0
"""Time without data after which the run may be anywhere [s]."""


class FollowedSpan(NamedTuple):
    """The names of the events that begin and end a run."""

    begin: str
    end: str


_APART_M = 0.01
"""Difference of distances [m] that shows at which of two moments of the reference the tools are."""


class LiveAlignment:
    """Live alignment: the moment of the reference that corresponds to now, if there is one.

    A run begins with its event, or when the robots are found to move as in the reference. Within a
    run the phase does not go back, unless it was wrong by more than a second.
    """

    def __init__(self, reference: np.ndarray, events: Mapping[str, Sequence[float]],
                 span: Optional[FollowedSpan] = None, period_s: float = PERIOD_S) -> None:
        """Set the reference: its positions (n, d) [m], and the times [s] of its events."""
        self._tracker = PhaseTracker(reference, period_s)
        self._events, self._span = events, span
        self._last_s: Optional[float] = None
        self._seen_s = self._resumed_s = -math.inf  # last position; first one after a gap
        self._place = np.full(reference.shape[1:], np.nan)
        self._phase_s = 0.0
        self._forget()

    def _forget(self) -> None:
        """Look for another run, because this one has ended or was lost."""
        self._tracker.restart()
        self._is_known = False
        self._begun_s: Optional[float] = None
        self._far_since_s: Optional[float] = None
        self._ends_s = self._at_end_s = math.inf

    @property
    def phase_s(self) -> Optional[float]:
        """Return the time of the reference [s] that corresponds to now; None if it is unknown."""
        return self._phase_s if self._is_known else None

    @property
    def elapsed_s(self) -> float:
        """Return the time since the run's begin event [s].

        NaN if the event was not seen, or noticed after a gap in which it may have come at any time.
        """
        if self._begun_s is None or self._last_s is None or not self._is_known:
            return math.nan
        return self._last_s - self._begun_s

    @property
    def behind_s(self) -> float:
        """Return the run's delay behind the reference up to here [s]; NaN if unknown."""
        return self.elapsed_s - (self._phase_s - self._begin_s())

    def take_event(self, name: str, time_s: float) -> None:
        """Process an event at a time [s].

        The event is ignored if the tools are not where the reference's are at this event: a machine
        that stops during a run and continues neither ends that run nor begins another one.
        """
        span = self._span
        if not self._is_there(name):
            return
        if span is not None and name == span.begin:
            self._begin(time_s)
        elif name in self._events:
            self._tracker.take_event(self._events[name])
        if span is not None and name == span.end != span.begin:
            ends_s = max(self._events.get(name, (self._tracker.duration_s,)))
            self._ends_s = time_s + _MAX_STRETCH * (self._tracker.duration_s - ends_s)

    def advance(self, time_s: float, place: np.ndarray) -> None:
        """Process the tools' position (d,) [m], NaN where unknown, at a time [s], ascending."""
        last_s = time_s if self._last_s is None else self._last_s
        if last_s - _LATE_S < time_s < last_s:
            time_s = last_s
        elapsed_s = time_s - last_s
        if not 0.0 <= elapsed_s <= _MAX_GAP_S:
            self._forget()
            elapsed_s = 0.0
        if np.isfinite(place).any():
            if _UNSEEN_S < time_s - self._seen_s < math.inf:
                self._resumed_s = time_s
            self._seen_s = time_s
        self._last_s, self._place = time_s, place
        self._tracker.advance(elapsed_s, place)
        found_s = self._tracker.phase_s
        if not (self._is_known and self._phase_s - _WRONG_S <= found_s < self._phase_s):
            self._phase_s = found_s
        if self._is_over(time_s):
            self._forget()
        else:
            self._judge(time_s, self._tracker.distance_m(place, found_s))

    def lose(self) -> None:
        """Note that the tools are unknown from now on: what moves later is another run."""
        if self._last_s is not None:
            self._forget()
            self._last_s = None

    def _is_there(self, name: str) -> bool:
        """Return whether the tools may be where the reference's are at an event."""
        times_s = self._events.get(name, ())
        return not len(times_s) or not all(
            self._tracker.distance_m(self._place, time_s) > _FAR_M for time_s in times_s)

    def _begin(self, time_s: float) -> None:
        begin_s = self._begin_s()
        is_dated = time_s - self._resumed_s > _RESUMES_S and not (
            _UNSEEN_S < time_s - self._seen_s < math.inf)
        if self._is_elsewhere(begin_s):  # it is the event that came early or late
            self._begun_s = time_s - (self._phase_s - begin_s) if is_dated else None
            return
        self._forget()
        self._tracker.begin_at(begin_s)
        self._begun_s, self._is_known = time_s if is_dated else None, True
        self._phase_s = self._tracker.phase_s
        self._last_s = time_s if self._last_s is None else max(time_s, self._last_s)

    def _is_elsewhere(self, begin_s: float) -> bool:
        """Return whether the tools are clearly at another moment of the run than its begin."""
        if not self._is_known or abs(self._phase_s - begin_s) > _FURTHEST_S:
            return False
        from_begin_m = self._tracker.distance_m(self._place, begin_s)
        return from_begin_m - self._tracker.distance_m(self._place, self._phase_s) > _APART_M

    def _begin_s(self) -> float:
        times_s = () if self._span is None else self._events.get(self._span.begin, ())
        return min(times_s, default=0.0)

    def _is_over(self, time_s: float) -> bool:
        """Return whether the run has ended, and so has the reference."""
        is_at_end = self._is_known and self._phase_s >= self._tracker.duration_s
        self._at_end_s = min(self._at_end_s, time_s) if is_at_end else math.inf
        if math.isfinite(self._ends_s):
            return is_at_end or time_s > self._ends_s
        return self._begun_s is None and time_s - self._at_end_s > _AT_END_S

    def _judge(self, time_s: float, distance_m: float) -> None:
        """Decide whether the robots are beside the reference; a robot at rest may be in no run."""
        if distance_m < _NEAR_M:
            self._far_since_s = None
            self._is_known = self._is_known or self._tracker.is_decided
        elif distance_m > _FAR_M or not self._is_known:
            self._far_since_s = time_s if self._far_since_s is None else self._far_since_s
        if self._far_since_s is not None and time_s - self._far_since_s > _LOST_S:
            self._forget()


_MAX_STEP_S = 0.5
"""Maximum time between two phases; between phases farther apart, the reference is unknown [s]."""


class PhaseHistory:
    """History of phases; between two phases of a run, the reference advances evenly."""

    def __init__(self, kept_s: float) -> None:
        self._kept_s = kept_s
        self._times_s: List[float] = []
        self._reference_s: List[float] = []

    @property
    def last_s(self) -> float:
        """Return the time of the last phase [s]; minus infinity without any."""
        return self._times_s[-1] if self._times_s else -math.inf

    def add(self, time_s: float, reference_s: Optional[float]) -> None:
        """Add the moment of the reference that corresponds to a time [s]; None if there is none."""
        if time_s < self.last_s:  # the clock was set back
            self._times_s.clear()
            self._reference_s.clear()
        self._times_s.append(time_s)
        self._reference_s.append(math.nan if reference_s is None else reference_s)
        if self._times_s[0] < time_s - 2.0 * self._kept_s:
            old = int(np.searchsorted(self._times_s, time_s - self._kept_s))
            del self._times_s[:old], self._reference_s[:old]

    def at(self, times_s: np.ndarray) -> np.ndarray:
        """Return the moments of the reference [s] (n,) at times (n,); NaN where there is none."""
        if len(self._times_s) < 2:
            return np.full(len(times_s), np.nan)
        known_s, reference_s = np.array(self._times_s), np.array(self._reference_s)
        behind = np.clip(np.searchsorted(known_s, times_s), 1, len(known_s) - 1)
        step_s = reference_s[behind] - reference_s[behind - 1]
        gap_s = known_s[behind] - known_s[behind - 1]
        share = (times_s - known_s[behind - 1]) / np.where(gap_s > 0.0, gap_s, 1.0)
        with np.errstate(invalid='ignore'):
            is_known = ((share >= 0.0) & (share <= 1.0) & (step_s >= 0.0)  # below 0: another run
                        & (gap_s <= _MAX_STEP_S))
        result: np.ndarray = np.where(is_known, reference_s[behind - 1] + share * step_s, np.nan)
        return result
