# SPDX-License-Identifier: BSD-3-Clause
"""Rates and times in section 6.4.1 of the thesis (R. Bilit, NTNU 2012).

Its figures are pictures; only the numbers of table 6.2 and of the text are here.
"""
from __future__ import annotations

from typing import Dict, NamedTuple

TOOL_FRAME, FORCE = 'tool frame', 'force'


class Rates(NamedTuple):
    """Messages per second as published by the drivers, in the bag, and as played."""

    published: float
    recorded: float
    played: float


TABLE_6_2: Dict[int, Dict[str, Rates]] = {
    30: {TOOL_FRAME: Rates(123.5, 102.8, 89.0), FORCE: Rates(93.8, 77.2, 70.3)},
    10: {TOOL_FRAME: Rates(123.1, 123.0, 100.0), FORCE: Rates(95.7, 95.2, 84.8)},
    0: {TOOL_FRAME: Rates(9.9, 9.9, 9.9), FORCE: Rates(93.1, 93.1, 93.1)},
}
"""By images per second; at 0 without the Kinect, and with drivers that were set to 10 Hz."""

PLAYED_STEPS_S = (0.0002, 0.2)
"""Shortest and longest time from one played message to the next (text on figure 6.16).

The text gives these numbers in milliseconds. But 100 messages a second have a mean step of 10 ms,
so they must be seconds.
"""
