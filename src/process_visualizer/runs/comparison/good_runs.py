# SPDX-License-Identifier: BSD-3-Clause
"""Good runs: which of them judge a run, the band that they span, and whether a run leaves it."""
from __future__ import annotations

from typing import Dict, Iterable, Iterator, List, Mapping, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from process_visualizer.runs.alignment.alignment import (
    Alignment,
    AlignmentMethod,
    Anchor,
    aligned_at,
    aligned_by_states,
    with_anchor,
)
from process_visualizer.runs.alignment.displacement import displacement
from process_visualizer.runs.alignment.time_map import joined
from process_visualizer.runs.comparison.comparison import (
    Comparison,
    Missing,
    Unjudged,
    unjudged,
)
from process_visualizer.runs.deviation.band import (
    EDGE_ROWS,
    MIN_RUNS,
    RELATIVE_TOLERANCE,
    USUAL_RATE,
    Band,
    BandLearner,
    SignalBand,
    TooFewRuns,
    beyond,
    common,
    fewest_runs,
    most_of,
    signal_tolerance,
    widened,
)
from process_visualizer.runs.deviation.channel_faults import (
    StuckSensors,
    explains,
    refined_onset,
    with_frequency,
)
from process_visualizer.runs.deviation.departures import (
    BESIDE,
    MIN_LASTING_ROWS,
    Departure,
    departures,
    outside,
    ranked,
)
from process_visualizer.runs.deviation.signals import (
    RATE_HZ,
    TIMING_LABEL,
    Columns,
    Signal,
    SignalKind,
    grid_s,
    own_columns,
    signals,
    steepness,
    tool_speed,
    unknown_moments,
)
from process_visualizer.runs.deviation.state_order import (
    StateOrder,
    state_departure,
    state_keys,
    states_of,
)
from process_visualizer.runs.run import DAMAGED, Group, Key, Run, fingerprint
from process_visualizer.runs.series import (
    MIN_HOLE_S,
    ROUGH_S,
    States,
    holes_s_of,
    inside,
    moving_maximum,
    period_s,
    spans,
)

_MIN_SHARE = 0.8
"""Minimum share of the reference, or of the run, with a counterpart in the other; else reported."""

_SHARE_ALIKE, _SAME_PLACE_M, _NEAR_ANOTHER_ROWS = 0.8, 0.005, int(0.3 * RATE_HZ)
"""Share of good runs, and their distance, for tools to be at the same place.

Rows that are within the third number of rows from another place do not count.
"""
_ELSEWHERE_M = 0.01
"""Median distance of the tools from the reference's [m] above which a path is at another place."""
_MIN_LONGER_S, _MIN_PACE = 0.1, 0.02
"""Minimum difference in duration [s], and as a share of the reference, that is reported."""


class _Good(NamedTuple):
    """A good run on the reference's clock."""

    run: Run
    fingerprint: bytes
    columns: Columns
    aligned_by: AlignmentMethod
    states: Mapping[Key, States]


class GoodRuns:
    """Good runs on the clock of one of them, the reference, and the band that they span."""

    def __init__(self, reference: Run, others: Iterable[Run] = (), rate: Optional[float] = None,
                 tolerance: float = RELATIVE_TOLERANCE) -> None:
        """Take the runs; those that stand out from the others are left out.

        Args:
            reference: the run on whose clock runs are compared; if it stands out, another one
                takes its place.
            others: further good runs.
            rate: how often a good run leaves the band; default: 0.05 if there are enough runs,
                otherwise the band is what the good runs did, their spread, and a tolerance.
            tolerance: a share of the range, for signals without a tolerance of their own.

        Raises:
            TooFewRuns: there are too few runs for the given rate.
            ValueError: the reference has nothing to compare.
        """
        if not reference.channels and not reference.motions:
            raise ValueError(f'{reference.name} has no variable, force or motion to compare')
        given = _distinct([reference, *others])
        whole = [it for it in given if not it.is_broken_off] or given[:1]
        runs = [it for it in whole if it.group == whole[0].group]
        self._elsewhere: Dict[Group, List[Run]] = {}
        for run in whole:
            if run.group != whole[0].group:
                self._elsewhere.setdefault(run.group, []).append(run)
        self._others: Dict[Group, GoodRuns] = {}
        self._of_place: Dict[Tuple[int, ...], Dict[Signal, SignalBand]] = {}
        if rate is not None and len(runs) - 1 < fewest_runs(rate):
            raise TooFewRuns(f'{len(runs) - 1} good runs beside the reference cannot support a '
                             f'rate of {rate:g}; it takes {fewest_runs(rate)}')
        self._asked_rate, self._tolerance = rate, tolerance
        notes = [f'{it.name} was broken off; it is left out' for it in given
                 if it.is_broken_off and it is not runs[0]]
        most = len(runs) - most_of(len(runs))
        while True:
            self._learn(runs, len(runs) - most)
            left_out = self._left_out()
            notes += [f'{runs[row].name} stands out from the other good runs ({why}); it is left '
                      'out' for row, why in sorted(left_out.items())]
            runs = [it for row, it in enumerate(runs) if row not in left_out]
            if 0 not in left_out and not self._by_states:
                break
        self.band = self._band(None)
        self.notes = (*notes, *self._limited())

    def _limited(self) -> Iterator[str]:
        """Yield a note where the configuration allows less than the differences of good runs."""
        for signal, limits in self.band.signals.items():
            if signal.max_tolerance is None or signal.over_s:
                continue
            count = sum(any(end - begin >= MIN_LASTING_ROWS for begin, end in spans(
                outside(it.columns[signal], limits))) for it in self._good if signal in it.columns)
            if count:
                most = f'{signal.max_tolerance:g} {signal.unit}'.strip()
                yield (f'{count} of {len(self._good)} good runs are farther from the others than '
                       f'the max_tolerance of {signal.name}, {most}: more good runs are out of '
                       'range than stated')

    def of(self, run: Run) -> Optional['GoodRuns']:
        """Return the good runs that a run is judged by: those of its group, if there are any."""
        if run.group == self.reference.group:
            return self
        if run.group not in self._others and run.group in self._elsewhere:
            first, *rest = self._elsewhere[run.group]
            rate = self._asked_rate
            if rate is not None and len(rest) < fewest_runs(rate):
                rate = None
            self._others[run.group] = GoodRuns(first, rest, rate, self._tolerance)
        return self._others.get(run.group)

    def _learn(self, runs: Sequence[Run], most_left_out: int) -> None:
        self.reference = runs[0]
        self._own_columns = own_columns(self.reference)
        self.times_s = grid_s(self.reference)
        self._is_displaced = False
        self._hold_beside(runs, most_left_out)
        if self._are_elsewhere():
            self._is_displaced = True
            self._hold_beside(runs, most_left_out)

    def _are_elsewhere(self) -> bool:
        """Return whether most good runs have the reference's path at another place, by design."""
        others = [it for it in self._good if it.run is not self.reference]
        if any(it.run.place for it in self._good) or not self.reference.motions:
            return False
        elsewhere = [it.run for it in others if it.run.motions and _is_elsewhere(it)]
        found = [displacement(self.reference, it) for it in elsewhere]
        return len(elsewhere) > 0 and 2 * sum(
            it is not None and not it.is_small for it in found) >= len(others)

    def _hold_beside(self, runs: Sequence[Run], most_left_out: int) -> None:
        self._good: List[_Good] = []
        self._first_of_place: Dict[Group, Tuple[Run, Alignment]] = {}
        self._times_by_place = _can_judge_times_by_place([it.place for it in runs])
        aligned_runs = []
        for run in runs:
            if run.place != self.reference.place and run.place not in self._first_of_place:
                self._first_of_place[run.place] = run, self._aligned(run, ())
            alignment, columns = self._columns(run)
            aligned_runs.append((run, alignment.time_map))
            self._good.append(_Good(run, fingerprint(run), columns, alignment.method,
                                    states_of(self.reference, run, alignment.time_map)))
        self._learner = BandLearner(
            [self._beside_place(_without_place(it, self.reference), it.run.place, row)
             for row, it in enumerate(self._good)], self._tolerance, most_left_out)
        common = _where_places_are_alike(self._good)
        self._common_learner = BandLearner(common, self._tolerance) if common else None
        self._stuck = StuckSensors(self.times_s, aligned_runs)
        self._orders = {key: self._order(key, None) for key in state_keys(self.reference)}

    def _left_out(self) -> Dict[int, str]:
        """Return the runs that are not good, and why; runs with other states are found first."""
        self._by_states: Dict[int, str] = {}
        for key, order in self._orders.items():
            for row, words in order.outliers().items():
                self._by_states.setdefault(row, f'{" ".join(key).strip()}: {words}')
        if self._by_states:
            return self._by_states
        return {row: signal.name for row, signal in self._learner.outliers()}

    def _order(self, key: Key, without: Optional[int]) -> StateOrder:
        good = [it.states[key] for row, it in enumerate(self._good)
                if key in it.states and row != without]
        return StateOrder(good, dict(self.reference.by_key[key].value_names))

    def compare(self, run: Run, anchors: Sequence[Anchor] = ()) -> Comparison:
        """Return where a run leaves the band; a good run is judged by the band of the others.

        ``anchors`` are moments that correspond because the operator says so.
        """
        good = self.of(run)
        if good is None:
            why_not = f'there is no good run of {_group_text(run.group)}'
            return Comparison(run, aligned_at(self.reference, run, anchors), {}, Band({}, 0), (),
                              (), (), why_not)
        if good is not self:
            return good.compare(run, anchors)
        alignment, columns = self._columns(run, anchors)
        own_print = fingerprint(run)
        own = next((row for row, it in enumerate(self._good) if it.fingerprint == own_print), None)
        if len(self._good) <= MIN_RUNS:  # too few others to judge it by
            own = None
        columns = self._beside_place(columns, run.place, own)
        band = self._band_of_place(run, own, self.band if own is None else self._band(own))
        missing = unjudged(self.reference, run, alignment, columns, band)
        columns = _where_moments_are_known(columns, missing, run, alignment, self.times_s)
        band = _band_of_run(band, alignment, columns, self.reference, self.times_s)
        band = _less_sure_near_gaps(band, missing, run, alignment, self.times_s)
        steep = _steep_rows(self.reference, self.times_s)
        stuck = () if own is not None else tuple(self._stuck.departures(run, alignment.time_map))
        left = [it for it in departures(self.times_s, columns, band)
                if not any(explains(other, it) for other in stuck)]
        found = ranked([*(refined_onset(it, left, run, alignment, band, self.times_s)._replace(
                              is_on_path=_is_on_path(it, steep)) for it in left),
                        *self._state_departures(run, alignment, own), *stuck],
                       alignment.time_map.to_run)
        found = tuple(with_frequency(it, run, alignment, float(self.times_s[-1])) for it in found)
        notes = [*alignment.notes, *self._notes(run, alignment, columns)]
        return Comparison(run, alignment, columns, band, found, tuple(notes), missing)

    def _state_departures(self, run: Run, alignment: Alignment,
                          own: Optional[int]) -> Iterator[Departure]:
        end_s = min(float(alignment.time_map.to_reference(np.array([run.duration_s]))[0]),
                    self.reference.duration_s)
        for key, found in states_of(self.reference, run, alignment.time_map).items():
            order = self._orders[key] if own is None else self._order(key, own)
            fault = order.fault(found, end_s)
            if fault is None:
                continue
            since_s = alignment.time_map.to_run(np.array([fault.since_s]))
            if not inside(since_s, holes_s_of(run), MIN_HOLE_S).any():
                sent_s = period_s(run.by_key[key].times_s) if np.isfinite(found.until_s) else 0.0
                yield state_departure(key, fault, end_s, sent_s)

    def _columns(self, run: Run,
                 anchors: Sequence[Anchor] = ()) -> Tuple[Alignment, Columns]:
        if not self._is_displaced or run is self.reference:
            alignment = self._aligned(run, anchors)
            first = self._first_of_place.get(run.place)
            usual = first[1].time_map if first and self._times_by_place and not anchors else None
            return alignment, signals(self.reference, run, alignment.time_map, usual,
                                      self._own_columns)
        found = displacement(self.reference, run)
        beside = run if found is None else found.of_run(run)
        alignment = self._aligned(beside, anchors)
        if found is not None and not found.is_small:
            alignment = alignment._replace(
                notes=(*alignment.notes, f'{found.text(self.reference)}; tools are judged relative '
                                         'to that, joints are not judged'))
        columns = signals(self.reference, beside, alignment.time_map, own=self._own_columns)
        return alignment, {signal: values for signal, values in columns.items()
                           if signal.kind is not SignalKind.JOINT}

    def _aligned(self, run: Run, anchors: Sequence[Anchor]) -> Alignment:
        """Return the alignment; for a run of another place, by the first good run of that place.

        So errors in finding the moments of a path to another place are the same for all these runs.
        """
        first = self._first_of_place.get(run.place)
        if first is not None and first[0] is run and not anchors:
            return first[1]
        if anchors or first is None:
            by_states = None
            if not anchors and run.place != self.reference.place:
                by_states = aligned_by_states(self.reference, run)
            return by_states or aligned_at(self.reference, run,
                                           anchors or _wait_anchors(self.reference, run))
        found = aligned_at(first[0], run, _wait_anchors(first[0], run))
        return found._replace(time_map=joined(first[1].time_map, found.time_map))

    def _band(self, without: Optional[int]) -> Band:
        runs = self._learner.kept - (without is not None)
        rate = self._asked_rate
        if rate is None and runs > fewest_runs(USUAL_RATE):
            rate = USUAL_RATE
        if without is not None and rate is not None and runs < fewest_runs(rate):
            rate = None
        return self._learner.band(rate, without)

    def _band_of_place(self, run: Run, own: Optional[int], band: Band) -> Band:
        """Return the band, in which good runs of the same place show where the tools should be.

        Where all places are alike, all good runs determine it. Signals that follow from the place,
        and that no such run covers, are not judged.
        """
        if all(it.run.place == run.place for it in self._good):
            return band
        found = {signal: limits for signal, limits in band.signals.items()
                 if signal.kind not in _OF_PLACE}
        of_all = {} if self._common_learner is None \
            else self._common_learner.band(None, own).signals
        found.update(of_all)
        alike = tuple(row for row, it in enumerate(self._good)
                      if it.run.place == run.place and row != own)
        if alike:
            if alike not in self._of_place:
                self._of_place[alike] = self._learned_of_place(alike)
            for signal, limits in self._of_place[alike].items():
                if signal not in of_all:
                    found[signal] = limits
                    continue
                held = _holding(of_all[signal], [self._good[row].columns[signal]
                                                   for row in alike])
                found[signal] = SignalBand(*(
                    np.where(np.isfinite(held.half_width), one, other)
                    for one, other in zip(held[:2], limits[:2])))
        return band._replace(signals=found)

    def _beside_place(self, columns: Columns, place: Group, own: Optional[int]) -> Columns:
        """Return the columns of a run, with *time lost* relative to the good runs of its place.

        The time map to another place is less exact, with the same error in each run that goes
        there. Taken for a deviation of these runs, the error would make good ones stand out or
        leave the band, all at the same moment. For a good run that is alone at its place, *time
        lost* is unknown.
        """
        if not self._times_by_place:
            return columns
        others = [it.columns[_TIME_LOST] for row, it in enumerate(self._good)
                  if it.run.place == place and row != own]
        if not others and own is None:
            return columns
        usual = common(np.stack(others)).astype(np.float32) if others else np.float32(np.nan)
        return {**columns, _TIME_LOST: columns[_TIME_LOST] - usual}

    def _learned_of_place(self, alike: Sequence[int]) -> Dict[Signal, SignalBand]:
        """Return bands of tool places, with a margin for times found by another place's motion."""
        columns = [self._good[row].columns for row in alike]
        band = BandLearner(columns, self._tolerance).band()
        return {signal: widened(limits._replace(half_width=limits.half_width + signal_tolerance(
                    signal, columns[0][signal], self._tolerance)))
                for signal, limits in band.signals.items() if signal.kind in _OF_PLACE}

    def _notes(self, run: Run, alignment: Alignment, columns: Columns) -> List[str]:
        notes = []
        if fingerprint(run) == fingerprint(self.reference):
            notes.append('it is the reference itself')
        if run.is_broken_off:
            last = max(run.events, key=lambda it: it.time_s, default=None)
            notes.append('it was broken off' + ('' if last is None else
                                                f' after "{last.name}"'))
        if run.is_damaged:
            notes.append(DAMAGED)
        if alignment.method is not AlignmentMethod.MOTION:
            notes.append(f'aligned by {alignment.method.value}: the runs have no motion in common')
        elif not unknown_moments(self.reference, run, self.times_s,
                                 alignment.time_map.to_run(self.times_s)).any():
            notes += _pace(alignment)
        if all(it.run.place != run.place for it in self._good):
            notes.append('not judged: the positions of tools, except where all places are alike, '
                         f'as there is no good run of {_group_text(run.place)}')
        notes += self._missing(run)
        known = {run.configuration, self.reference.configuration} - {''}
        if len(known) > 1:
            notes.append('it was recorded with another configuration than the reference')
        return notes + self._uncovered(run, alignment, columns)

    def _uncovered(self, run: Run, alignment: Alignment, columns: Columns) -> List[str]:
        covered = np.isfinite(np.stack([it for signal, it in columns.items()
                                        if signal.kind is not SignalKind.STATE])).any(axis=0)
        if covered.mean() < _MIN_SHARE:
            return [f'it covers {covered.mean():.0%} of the reference']
        ends_s = np.clip(alignment.time_map.to_run(self.times_s[[0, -1]]), 0.0, run.duration_s)
        compared_s = float(ends_s[1] - ends_s[0])
        if compared_s < _MIN_SHARE * run.duration_s:
            return [f'{compared_s:.1f} s of its {run.duration_s:.1f} s are compared: the reference '
                    'is shorter']
        return []

    def _missing(self, run: Run) -> List[str]:
        mine, theirs = (list(it.by_key) for it in (self.reference, run))
        notes = []
        for only, where in (([key for key in mine if key not in theirs], 'the reference'),
                            ([key for key in theirs if key not in mine], 'the run')):
            if only:
                names = ', '.join(' '.join(key) for key in only[:4])
                more = f' and {len(only) - 4} more' if len(only) > 4 else ''
                notes.append(f'only {where} has {names}{more}')
        return notes


def _is_elsewhere(good: _Good) -> bool:
    places = [it for signal, it in good.columns.items() if signal.kind is SignalKind.PLACE]
    if good.aligned_by is not AlignmentMethod.MOTION or not places:
        return True
    away_m = np.sqrt(np.square(np.stack(places)).sum(axis=0))
    known = away_m[np.isfinite(away_m)]
    return len(known) > 0 and float(np.median(known)) > _ELSEWHERE_M


def _steep_rows(reference: Run, times_s: np.ndarray) -> Dict[str, np.ndarray]:
    """Return where (t,) (bool) each tool's path is steep."""
    return {it.device: np.less(*map(np.abs, steepness(it, times_s)))
            for it in reference.motions if len(it.times_s)}


def _is_on_path(it: Departure, steep: Mapping[str, np.ndarray]) -> bool:
    """Return whether a tool that is too high or too low is so on a steep path: early or late."""
    if it.signal.label != 'tool up' or it.signal.device not in steep:
        return False
    return bool(steep[it.signal.device][int(round(it.worst_s * RATE_HZ))])


def _can_judge_times_by_place(places: Sequence[Group]) -> bool:
    """Return whether enough good runs share their place with another to judge times by place."""
    return len(set(places)) > 1 and sum(
        list(places).count(it) > 1 for it in places) >= MIN_RUNS


def _without_place(good: _Good, reference: Run) -> Columns:
    """Return the columns of a good run that hold for all places: no tool places of another one."""
    if good.run.place == reference.place:
        return good.columns
    return {signal: values for signal, values in good.columns.items()
            if signal.kind not in _OF_PLACE}


def _where_places_are_alike(good: Sequence[_Good]) -> List[Columns]:
    """Return the tools' places where they are the same for all places; empty without any such.

    One run in five may be elsewhere, as it may not be good.
    """
    found: List[Columns] = [{} for _ in good]
    if all(it.run.place == good[0].run.place for it in good):
        return []
    # not a set: the order of the signals would differ from one start of the program to the next
    for device in dict.fromkeys(it.device for it in good[0].columns
                                if it.kind is SignalKind.PLACE):
        axes = [it for it in good[0].columns if it.kind is SignalKind.PLACE
                and it.device == device and all(it in other.columns for other in good)]
        values = np.stack([[it.columns[axis] for axis in axes] for it in good])
        away_m = np.sort(np.abs(values - np.median(values, axis=0)).max(axis=1), axis=0)
        differ = ~(away_m[int(_SHARE_ALIKE * (len(good) - 1))] < _SAME_PLACE_M)
        differ = moving_maximum(differ.astype(float), _NEAR_ANOTHER_ROWS) > 0.0
        for places, at in zip(found, np.where(differ, np.float32(np.nan), values)):
            places.update({} if differ.all() else dict(zip(axes, at)))
    return found if found[0] else []


def _group_text(group: Group) -> str:
    """Return a group in words: what determines the expectation, and its value."""
    return ', '.join(f'{name} {"unknown" if value is None else format(value, "g")}'
                     for name, value in group) or 'no variant'


def _wait_anchors(reference: Run, run: Run) -> List[Anchor]:
    """Return anchors at the starts and ends of waits, whose duration is arbitrary."""
    mine, theirs = reference.waits_s, run.waits_s
    if len(mine) != len(theirs):
        return []
    anchors = (Anchor(*it) for one, other in zip(mine, theirs) for it in zip(one, other))
    found: Tuple[Anchor, ...] = ()
    for anchor in anchors:
        found = with_anchor(found, anchor)
    return list(found)


def _distinct(runs: Sequence[Run]) -> List[Run]:
    """Return each run once: the same run twice would look like two that agree."""
    found: Dict[bytes, Run] = {}
    for run in runs:
        found.setdefault(fingerprint(run), run)
    return list(found.values())


def _pace(alignment: Alignment) -> List[str]:
    """Return how much longer or shorter the motion took, if the difference is worth reporting."""
    reference_s, run_s = (float(it[-1] - it[0]) for it in alignment.time_map)
    longer_s = run_s - reference_s
    if reference_s <= 0.0 or abs(longer_s) < max(_MIN_LONGER_S, _MIN_PACE * reference_s):
        return []
    return [f'its motion took {abs(longer_s):.2f} s ({100 * abs(longer_s) / reference_s:.1f} %) '
            f'{"longer" if longer_s > 0 else "less"} than in the reference']


# The band as it holds for one run: wider where that run's moments are less certain.

_OF_PLACE = (SignalKind.PLACE, SignalKind.JOINT, SignalKind.SPEED)
"""Signals that depend on the place at which a process runs."""
_TIME_LOST = Signal('', TIMING_LABEL, 's', SignalKind.TIMING)
_EDGED = (SignalKind.VARIABLE, SignalKind.FORCE, SignalKind.SPEED, SignalKind.NOISE)
_EDGE_S, _MIN_WAIT_S = EDGE_ROWS / RATE_HZ, 0.1
_AROUND_ROWS, _MIN_SPEED_M_S = int(0.5 * RATE_HZ), 0.005
_BY_STATES_S = 0.08
_NEAR_MISSING_S, _LESS_SURE = 0.4, 2.0
"""Time beside missing data [s] in which a band is wider, and how many times."""


def _band_of_run(band: Band, alignment: Alignment, columns: Columns, reference: Run,
                times_s: np.ndarray) -> Band:
    """Return the band for a run, from the band of the good runs.

    Args:
        band: of the good runs of the same group and place.
        alignment, columns: of the run.
        times_s: (t,) the moments of the reference.
    """
    if alignment.method is AlignmentMethod.STATES:
        band = _wider_in_time(band, reference, times_s)
    band = _less_sure_in_waits(band, alignment, reference, times_s)
    return _less_sure_beside(band, columns, reference, times_s)


def _wider_in_time(band: Band, reference: Run, times_s: np.ndarray) -> Band:
    """Return the band for a run whose moments are known only from messages of states.

    The faster a tool moves, the less is known about where it should be.
    """
    found = dict(band.signals)
    speeds = {it.device: tool_speed(it, times_s) for it in reference.motions if len(it.times_s)}
    for signal, limits in band.signals.items():
        if signal.label == TIMING_LABEL:
            found[signal] = limits._replace(half_width=limits.half_width + _BY_STATES_S)
        elif signal.kind is SignalKind.PLACE and signal.device in speeds:
            found[signal] = limits._replace(
                half_width=limits.half_width + _BY_STATES_S * speeds[signal.device])
        elif signal.kind in _OF_PLACE:
            found[signal] = widened(limits)
    return band._replace(signals=found)


def _less_sure_in_waits(band: Band, alignment: Alignment, reference: Run,
                        times_s: np.ndarray) -> Band:
    """Return the band for a run that waited less: its edges there are slower on the other clock."""
    found = dict(band.signals)
    for begin_s, end_s in reference.waits_s:
        run_s = alignment.time_map.to_run(np.array([begin_s, end_s]))
        stretch = (end_s - begin_s) / max(float(np.ptp(run_s)), _MIN_WAIT_S)
        if stretch <= 1.0:
            continue
        rows = slice(*np.searchsorted(times_s, (begin_s - stretch * _EDGE_S, end_s + _EDGE_S)))
        for signal, limits in found.items():
            if signal.kind in _EDGED:
                edge_s = _EDGE_S + (ROUGH_S if signal.kind is SignalKind.NOISE else 0.0)
                wider = widened(limits, int(stretch * edge_s * RATE_HZ) + 1)
                found[signal] = limits._replace(**{
                    name: _with_rows(getattr(limits, name), rows, getattr(wider, name))
                    for name in ('middle', 'half_width')})
    return band._replace(signals=found)


def _with_rows(values: np.ndarray, rows: slice, others: np.ndarray) -> np.ndarray:
    result = values.copy()
    result[rows] = others[rows]
    return result


def _less_sure_beside(band: Band, columns: Columns, reference: Run, times_s: np.ndarray) -> Band:
    """Return the band for a run whose tools are farther beside their paths than in good runs.

    Moments are found by the place of a tool on its path. A tool beside its path may as well be
    earlier or later, by the time it takes for that distance.
    """
    away, passed = np.zeros((2, len(times_s)))
    for motion in reference.motions:
        if not len(motion.times_s):
            continue
        outside_m = {signal.label: np.nan_to_num(beyond(
            columns[signal], limits.middle - limits.half_width,
            limits.middle + limits.half_width)) for signal, limits in band.signals.items()
            if signal.device == motion.device and signal.kind is SignalKind.PLACE
            and signal in columns}
        level, climb = steepness(motion, times_s)
        along, aside, up = (outside_m.get(label, np.zeros(len(times_s)))
                            for label in ('tool along', *BESIDE))
        away += np.square(aside) + np.square(level * up - climb * along)
        passed += np.square(tool_speed(motion, times_s))
    speed_m_s = np.sqrt(moving_maximum(passed, _AROUND_ROWS))
    unsure_s = np.where(speed_m_s > 0.0, np.sqrt(away) / np.maximum(speed_m_s, _MIN_SPEED_M_S), 0.0)
    unsure_s = moving_maximum(unsure_s, 2 * _AROUND_ROWS)
    if _TIME_LOST not in band.signals or not unsure_s.any():
        return band
    limits = band.signals[_TIME_LOST]
    wider = limits._replace(half_width=limits.half_width + unsure_s)
    return band._replace(signals={**band.signals, _TIME_LOST: wider})


def _where_moments_are_known(columns: Columns, missing: Sequence[Unjudged], run: Run,
                             alignment: Alignment, times_s: np.ndarray) -> Columns:
    """Return the columns, unknown where the moment is, even if a single signal has values there."""
    ends_s = {(it.begin_s, it.end_s) for it in missing if it.why is Missing.MOTION}
    if not ends_s:
        return columns
    unknown = inside(run.begin_s + alignment.time_map.to_run(times_s), np.array(sorted(ends_s)))
    return {signal: values if signal.kind is SignalKind.STATE
            else np.where(unknown, np.float32(np.nan), values)
            for signal, values in columns.items()}


def _less_sure_near_gaps(band: Band, missing: Sequence[Unjudged], run: Run, alignment: Alignment,
                         times_s: np.ndarray) -> Band:
    """Return the band for a run that lacks data: beside these, values are less certain.

    Where messages are lost or late, their neighbors were often delayed, too, though less: those of
    the same signal, and if half of the devices lack data, those of all signals.
    """
    recording_s = run.begin_s + alignment.time_map.to_run(times_s)

    def near(stretches: Iterable[Unjudged]) -> np.ndarray:
        ends_s = {(it.begin_s, it.end_s) for it in stretches if it.why is not Missing.SELDOM}
        return inside(recording_s, np.array(sorted(ends_s)).reshape(-1, 2), _NEAR_MISSING_S)

    devices = {it.device for it in band.signals} - {''}
    lack = np.array([near(it for it in missing if it.signal.device == name) for name in devices])
    of_all = lack.mean(axis=0) >= 0.5 if len(lack) else np.zeros(len(times_s), bool)
    found = {}
    for signal, limits in band.signals.items():
        is_near = of_all | near(it for it in missing if it.signal == signal)
        found[signal] = limits._replace(
            half_width=np.where(is_near, _LESS_SURE, 1.0) * limits.half_width)
    return band._replace(signals=found)


def _holding(limits: SignalBand, values: Sequence[np.ndarray]) -> SignalBand:
    """Return the band of all places, widened to hold what good runs of one place did.

    The moments of these runs were found by the states of one of them, with the same error in each.
    """
    low = np.fmin.reduce([limits.middle, *values]) - limits.half_width
    high = np.fmax.reduce([limits.middle, *values]) + limits.half_width
    return SignalBand(0.5 * (low + high), 0.5 * (high - low))
