# SPDX-License-Identifier: BSD-3-Clause
"""JSON from other programs: whatever is wrong with it is reported as a ValueError."""
from __future__ import annotations

import json
import math
from typing import Any


def parsed_json(text: str) -> Any:
    """Return what a text says in JSON.

    Raises:
        ValueError: it is none, or is nested too deeply.
    """
    try:
        return json.loads(text)
    except RecursionError:
        raise ValueError('it is nested too deeply') from None


def finite_number(value: Any) -> float:
    """Return a number of JSON.

    Raises:
        ValueError: it is none, or is not finite.
    """
    if not isinstance(value, (int, float)) or isinstance(value, bool):
        raise ValueError('a number is expected')
    try:
        number = float(value)
    except OverflowError:
        number = math.inf
    if not math.isfinite(number):
        raise ValueError('a number is not finite')
    return number
