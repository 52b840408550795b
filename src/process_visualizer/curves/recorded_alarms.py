# SPDX-License-Identifier: BSD-3-Clause
"""Alarms of a recording: when its variables were beyond their limits, from the curves."""
from __future__ import annotations

import math
from typing import List, NamedTuple, Sequence, Tuple

import numpy as np

from process_visualizer.cell.model import Device, Variable
from process_visualizer.curves.curves import Curve
from process_visualizer.curves.position_values import key_of
from process_visualizer.motion.limit_alarms import Limits, limit_alarms


class RecordedAlarm(NamedTuple):
    """From when to when [s from the beginning] which device had which alarm."""

    device: str
    text: str
    begin_s: float
    end_s: float


def recorded_alarms(devices: Sequence[Device],
                    curves: Sequence[Curve]) -> Tuple[RecordedAlarm, ...]:
    """Return the alarms of all variables with limits, in the order of time."""
    by_key = {key_of(curve.device, curve.label, curve.topic): curve for curve in curves}
    found: List[RecordedAlarm] = []
    for device in devices:
        for variable in device.variables:
            label = variable.label or variable.topic.strip('/')
            curve = by_key.get(key_of(device.name, label, variable.topic))
            if curve is not None:
                found += _alarms(device.name, label, variable, curve)
    return tuple(sorted(found, key=lambda it: it.begin_s))


def limits_of(variable: Variable) -> Limits:
    """Return the limits of a variable; without any, every value is good."""
    given = variable.limits
    if given is None:
        return Limits()
    return Limits(-math.inf if given.low is None else given.low,
                  math.inf if given.high is None else given.high)


def _alarms(device: str, label: str, variable: Variable, curve: Curve) -> List[RecordedAlarm]:
    limits, unit = limits_of(variable), variable.unit
    if not limits.exist:
        return []
    is_there = np.isfinite(curve.high)
    low, high = curve.low[is_there], curve.high[is_there]
    worst = np.where(limits.excess(high) >= limits.excess(low), high, low)
    return [RecordedAlarm(device, f'{limits.sentence(label, it.extreme, unit)}, '
                          f'{limits.reach(it.extreme, unit)}', it.begin_s, it.end_s)
            for it in limit_alarms(limits, curve.times_s[is_there], worst)]
