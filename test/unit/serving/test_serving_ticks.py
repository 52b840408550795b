# SPDX-License-Identifier: BSD-3-Clause
"""The page keeps running while the computer's clock is set."""
from __future__ import annotations

import time
from typing import List

import pytest
from tornado.ioloop import IOLoop

from process_visualizer.serving.web_server import Ticks

PERIOD_S = 0.001


@pytest.mark.parametrize('shift_s', [-3600.0, 3600.0])
def test_a_clock_that_is_set_stops_nothing(
        shift_s: float, monkeypatch: pytest.MonkeyPatch) -> None:
    loop, calls, day = IOLoop(make_current=False), [], time.time  # type: ignore[var-annotated]
    shifts: List[float] = [0.0]

    def act() -> None:
        calls.append(1)
        if len(calls) == 10:
            shifts[0] = shift_s
        if len(calls) == 20:
            loop.stop()

    monkeypatch.setattr('tornado.ioloop.time.time', lambda: day() + shifts[0])
    ticks = Ticks(loop, act, PERIOD_S)
    ticks.start()
    given_up = loop.asyncio_loop.call_later(60.0, loop.stop)  # type: ignore[attr-defined]
    loop.start()
    given_up.cancel()
    assert len(calls) == 20
    ticks.stop()
    loop.add_callback(loop.stop)
    loop.start()
    assert len(calls) == 20
    loop.close()


def test_an_error_does_not_end_it() -> None:
    loop, calls = IOLoop(make_current=False), []  # type: ignore[var-annotated]

    def act() -> None:
        calls.append(1)
        if len(calls) == 3:
            loop.stop()
        raise ValueError('of one call')

    ticks = Ticks(loop, act, PERIOD_S)
    ticks.start()
    loop.start()
    ticks.stop()
    loop.close()
    assert len(calls) == 3
