# SPDX-License-Identifier: BSD-3-Clause
"""The timeline of a page: curves, the bands of good runs, marks, alarms and departures."""
from __future__ import annotations

import math
from typing import Any, Dict, List, Mapping, NamedTuple, Sequence, Tuple

import numpy as np

from process_visualizer.cell.model import Device
from process_visualizer.curves.curves import Curve, curve_of, recorded_alarms
from process_visualizer.curves.samples import Samples
from process_visualizer.curves.value_scale import tick_texts, tidy_scale, with_near_limits
from process_visualizer.page.packed import Packed
from process_visualizer.page.robots import PageSpan
from process_visualizer.runs.comparison.timeline_bands import TimelineBand
from process_visualizer.runs.run import Key

_COLUMNS = 1500
"""Number of columns of the shown part."""
_MAX_COLUMNS = 400_000


class Grid(NamedTuple):
    """Columns of equal duration over a whole recording, and the shown ones among them."""

    duration_s: float
    columns: int
    shown: slice

    @property
    def step_s(self) -> float:
        """The duration of a column."""
        return self.duration_s / self.columns


def grid_over(duration_s: float, span: PageSpan) -> Grid:
    """Return columns that show a part of a recording in detail."""
    length_s = max(span.end_s - span.begin_s, 1e-3)
    columns = int(min(max(math.ceil(_COLUMNS * max(duration_s, 1e-3) / length_s), 1),
                      _MAX_COLUMNS))
    step_s = max(duration_s, 1e-3) / columns
    first = max(int(span.begin_s / step_s), 0)
    return Grid(max(duration_s, 1e-3), columns,
                slice(first, min(math.ceil(span.end_s / step_s), columns)))


def curves_of(samples: Sequence[Samples], grid: Grid) -> List[Curve]:
    """Return the curves that have at least one value."""
    found = [curve_of(it, grid.duration_s, grid.columns) for it in samples]
    return [it for it in found if np.isfinite(it.high).any()]


def lane_entries(curves: Sequence[Curve], labels: Mapping[Tuple[str, str, str], str],
                 bands: Mapping[Key, TimelineBand], grid: Grid,
                 packed: Packed) -> List[Dict[str, Any]]:
    """Return the curves as entries of the page; ``labels`` are their labels in a run."""
    found = []
    for curve in curves:
        label = labels[(curve.device, curve.label, curve.topic)]
        band = bands.get((curve.device, label))
        low, high = curve.low[grid.shown], curve.high[grid.shown]
        entry: Dict[str, Any] = {
            'device': curve.device, 'label': label, 'unit': curve.unit,
            'color': list(curve.color), 'begin': grid.shown.start * grid.step_s,
            'step': grid.step_s, 'low': packed.single(low), 'high': packed.single(high)}
        ends = [low, high]
        if band is not None:
            ends += [band.low[grid.shown], band.high[grid.shown]]
            entry['band'] = {'low': packed.single(ends[2]), 'high': packed.single(ends[3]),
                             'out': packed.plain(band.departed[grid.shown].astype(np.uint8))}
        limits = [] if curve.limits is None else [
            it for it in (curve.limits.low, curve.limits.high) if it is not None]
        found.append({**entry, 'limits': limits, **lane_scale(ends, limits)})
    return found


def lane_scale(columns: Sequence[np.ndarray], limits: Sequence[float]) -> Dict[str, Any]:
    """Return the scale and ticks of a lane, for JSON."""
    known = np.concatenate([it[np.isfinite(it)] for it in columns])
    if not len(known):
        return {'scale': [0.0, 1.0], 'ticks': []}
    scale = tidy_scale(*with_near_limits(float(known.min()), float(known.max()), limits))
    return {'scale': [scale.low, scale.high],
            'ticks': [list(it) for it in zip(scale.ticks, tick_texts(scale))]}


def alarm_entries(devices: Sequence[Device], curves: Sequence[Curve],
                  span: PageSpan) -> List[Dict[str, Any]]:
    """Return the alarms of variables with limits."""
    return [{'device': it.device, 'text': it.text, 'begin': it.begin_s, 'end': it.end_s}
            for it in recorded_alarms(devices, curves)
            if it.begin_s <= span.end_s and it.end_s >= span.begin_s]
