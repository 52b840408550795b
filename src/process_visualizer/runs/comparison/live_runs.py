# SPDX-License-Identifier: BSD-3-Clause
"""Decides when live runs are over, and the verdict in their rows."""
from __future__ import annotations

import math
from types import MappingProxyType
from typing import Any, Dict, Iterable, List, Mapping, NamedTuple, Optional, Tuple

from process_visualizer.figures import clock_text
from process_visualizer.runs.comparison.comparison import Missing
from process_visualizer.runs.comparison.live_comparison import OPEN_BEGIN_S, LiveDeparture
from process_visualizer.runs.comparison.wording import quantity

AGAIN_S = 1.0
"""A moment of the reference that is earlier by this much belongs to another run [s]."""
_UNKNOWN_S = 1.0
"""Time without a known moment of the reference after which a run is over [s]."""
_MIN_S = 1.0
_LOST_S = 5.0
"""Time without values after which a run is over [s]."""
_MAX_UNJUDGED = 2
_UNJUDGED_S, _UNJUDGED_SHARE = 0.5, 0.05
"""Time without values that a verdict need not mention [s], and as a share of the run."""
_SAME_RUN_S = 2.0
"""Maximum difference between the times that passed in a run and in its reference [s]."""
_MOVED_S = 0.5
"""Minimum part of the reference that a run passes that was not seen from its beginning [s]."""
_OPEN_END_S = 0.5
"""Part of the reference that may be missing at the end of a whole run [s]."""


class FinishedRun(NamedTuple):
    """A run that is over; times in s since the epoch. ``departed`` names what was out of range.

    Four moments of the reference [s] may be None: ``broken_off_s``, at which the run ended too
    early; ``seen_from_s``, from which on it was compared, if not from the beginning;
    ``lost_from_s``, from which on there were no values until its end; ``watched_until_s``, at which
    the comparison ended, while the run may have gone on. ``unjudged`` names channels that lacked
    values for a part of the run, each with how long. ``unwatched_s`` are the stretches of the
    reference (begin and end) in which nothing was compared: all data was missing, or nodes were
    restarted.
    """

    began_s: float
    ended_s: float
    reference: str
    departed: Tuple[str, ...] = ()
    is_judged: bool = True
    broken_off_s: Optional[float] = None
    seen_from_s: Optional[float] = None
    lost_from_s: Optional[float] = None
    watched_until_s: Optional[float] = None
    unjudged: Tuple[str, ...] = ()
    unwatched_s: Tuple[Tuple[float, float], ...] = ()

    @property
    def is_good(self) -> bool:
        """Return whether the whole run was judged, and nothing was out of range."""
        return (self.is_judged and not self.departed and self.broken_off_s is None
                and self.seen_from_s is None and self.watched_until_s is None
                and self.lost_from_s is None and not self.unjudged and not self.unwatched_s)

    @property
    def is_good_in_part(self) -> bool:
        """Return whether a part of the run is missing or not judged, and the rest was in range."""
        return not self.is_good and self._replace(
            seen_from_s=None, unjudged=(), broken_off_s=None, watched_until_s=None,
            lost_from_s=None, unwatched_s=()).is_good

    @property
    def verdict(self) -> str:
        """Return the verdict in words."""
        end = [] if self.broken_off_s is None else [
            f'broken off at {clock_text(self.broken_off_s)}']
        end += [f'not compared from {clock_text(begin_s)} to {clock_text(end_s)}'
                for begin_s, end_s in self.unwatched_s]
        if self.watched_until_s is not None:
            end.append(f'not compared after {clock_text(self.watched_until_s)}')
        if not self.is_judged:
            return ', '.join(['no data', *end])
        if self.lost_from_s is not None:
            end.append(f'no data from {clock_text(self.lost_from_s)} on')
        elif self.unjudged and not self.departed:
            more = len(self.unjudged) - _MAX_UNJUDGED
            end.append(f'not judged: {", ".join(self.unjudged[:_MAX_UNJUDGED])}'
                       + (f' and {more} more' if more > 0 else '') + f' ({Missing.DATA.value})')
        since = '' if self.seen_from_s is None else f' from {clock_text(self.seen_from_s)} on'
        return ', '.join([f'out of range: {"; ".join(self.departed)}' if self.departed
                          else f'in range{since}', *end])

    def settings(self) -> Dict[str, Any]:
        """Return the settings that ``finished_run`` needs."""
        return dict(self._asdict(), departed=list(self.departed), unjudged=list(self.unjudged),
                    unwatched_s=list(map(list, self.unwatched_s)))


def finished_run(settings: Mapping[str, Any]) -> FinishedRun:
    """Return the run whose ``settings`` are given.

    Raises:
        KeyError, TypeError, ValueError: these are not the settings of a run.
    """
    broken_off_s, seen_from_s, lost_from_s, watched_until_s = (
        None if it is None else float(it) for it in (settings['broken_off_s'], *(
            settings.get(it) for it in ('seen_from_s', 'lost_from_s', 'watched_until_s'))))
    return FinishedRun(float(settings['began_s']), float(settings['ended_s']),
                       str(settings['reference']), tuple(str(it) for it in settings['departed']),
                       bool(settings['is_judged']), broken_off_s, seen_from_s, lost_from_s,
                       watched_until_s,
                       tuple(str(it) for it in settings.get('unjudged', ())),
                       tuple((float(begin_s), float(end_s))
                             for begin_s, end_s in settings.get('unwatched_s', ())))


def with_rest(run: FinishedRun, rest: FinishedRun) -> Optional[FinishedRun]:
    """Return a run that was watched again after an interruption as one; None if it is another one.

    ``rest`` was seen next. It is of the same run if as much time has passed as in the reference.
    """
    if run.watched_until_s is None or rest.seen_from_s is None or run.reference != rest.reference:
        return None
    missed_s = rest.seen_from_s - run.watched_until_s
    if missed_s <= 0.0 or not _is_same_run(rest.began_s - run.ended_s, missed_s):
        return None
    return rest._replace(
        began_s=run.began_s, departed=(*run.departed, *rest.departed),
        is_judged=run.is_judged or rest.is_judged, seen_from_s=run.seen_from_s,
        unjudged=(*run.unjudged, *rest.unjudged),
        unwatched_s=(*_with_gap(run.unwatched_s, run.watched_until_s, rest.seen_from_s),
                     *rest.unwatched_s))


def _is_same_run(passed_s: float, reference_s: float) -> bool:
    """Return whether what follows an interruption is of the same run.

    If it is, about as much time [s] has passed as in the reference.
    """
    return abs(passed_s - reference_s) <= _SAME_RUN_S


def _with_gap(gaps_s: Tuple[Tuple[float, float], ...], begin_s: float,
              end_s: float) -> Tuple[Tuple[float, float], ...]:
    """Return gaps with one more, joined with the last one if they overlap; not a short one."""
    if end_s - begin_s < _UNJUDGED_S:
        return gaps_s
    if gaps_s and begin_s <= gaps_s[-1][1]:
        return (*gaps_s[:-1], (min(gaps_s[-1][0], begin_s), max(gaps_s[-1][1], end_s)))
    return (*gaps_s, (begin_s, end_s))


class _Run(NamedTuple):
    began_s: float
    last_s: float
    reference_s: float
    seen_from_s: float
    unwatched_s: Tuple[Tuple[float, float], ...] = ()

    def reference_at(self, time_s: float) -> float:
        """Return the moment of the reference at a time shortly before the last known one [s]."""
        return max(self.reference_s - max(self.last_s - time_s, 0.0), self.seen_from_s)


class LiveRuns:
    """Tracker of live runs, by the moments of a reference and the departures at them."""

    def __init__(self, reference: str, duration_s: float) -> None:
        """Set the reference's name and duration."""
        self._reference, self._duration_s = reference, duration_s
        self._run: Optional[_Run] = None
        self._departed: Dict[str, Tuple[LiveDeparture, float]] = {}
        self._unjudged_s: Dict[str, float] = {}
        self._is_judged = self._is_lost = False
        self._gap_from_s: Optional[float] = None  # moment at which a comparison was interrupted
        self._lost: Optional[_Run] = None  # the run as it was when its values ended
        self._is_waiting = False  # for values, as the run has ended without them

    @property
    def has_departed(self) -> bool:
        """Return whether anything has been out of range since the run began."""
        return bool(self._departed)

    def at(self, stamp_s: float, reference_s: Optional[float]) -> Optional[FinishedRun]:
        """Take the current moment of the reference [s]; return the run that this ends, if any."""
        run = self._run
        if self._is_lost and self._is_judged and run is not None:
            self._lost = lost = self._lost or run
            if stamp_s - lost.last_s > _LOST_S:
                self._is_waiting = True
                return self.end()
        if self._is_waiting:
            return None
        if reference_s is None:
            is_over = run is not None and stamp_s - run.last_s > _UNKNOWN_S
            return self.end() if is_over else None
        if run is None:
            self._run = _Run(stamp_s, stamp_s, reference_s, reference_s)
            return None
        is_silent, step_s = stamp_s - run.last_s > _UNKNOWN_S, reference_s - run.reference_s
        if is_silent and not self._is_lost:  # nodes were restarted or stood still
            if _is_same_run(stamp_s - run.last_s, step_s):
                run = run._replace(
                    unwatched_s=_with_gap(run.unwatched_s, run.reference_s, reference_s))
            else:
                step_s = -math.inf
        if step_s > -AGAIN_S:
            self._run = run._replace(last_s=stamp_s, reference_s=reference_s)
            return None
        finished = self.end(is_watched=not is_silent)
        self._run = _Run(stamp_s, stamp_s, reference_s, reference_s)
        return finished

    def judge(self, departures: Iterable[LiveDeparture],
              unjudged_s: Mapping[str, float] = MappingProxyType({})) -> None:
        """Take the current departures; the farthest of each channel counts.

        ``unjudged_s`` are the times [s], since the last call, that channels could not be judged.
        """
        was_lost, self._is_lost = self._is_lost, False
        self._lost, self._is_waiting = None, False
        run = self._run
        if run is None:
            return
        if was_lost and self._gap_from_s is not None:
            run = self._run = run._replace(unwatched_s=_with_gap(
                run.unwatched_s, self._gap_from_s, run.reference_s))
        elif was_lost:
            run = self._run = run._replace(seen_from_s=run.reference_s)
        self._gap_from_s = None
        self._is_judged = True
        for name, seconds in unjudged_s.items():
            self._unjudged_s[name] = self._unjudged_s.get(name, 0.0) + seconds
        for it in departures:
            before = self._departed.get(it.signal.name)
            from_s = run.reference_at(it.since_s) if before is None else before[1]
            if before is None or abs(it.beyond) > abs(before[0].beyond):
                self._departed[it.signal.name] = it, from_s

    def lose(self) -> None:
        """Note that values are unknown until ``judge`` is called again.

        What is compared before and after belongs to one run, with a gap. A run that is lost for
        long is over.
        """
        if self._run is not None and self._is_judged and not self._is_lost:
            self._gap_from_s = self._run.reference_s
        self._is_lost = True

    def end(self, is_watched: bool = True) -> Optional[FinishedRun]:
        """End the current run, and return it; None without one.

        If watching stopped (not ``is_watched``), the run did not end by itself, and is not reported
        as broken off.
        """
        run, departed, is_judged = self._run, self._departed, self._is_judged
        lost, self._lost = self._lost, None
        unjudged_s, self._unjudged_s = self._unjudged_s, {}
        self._run, self._departed, self._is_judged, self._gap_from_s = None, {}, False, None
        if run is None or run.last_s - run.began_s < _MIN_S:
            return None
        if self._is_lost and not is_judged:
            return None  # nothing was seen of it
        if run.seen_from_s > OPEN_BEGIN_S and run.reference_s - run.seen_from_s < _MOVED_S:
            return None  # robots that stand where the reference passes by
        gaps_s = sum(end_s - begin_s for begin_s, end_s in run.unwatched_s)  # named already
        texts: List[str] = [_text(it, from_s) for it, from_s in departed.values()]
        is_whole = run.reference_s > self._duration_s - _OPEN_END_S or lost is not None
        longest_first = sorted(unjudged_s.items(), key=lambda it: -it[1])
        return FinishedRun(run.began_s, run.last_s if lost is None else lost.last_s,
                           self._reference, tuple(texts), is_judged,
                           run.reference_s if is_watched and not is_whole else None,
                           run.seen_from_s if run.seen_from_s > OPEN_BEGIN_S else None,
                           None if lost is None else lost.reference_s,
                           None if is_watched or is_whole else run.reference_s,
                           tuple(f'{name} for {it:.1f} s' for name, it in longest_first
                                 if it - gaps_s > max(_UNJUDGED_S, _UNJUDGED_SHARE * (
                                     run.last_s - run.began_s))), run.unwatched_s)


def _text(departure: LiveDeparture, from_s: float) -> str:
    beyond = quantity(departure.signal, departure.beyond, sign=True, digits=2)
    return f'{departure.signal.name} {beyond} from {clock_text(from_s)}'
