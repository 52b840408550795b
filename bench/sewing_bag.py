# SPDX-License-Identifier: BSD-3-Clause
"""Bags of the driver topics of the simulated sewing cell, and the cell at another speed."""
from __future__ import annotations

from typing import Any, Callable, List, Tuple

import numpy as np
import rosbag
from genpy import Time
from std_msgs.msg import Float32, Float32MultiArray, UInt16

from sewing_cell.cycle import SewingCycle
from sewing_cell.layout import ARMS, Arm

JOINT_HZ, FORCE_HZ, SENSOR_HZ = 125.0, 94.0, 50.0
BEGIN_S = 1_600_000_000.0


class WarpedCycle:
    """The cell at other times: ``warp`` maps seconds since the start (n,) to the cycle's."""

    def __init__(self, cycle: SewingCycle, warp: Callable[[np.ndarray], np.ndarray]) -> None:
        self._cycle, self._warp = cycle, warp

    def joints(self, arm: Arm, time_s: np.ndarray) -> np.ndarray:
        return self._cycle.joints(arm, self._warp(time_s))

    def tool_frame(self, arm: Arm, time_s: np.ndarray) -> np.ndarray:
        return self._cycle.tool_frame(arm, self._warp(time_s))

    def wrench(self, arm: Arm, time_s: np.ndarray) -> np.ndarray:
        return self._cycle.wrench(arm, self._warp(time_s))

    def edge(self, arm: Arm, time_s: np.ndarray) -> np.ndarray:
        return self._cycle.edge(arm, self._warp(time_s))

    def feed_rate(self, time_s: np.ndarray) -> np.ndarray:
        return self._cycle.feed_rate(self._warp(time_s))


def write_sewing_bag(path: str, cycle: SewingCycle, seconds: float) -> str:
    """Write the topics of the robots' and the machine's drivers, no images; return the path."""
    rows: List[Tuple[float, str, Any]] = []

    def add(topic: str, rate_hz: float, make: Callable[[Any], Any], values: np.ndarray) -> None:
        rows.extend((number / rate_hz, topic, make(value))
                    for number, value in enumerate(values.tolist()))

    times_s = {rate_hz: np.arange(0.0, seconds, 1.0 / rate_hz)
               for rate_hz in (JOINT_HZ, FORCE_HZ, SENSOR_HZ)}
    for arm in ARMS:
        robot = f'/ur_rt_{arm.name}'
        add(f'{robot}/q_act', JOINT_HZ, _array, cycle.joints(arm, times_s[JOINT_HZ]))
        add(f'{robot}/tcf', JOINT_HZ, _array, cycle.tool_frame(arm, times_s[JOINT_HZ]))
        add(f'/ft_{arm.name}/ft', FORCE_HZ, _array, cycle.wrench(arm, times_s[FORCE_HZ]))
        add(f'/edge_finder_{arm.name}', SENSOR_HZ, UInt16, cycle.edge(arm, times_s[SENSOR_HZ]))
    add('/feed_rate_est', SENSOR_HZ, Float32, cycle.feed_rate(times_s[SENSOR_HZ]))
    with rosbag.Bag(path, 'w') as bag:
        for time_s, topic, message in sorted(rows, key=lambda row: row[0]):
            bag.write(topic, message, Time.from_sec(BEGIN_S + time_s))
    return path


def _array(values: List[float]) -> Float32MultiArray:
    return Float32MultiArray(data=values)
