# SPDX-License-Identifier: BSD-3-Clause
"""States and bits of a run compared with good runs: those that are wrong, missing or late."""
from __future__ import annotations

from collections import Counter
from typing import Dict, List, Mapping, NamedTuple, Optional, Sequence, Set, Tuple

import numpy as np

from process_visualizer.runs.alignment.time_map import TimeMap
from process_visualizer.runs.deviation.band import student_quantile
from process_visualizer.runs.deviation.departures import Departure
from process_visualizer.runs.deviation.signals import Signal, SignalKind
from process_visualizer.runs.run import Key, Run
from process_visualizer.runs.series import States, edits, is_sequence, states

Order = Tuple[float, ...]
_MIN_LATE_S, _LATE_OF_ONE_S = 0.2, 0.6
"""Minimum delay or lead of a state that is reported [s], with many good runs and with one."""
_MIN_SPREAD_S = 0.03
_PRIOR_RUNS = 4.0
"""Weight of the usual spread of all states of a channel, in runs."""
_RATE_OF_ONE = 1e-3
_FEW = 5
"""Number of good runs below which each may differ for a reason."""
_SHARE_OF_OUTLIERS = 0.1
"""Share of the good runs that may, with one more, agree on a wrong order."""
_WRONG_STATE, _STATE_KNOWN_S = 10.0, 0.05
"""The severity of a wrong state, and the uncertainty of its time [s]."""


def _completed(states: States, orders: Set[Order]) -> States:
    """Return the states with the one before the first message, if other runs show which that is.

    It is unknown for the first run of a recording.
    """
    longer = [it for it in orders if it[1:] == states.values and len(it) > 1]
    if not longer or not states.values or states.values in orders and len(longer) != 1:
        return states
    before_s = min(states.since_s[0], 0.0)
    return states._replace(values=longer[0], since_s=(before_s, *states.since_s))


def _steps(order: Order) -> Order:
    return tuple(after - before for before, after in zip(order, order[1:]))


class StateFault(NamedTuple):
    """A fault of a state, in words, from a time of the reference [s] on.

    For a late state, ``late_s`` is the delay, and ``limit_s`` the usual limit.
    """

    words: str
    since_s: float
    late_s: float = 0.0
    limit_s: float = 0.0


class StateOrder:
    """The order of states in good runs of one channel, and their times."""

    def __init__(self, good: Sequence[States], names: Mapping[float, str]) -> None:
        """Set the states of good runs, with times of the reference, and the names of values."""
        self._names = dict(names)
        whole = {it.values for it in good}
        good = [_completed(it, whole) for it in good]
        self._orders = [it.values for it in good]
        self._times = [it.since_s for it in good]
        steps = {_steps(it) for it in self._orders}
        self._is_run_counter = len(steps) == 1 and set(steps.pop()) == {1.0} and \
            len(set(self._orders)) == len(self._orders)
        counts = Counter(it for it in self._orders if it)
        self._usual: Order = counts.most_common(1)[0][0] if counts else ()
        self._count = counts[self._usual] if counts else 0

    @property
    def is_known(self) -> bool:
        """Return whether good runs agree on an order; if not, only values are judged."""
        return self._count >= 0.5 * len(self._orders) or len(self._orders) < 3

    def outliers(self) -> Dict[int, str]:
        """Return the good runs with another order than most, and the difference, if most agree."""
        alone = [row for row, it in enumerate(self._orders) if it != self._usual]
        if len(self._orders) < 4 or len(alone) > 0.25 * len(self._orders):
            return {}
        times = Counter(self._orders)
        most = 1 + int(_SHARE_OF_OUTLIERS * len(self._orders))
        return {row: self._difference(self._orders[row], ())[0].words for row in alone
                if times[self._orders[row]] <= most}

    def fault(self, run: States, end_s: float) -> Optional[StateFault]:
        """Return what is wrong with a run's states; None if nothing is.

        ``end_s`` is where the run ends, on the reference's clock.
        """
        order, times_s = self._comparable(_completed(run, set(self._orders)), end_s)
        if self._is_constant_per_run(order):
            return self._other_context(order)
        is_new = order not in self._orders
        if self._is_run_counter and is_new and _steps(order) == _steps(self._usual):
            return None
        if not is_new:
            return self._late(order, times_s)
        if not self.is_known:
            return self._strange(order, times_s)
        found = self._difference(order, times_s)
        return found[0] if found else None

    def _comparable(self, run: States, end_s: float) -> Tuple[Order, Tuple[float, ...]]:
        """Return the run's order and times; after its messages end, the usual order continues."""
        if run.until_s >= end_s or not self._usual:
            return run.values, run.since_s
        usual = self._usual_times()
        rest = [row for row, time_s in enumerate(usual) if time_s > run.until_s]
        return (run.values + tuple(self._usual[row] for row in rest),
                run.since_s + tuple(usual[row] for row in rest))

    def _is_constant_per_run(self, order: Order) -> bool:
        """Return whether the channel has one value in each run: a variant, a place, a number."""
        return len(order) == 1 and all(len(it) == 1 for it in self._orders)

    def _other_context(self, order: Order) -> Optional[StateFault]:
        known = set(self._orders)
        if len(known) > 1 or len(self._orders) < _FEW or order in known:
            return None
        return StateFault(f'{self._name(order[0])} instead of {self._name(self._usual[0])}', 0.0)

    def _usual_times(self) -> List[float]:
        times = [it for order, it in zip(self._orders, self._times) if order == self._usual]
        return [float(it) for it in np.median(np.array(times), axis=0)] if times else []

    def _strange(self, order: Order, times_s: Sequence[float]) -> Optional[StateFault]:
        known = {value for it in self._orders for value in it}
        return next((StateFault(f'{self._name(value)} occurs in no good run', float(time_s))
                     for value, time_s in zip(order, times_s) if value not in known), None)

    def _difference(self, order: Order, times_s: Sequence[float]) -> List[StateFault]:
        """Return what distinguishes an order from the usual one, the earliest first.

        Each edit turns ``self._usual[usual_begin:usual_end]`` into ``order[begin:end]``.
        """
        usual_s = self._usual_times()
        found, equal = [], 0
        for what, usual_begin, usual_end, begin, end in edits(self._usual, order):
            if what == 'equal':
                equal = usual_end - usual_begin
                continue
            shift = 0
            if what == 'insert' and times_s:
                shift = _best_shift(order, times_s, begin, end,
                                    usual_s[usual_begin - equal:usual_begin])
            elif what == 'delete' and times_s:
                shift = _best_shift(self._usual, usual_s, usual_begin, usual_end,
                                    times_s[begin - equal:begin])
            expected = self._usual[usual_begin - shift:usual_end - shift]
            usual_begin, begin, end, equal = usual_begin - shift, begin - shift, end - shift, 0
            since_s = float(times_s[begin]) if 0 < begin < len(times_s) else \
                usual_s[min(usual_begin, len(usual_s) - 1)]
            if what == 'delete' and usual_begin < len(usual_s):
                since_s = min(since_s, usual_s[usual_begin])
            found.append(StateFault(self._words(what, expected, order[begin:end]), since_s))
        return found

    def _words(self, what: str, expected: Order, came: Order) -> str:
        if what == 'delete':
            return f'{self._named(expected)} {"is" if len(expected) == 1 else "are"} missing'
        if what == 'replace':
            return f'{self._named(came)} instead of {self._named(expected)}'
        times = 'once too often' if all(it in self._usual for it in came) else 'in addition'
        return f'{self._named(came)} {"occurs" if len(came) == 1 else "occur"} {times}'

    def _named(self, values: Order) -> str:
        *names, last = (self._name(it) for it in values[:3])
        if len(values) > 3:
            return f'{", ".join(names)}, {last} …'
        return f'{", ".join(names)} and {last}' if names else last

    def _name(self, value: float) -> str:
        name = self._names.get(value)
        return f'{value:g}' if name is None else f'{value:g} ({name})'

    def _late(self, order: Order, times_s: Sequence[float]) -> Optional[StateFault]:
        """Return the first change that is later or earlier than in the good runs."""
        alike = np.array([it for known, it in zip(self._orders, self._times) if known == order])
        if len(order) < 2:
            return None
        count = len(alike)
        late_s = (np.array(times_s) - alike.mean(axis=0))[1:]
        if count < 2:
            limit_s = np.full(len(late_s), _LATE_OF_ONE_S)
        else:
            away = (alike - alike.mean(axis=0))[:, 1:]
            square = (away * away).sum(axis=0)
            usual = np.median(square / (count - 1.0))
            freedom = count - 1.0 + _PRIOR_RUNS
            spread = np.sqrt((square + _PRIOR_RUNS * usual) / freedom + _MIN_SPREAD_S ** 2)
            factor = student_quantile(_RATE_OF_ONE / len(late_s), freedom)
            limit_s = np.maximum(factor * np.sqrt(1.0 + 1.0 / count) * spread,
                                 max(_LATE_OF_ONE_S / count, _MIN_LATE_S))
        rows = np.flatnonzero(np.abs(late_s) > limit_s)
        if not len(rows):
            return None
        row = int(rows[0])
        late = float(late_s[row])
        since_s = min(float(times_s[row + 1]), float(times_s[row + 1]) - late)
        return StateFault(f'{self._name(order[row + 1])} occurs {abs(late):.2f} s '
                          f'{"later" if late > 0 else "earlier"} than usual '
                          f'(±{limit_s[row]:.2f} s)',
                          since_s, late, float(limit_s[row]))


def _best_shift(values: Order, times_s: Sequence[float], begin: int, end: int,
                equal_s: Sequence[float]) -> int:
    """Return how many places to the left the inserted block ``values[begin:end]`` really is.

    If the values at the ends of a block repeat, its place is ambiguous: in 0 1 0 1 0, either 0 1
    or 1 0 was inserted. The right place is the one at which the times of the remaining values
    match best those of the equal values of the other run, ``equal_s``.
    """
    best, more_s, least_s = 0, 0.0, 0.0
    for shift, at_s in enumerate(reversed(equal_s), 1):
        if values[begin - shift] != values[end - shift]:
            break
        more_s += abs(times_s[end - shift] - at_s) - abs(times_s[begin - shift] - at_s)
        if more_s < least_s:
            best, least_s = shift, more_s
    return best


# States of runs, on the clock of a reference run, and faults of states as departures.

def state_keys(reference: Run) -> List[Key]:
    """Return the channels with states, except for numbers that say what is expected of a run.

    Such a number may be sent at any time before it applies; until then, that of another run holds.
    """
    of_runs = {name.strip('/') for name, _ in reference.group + reference.place}
    return [channel.key for channel in reference.channels if is_sequence(channel)
            and not of_runs & {channel.label, channel.topic.strip('/')}]


def states_of(reference: Run, run: Run, time_map: TimeMap) -> Dict[Key, States]:
    """Return the states of a run on the reference's clock."""
    found, theirs = {}, run.by_key
    for key in state_keys(reference):
        if key not in theirs:
            continue
        mine = states(theirs[key])
        until_s = mine.until_s
        since_s = time_map.to_reference(np.array(mine.since_s, float)).tolist()
        if np.isfinite(until_s):
            until_s = float(time_map.to_reference(np.array([until_s]))[0])
        found[key] = States(mine.values, tuple(since_s), until_s)
    return found


def state_departure(key: Key, fault: StateFault, end_s: float, sent_s: float) -> Departure:
    """Return the departure of a state; one that is sent all the time is known every ``sent_s``."""
    since_s = min(max(fault.since_s, 0.0), end_s)
    deviation, limit = (fault.late_s, fault.limit_s) if fault.limit_s else (_WRONG_STATE, 1.0)
    return Departure(Signal(*key, '', SignalKind.STATE), since_s, None, since_s,
                     _STATE_KNOWN_S + sent_s,
                     since_s, deviation, limit, fault.words, bool(fault.limit_s))
