# SPDX-License-Identifier: BSD-3-Clause
"""The rates that "faster" and "slower" lead through."""
from __future__ import annotations

import math

RATES = (0.01, 0.02, 0.05, 0.1, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0)


def faster(rate: float) -> float:
    """Return the next rate that is farther from zero, in the same direction; the last stays."""
    return math.copysign(next((it for it in RATES if it > abs(rate)), RATES[-1]), rate)


def slower(rate: float) -> float:
    """Return the next rate that is nearer to zero, in the same direction; the first stays."""
    return math.copysign(next((it for it in reversed(RATES) if it < abs(rate)), RATES[0]), rate)
