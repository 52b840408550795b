# SPDX-License-Identifier: BSD-3-Clause
"""Good and faulty runs of five cells with six-axis robots, made from seeds alone.

A cell is a list of steps: the tool's target, the duration, and the values of the process meanwhile.
Each run has its own pace, longer and shorter steps, gains, a temperature that rises over the shift,
and noise; messages without a stamp are delayed now and then. The runs share nothing with the sewing
cell's simulator.
"""
from __future__ import annotations

from typing import Callable, Dict, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from process_visualizer.runs.run import (
    Channel,
    ChannelKind,
    Group,
    Run,
    RunEvent,
    RunPhase,
    ToolForce,
    ToolMotion,
)

JOINT_HZ, FORCE_HZ, SENSOR_HZ, PLC_HZ, SLOW_HZ = 125.0, 100.0, 50.0, 20.0, 1.0
REST_S = 0.3
_SMOOTH_S, _HELD_UP_S = 0.06, 0.04
_NOISE = {'force': 1.3, 'current': 0.12, 'torque': 0.03, 'flow': 0.04, 'pressure': 0.05,
          'vacuum': 0.5}
_GAIN = {'force': 0.02, 'current': 0.015, 'torque': 0.015, 'flow': 0.015, 'pressure': 0.01,
         'vacuum': 0.01}
_UNITS = {'force': 'N', 'current': 'A', 'torque': 'Nm', 'flow': 'ml/s', 'pressure': 'bar',
          'vacuum': 'kPa'}
_WAITS = (RunPhase('wait', 'waits', 'goes on', True),)
_DIRECTION = np.array([0.2, 0.1, 0.97])
PITCH_M = 0.12

Point = Tuple[float, float, float]


class Step(NamedTuple):
    """A step: the tool goes to ``to`` [m], while quantities have ``values``.

    A value is a number, or two between which it rises. A step that ``is_wait`` has any duration.
    """

    state: int
    duration_s: float
    to: Optional[Point] = None
    values: Dict[str, object] = {}
    is_wait: bool = False


class Fault(NamedTuple):
    """A fault: ``wanted`` are suffixes of the signals at fault, ``begin_s`` is its beginning [s].

    NaN: the fault is there from the beginning of the run.
    """

    kind: str
    size: str
    wanted: Tuple[str, ...]
    begin_s: float


class MadeRun(NamedTuple):
    """A run, and its fault, if it has one."""

    run: Run
    fault: Optional[Fault] = None


class ProcessCell(NamedTuple):
    """A cell: its steps by the number that selects variant or position, and its possible faults."""

    name: str
    steps: Callable[[int], List[Step]]
    numbers: int
    quantities: Tuple[str, ...]
    kinds: Tuple[str, ...]
    number_label: str = ''


def _grinding(_number: int) -> List[Step]:
    home, above, begin, end = (0.5, -0.3, 0.5), (0.7, -0.15, 0.35), (0.7, -0.15, 0.3), \
        (0.7, 0.15, 0.3)
    grind: Dict[str, object] = {'force': 28.0, 'current': 6.0}
    idle: Dict[str, object] = {'current': 3.0}
    return [Step(10, 0.8, None), Step(20, 1.6, above, idle), Step(30, 0.8, begin, idle),
            Step(40, 3.5, end, grind), Step(40, 3.5, begin, grind), Step(40, 3.0, end, grind),
            Step(50, 0.8, (0.7, 0.15, 0.4), idle), Step(55, 1.8, home), Step(60, 0.6, None)]


def _screwing(_number: int) -> List[Step]:
    steps = [Step(10, 0.6, None)]
    for x, y in ((0.6, -0.1), (0.7, -0.1), (0.7, 0.1), (0.6, 0.1)):
        steps += [Step(20, 1.0, (x, y, 0.4)), Step(30, 0.6, (x, y, 0.3)),
                  Step(35, 0.8, (x, y, 0.29), {'force': 15.0, 'torque': 0.6, 'current': 2.0}),
                  Step(40, 0.7, None, {'force': 20.0, 'torque': (0.6, 3.0), 'current': 3.5}),
                  Step(50, 0.6, (x, y, 0.4))]
    return [*steps, Step(55, 1.4, (0.4, 0.0, 0.5)), Step(60, 0.5, None)]


def _palletising(number: int) -> List[Step]:
    x, y = 0.55 + PITCH_M * (number % 3), 0.1 + PITCH_M * (number // 3)
    held: Dict[str, object] = {'vacuum': 60.0, 'force': 12.0}
    return [Step(10, 0.5, None), Step(20, 1.2, (0.6, -0.4, 0.5)), Step(25, 2.0, None, {}, True),
            Step(30, 0.7, (0.6, -0.4, 0.25)), Step(35, 0.4, None, {'vacuum': 60.0}),
            Step(40, 0.7, (0.6, -0.4, 0.5), held), Step(45, 1.6, (x, y, 0.5), held),
            Step(50, 0.8, (x, y, 0.2), held), Step(55, 0.4, None), Step(58, 0.7, (x, y, 0.5)),
            Step(59, 1.6, (0.5, -0.2, 0.6)), Step(60, 0.4, None)]


def _dispensing(_number: int) -> List[Step]:
    bead: Dict[str, object] = {'flow': 2.0, 'pressure': 4.0}
    ready: Dict[str, object] = {'pressure': 4.0}
    corners: Sequence[Point] = ((0.8, -0.2, 0.3), (0.8, 0.2, 0.3), (0.5, 0.2, 0.3),
                                (0.5, -0.2, 0.3))
    return [Step(10, 0.6, None), Step(15, 3.0, None, {}, True),
            Step(20, 1.5, (0.5, -0.2, 0.4), ready), Step(30, 0.6, (0.5, -0.2, 0.3), ready),
            *(Step(40, 2.2, corner, bead) for corner in corners),
            Step(50, 0.8, (0.5, -0.2, 0.45), ready), Step(55, 3.0, None, {}, True),
            Step(58, 1.5, (0.4, 0.0, 0.6)), Step(60, 0.5, None)]


def _variants(number: int) -> List[Step]:
    wide = 0.0 if number == 0 else 0.15
    work: Dict[str, object] = {'force': 18.0 + 8.0 * number, 'current': 4.0 + number}
    return [Step(10, 0.6, None), Step(20, 1.5, (0.6, -0.1 - wide, 0.4)),
            Step(30, 0.6, (0.6, -0.1 - wide, 0.3)), Step(40, 3.0, (0.7, 0.1 + wide, 0.3), work),
            Step(42, 2.5, (0.8, -0.1, 0.3), work), Step(50, 0.7, (0.8, -0.1, 0.45)),
            Step(55, 1.6, (0.4, 0.0, 0.5)), Step(60, 0.5, None)]


_ALWAYS = ('temperature', 'ok_missing', 'dwell', 'missing_step', 'extra_step', 'override',
           'tool_offset', 'wrong_state', 'late_ok')
_FORCED = ('force_gain', 'vibration', 'contact_lost', 'force_noise', 'force_turned', 'force_stuck')
CELLS: Tuple[ProcessCell, ...] = (
    ProcessCell('grinding', _grinding, 1, ('force', 'current'),
                (*_ALWAYS, *_FORCED, 'current_gain', 'current_drift')),
    ProcessCell('screwing', _screwing, 1, ('force', 'torque', 'current'),
                (*_ALWAYS, 'force_gain', 'torque_gain', 'torque_once', 'current_gain')),
    ProcessCell('palletising', _palletising, 12, ('force', 'vacuum'),
                (*_ALWAYS, 'wrong_number', 'vacuum_gain', 'force_gain'), 'pattern_index'),
    ProcessCell('dispensing', _dispensing, 1, ('flow', 'pressure'),
                (*_ALWAYS, 'flow_gain', 'late_flow', 'pressure_gain')),
    ProcessCell('variants', _variants, 2, ('force', 'current'),
                (*_ALWAYS, *_FORCED, 'wrong_number', 'current_gain'), 'variant'))
SIZES = ('small', 'middle', 'large')
_SIZES: Dict[str, Tuple[float, float, float]] = {
    'temperature': (1.0, 2.0, 5.0), 'dwell': (0.15, 0.3, 0.6), 'override': (0.93, 0.87, 0.75),
    'tool_offset': (0.001, 0.002, 0.004), 'force_gain': (0.06, 0.12, 0.2),
    'current_gain': (0.05, 0.1, 0.2), 'torque_gain': (0.05, 0.1, 0.2),
    'torque_once': (0.1, 0.2, 0.3), 'vacuum_gain': (0.05, 0.1, 0.2),
    'pressure_gain': (0.04, 0.08, 0.15), 'flow_gain': (-0.06, -0.12, -0.25),
    'vibration': (2.5, 4.0, 8.0), 'contact_lost': (0.2, 0.4, 0.8), 'force_noise': (1.5, 2.0, 3.0),
    'force_turned': (20.0, 40.0, 60.0), 'force_stuck': (0.5, 1.0, 2.0),
    'current_drift': (0.1, 0.2, 0.4), 'late_flow': (0.25, 0.4, 0.8), 'late_ok': (0.3, 0.6, 1.2)}
_NEEDED = {'vibration': 'force', 'contact_lost': 'force', 'force_noise': 'force',
           'force_turned': 'force', 'force_stuck': 'force', 'current_drift': 'current',
           'torque_once': 'torque', 'late_flow': 'flow'}
"""The quantity that a step must have for a fault to show."""
_PLACE = ('tool along', 'tool sideways', 'tool up', 'place')
_WANTED: Dict[str, Tuple[str, ...]] = {
    'temperature': ('temperature',), 'ok_missing': ('ok',), 'late_ok': ('ok',),
    'dwell': ('time lost', 'pace'), 'override': ('pace', 'time lost', 'tool speed'),
    'missing_step': ('state', 'time lost', 'pace', *_PLACE),
    'extra_step': ('state', 'time lost', 'pace', *_PLACE), 'tool_offset': _PLACE,
    'wrong_state': ('state',), 'force_gain': ('force',), 'vibration': ('force',),
    'contact_lost': ('force',), 'force_noise': ('force',), 'force_turned': ('force', 'direction'),
    'force_stuck': ('force',), 'wrong_number': (*_PLACE, 'pattern_index', 'variant'),
    'current_gain': ('current',), 'current_drift': ('current',), 'torque_gain': ('torque',),
    'torque_once': ('torque',), 'vacuum_gain': ('vacuum',), 'pressure_gain': ('pressure',),
    'flow_gain': ('flow',), 'late_flow': ('flow',)}


def good_run(cell: ProcessCell, seed: int) -> MadeRun:
    """Return a good run."""
    return _Maker(cell, seed).run()


def faulty_run(cell: ProcessCell, kind: str, size: str, seed: int) -> MadeRun:
    """Return a run with a fault of a kind and size, in a step drawn by the seed."""
    return _Maker(cell, seed, kind, size).run()


class _Maker:
    def __init__(self, cell: ProcessCell, seed: int, kind: str = '', size: str = 'middle') -> None:
        self._cell, self._seed, self._kind, self._size = cell, seed, kind, size
        self._amount = _SIZES.get(kind, (1.0, 1.0, 1.0))[SIZES.index(size)]
        self._random = np.random.default_rng([seed, 77])
        self._number = int(self._random.integers(cell.numbers))
        done = self._number
        if kind == 'wrong_number':
            done = (self._number + 1 + (size == 'large')) % cell.numbers
            done = done if done != self._number else (done + 1) % cell.numbers
        self._steps = cell.steps(done)
        self._pace = 1.0 + 0.012 * self._random.standard_normal()
        self._durations_s = [self._duration_s(it) for it in self._steps]
        self._gains = {it: 1.0 + _GAIN[it] * self._random.standard_normal()
                       for it in cell.quantities}
        self._warmth = 46.7 + 0.3 * float(np.clip(self._random.standard_normal(), -2.0, 2.0))
        self._changed_row = self._change_steps()
        self._starts_s = REST_S + np.concatenate(([0.0], np.cumsum(self._durations_s)))
        self.duration_s = float(self._starts_s[-1]) + REST_S

    def _duration_s(self, step: Step) -> float:
        if step.is_wait:
            return float(step.duration_s * np.exp(0.6 * self._random.standard_normal()))
        return float(step.duration_s * self._pace * (1.0 + 0.008 * self._random.standard_normal())
                     + 0.01 * self._random.standard_normal())

    def _change_steps(self) -> int:
        """Apply the faults that change steps; return the row of the step at fault."""
        random = np.random.default_rng([self._seed, 78])
        inner = [row for row in range(1, len(self._steps) - 1) if not self._steps[row].is_wait]
        moving = [row for row in inner if self._steps[row].to is not None]
        working = [row for row in inner if self._steps[row].values]
        needed = _NEEDED.get(self._kind)
        if needed is not None:
            working = [it for it in working if needed in self._steps[it].values]
        row = int(random.choice(working))
        if self._kind in ('missing_step', 'extra_step'):
            row = int(random.choice([it for it in working
                                     if self._steps[it].duration_s >= 0.6]))
            step, took_s = self._steps[row], self._durations_s[row]
            if self._kind == 'missing_step':
                del self._steps[row], self._durations_s[row]
            else:
                before = self._steps[row - 1]
                self._steps[row + 1:row + 1] = [before, step]
                self._durations_s[row + 1:row + 1] = [self._durations_s[row - 1], took_s]
                row += 1
        elif self._kind == 'override':
            self._durations_s = [took_s if step.is_wait else took_s / self._amount
                                 for step, took_s in zip(self._steps, self._durations_s)]
        elif self._kind == 'dwell':
            row = int(random.choice(moving))
            self._steps.insert(row, self._steps[row]._replace(to=None))
            self._durations_s.insert(row, self._amount)
        return row

    def run(self) -> MadeRun:
        positions = self._positions
        times_s = self._times_s(JOINT_HZ)
        at = positions(times_s)
        if self._kind == 'tool_offset':
            at = at + self._amount * np.array([0.6, 0.64, 0.48])
        speed = np.linalg.norm(np.gradient(positions(times_s), axis=0), axis=1) * JOINT_HZ
        channels = [Channel('robot', 'tool speed', 'm/s', ChannelKind.SPEED, times_s, speed)]
        channels += [Channel('robot', f'joint j{number}', 'rad', ChannelKind.JOINT, times_s, it)
                     for number, it in enumerate(_joints(positions(times_s)).T, start=1)]
        forces: Tuple[ToolForce, ...] = ()
        if 'force' in self._cell.quantities:
            force_s = self._times_s(FORCE_HZ)
            vectors = self._force(force_s)
            forces = (ToolForce('robot', 'tool0', force_s, vectors),)
            channels.append(Channel('robot', 'tool force', 'N', ChannelKind.FORCE, force_s,
                                    np.linalg.norm(vectors, axis=1)))
        channels += [self._sensor(it) for it in self._cell.quantities if it != 'force']
        channels += [self._temperature(), *self._plc()]
        events = [RunEvent('cycle begins', REST_S),
                  RunEvent('cycle ends', self.duration_s - REST_S)]
        for step, begin_s, took_s in zip(self._steps, self._starts_s, self._durations_s):
            if step.is_wait:
                events += [RunEvent('waits', float(begin_s)),
                           RunEvent('goes on', float(begin_s + took_s))]
        run = Run(f'{self._cell.name} {self._kind or "good"} {self._seed}', self.duration_s,
                  tuple(channels), (ToolMotion('robot', times_s, at),),
                  tuple(sorted(events, key=lambda it: it.time_s)), forces=forces,
                  phases=_WAITS, **self._group())
        return MadeRun(run, self._fault())

    def _group(self) -> Dict[str, Group]:
        label = self._cell.number_label
        group = ((label, float(self._number)),)
        return {} if not label else {'place' if label == 'pattern_index' else 'group': group}

    def _fault(self) -> Optional[Fault]:
        if not self._kind:
            return None
        begin_s = float(self._starts_s[self._changed_row])
        if self._kind == 'late_flow':  # when it should have begun
            begin_s = float(next(start_s for start_s, step in zip(self._starts_s, self._steps)
                                 if 'flow' in step.values))
        if self._kind in ('temperature', 'override', 'tool_offset', 'ok_missing', 'late_ok',
                          'wrong_state', 'wrong_number') or self._kind.endswith('gain'):
            begin_s = np.nan
        return Fault(self._kind, self._size, _WANTED[self._kind], begin_s)

    def _times_s(self, rate_hz: float) -> np.ndarray:
        count = int(self.duration_s * rate_hz)
        offset = self._random.uniform(0.0, 1.0 / rate_hz)
        jitter = 0.02 / rate_hz * self._random.standard_normal(count)
        result: np.ndarray = np.sort(np.arange(count) / rate_hz + offset + jitter)
        return result

    def _arrivals_s(self, times_s: np.ndarray) -> np.ndarray:
        """Return arrival times of messages without a stamp: delayed ones then arrive at once."""
        begin_s = self._random.uniform(0.0, self.duration_s)
        held = (times_s >= begin_s) & (times_s < begin_s + 2.0 * _HELD_UP_S)
        result: np.ndarray = np.where(
            held, begin_s + 2.0 * _HELD_UP_S + 2e-4 * np.cumsum(held), times_s)
        return np.sort(result)

    def _positions(self, times_s: np.ndarray) -> np.ndarray:
        at: Point = self._steps[-3].to or (0.5, -0.3, 0.5)
        for step in reversed(self._steps):
            if step.to is not None:
                at = step.to
                break
        found = np.tile(np.array(at), (len(times_s), 1))
        for step, begin_s, took_s in zip(self._steps, self._starts_s, self._durations_s):
            if step.to is None:
                continue
            u = np.clip((times_s - begin_s) / took_s, 0.0, 1.0)
            share = (u * u * u * (10.0 - 15.0 * u + 6.0 * u * u))[:, np.newaxis]
            here = times_s >= begin_s
            found[here] = (np.array(at) + share * (np.array(step.to) - at))[here]
            at = step.to
        return found

    def _level(self, quantity: str, times_s: np.ndarray) -> np.ndarray:
        """Return the values without noise, with edges that are a little delayed."""
        found = np.zeros(len(times_s))
        for row, (step, begin_s, took_s) in enumerate(zip(self._steps, self._starts_s,
                                                          self._durations_s)):
            value = step.values.get(quantity)
            if value is None:
                continue
            first, last = value if isinstance(value, tuple) else (value, value)
            joins = row > 0 and quantity in self._steps[row - 1].values
            late_s = 0.0 if joins else 0.03 * abs(self._random.standard_normal())
            if self._kind == 'late_flow' and quantity == 'flow' and not joins:
                late_s += self._amount
            gain = 1.0
            if self._kind == 'torque_once' and quantity == 'torque' and row == self._changed_row:
                gain += self._amount
            here = (times_s >= begin_s + late_s) & (times_s < begin_s + took_s)
            share = (times_s[here] - begin_s) / took_s
            found[here] = gain * (first + (last - first) * share)
        if self._kind == f'{quantity}_gain':
            found *= 1.0 + self._amount
        if self._kind == f'{quantity}_drift':
            found *= 1.0 + self._amount * np.clip(
                (times_s - self._starts_s[self._changed_row]) / 4.0, 0.0, 1.0)
        if self._kind == 'contact_lost' and quantity == 'force':
            found[self._in_fault(times_s, self._amount)] = 0.0
        return _low_pass(found * self._gains[quantity], times_s)

    def _in_fault(self, times_s: np.ndarray, longest_s: float) -> np.ndarray:
        begin_s = self._starts_s[self._changed_row]
        end_s = begin_s + min(longest_s, self._durations_s[self._changed_row])
        result: np.ndarray = (times_s >= begin_s) & (times_s < end_s)
        return result

    def _noise(self, quantity: str, times_s: np.ndarray, level: np.ndarray) -> np.ndarray:
        size = _NOISE[quantity] * np.where(np.abs(level) > 0.1, 1.0, 0.3)
        noise: np.ndarray = size * self._random.standard_normal(len(times_s))
        return noise

    def _force(self, times_s: np.ndarray) -> np.ndarray:
        level = self._level('force', times_s)
        noise = self._noise('force', times_s, level)
        fault = self._in_fault(times_s, 2.4)
        if self._kind == 'vibration':
            level = level + fault * self._amount * np.sin(2.0 * np.pi * 12.0 * times_s)
        if self._kind == 'force_noise':
            noise = np.where(fault, self._amount, 1.0) * noise
        values = level + noise
        if self._kind == 'force_stuck':
            rows = np.flatnonzero(self._in_fault(times_s, self._amount))
            values[rows] = values[rows[0]] if len(rows) else 0.0
        vectors = values[:, np.newaxis] * _DIRECTION / np.linalg.norm(_DIRECTION)
        vectors = vectors + 0.3 * self._random.standard_normal(vectors.shape)
        if self._kind == 'force_turned':
            angle = np.radians(self._amount)
            turn = np.array([[1.0, 0.0, 0.0], [0.0, np.cos(angle), -np.sin(angle)],
                             [0.0, np.sin(angle), np.cos(angle)]])
            vectors = np.where(self._in_fault(times_s, 9.0)[:, np.newaxis], vectors @ turn.T,
                               vectors)
        return np.rint(vectors * 10.0) / 10.0

    def _sensor(self, quantity: str) -> Channel:
        times_s = self._times_s(SENSOR_HZ)
        level = self._level(quantity, times_s)
        values = np.rint((level + self._noise(quantity, times_s, level)) * 50.0) / 50.0
        return Channel('process', quantity, _UNITS[quantity], ChannelKind.VARIABLE,
                       self._arrivals_s(times_s), values)

    def _temperature(self) -> Channel:
        times_s = self._times_s(SLOW_HZ)
        rise = 0.3 * times_s / 17.0 * float(self._random.uniform(0.0, 1.0))
        more = self._amount if self._kind == 'temperature' else 0.0
        values = self._warmth + more + rise + 0.05 * self._random.standard_normal(len(times_s))
        return Channel('process', 'temperature', '°C', ChannelKind.VARIABLE, times_s,
                       np.rint(values * 10.0) / 10.0)

    def _plc(self) -> List[Channel]:
        times_s = self._times_s(PLC_HZ)
        row = np.clip(np.searchsorted(self._starts_s, times_s, 'right') - 1, 0, len(self._steps))
        states = np.array([it.state for it in self._steps] + [0])
        if self._kind == 'wrong_state':
            states[self._changed_row] = 99
        states = np.where(times_s < REST_S, 0, states[row])
        late_s = self._amount if self._kind == 'late_ok' else 0.0
        end_s = self.duration_s - REST_S
        jitter_s = 0.02 * self._random.standard_normal()
        ok_s = end_s - 0.8 + jitter_s + late_s
        ok = (np.array([0.9, ok_s]), np.array([0.0, 1.0])) if self._kind != 'ok_missing' \
            else (np.array([0.9]), np.array([0.0]))
        found = [Channel('process', 'state', '', ChannelKind.VARIABLE, self._arrivals_s(times_s),
                         states.astype(float)),
                 Channel('process', 'ok', '', ChannelKind.VARIABLE, *ok),
                 Channel('process', 'cycle', '', ChannelKind.VARIABLE,
                         np.array([REST_S, end_s]), np.array([1.0, 0.0]))]
        if self._cell.number_label:
            found.append(Channel('process', self._cell.number_label, '', ChannelKind.VARIABLE,
                                 times_s, np.full(len(times_s), float(self._number))))
        return found


def _low_pass(values: np.ndarray, times_s: np.ndarray) -> np.ndarray:
    rows = max(int(_SMOOTH_S / (times_s[1] - times_s[0] + 1e-9)), 1)
    padded = np.concatenate((np.full(rows, values[0]), values))
    total = np.concatenate(([0.0], np.cumsum(padded)))
    result: np.ndarray = (total[rows:] - total[:-rows])[-len(values):] / rows
    return result


def _joints(positions: np.ndarray) -> np.ndarray:
    """Return the joints of an arm with two links of 0.6 m whose tool points down."""
    x, y, z = positions.T
    reach = np.hypot(x, y)
    far = np.clip(np.hypot(reach, z), 0.05, 1.19)
    elbow = np.pi - 2.0 * np.arcsin(far / 1.2)
    shoulder = np.arctan2(z, reach) + 0.5 * elbow
    turn = np.arctan2(y, x)
    return np.column_stack((turn, shoulder, -elbow, 0.0 * x, np.pi / 2 + elbow - shoulder, turn))
