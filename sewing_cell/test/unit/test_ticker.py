# SPDX-License-Identifier: BSD-3-Clause
"""The ticker keeps absolute deadlines, skips missed ticks, and stops at once."""

from __future__ import annotations

from threading import Event, Thread
from typing import Callable, Optional

import numpy as np
import pytest
from simulated_node import SimulatedNode

from sewing_cell.camera import Lookahead
from sewing_cell.simulator import Ticker

RATE_HZ = 100.0


class Recorder:
    """An action that records its ticks, their times and delays; and its ticker."""

    def __init__(self, then: Optional[Callable[[int], None]] = None) -> None:
        self.node = SimulatedNode()
        self.ticks: list[int] = []
        self.times_s: list[float] = []
        self.late_s: list[float] = []
        self.skipped: list[int] = []
        self.failures: list[Exception] = []
        self._then = then
        self.ticker = Ticker(
            self.node, "test", RATE_HZ, self, self.skipped.append, self.failures.append
        )

    def __call__(self, tick: int, late_s: float) -> None:
        self.ticks.append(tick)
        self.late_s.append(late_s)
        self.times_s.append(self.node.now_s)
        if self._then is not None:
            self._then(tick)


def test_ticks_are_at_their_times() -> None:
    recorder = Recorder()
    start_s = recorder.node.now_s + 0.05
    recorder.ticker.start(start_s)
    recorder.node.advance(0.049)
    assert recorder.ticks == []
    recorder.node.advance(1.0)
    assert recorder.ticks == list(range(100))
    np.testing.assert_allclose(recorder.times_s, start_s + np.arange(100) / RATE_HZ, atol=1e-9)
    np.testing.assert_allclose(recorder.late_s, 0.0, atol=1e-9)
    assert recorder.skipped == []


def test_what_is_over_is_skipped_and_the_deadlines_stay() -> None:
    """One action takes long."""

    def act(tick: int) -> None:
        if tick == 3:
            recorder.node.now_s += 0.0452

    recorder = Recorder(act)
    start_s = recorder.node.now_s
    recorder.ticker.start(start_s)
    recorder.node.advance(0.105)
    assert recorder.ticks == [0, 1, 2, 3, 7, 8, 9, 10]
    assert recorder.skipped == [3]
    assert recorder.late_s[4] == pytest.approx(0.0052)  # 7 was due at 70 ms
    due_s = start_s + np.array(recorder.ticks) / RATE_HZ
    np.testing.assert_allclose(np.array(recorder.times_s) - recorder.late_s, due_s, atol=1e-9)


def test_a_start_in_the_past_skips_to_the_present() -> None:
    recorder = Recorder()
    recorder.ticker.start(recorder.node.now_s - 1.005)
    recorder.node.advance(0.0)
    assert (recorder.ticks, recorder.skipped) == ([100], [100])


def test_stops_while_waiting() -> None:
    recorder = Recorder()
    recorder.ticker.start(recorder.node.now_s)
    recorder.node.advance(0.015)
    recorder.ticker.stop()
    recorder.node.advance(1.0)
    assert recorder.ticks == [0, 1]


def test_an_action_may_stop_its_own_ticker() -> None:
    recorder = Recorder(lambda tick: recorder.ticker.stop())
    recorder.ticker.start(recorder.node.now_s)
    recorder.node.advance(1.0)
    assert recorder.ticks == [0]


def test_stopping_waits_for_an_action_that_is_under_way_but_not_for_ever() -> None:
    acting, may_end, ended = Event(), Event(), Event()

    def act(tick: int) -> None:
        acting.set()
        may_end.wait(60.0)
        ended.set()

    recorder = Recorder(act)
    recorder.ticker.start(recorder.node.now_s)
    thread = Thread(target=recorder.node.advance, args=(0.0,))
    thread.start()
    assert acting.wait(60.0)
    recorder.ticker.stop(timeout_s=0.0)
    assert not ended.is_set()
    may_end.set()
    recorder.ticker.stop(timeout_s=60.0)
    assert ended.is_set()
    thread.join(60.0)


def test_a_failure_is_passed_on_and_ends_the_ticking() -> None:
    def break_down(tick: int) -> None:
        raise RuntimeError("broken")

    recorder = Recorder(break_down)
    recorder.ticker.start(recorder.node.now_s)
    recorder.node.advance(1.0)
    assert [str(error) for error in recorder.failures] == ["broken"]
    assert recorder.ticks == [0]


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
