# SPDX-License-Identifier: BSD-3-Clause
"""Waits before something that is missing is told: it may only come a little later."""
from __future__ import annotations

import math


class Patience:
    """Tells whether something has been missing for a time, without a break."""

    def __init__(self, period_s: float) -> None:
        """Take for how long [s] it may be missing."""
        self._period_s = period_s
        self._since_s = math.inf

    def is_over(self, is_missing: bool, now_s: float) -> bool:
        """Take whether it is missing at a time [s]; return whether that is to be told."""
        self._since_s = min(self._since_s, now_s) if is_missing else math.inf
        return now_s >= self._since_s + self._period_s
