# SPDX-License-Identifier: BSD-3-Clause
"""Alignments of other tools: none, at the start, warping of the signal."""
from __future__ import annotations

from typing import Callable, Dict

import numpy as np

from process_visualizer.runs.alignment.alignment import aligned
from process_visualizer.runs.alignment.time_map import TimeMap, shift, time_map
from process_visualizer.runs.run import ChannelKind, Run

_WARP_HZ = 10.0

Aligner = Callable[[Run, Run], TimeMap]


def unaligned(_reference: Run, _run: Run) -> TimeMap:
    """Both clocks begin with the recording."""
    return shift(0.0)


def at_start(reference: Run, run: Run) -> TimeMap:
    """The first event of both is the same moment (TrendMiner, Sift)."""
    if not reference.events or not run.events:
        return shift(0.0)
    return time_map(np.array([reference.events[0].time_s]), np.array([run.events[0].time_s]))


def warped_on_signal(reference: Run, run: Run) -> TimeMap:
    """Dynamic time warping, without limits, of the judged signals: variables and forces."""
    first, second = _judged(reference), _judged(run)
    spread = first.std(axis=0) + 1e-9
    costs = (((first[:, np.newaxis] - second[np.newaxis]) / spread) ** 2).sum(axis=2)
    total = np.full((len(first) + 1, len(second) + 1), np.inf)
    total[0, 0] = 0.0
    for row in range(len(first)):
        above = np.minimum(total[row, :-1], total[row, 1:])
        line, cost = total[row + 1], costs[row].tolist()
        left = np.inf
        for column, least in enumerate(above.tolist()):
            left = min(left, least) + cost[column]
            line[column + 1] = left
    return _path(total)


def _path(total: np.ndarray) -> TimeMap:
    row, column = total.shape[0] - 1, total.shape[1] - 1
    rows, columns = [row], [column]
    while row > 1 or column > 1:
        row, column = min(((row - 1, column - 1), (row - 1, column), (row, column - 1)),
                          key=lambda place: total[place])
        rows.append(row)
        columns.append(column)
    return time_map((np.array(rows[::-1]) - 1) / _WARP_HZ, (np.array(columns[::-1]) - 1) / _WARP_HZ)


def _judged(run: Run) -> np.ndarray:
    times_s = np.arange(0.0, run.duration_s, 1.0 / _WARP_HZ)
    return np.column_stack([np.interp(times_s, it.times_s, it.values) for it in run.channels
                            if it.kind in (ChannelKind.VARIABLE, ChannelKind.FORCE)])


ALIGNERS: Dict[str, Aligner] = {
    'none': unaligned,
    'at the start': at_start,
    'warped on the judged signals': warped_on_signal,
    'ours': lambda reference, run: aligned(reference, run).time_map,
}
