# SPDX-License-Identifier: BSD-3-Clause
"""Notices that ROS time stands still or goes back, which simulated time can do."""
from __future__ import annotations

import math
from typing import Optional

LONGEST_STEP_S = 1.0  # of a simulated clock
MEMORY_S = 6.0  # longer than warnings are held back


class TimeWatch:
    """Compares ROS time with a clock that always goes on (the class TimeWatch in C++ is alike)."""

    def __init__(self) -> None:
        self._last_s: Optional[float] = None
        self._advanced_s = 0.0
        self._stepped_back_s = -math.inf

    def problem(self, ros_s: float, steady_s: float) -> str:
        """Return what is wrong with ROS time [s], or was some seconds ago; nothing if it goes on.

        Args:
            ros_s: the present ROS time.
            steady_s: the present time of a clock that always goes on.
        """
        if self._last_s is not None and ros_s < self._last_s:
            self._stepped_back_s = steady_s
        if ros_s != self._last_s:
            self._advanced_s = steady_s
        self._last_s = ros_s
        if steady_s - self._stepped_back_s < MEMORY_S:
            return 'ROS time has gone back: look at what publishes /clock'
        if steady_s - self._advanced_s > LONGEST_STEP_S:
            return ('ROS time stands still: look at what publishes /clock, or set /use_sim_time '
                    'to false')
        return ''
