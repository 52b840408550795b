# SPDX-License-Identifier: BSD-3-Clause
"""The plain numbers of a process variable, as its messages come."""
from __future__ import annotations

from typing import List, Tuple

import numpy as np

from process_visualizer.bags.record_batches import RecordBatch
from process_visualizer.curves.curve_sources import CurveSource, Quantity
from process_visualizer.curves.live.recent_part import RecentPart
from process_visualizer.curves.number_columns import NumberColumns, Numbers, joined_numbers
from process_visualizer.curves.samples import Samples, sampled
from process_visualizer.curves.source_locators import SourceLocators
from process_visualizer.motion.velocity.speed_series import WINDOW_S, measuring_times

_CONTEXT_S = 2.0  # of the past, to know the period of a driver and to join what moves a tool


class LiveSeries:
    """Numbers with their times [s] from a beginning."""

    def __init__(self, source: CurveSource, locators: SourceLocators, begin_ns: int) -> None:
        self._source, self._locators, self._begin_ns = source, locators, begin_ns
        self._columns = [{number: NumberColumns(locator) for number, locator in part.items()}
                         for part in locators.parts]
        self._context: List[Numbers] = []  # of each part
        self._known_s = -np.inf  # up to here the numbers have been returned

    def new(self, part: RecentPart) -> Tuple[np.ndarray, np.ndarray]:
        """Return times (m,) and finite numbers (m,) that follow from messages that have come."""
        # a number's position is the time at which it arrived
        batch = RecordBatch(part.buffer, part.times_ns, part.begin, part.end)
        found = []
        for columns in self._columns:
            for number, of_connection in columns.items():
                of_connection.add(batch, np.flatnonzero(part.numbers == number))
            found.append(joined_numbers(tuple(it.taken() for it in columns.values())))
        with np.errstate(over='ignore', invalid='ignore'):  # of numbers that are no measurements
            if self._source.quantity is not Quantity.SPEED:
                return _finite(*sampled(self._samples(found[0])))
            return self._speeds(found)

    def _speeds(self, found: List[Numbers]) -> Tuple[np.ndarray, np.ndarray]:
        self._context = [_with_context(old, new)
                         for old, new in zip(self._context or found, found)]
        numbers = self._locators.joined(self._measured_s, self._context)
        if len(numbers.positions) < 2:
            return np.empty(0), np.empty(0)
        times_s = self._measured_s(numbers)
        middle_s, values = sampled(Samples(self._source, times_s, numbers.values))
        is_new = (middle_s > self._known_s) & (middle_s <= times_s[-1] - 0.45 * WINDOW_S)
        if is_new.any():
            self._known_s = float(middle_s[is_new].max())
        return _finite(middle_s[is_new], values[is_new])

    def _samples(self, numbers: Numbers) -> Samples:
        return Samples(self._source, (numbers.positions - self._begin_ns) / 1e9, numbers.values)

    def _measured_s(self, numbers: Numbers) -> np.ndarray:
        stamps_s = np.where(numbers.stamps_ns > 0, (numbers.stamps_ns - self._begin_ns) / 1e9,
                            np.nan)
        return measuring_times((numbers.positions - self._begin_ns) / 1e9, stamps_s)


def _with_context(old: Numbers, new: Numbers) -> Numbers:
    """The new numbers after those of the last seconds."""
    joined = new if old is new else joined_numbers((old, new))
    if not len(joined.positions):
        return joined
    is_recent = joined.positions >= joined.positions[-1] - int(_CONTEXT_S * 1e9)
    recent = Numbers(*(column[is_recent] for column in joined))
    return recent if len(new.positions) <= len(recent.positions) else joined


def _finite(times_s: np.ndarray, values: np.ndarray) -> Tuple[np.ndarray, np.ndarray]:
    is_finite = np.isfinite(values)
    return times_s[is_finite], values[is_finite]
