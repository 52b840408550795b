# SPDX-License-Identifier: BSD-3-Clause
"""A run that goes on, held against its reference: begun by an event, followed, and ended."""
from __future__ import annotations

import math
from typing import Mapping, NamedTuple, Optional, Sequence

import numpy as np

from process_visualizer.runs.alignment.phase_tracker import PhaseTracker

PERIOD_S = 0.02
_NEAR_M, _FAR_M = 0.1, 0.2
_LOST_S = 2.0
"""A robot that has been far from the reference for so long does something else."""
_SLOWEST = 1.5
"""What comes after the end of a run takes at most so many times as long as in the reference."""
_WRONG_S = 1.0
"""A step back in the reference that is shorter is noise; a longer one corrects what was wrong."""
_LATE_S = 0.5
"""A place may be so much older than an event that has come; more is a clock that was set back."""
_LONGEST_GAP_S = 5.0
"""After this, without anything known in between, the run may be anywhere."""


class Span(NamedTuple):
    """The names of the events that begin and end a run."""

    begin: str
    end: str


class LiveAlignment:
    """Tells which moment of the reference belongs to now; it may be none.

    A run begins with its event, or where the robots are found to move as in the reference. Within
    a run the phase does not go back, unless it was wrong by more than a second.
    """

    def __init__(self, reference: np.ndarray, events: Mapping[str, Sequence[float]],
                 span: Optional[Span] = None, period_s: float = PERIOD_S) -> None:
        """Take the reference: its places (n, d) [m], and when [s] its events come."""
        self._tracker = PhaseTracker(reference, period_s)
        self._events, self._span = events, span
        self._last_s: Optional[float] = None
        self._place = np.full(reference.shape[1:], np.nan)
        self._phase_s = 0.0
        self._forget()

    def _forget(self) -> None:
        """The run has ended, or nothing is known of it any longer: look for another one."""
        self._tracker.restart()
        self._is_known = False
        self._begun_s: Optional[float] = None
        self._far_since_s: Optional[float] = None
        self._ends_s = math.inf

    @property
    def phase_s(self) -> Optional[float]:
        """The time of the reference [s] that belongs to now; None: to none that is known."""
        return self._phase_s if self._is_known else None

    @property
    def elapsed_s(self) -> float:
        """Return how long the run has gone on [s], from its event; NaN if that was not seen."""
        if self._begun_s is None or self._last_s is None or not self._is_known:
            return math.nan
        return self._last_s - self._begun_s

    @property
    def behind_s(self) -> float:
        """Return the run's delay behind the reference up to here [s]; NaN if unknown."""
        return self.elapsed_s - (self._phase_s - self._begin_s())

    def take_event(self, name: str, time_s: float) -> None:
        """Take that an event came at a time [s].

        It does not count where the reference is somewhere else when it comes: a machine that
        stops amid a run and goes on neither ends that run nor begins another one.
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
            self._ends_s = time_s + _SLOWEST * (self._tracker.duration_s - ends_s)

    def advance(self, time_s: float, place: np.ndarray) -> None:
        """Take where the tools are, (d,) [m], NaN where unknown, at a time [s] that rises."""
        last_s = time_s if self._last_s is None else self._last_s
        if last_s - _LATE_S < time_s < last_s:
            time_s = last_s
        elapsed_s = time_s - last_s
        if not 0.0 <= elapsed_s <= _LONGEST_GAP_S:
            self._forget()
            elapsed_s = 0.0
        self._last_s, self._place = time_s, place
        self._tracker.advance(elapsed_s, place)
        found_s = self._tracker.phase_s
        if not (self._is_known and self._phase_s - _WRONG_S <= found_s < self._phase_s):
            self._phase_s = found_s
        if self._is_over(time_s):
            self._forget()
        else:
            self._judge(time_s, self._tracker.distance_m(place, found_s))

    def _is_there(self, name: str) -> bool:
        """Return whether the tools may be where the reference's are when an event comes."""
        times_s = self._events.get(name, ())
        return not len(times_s) or not all(
            self._tracker.distance_m(self._place, time_s) > _FAR_M for time_s in times_s)

    def _begin(self, time_s: float) -> None:
        self._forget()
        self._tracker.begin_at(self._begin_s())
        self._begun_s, self._is_known = time_s, True
        self._phase_s = self._tracker.phase_s
        self._last_s = time_s if self._last_s is None else max(time_s, self._last_s)

    def _begin_s(self) -> float:
        times_s = () if self._span is None else self._events.get(self._span.begin, ())
        return min(times_s, default=0.0)

    def _is_over(self, time_s: float) -> bool:
        """Return whether the run has ended, and with it the reference."""
        return math.isfinite(self._ends_s) and (
            time_s > self._ends_s or self._phase_s >= self._tracker.duration_s)

    def _judge(self, time_s: float, distance_m: float) -> None:
        """Judge whether the robots are beside the reference; one that rests may be in no run."""
        if distance_m < _NEAR_M:
            self._far_since_s = None
            self._is_known = self._is_known or self._tracker.is_decided
        elif distance_m > _FAR_M or not self._is_known:
            self._far_since_s = time_s if self._far_since_s is None else self._far_since_s
        if self._far_since_s is not None and time_s - self._far_since_s > _LOST_S:
            self._forget()
