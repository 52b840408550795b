# SPDX-License-Identifier: BSD-3-Clause
"""Formatting of numbers in a configuration."""
from __future__ import annotations

DECIMALS = 6
"""Of metres and radians: a micrometre."""


def number_text(value: float) -> str:
    """Return a number with at most DECIMALS decimals, such as 0.1 or -3; never -0."""
    text = f'{round(value, DECIMALS) + 0.0:.{DECIMALS}f}'  # -0.0 + 0.0 is 0.0
    return text.rstrip('0').rstrip('.')
