# SPDX-License-Identifier: BSD-3-Clause
"""The curves of a running cell over the last minutes, encoded for a live page."""
from __future__ import annotations

from struct import Struct
from typing import Any, Dict, List, NamedTuple, Tuple

import numpy as np

from process_visualizer.curves.curves import held_columns
from process_visualizer.curves.live_curves import COLUMN_S, MAX_S, LiveCurve, LiveWindow
from process_visualizer.page.lanes import lane_scale

LANES = 2
"""First byte of encoded columns; see `LiveLanes.columns`."""
JOINED = 5
STEP_S = JOINED * COLUMN_S
"""Duration of a column of a page: one pixel when a screen shows two minutes."""
MAX_LANES = 40
WINDOW_S = 1500 * STEP_S
"""Duration of the longest LiveWindow that has columns of this duration."""
_HEAD = Struct('<BBHIId')


class _Lane(NamedTuple):
    curve: LiveCurve
    low: np.ndarray
    high: np.ndarray


class LiveLanes:
    """Keeps the columns of all curves; columns with the same number cover the same time."""

    def __init__(self, keep_s: float = MAX_S) -> None:
        """Keep the columns of the last ``keep_s`` seconds."""
        self._count = round(keep_s / STEP_S)
        self._lanes: Dict[Tuple[str, str, str], _Lane] = {}
        self._epoch_s = 0.0
        self._end = 0
        self._number = 0
        self._entries: List[Dict[str, Any]] = []

    @property
    def entries(self) -> List[Dict[str, Any]]:
        """Return the lanes without their columns, for JSON."""
        return self._entries

    def take(self, window: LiveWindow) -> None:
        """Take the newest curves; the window is not longer than WINDOW_S."""
        if not window.curves:
            return
        if window.epoch_s != self._epoch_s:  # the recorder was restarted
            self._lanes, self._entries = {}, []
            self._epoch_s, self._end = window.epoch_s, 0
        end = round((window.begin_s + window.duration_s) / STEP_S)
        self._move_to(end)
        for curve in window.curves:
            key = curve.source.device, curve.source.label, curve.source.topic
            if not len(curve.low) or (key not in self._lanes and len(self._lanes) >= MAX_LANES):
                continue
            lane = self._lanes.get(key) or _Lane(curve, *self._empty())
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
            for values in (lane.low, lane.high):
                values[:len(values) - step] = values[step:].copy()
                values[len(values) - step:] = np.nan

    def columns(self, seconds: float) -> bytes:
        """Return the columns of the last seconds as bytes.

        A header (kind, number of lanes, number of the set of lanes, number of the first column,
        number of columns, start of column 0 [s since the epoch]), then for each lane the minima
        and the maxima in single precision, NaN where there is no value. See held_columns.
        """
        count = min(round(seconds / STEP_S), self._count, self._end)
        lanes = list(self._lanes.values())
        head = _HEAD.pack(LANES, len(lanes), self._number & 0xFFFF, self._end - count, count,
                          self._epoch_s)
        with np.errstate(over='ignore'):
            return head + b''.join(values[len(values) - count:].astype('<f4').tobytes()
                                   for lane in lanes
                                   for values in held_columns(lane.low, lane.high, STEP_S))


def _entry(lane: _Lane) -> Dict[str, Any]:
    source = lane.curve.source
    limits = [] if source.limits is None else [
        it for it in (source.limits.low, source.limits.high) if it is not None]
    return {'device': source.device, 'label': source.channel_label, 'unit': source.unit,
            'color': list(source.color), 'limits': limits, 'step': STEP_S,
            **lane_scale([lane.low, lane.high], limits)}
