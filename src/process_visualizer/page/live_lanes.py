# SPDX-License-Identifier: BSD-3-Clause
"""The curves of a running cell over the last minutes, encoded for a live page."""
from __future__ import annotations

from struct import Struct
from typing import Any, Dict, List, NamedTuple, Optional, Tuple

import numpy as np

from process_visualizer.curves.curves import held_columns
from process_visualizer.curves.live_curves import COLUMN_S, MAX_S, LiveCurve, LiveWindow
from process_visualizer.page.lanes import lane_scale
from process_visualizer.runs.comparison.live_comparison import LiveBands
from process_visualizer.runs.comparison.timeline_bands import TimelineBand

LANES = 2
"""First byte of encoded columns; see `LiveLanes.columns`."""
JOINED = 5
STEP_S = JOINED * COLUMN_S
"""Duration of a column on a page: one pixel when a screen shows two minutes."""
MAX_LANES = 40
WINDOW_S = 1500 * STEP_S
"""Duration of the longest LiveWindow with columns of this duration."""
_HEAD = Struct('<BBHIId')


class _Lane(NamedTuple):
    curve: LiveCurve
    low: np.ndarray
    high: np.ndarray
    band: TimelineBand

    @property
    def columns(self) -> Tuple[np.ndarray, ...]:
        """Return all columns (n,)."""
        return self.low, self.high, *self.band


class LiveLanes:
    """Keeps the columns of all curves; columns with the same number cover the same time."""

    def __init__(self, keep_s: float = MAX_S) -> None:
        """Keep the columns of the last ``keep_s`` seconds."""
        self._count = round(keep_s / STEP_S)
        self._lanes: Dict[Tuple[str, str, str], _Lane] = {}
        self._epoch_s = 0.0
        self._end = 0
        self._number = 0
        self._late: Optional[int] = None  # number of the first column changed by a late band
        self._entries: List[Dict[str, Any]] = []

    @property
    def entries(self) -> List[Dict[str, Any]]:
        """Return the lanes without their columns, for JSON."""
        return self._entries

    def take(self, window: LiveWindow) -> None:
        """Add the newest curves; the window must not be longer than WINDOW_S."""
        if not window.curves:
            return
        if window.epoch_s != self._epoch_s:  # the recorder was restarted
            self._lanes, self._entries = {}, []
            self._epoch_s, self._end, self._late = window.epoch_s, 0, None
        end = round((window.begin_s + window.duration_s) / STEP_S)
        self._move_to(end)
        for curve in window.curves:
            key = curve.source.device, curve.source.label, curve.source.topic
            if not len(curve.low) or (key not in self._lanes and len(self._lanes) >= MAX_LANES):
                continue
            lane = self._lanes.get(key) or _Lane(curve, *self._empty(), TimelineBand(
                *self._empty(), np.zeros(self._count, bool)))
            count = min(len(curve.low), self._count)
            lane.low[-count:], lane.high[-count:] = curve.low[-count:], curve.high[-count:]
            self._lanes[key] = lane._replace(curve=curve)
        if len(self._lanes) != len(self._entries):
            self._number += 1
        self._entries = [_entry(it) for it in self._lanes.values()]

    def _empty(self) -> Tuple[np.ndarray, np.ndarray]:
        return np.full(self._count, np.nan), np.full(self._count, np.nan)

    def _move_to(self, end: int) -> None:
        step = min(max(end - self._end, 0), self._count)
        self._end = end
        for lane in self._lanes.values():
            for values in lane.columns:
                values[:len(values) - step] = values[step:].copy()
                values[len(values) - step:] = np.nan if values.dtype == float else False

    def take_bands(self, bands: LiveBands) -> None:
        """Update the bands of the last seconds, in the time of the curves; older ones are kept."""
        middles_s = self._epoch_s + STEP_S * (np.arange(self._end - self._count, self._end) + 0.5)
        told = np.floor((middles_s - bands.begin_s) / bands.step_s)
        for lane in self._lanes.values():
            source = lane.curve.source
            band = bands.channels.get((source.device, source.channel_label))
            if band is None:
                continue
            rows = np.flatnonzero((told >= 0) & (told < len(band.low)))
            for known, new in zip(lane.band, band):
                values = new[told[rows].astype(int)]
                changed = rows[(known[rows] != values) & ~(np.isnan(known[rows])
                                                           & np.isnan(values))]
                known[rows] = values
                if len(changed):
                    number = self._end - self._count + int(changed[0])
                    self._late = number if self._late is None else min(self._late, number)

    def new_columns(self, seconds: float) -> bytes:
        """Return the columns of the last seconds, and earlier ones whose bands arrived late."""
        late_s = 0.0 if self._late is None else STEP_S * (self._end - self._late)
        self._late = None
        return self.columns(max(seconds, late_s))

    def columns(self, seconds: float) -> bytes:
        """Return the columns of the last seconds as bytes.

        A header (kind, number of lanes, number of the set of lanes, number of the first column,
        number of columns, start of column 0 [s since the epoch]), and for each lane a byte that is
        1 if it has a band. Then for each lane the minima and the maxima in single precision, NaN
        where there is no value (see held_columns), and if it has a band, in the same way its lower
        and upper limits, and a byte for each column in which the curve is outside.
        """
        count = min(round(seconds / STEP_S), self._count, self._end)
        first = self._count - count
        lanes = list(self._lanes.values())
        parts = [_HEAD.pack(LANES, len(lanes), self._number & 0xFFFF, self._end - count, count,
                            self._epoch_s),
                 bytes(bool(np.isfinite(it.band.low[first:]).any()) for it in lanes)]
        with np.errstate(over='ignore'):
            for has_band, lane in zip(parts[1], lanes):
                values = held_columns(lane.low, lane.high, STEP_S)
                parts += [it[first:].astype('<f4').tobytes()
                          for it in (*values, *lane.band[:2 * has_band])]
                parts += [lane.band.departed[first:].tobytes()] * has_band
        return b''.join(parts)


def _entry(lane: _Lane) -> Dict[str, Any]:
    source = lane.curve.source
    limits = [] if source.limits is None else [
        it for it in (source.limits.low, source.limits.high) if it is not None]
    return {'device': source.device, 'label': source.channel_label, 'unit': source.unit,
            'color': list(source.color), 'limits': limits, 'step': STEP_S,
            **lane_scale([lane.low, lane.high, lane.band.low, lane.band.high], limits)}
