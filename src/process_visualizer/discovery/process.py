# SPDX-License-Identifier: BSD-3-Clause
"""Process of a recording: its runs, events, phases and groups, derived from bits and states."""
from __future__ import annotations

import re
from bisect import bisect_left, bisect_right
from collections import Counter
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import islice
from typing import Dict, FrozenSet, Iterator, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from process_visualizer.bagio.message_definition import (
    DefinitionError,
    Definitions,
    parse_definitions,
    short_name,
)
from process_visualizer.bagio.recording import Recording
from process_visualizer.curves.curve_sources import CurveSource, Quantity
from process_visualizer.curves.samples import found_series, read_samples
from process_visualizer.discovery.draft import DraftElement, is_field
from process_visualizer.runs.event import Cycle, cycles, passages_s
from process_visualizer.runs.run import Channel, ChannelKind
from process_visualizer.runs.series import States, is_sequence, states

# Bits and states of a recording.

_WHOLE_TYPES = frozenset({'bool', 'byte', 'char', 'int8', 'uint8', 'int16', 'uint16', 'int32',
                          'uint32', 'int64', 'uint64'})
_NO_STATES = ('std_msgs/Header', 'sensor_msgs', 'geometry_msgs', 'nav_msgs', 'visualization_msgs',
              'trajectory_msgs', 'shape_msgs', 'stereo_msgs', 'control_msgs')
_MAX_FIELDS, _MAX_VISITED, _MAX_DEPTH, _MAX_MESSAGES = 64, 10_000, 3, 100_000


@dataclass(frozen=True, eq=False)
class StateNumber:
    """An integer on a topic that keeps each value for a while: its field, values, and times [s]."""

    topic: str
    field: str
    times_s: np.ndarray
    values: np.ndarray
    label: str

    @property
    def words(self) -> FrozenSet[str]:
        """Return the words of the topic and the field."""
        return frozenset(re.split('[^a-z]+', f'{self.topic} {self.field}'.lower()))

    @cached_property
    def held(self) -> States:
        """Return the successive values, each with its start time."""
        return states(Channel('', '', '', ChannelKind.VARIABLE, self.times_s, self.values))

    @cached_property
    def is_bit(self) -> bool:
        """Return whether the number is always 0 or 1."""
        return bool(np.isin(self.values, (0.0, 1.0)).all())


def recorded_states(recording: Recording, topics: Sequence[str]) -> List[StateNumber]:
    """Return the bits and states that change in a recording, on some of its topics.

    Raises:
        BagError: a file cannot be read.
    """
    fields: Dict[Tuple[str, str], None] = {}
    for connection in recording.index.connections:
        if connection.topic in topics:
            kind = short_name(connection.type)
            try:
                definitions = parse_definitions(kind, connection.message_definition)
            except DefinitionError:
                continue
            paths = filter(None, islice(_paths(kind, definitions), _MAX_VISITED))
            fields.update({(connection.topic, path): None for path in islice(paths, _MAX_FIELDS)})
    sources = [CurveSource('', field, '', (0.0, 0.0, 0.0), Quantity.NUMBER, topic, field=field)
               for topic, field in fields]
    samples = read_samples(recording, found_series(recording, sources, ()), _MAX_MESSAGES)
    states = [state for sample in samples
              for state in _state(sample.source, sample.times_s, sample.values[:, 0])]
    labels = Counter(state.label for state in states)
    return [state if labels[state.label] == 1 else replace(state, label=_whole_name(state))
            for state in states]


def _whole_name(state: StateNumber) -> str:
    return ' '.join([*state.topic.strip('/').split('/'),
                     *(state.field.split('.') if state.field != 'data' else ())])


def _paths(kind: str, definitions: Definitions, before: str = '', depth: int = 0) -> Iterator[str]:
    """Yield the path of each number in a message, and an empty text for every other field."""
    if kind in _NO_STATES or kind.partition('/')[0] in _NO_STATES or depth > _MAX_DEPTH:
        return
    for it in definitions.get(kind, ()):
        path = f'{before}{it.name}'
        is_number = not it.is_array and it.type_name in _WHOLE_TYPES and is_field(path)
        yield path if is_number else ''
        if not it.is_array and it.type_name not in _WHOLE_TYPES:
            yield from _paths(it.type_name, definitions, f'{path}.', depth + 1)


def _state(source: CurveSource, times_s: np.ndarray, values: np.ndarray) -> Iterator[StateNumber]:
    order = np.argsort(times_s, kind='stable')
    channel = Channel('', '', '', ChannelKind.VARIABLE, times_s[order], values[order])
    if len(values) > 1 and np.ptp(values) > 0.0 and is_sequence(channel):
        label = source.topic.rpartition('/')[2] if source.field == 'data' else \
            source.field.replace('.', ' ').replace('_', ' ')
        yield StateNumber(source.topic, source.field, channel.times_s, channel.values, label)


# Definition of one run of the process.

_MIN_RUNS, _MIN_CONSISTENT, _MIN_SCORE = 2, 0.6, 0.2
_PULSE_SCORE, _PULSE_SHARE = 0.3, 0.1
"""Score of a run from pulse to pulse; share of time below which a bit counts as sending pulses.

The score is low because such a run is less often correct than one from a rise to a fall.
"""
_MAX_REST_LEVELS = 3
"""Number of the lowest values of a state that may mean rest."""
_EDGE_S, _EDGE_SHARE = 0.25, 0.1
"""Time, and share of a run, ignored at its beginning and end.

There, numbers sent in separate messages do not all change at the same time.
"""
_SHORT = 0.5
_RUN_WORDS, _NAMED = frozenset({'cycle', 'run', 'running', 'busy', 'active', 'process'}), 1.05


@dataclass(frozen=True, eq=False)
class _Event:
    name: str
    state: StateNumber
    threshold: float
    is_above: bool

    @cached_property
    def times_s(self) -> np.ndarray:
        return passages_s(self.state.times_s, self.state.values, self.threshold, self.is_above, 0.0)

    @property
    def element(self) -> DraftElement:
        attributes = {'name': self.name, 'topic': self.state.topic}
        if self.state.field != 'data':
            attributes['field'] = self.state.field
        attributes['above' if self.is_above else 'below'] = f'{self.threshold:g}'
        return DraftElement('event', attributes)


class _Span(NamedTuple):
    """A candidate definition of a run; ``score`` rates how well it explains the repetition."""

    begin: _Event
    end: _Event
    found: Tuple[Cycle, ...]
    score: float


def _span(begin: _Event, end: _Event, known: Sequence[StateNumber]) -> Optional[_Span]:
    begins_s, ends_s = begin.times_s, end.times_s
    runs = tuple(map(Cycle, begins_s.tolist(), begins_s[1:].tolist())) \
        if begin is end else cycles(begins_s.tolist(), ends_s.tolist())
    whole = tuple(run for run in runs if not run.is_broken_off)
    usual_s = float(np.median([run.end_s - run.begin_s for run in whole])) if whole else 0.0
    whole = tuple(run for run in whole if run.end_s - run.begin_s > _SHORT * usual_s)
    if len(whole) < _MIN_RUNS:
        return None
    covered = sum(run.end_s - run.begin_s for run in whole) / (whole[-1].end_s - whole[0].begin_s)
    alike = [share for share in (_consistency(state, whole) for state in known)
             if share is not None]
    consistent = float(np.mean(alike)) if alike else 1.0
    if consistent < _MIN_CONSISTENT:
        return None
    weight = _PULSE_SCORE if begin is end else 1.0
    weight *= _NAMED if begin.state.words & _RUN_WORDS else 1.0
    return _Span(begin, end, whole, weight * covered * consistent)


def _consistency(state: StateNumber, runs: Sequence[Cycle]) -> Optional[float]:
    """Return the share of runs with the usual order of values; None if each run has one value."""
    orders = [order if len(order) > 1 else () for order in (_order(state, run) for run in runs)]
    if not any(orders):
        return None
    return Counter(orders).most_common(1)[0][1] / len(orders)


def _order(state: StateNumber, cycle: Cycle) -> Tuple[float, ...]:
    return tuple(value for value, _ in _held(state, cycle))


def _held(state: StateNumber, cycle: Cycle) -> List[Tuple[float, float]]:
    """Return the values of a number within a run, each with its start time [s]."""
    edge_s = min(_EDGE_S, _EDGE_SHARE * (cycle.end_s - cycle.begin_s))
    first = max(bisect_right(state.held.since_s, cycle.begin_s + edge_s) - 1, 0)
    last = bisect_left(state.held.since_s, cycle.end_s - edge_s)
    return list(zip(state.held.values[first:last], state.held.since_s[first:last]))


def _spans(known: Sequence[StateNumber]) -> Iterator[_Span]:
    for state in known:
        levels = np.unique(state.values)
        for low, high in list(zip(levels, levels[1:]))[:_MAX_REST_LEVELS]:
            threshold = 0.5 * float(low + high)
            name = state.label if state.is_bit else 'run'
            rise = _Event(f'{name} begins', state, threshold, True)
            fall = _Event(f'{name} ends', state, threshold, False)
            pairs = [(rise, fall)] if not state.is_bit else \
                [(rise, rise)] if _is_pulse(state) else [(rise, fall), (fall, rise)]
            for begin, end in pairs:
                span = _span(begin, end, known)
                if span is not None and span.score >= _MIN_SCORE:
                    yield span


def _is_pulse(bit: StateNumber) -> bool:
    since_s = np.array([*bit.held.since_s, bit.times_s[-1]])
    on_s = float((np.diff(since_s) * np.array(bit.held.values)).sum())
    return on_s < _PULSE_SHARE * float(since_s[-1] - since_s[0])


# Phases: the values of a state within a run.

_MAX_PHASES, _MIN_WAITS = 12, 4
_MIN_WAIT_S, _MIN_WAIT, _TIMES_USUAL = 1.0, 0.2, 4.0
"""Minimum spread of a wait's durations: range [s], std over mean, factor over usual."""


class _Phase(NamedTuple):
    name: str
    begin: str
    end: str
    took_s: np.ndarray


def _phases(state: StateNumber, span: _Span) -> Tuple[List[_Event], List[_Phase]]:
    """Return the values of a state as phases; a value reached from a higher one gets no event."""
    held = [_held(state, run) for run in span.found]
    orders = [tuple(value for value, _ in values) for values in held]
    usual = Counter(orders).most_common(1)[0][0]
    levels = np.unique(state.values)
    rising = {value: all(a < b for order in orders for a, b in zip(order, order[1:]) if b == value)
              for value in usual}
    events: Dict[float, _Event] = {}
    for value in usual[1:]:
        if rising[value]:
            below = float(levels[levels < value].max())
            events[value] = _Event(f'{state.label} {value:g}', state, 0.5 * (below + value), True)
    phases: Dict[str, _Phase] = {}
    for row, value in enumerate(usual):
        begin = span.begin.name if row == 0 else events[value].name if value in events else ''
        behind = usual[row + 1] if row + 1 < len(usual) else None
        end = span.end.name if behind is None else \
            events[behind].name if behind in events else ''
        as_usual = [(values, run) for values, order, run in zip(held, orders, span.found)
                    if order == usual]
        ends_s = [values[row + 1][1] if behind is not None else run.end_s
                  for values, run in as_usual]
        begins_s = [max(values[row][1], run.begin_s) for values, run in as_usual]
        if begin and end and begin != end:
            phases.setdefault(f'{state.label} {value:g}', _Phase(
                f'{state.label} {value:g}', begin, end, np.array(ends_s) - np.array(begins_s)))
    return list(events.values()), list(phases.values())


def _waits(phases: Sequence[_Phase]) -> List[str]:
    """Return the names of the phases that are waits, by their varying durations."""
    if not phases or len(phases[0].took_s) < _MIN_WAITS:
        return []
    shares = [float(it.took_s.std() / max(it.took_s.mean(), 1e-9)) for it in phases]
    usual = float(np.median(shares))
    return [it.name for it, share in zip(phases, shares)
            if np.ptp(it.took_s) > _MIN_WAIT_S and share > max(_MIN_WAIT, _TIMES_USUAL * usual)]


# Numbers that are meant to differ from run to run.

_MIN_CONSTANT, _MIN_STEPS, _MIN_TIMES = 0.9, 0.8, 2
_WORDS = {'place': frozenset({'place', 'pattern', 'index', 'position', 'pocket', 'slot', 'row'}),
          'group': frozenset({'variant', 'recipe', 'product', 'type', 'program', 'article'})}
"""Words in the names of such numbers."""


def _differing(known: Sequence[StateNumber], span: _Span) -> Dict[str, StateNumber]:
    """Return the numbers that identify the variant (group) and the place of a run."""
    found: Dict[str, StateNumber] = {}
    for state in known:
        orders = [_order(state, run) for run in span.found]
        values = [order[0] for order in orders if len(order) == 1]
        distinct = sorted(set(values))
        if len(values) < _MIN_CONSTANT * len(orders) or len(distinct) < 2:
            continue
        is_named = {what: bool(state.words & words) for what, words in _WORDS.items()}
        steps = [b - a for a, b in zip(values, values[1:])]
        is_counter = all(step > 0.0 for step in steps)
        is_pattern = len(distinct) > 2 and not is_counter and np.mean(
            [step == 1.0 or step < 0.0 for step in steps]) >= _MIN_STEPS
        comes_again = min(Counter(values).values()) >= _MIN_TIMES and not state.is_bit
        for what, fits in (('group', comes_again and not is_pattern), ('place', is_pattern)):
            is_other = is_named['place' if what == 'group' else 'group']
            if is_named[what] or fits and not is_other and what not in found:
                found[what] = state
    return found


# The whole proposal.

class Process(NamedTuple):
    """The proposed elements, the numbers that they need, and a summary."""

    elements: Tuple[DraftElement, ...]
    states: Tuple[StateNumber, ...]
    summary: str


def proposed_process(known: Sequence[StateNumber]) -> Optional[Process]:
    """Return a definition of one run of the process, with events, phases and groups.

    A run is a part that repeats in the same order: it begins when a bit rises or a state leaves its
    lowest value, and ends when the bit or state falls back. None if nothing repeats.
    """
    span = max(_spans(known), key=lambda it: it.score, default=None)
    if span is None:
        return None
    events, phases = _of_states(known, span)
    differing = _differing([it for it in known if it is not span.begin.state], span)
    took_s = [cycle.end_s - cycle.begin_s for cycle in span.found]
    count = f'{len(took_s)} runs of {min(took_s):.1f} to {max(took_s):.1f} s'
    run = {'begin': span.begin.name, 'end': span.end.name, **_shortest(span),
           **{what: state.topic.strip('/') if state.field == 'data' else state.label
              for what, state in differing.items()}}
    waits = _waits(phases)
    by_name = {event.name: event for event in (span.begin, span.end, *events)}
    elements = [event.element for event in by_name.values()]
    elements.append(DraftElement('run', run, _about_run(count, differing)))
    for phase in phases:
        attributes = {'name': phase.name, 'from': phase.begin, 'to': phase.end}
        comment = ''
        if phase.name in waits:
            attributes['wait'] = 'true'
            comment = (f'It took {phase.took_s.min():.1f} to {phase.took_s.max():.1f} s: as if the '
                       'process waited. The duration of a wait is not judged.')
        elements.append(DraftElement('phase', attributes, comment))
    return Process(tuple(elements), tuple(known),
                   f'{count}, from "{span.begin.name}" to "{span.end.name}"')


def _about_run(count: str, differing: Dict[str, StateNumber]) -> str:
    text = f'One run of the process, as it repeats itself in the recording: {count}.'
    if 'group' in differing:
        text += ' Only runs of the same group are compared; remove it if all are to be the same.'
    if 'place' in differing:
        text += (' Tool positions are compared with runs of the same place; remove that if they '
                 'are to be the same in all runs.')
    return text


def _shortest(span: _Span) -> Dict[str, str]:
    """Return the attribute that excludes parts much shorter than a run, if there are any."""
    usual_s = float(np.median([it.end_s - it.begin_s for it in span.found]))
    found = cycles(span.begin.times_s.tolist(), span.end.times_s.tolist())
    if span.begin is span.end or all(it.end_s - it.begin_s > _SHORT * usual_s for it in found
                                     if not it.is_broken_off):
        return {}
    return {'shortest': f'{_SHORT * usual_s:.2g}'}


def _of_states(known: Sequence[StateNumber],
               span: _Span) -> Tuple[List[_Event], List[_Phase]]:
    """Return events and phases from the state with the most values in a run, else from bits."""
    best: Tuple[int, Optional[StateNumber]] = 0, None
    for state in known:
        share = _consistency(state, span.found)
        if state.is_bit or share is None or share < _MIN_CONSISTENT:
            continue
        length = len(Counter(_order(state, run) for run in span.found).most_common(1)[0][0])
        if length > best[0]:
            best = length, state
    if best[1] is None:
        return _of_bits(known, span)
    if best[0] > _MAX_PHASES and len(np.unique(best[1].values)) > _MAX_PHASES:
        return [], []
    events, phases = _phases(best[1], span)
    used = {phase.begin for phase in phases} | {phase.end for phase in phases}
    return [event for event in events if event.name in used], phases


def _of_bits(known: Sequence[StateNumber], span: _Span) -> Tuple[List[_Event], List[_Phase]]:
    """Return events and phases of bits that rise and fall once in each run, such as a gripper's."""
    events: List[_Event] = []
    phases: List[_Phase] = []
    for state in known:
        held = [_held(state, run) for run in span.found]
        if len(phases) < _MAX_PHASES and all([value for value, _ in values] == [0.0, 1.0, 0.0]
                                             for values in held):
            on, off = (_Event(f'{state.label} {what}', state, 0.5, what == 'on')
                       for what in ('on', 'off'))
            events += [on, off]
            phases.append(_Phase(state.label, on.name, off.name,
                                 np.array([values[2][1] - values[1][1] for values in held])))
    return events, phases
