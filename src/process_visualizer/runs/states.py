# SPDX-License-Identifier: BSD-3-Clause
"""Channels of whole numbers and bits: which value holds when."""
from __future__ import annotations

from typing import NamedTuple, Tuple

import numpy as np

from process_visualizer.runs.data_gaps import period_s
from process_visualizer.runs.run import Channel, ChannelKind

_MOST_CHANGES, _FEW_CHANGES = 0.2, 3
"""Whole numbers that change more often, as a share of their messages, are measurements."""
_CYCLIC_S, _MISSED = 0.5, 10.0
"""What comes at least so often is there no more when so many periods have nothing."""


class States(NamedTuple):
    """The values (k,) that hold one after the other, each from ``since_s`` (k,) [s] on.

    Of what is sent all the time, nothing is known from ``until_s`` on.
    """

    values: Tuple[float, ...]
    since_s: Tuple[float, ...]
    until_s: float = np.inf


def is_sequence(channel: Channel) -> bool:
    """Return whether a channel is one of states or bits: whole numbers that hold for a while."""
    values = channel.values[np.isfinite(channel.values)]
    if channel.kind is not ChannelKind.VARIABLE or channel.unit or not len(values):
        return False
    if (values != np.rint(values)).any():
        return False
    changes = int(np.count_nonzero(np.diff(values)))
    return changes <= max(_MOST_CHANGES * len(values), _FEW_CHANGES) or \
        period_s(channel.times_s) > _CYCLIC_S


def states(channel: Channel) -> States:
    """Return which values a channel has one after the other."""
    finite = np.isfinite(channel.values)
    times_s, values = channel.times_s[finite], channel.values[finite]
    if not len(values):
        return States((), ())
    first = np.concatenate(([True], np.diff(values) != 0.0))
    usual_s = period_s(times_s)
    is_cyclic = len(values) > _MISSED and 0.0 < usual_s <= _CYCLIC_S
    until_s = float(times_s[-1]) + _MISSED * usual_s if is_cyclic else np.inf
    return States(tuple(values[first].tolist()), tuple(times_s[first].tolist()), until_s)


def held_at(times_s: np.ndarray, known_s: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return the value (m,) that holds at times (m,): the newest one, before the first the first.

    NaN where a time is, or where there is no value at all.
    """
    if not len(known_s):
        return np.full(len(times_s), np.nan)
    row = np.searchsorted(known_s, np.nan_to_num(times_s, nan=-np.inf), 'right') - 1
    result: np.ndarray = np.where(np.isfinite(times_s), values[np.maximum(row, 0)], np.nan)
    return result
