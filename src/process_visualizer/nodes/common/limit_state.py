# SPDX-License-Identifier: BSD-3-Clause
"""Says on /diagnostics that a variable is beyond its limits, for as long as it is."""
from __future__ import annotations

import math

from process_visualizer.motion.limit_alarms import Limits, LimitWatch
from process_visualizer.nodes.common.complaints import Complaints
from process_visualizer.ros_names import LIMIT_KEY


class LimitState:
    """Judges one variable of a device; see LimitWatch for when an alarm begins and ends."""

    def __init__(self, complaints: Complaints, key: str, label: str, limits: Limits,
                 unit: str) -> None:
        """``key`` is the variable's alone in its device."""
        self._complaints, self._limits = complaints, limits
        self._key, self._label, self._unit = f'limits of {key}', label, unit
        self._watch = LimitWatch(limits)

    def take(self, time_s: float, value: float) -> None:
        """Take the present value; times [s] are those of a clock that does not jump."""
        if not self._limits.exist:
            return
        self._watch.add(time_s, value)
        present = self._watch.present
        if present is None:
            self._complaints.end(self._key)
            return
        text = self._limits.sentence(self._label, present.extreme, self._unit)
        values = {LIMIT_KEY: self._limits.reach(present.extreme, self._unit)}
        self._complaints.state(self._key, text, values, log_period_s=math.inf, is_error=True)

    def forget(self) -> None:
        """End the alarm, as values of another time follow."""
        if self._watch.present is not None:
            self._complaints.end(self._key)
        self._watch = LimitWatch(self._limits)
