# SPDX-License-Identifier: BSD-3-Clause
"""A variable beyond its limits is a problem of its node, once, as long as it lasts."""
from __future__ import annotations

from typing import Any, Dict, List

from process_visualizer.nodes.common.complaints import LimitState
from process_visualizer.robot.limit_alarms import Limits
from process_visualizer.ros_names import LIMIT_KEY, TIMES_KEY


class Told:
    """Complaints without a master."""

    def __init__(self) -> None:
        self.present: Dict[str, Any] = {}
        self.began: List[str] = []
        self.times = ''

    def state(self, key: str, text: str, values: Any, log_period_s: float,
              is_error: bool) -> None:
        assert is_error
        if key not in self.present:
            self.began.append(key)
        self.present[key] = (text, values[LIMIT_KEY])
        self.times = values[TIMES_KEY]

    def end(self, key: str) -> None:
        self.present.pop(key, None)


def fed(state: LimitState, begin_s: float, *values: float) -> float:
    """Process values that arrive ten times per second; return the time of the next one."""
    for number, value in enumerate(values):
        state.take(begin_s + 0.1 * number, value)
    return begin_s + 0.1 * len(values)


def test_from_the_first_value_beyond_until_it_is_back() -> None:
    told = Told()
    state = LimitState(told, '/oven data', 'oven', Limits(high=100.0), '°C')  # type: ignore
    now_s = fed(state, 0.0, 99.0, 101.0, 130.0)
    assert told.present == {}
    now_s = fed(state, now_s, 120.0, 120.0)
    assert told.present == {'limits of /oven data': ('oven is above 100 °C', 'up to 130 °C')}
    now_s = fed(state, now_s, *[90.0] * 5)
    assert told.present
    fed(state, now_s, 90.0, 90.0)
    assert (told.present, len(told.began)) == ({}, 1)


def test_how_often_it_came_is_told() -> None:
    told, now_s = Told(), 0.0
    state = LimitState(told, '/oven data', 'oven', Limits(high=100.0), '°C')  # type: ignore
    for times in ('1', '2', '3'):
        now_s = fed(state, now_s, *[130.0] * 5)
        assert (told.times, len(told.present)) == (times, 1)
        now_s = fed(state, now_s, *[90.0] * 8)
        assert told.present == {}


def test_another_time_ends_it() -> None:
    told = Told()
    state = LimitState(told, '/edge data', 'edge', Limits(low=10.0), '')  # type: ignore
    fed(state, 5.0, 1.0, 1.0, 1.0, 1.0)
    assert told.present == {'limits of /edge data': ('edge is below 10', 'down to 1')}
    state.forget()
    assert told.present == {}
    fed(state, 0.0, 1.0, 20.0, 20.0)
    assert told.present == {}


def test_without_limits_nothing_is_judged() -> None:
    told = Told()
    fed(LimitState(told, 'k', 'v', Limits(), ''), 0.0, *[1e300] * 9)  # type: ignore
    assert told.began == []
