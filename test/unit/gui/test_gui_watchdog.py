# SPDX-License-Identifier: BSD-3-Clause
"""The watchdog detects when the GUI thread is blocked, and by what."""
from __future__ import annotations

import json
import os
import threading
from pathlib import Path

import pytest
from PyQt5.QtCore import QObject

from process_visualizer.gui.app.watchdog import (
    VARIABLE,
    ProcessorTimes,
    ProcessorWait,
    Watchdog,
    read_report,
    watch_if_wanted,
)


@pytest.fixture
def file(tmp_path: Path) -> str:
    return str(tmp_path / 'watchdog')


class Clock:
    """A clock that the test moves."""

    now_s = 100.0

    def __call__(self) -> float:
        return self.now_s


def doze(watchdog: Watchdog) -> None:
    """Block the thread until the watchdog has noticed it."""
    while watchdog._seen is None:
        os.sched_yield()


def test_a_block_is_measured_and_its_stack_taken(qtbot, file):
    clock = Clock()
    watchdog = Watchdog(file, clock_s=clock)
    qtbot.waitUntil(lambda: watchdog._beats > 2)
    clock.now_s += 0.2
    doze(watchdog)
    beats = watchdog._beats
    qtbot.waitUntil(lambda: watchdog._beats > beats + 2)
    watchdog.close()
    report = read_report(file)
    [block] = report.blocks
    assert block['blocked_ms'] == report.longest_ms == 200.0
    assert report.longest_own_ms == pytest.approx(200.0 - block['waited_ms'], abs=0.02)
    assert 'in doze' in block['stack']


def test_a_thread_that_is_free_has_no_block(qtbot, file):
    clock = Clock()
    watchdog = Watchdog(file, clock_s=clock)
    for _ in range(5):
        beats = watchdog._beats
        qtbot.waitUntil(lambda before=beats: watchdog._beats > before)
        clock.now_s += 0.03
    watchdog.close()
    report = read_report(file)
    assert report.blocks == [] and report.longest_ms == 30.0
    last = json.loads(Path(file).read_text().splitlines()[-1])
    assert last['blocks'] == 0 and last['beats'] >= 5


def test_a_program_that_was_killed_has_left_its_blocks(qtbot, file):
    Path(file).write_text('{"blocked_ms": 80.0, "waited_ms": 10.0, "at": 1.0, "stack": ""}\n')
    report = read_report(file)
    assert (report.longest_ms, report.longest_own_ms) == (80.0, 70.0)


def test_only_if_it_is_wanted(qtbot, file, monkeypatch):
    parent = QObject()
    monkeypatch.delenv(VARIABLE, raising=False)
    assert watch_if_wanted(parent) is None
    monkeypatch.setenv(VARIABLE, file)
    watchdog = watch_if_wanted(parent)
    assert watchdog is not None
    watchdog.close()


@pytest.mark.parametrize('ran_s, waited_s, other_s, kept_s', [
    (0.3, 0.0, 0.5, 0.0),  # it computed: a waiting thread did not block it
    (0.1, 0.2, 0.0, 0.2),
    (0.0, 0.0, 0.2, 0.2),  # it slept for 0.3 s; for 0.2 s of it another thread waited
    (0.1, 0.1, 0.9, 0.2),  # never more than it slept
])
def test_what_kept_the_thread_waiting(ran_s, waited_s, other_s, kept_s):
    before = ProcessorTimes(1.0, 2.0, {7: 3.0, 8: 4.0})
    after = ProcessorTimes(1.0 + ran_s, 2.0 + waited_s, {7: 3.0, 8: 4.0 + other_s, 9: 5.0})
    assert after.kept_waiting_s(before, 0.3) == pytest.approx(kept_s)


def test_threads_that_begin_and_end_are_followed():
    times = ProcessorWait()
    before = times.times()
    for _ in range(60):
        thread = threading.Thread(target=sum, args=(range(1000),))
        thread.start()
        thread.join()
        times.times()
    assert times.times().ran_s > before.ran_s
    times.close()
