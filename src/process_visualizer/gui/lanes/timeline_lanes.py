# SPDX-License-Identifier: BSD-3-Clause
"""Lanes of curves: their value texts, and distinct colors of curves that share a lane."""
from __future__ import annotations

import math
import re
from dataclasses import dataclass, replace
from functools import cached_property
from typing import List, Mapping, NamedTuple, Optional, Sequence, Tuple, Union

import numpy as np

from process_visualizer.cell.model import WarningLimits
from process_visualizer.curves.curves import held_columns
from process_visualizer.curves.position_values import Key
from process_visualizer.gui.lanes.lane_choice import LaneChoice
from process_visualizer.runs.comparison.timeline_bands import TimelineBand

_MIN_SPAN = 0.01  # of the whole curve's range; smaller changes do not fill the lane
_MAX_DECIMALS = 6
_IN_WORDS = {'v': 'tool speed v', 'F': 'tool force F'}  # the letters are those at the arrows


@dataclass(frozen=True, eq=False)
class Lane:
    """A process variable over the whole recording, in columns of equal duration.

    ``low`` and ``high`` are the extreme values in each column, NaN without a value. ``key`` is used
    to find the value at the position. Beyond its ``limits`` the curve has their color. The ``band``
    of good runs has the same number of columns. Changes of less than the share ``steady`` of the
    largest value do not fill the lane. Other variables may be ``overlaid``: they share the
    lane. A folded lane shows only names and values.
    """

    label: str
    unit: str
    color: Tuple[float, float, float]
    low: np.ndarray
    high: np.ndarray
    key: Key = ('', '', '')
    limits: Optional[WarningLimits] = None
    band: Optional[TimelineBand] = None
    overlaid: Tuple[Lane, ...] = ()
    is_folded: bool = False
    steady: float = 0.0

    @property
    def curves(self) -> Tuple[Lane, ...]:
        """All variables in this lane."""
        return (self, *self.overlaid)

    def with_band(self, band: Optional[TimelineBand]) -> Lane:
        """Return the lane with a band, which is left out where the lane has no values."""
        if band is None:
            return self
        low, high = (np.where(np.isnan(self.low), np.nan, it) for it in (band.low, band.high))
        return replace(self, band=band._replace(low=low, high=high))

    @property
    def arrangement(self) -> Tuple[Tuple[Key, ...], bool]:
        """Return the keys of the variables in this lane, and whether it is folded."""
        return tuple(it.key for it in self.curves), self.is_folded

    @property
    def scale_name(self) -> Tuple[str, ...]:
        """Return a name that is equal for variables in a lane with a common scale."""
        return (self.unit,) if self.unit else self.key

    def at(self, share: float) -> float:
        """Return the middle of the values at a share (0 to 1) of the recording; NaN without any."""
        low, high = self.range_at(share)
        return 0.5 * (low + high)

    def range_at(self, share: float) -> Tuple[float, float]:
        """Return the least and the greatest value of the column at a share of the recording.

        Both are NaN without a value there.
        """
        column = min(int(share * len(self.low)), len(self.low) - 1)
        if column < 0:
            return float('nan'), float('nan')
        return float(self.low[column]), float(self.high[column])

    def good_at(self, share: float) -> Optional[float]:
        """Return the middle of the band at a share (0 to 1) of the recording; None without one."""
        if self.band is None or not len(self.band.low):
            return None
        column = min(int(share * len(self.band.low)), len(self.band.low) - 1)
        middle = 0.5 * float(self.band.low[column] + self.band.high[column])
        return None if math.isnan(middle) else middle

    @cached_property
    def extent(self) -> Tuple[float, float]:
        """The least and the greatest value; NaN without values."""
        known = ~np.isnan(self.low)
        if not known.any():
            return float('nan'), float('nan')
        return float(self.low[known].min()), float(self.high[known].max())

    @property
    def least_span(self) -> float:
        """Return the minimum range of values that fills the lane."""
        low, high = self.extent
        if math.isnan(low):
            return 0.0
        return max(_MIN_SPAN * (high - low), self.steady * max(abs(low), abs(high)))

    @cached_property
    def is_whole(self) -> bool:
        """Return whether all values are whole numbers; False without values."""
        known = ~np.isnan(self.low)
        return bool(known.any()) and all(
            bool(np.all(np.trunc(it[known]) == it[known])) for it in (self.low, self.high))

    @property
    def limit_values(self) -> Tuple[float, ...]:
        """The limits that are set, the lower one first."""
        limits = () if self.limits is None else (self.limits.low, self.limits.high)
        return tuple(limit for limit in limits if limit is not None)


def lane_of(label: str, unit: str, color: Tuple[float, float, float], low: np.ndarray,
            high: np.ndarray, column_s: float) -> Lane:
    """Return a lane with held values; see held_columns. ``column_s`` is a column's duration [s]."""
    return Lane(label, unit, color, *held_columns(low, high, column_s))


def lane_label(device: str, label: str) -> str:
    """Return the name of a curve as in RViz, preceded by the device unless the name includes it."""
    if re.match(f'{re.escape(device)}(\\b|_)', label, re.IGNORECASE):
        return label
    return f'{device}  {_IN_WORDS.get(label, label)}'


_NO_DATA = 'no data'


class LaneTexts(NamedTuple):
    """A curve's value at the position, its value at the mouse, and their difference; '' for none.

    The last text that is not empty has the unit.
    """

    at_position: str
    at_mouse: str = ''
    difference: str = ''


Range = Tuple[float, float]


def lane_texts(lane: Lane, span: float, at_position: Optional[float],
               at_mouse: Union[None, float, Range], good: Optional[float] = None,
               silent_s: float = math.inf) -> LaneTexts:
    """Return a curve's values as texts, in its unit, for a scale with a ``span`` of values.

    A missing value is NaN. None means at the position: not known yet; at the mouse: no mouse. There
    may be several values at the mouse, as a column has a width: a range then, not their middle,
    which may never have been sent. The ``good`` value at the position follows the value, with the
    difference. Missing data is reported with the time since the last value ``silent_s`` [s], if
    that is finite.
    """
    decimals = 0 if lane.is_whole else decimals_for(span)
    known = '…' if at_position is None else _value_text(at_position, decimals)
    if at_mouse is None:
        if known == _NO_DATA:
            known += '' if math.isinf(silent_s) else f' for {_seconds_text(silent_s)}'
        unit = '' if known.startswith(_NO_DATA) else lane.unit
        return LaneTexts(f'{known} {unit}'.rstrip() + _beside_good(at_position, good, decimals))
    ends = at_mouse if isinstance(at_mouse, tuple) else (at_mouse, at_mouse)
    base = math.nan if at_position is None else round(at_position, decimals)
    there = dict.fromkeys(_value_text(it, decimals) for it in ends)
    away = dict.fromkeys(  # of the numbers as displayed
        number_text(round(it, decimals) - base, decimals, '+') for it in ends)
    return LaneTexts(known, ' to '.join(there), f'Δ {" to ".join(away)} {lane.unit}'.rstrip())


def _value_text(value: float, decimals: int) -> str:
    return _NO_DATA if math.isnan(value) else number_text(value, decimals)


def _seconds_text(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    return f'{minutes} min {rest} s' if minutes else f'{rest} s'


def _beside_good(value: Optional[float], good: Optional[float], decimals: int) -> str:
    if good is None or value is None or math.isnan(value):
        return ''
    difference = round(value, decimals) - round(good, decimals)
    return (f'  (reference {number_text(good, decimals)}, '
            f"Δ {number_text(difference, decimals, '+')})")


def decimals_for(span: float) -> int:
    """Return the number of decimals that show about a hundredth of a span of values."""
    return min(max(2 - math.floor(math.log10(max(span, 1e-9)) + 1e-9), 0), _MAX_DECIMALS)


def number_text(value: float, decimals: int, sign: str = '') -> str:
    """Return a value as text, a dash for NaN; ``sign`` '+' adds a sign to positive values, too."""
    if math.isnan(value):
        return '–'
    return f'{round(value, decimals) + 0.0:{sign}.{decimals}f}'.replace('-', '−')


# Grouping of curves into shared lanes, each curve with a distinct color.

Color = Tuple[float, float, float]

_OTHERS: Tuple[Color, ...] = (
    (0.0, 0.45, 0.70), (0.90, 0.60, 0.0), (0.80, 0.47, 0.65), (0.0, 0.62, 0.45), (0.84, 0.37, 0.0),
    (0.34, 0.71, 0.91), (0.45, 0.30, 0.75), (0.50, 0.50, 0.50))
"""Colors of Okabe and Ito, "Color universal design", which color-blind people can tell apart."""
_DISTINCT = 0.45  # minimum distance between two colors in a cube with sides of 1


def grouped_lanes(curves: Mapping[Key, Lane], choice: LaneChoice) -> List[Lane]:
    """Return the visible lanes: the first curve of each, with the others overlaid."""
    lanes = []
    for keys in choice.lanes(tuple(curves)):
        shown = [curve for curve in distinct([curves[key] for key in keys])
                 if curve.key not in choice.hidden]
        if shown:
            lanes.append(replace(shown[0], overlaid=tuple(shown[1:]),
                                 is_folded=choice.is_folded(keys)))
    return lanes


def distinct(curves: Sequence[Lane]) -> List[Lane]:
    """Return curves with distinct colors: a later one never has the color of an earlier one."""
    found: List[Lane] = []
    for curve in curves:
        used = [it.color for it in found]
        color = curve.color
        if used and _distance(color, used) < _DISTINCT:
            color = max(_OTHERS, key=lambda it: _distance(it, used))
        found.append(replace(curve, color=color))
    return found


def _distance(color: Color, used: Sequence[Color]) -> float:
    """Return the distance of a color from the nearest used color."""
    return min(math.dist(color, it) for it in used)
