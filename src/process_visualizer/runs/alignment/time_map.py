# SPDX-License-Identifier: BSD-3-Clause
"""A monotone, piecewise linear map between the times of a reference and of a run."""
from __future__ import annotations

from typing import Dict, List, NamedTuple, Sequence, Tuple

import numpy as np

from process_visualizer.runs.run import RunEvent

_MIN_STEP_S = 1e-6
"""Minimum spacing of the points of a map [s], which keeps the map invertible."""


class TimeMap(NamedTuple):
    """``run_s[i]`` corresponds to ``reference_s[i]`` (n,) [s]; both ascend; n is at least 1.

    Before the first and after the last point both clocks run equally fast.
    """

    reference_s: np.ndarray
    run_s: np.ndarray

    def to_run(self, reference_s: np.ndarray) -> np.ndarray:
        """Return the times of the run (m,) [s] at times of the reference (m,)."""
        return _mapped(np.asarray(reference_s, float), self.reference_s, self.run_s)

    def to_reference(self, run_s: np.ndarray) -> np.ndarray:
        """Return the times of the reference (m,) [s] at times of the run (m,)."""
        return _mapped(np.asarray(run_s, float), self.run_s, self.reference_s)


def time_map(reference_s: np.ndarray, run_s: np.ndarray) -> TimeMap:
    """Return the map through points (n,), which are made to ascend where they do not."""
    return TimeMap(_rising(reference_s), _rising(run_s))


def shift(run_s: float) -> TimeMap:
    """Return the map that puts a time of the run at the reference's zero."""
    return TimeMap(np.zeros(1), np.array([run_s]))


def joined(first: TimeMap, second: TimeMap) -> TimeMap:
    """Return the map from the reference of the first map to the run of the second.

    The run of the first map is the reference of the second.
    """
    between_s = np.union1d(first.run_s, second.reference_s)
    return time_map(first.to_reference(between_s), second.to_run(between_s))


def _rising(times_s: np.ndarray) -> np.ndarray:
    steps = _MIN_STEP_S * np.arange(len(times_s))
    result: np.ndarray = np.maximum.accumulate(times_s - steps) + steps
    return result


def _mapped(times_s: np.ndarray, known_s: np.ndarray, others_s: np.ndarray) -> np.ndarray:
    inside = np.interp(times_s, known_s, others_s)
    before = np.minimum(times_s - known_s[0], 0.0)
    behind = np.maximum(times_s - known_s[-1], 0.0)
    result: np.ndarray = inside + before + behind
    return result


# The events that two runs have in common, as points of a map of time.

class CommonEvents(NamedTuple):
    """Times [s] (k,) of the same events in both runs, both ascending, and notes on others."""

    reference_s: np.ndarray
    run_s: np.ndarray
    notes: Tuple[str, ...] = ()


def common_events(reference: Sequence[RunEvent], run: Sequence[RunEvent]) -> CommonEvents:
    """Return the events that both runs have equally often and in the same order.

    A mark that an operator set in only one of them is not an event that the other one lacks.
    """
    first, second = _by_name(reference), _by_name(run)
    marks = {it.name for it in (*reference, *run) if it.is_mark}
    notes, pairs = [], []
    for name in sorted(set(first) | set(second)):
        mine, others = first.get(name, []), second.get(name, [])
        if len(mine) == len(others):
            pairs += list(zip(mine, others))
        elif name not in marks:
            here = f'{_times(len(others))} here' if others else 'not here'
            there = f'{_times(len(mine))} in' if mine else 'not in'
            notes.append(f'the event "{name}" occurs {there} the reference, but {here}; it is '
                         'ignored' if mine else f'the event "{name}" occurs {here}, but {there} '
                         'the reference; it is ignored')
    pairs.sort()
    kept = _longest_rising([it[1] for it in pairs])
    if len(kept) < len(pairs):
        notes.append(f'{len(pairs) - len(kept)} of {len(pairs)} events occur in a different order '
                     'than in the reference; they are ignored')
    chosen = np.array([pairs[row] for row in kept], float).reshape(-1, 2)
    return CommonEvents(chosen[:, 0], chosen[:, 1], tuple(notes))


def _by_name(events: Sequence[RunEvent]) -> Dict[str, List[float]]:
    found: Dict[str, List[float]] = {}
    for event in sorted(events, key=lambda it: it.time_s):
        found.setdefault(event.name, []).append(event.time_s)
    return found


def _times(count: int) -> str:
    return {0: 'never', 1: 'once', 2: 'twice'}.get(count, f'{count} times')


def _longest_rising(values: Sequence[float]) -> List[int]:
    """Return the indices of a longest subsequence that does not fall."""
    length, before = [1] * len(values), [-1] * len(values)
    for here, value in enumerate(values):
        for earlier in range(here):
            if values[earlier] <= value and length[earlier] + 1 > length[here]:
                length[here], before[here] = length[earlier] + 1, earlier
    place = int(np.argmax(length)) if values else -1
    found = []
    while place >= 0:
        found.append(place)
        place = before[place]
    return found[::-1]
