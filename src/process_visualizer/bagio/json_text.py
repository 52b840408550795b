# SPDX-License-Identifier: BSD-3-Clause
"""Parses JSON from other programs; any error in it raises ValueError."""
from __future__ import annotations

import json
import math
from typing import Any


def parsed_json(text: str) -> Any:
    """Return the value of a JSON text.

    Raises:
        ValueError: the text is not JSON, or is nested too deeply.
    """
    try:
        return json.loads(text)
    except RecursionError:
        raise ValueError('it is nested too deeply') from None


def finite_number(value: Any) -> float:
    """Return a JSON value as a number.

    Raises:
        ValueError: the value is not a number, or is not finite.
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
