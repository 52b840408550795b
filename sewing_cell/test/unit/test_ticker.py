# SPDX-License-Identifier: BSD-3-Clause
"""The ticker keeps absolute deadlines, skips what is over, and stops at once."""

from __future__ import annotations

import threading
import time
from typing import Callable, Optional

import numpy as np
import pytest

from sewing_cell.lookahead import Lookahead
from sewing_cell.ticker import Ticker

WAIT_S = 10.0


class Recorder:
    """An action that notes its ticks and times until it has ``wanted`` of them."""

    def __init__(self, wanted: int, then: Optional[Callable[[int], None]] = None) -> None:
        self.ticks: list[int] = []
        self.times_s: list[float] = []
        self.late_s: list[float] = []
        self.skipped: list[int] = []
        self.failures: list[Exception] = []
        self.done = threading.Event()
        self._wanted, self._then = wanted, then

    def __call__(self, tick: int, late_s: float) -> None:
        self.ticks.append(tick)
        self.late_s.append(late_s)
        self.times_s.append(time.monotonic())
        if len(self.ticks) >= self._wanted:
            self.done.set()
        if self._then is not None:
            self._then(tick)

    def fail(self, error: Exception) -> None:
        self.failures.append(error)
        self.done.set()

    def ticker(self, rate_hz: float) -> Ticker:
        return Ticker("test", rate_hz, self, self.skipped.append, self.fail)


def run(recorder: Recorder, rate_hz: float, start_s: float) -> None:
    """Tick until the recorder has what it wants."""
    ticker = recorder.ticker(rate_hz)
    ticker.start(start_s)
    assert recorder.done.wait(WAIT_S)
    ticker.stop()


def test_ticks_are_never_early_and_every_one_is_accounted_for() -> None:
    recorder, start_s = Recorder(40), time.monotonic() + 0.05
    run(recorder, 100.0, start_s)
    due = start_s + np.array(recorder.ticks) / 100.0
    assert np.all(np.array(recorder.times_s) >= due - 1e-4)
    told = np.array(recorder.times_s) - recorder.late_s
    np.testing.assert_array_less(-1e-6, told - due)  # the action is called a moment later
    assert np.median(told - due) < 0.005
    assert len(recorder.ticks) + sum(recorder.skipped) == recorder.ticks[-1] + 1
    assert np.all(np.diff(recorder.ticks) > 0)


def test_a_start_in_the_past_skips_to_the_present() -> None:
    recorder = Recorder(1)
    run(recorder, 100.0, time.monotonic() - 1.0)
    assert recorder.ticks[0] >= 100
    assert recorder.skipped[0] == recorder.ticks[0]


def test_stops_while_waiting() -> None:
    recorder = Recorder(2)
    ticker = recorder.ticker(0.001)
    ticker.start(time.monotonic())
    before_s = time.monotonic()
    ticker.stop()
    assert time.monotonic() - before_s < 2.0
    assert len(recorder.ticks) <= 1


def test_an_action_may_stop_its_own_ticker() -> None:
    recorder = Recorder(1, then=lambda tick: ticker.stop())
    ticker = recorder.ticker(200.0)
    ticker.start(time.monotonic())
    assert recorder.done.wait(WAIT_S)
    ticker.stop()
    assert len(recorder.ticks) == 1


def test_a_failure_is_passed_on() -> None:
    def break_down(tick: int) -> None:
        raise RuntimeError("broken")

    recorder = Recorder(100, then=break_down)
    run(recorder, 100.0, time.monotonic())
    assert [str(error) for error in recorder.failures] == ["broken"]
    assert len(recorder.ticks) == 1


@pytest.mark.parametrize("ticks", [range(100), range(99, -1, -1), [7, 1000, 8]])
def test_lookahead_gives_what_the_function_gives(ticks: range) -> None:
    rows = Lookahead(lambda times: np.stack([times, times**2], axis=-1), 50.0, size=16)
    for tick in ticks:
        assert rows(tick) == [tick / 50.0, (tick / 50.0) ** 2]


def test_lookahead_computes_each_block_once() -> None:
    calls: list[int] = []

    def function(times: np.ndarray) -> np.ndarray:
        calls.append(len(times))
        return times

    rows = Lookahead(function, 100.0, size=10)
    assert [rows(tick) for tick in range(35)] == [tick / 100.0 for tick in range(35)]
    assert calls == [10, 10, 10, 10]
