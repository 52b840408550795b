# SPDX-License-Identifier: BSD-3-Clause
"""The events that two runs have in common, as points of a map of time."""
from __future__ import annotations

from typing import Dict, List, NamedTuple, Sequence, Tuple

import numpy as np

from process_visualizer.runs.run import RunEvent


class CommonEvents(NamedTuple):
    """Times [s] (k,) of the same events in both runs, both rising, and what could not be used."""

    reference_s: np.ndarray
    run_s: np.ndarray
    notes: Tuple[str, ...] = ()


def common_events(reference: Sequence[RunEvent], run: Sequence[RunEvent]) -> CommonEvents:
    """Return the events that both have equally often and in the same order."""
    first, second = _by_name(reference), _by_name(run)
    notes, pairs = [], []
    for name in sorted(set(first) | set(second)):
        mine, others = first.get(name, []), second.get(name, [])
        if len(mine) == len(others):
            pairs += list(zip(mine, others))
        else:
            notes.append(f'the event "{name}" is there {_times(len(others))}, in the reference '
                         f'{_times(len(mine))}; it is not used')
    pairs.sort()
    kept = _longest_rising([it[1] for it in pairs])
    if len(kept) < len(pairs):
        notes.append(f'{len(pairs) - len(kept)} of {len(pairs)} events come in another order than '
                     'in the reference; they are not used')
    chosen = np.array([pairs[row] for row in kept], float).reshape(-1, 2)
    return CommonEvents(chosen[:, 0], chosen[:, 1], tuple(notes))


def _by_name(events: Sequence[RunEvent]) -> Dict[str, List[float]]:
    found: Dict[str, List[float]] = {}
    for event in sorted(events, key=lambda it: it.time_s):
        found.setdefault(event.name, []).append(event.time_s)
    return found


def _times(count: int) -> str:
    return {0: 'not at all', 1: 'once', 2: 'twice'}.get(count, f'{count} times')


def _longest_rising(values: Sequence[float]) -> List[int]:
    """Return the places of a longest subsequence that does not fall."""
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
