# SPDX-License-Identifier: BSD-3-Clause
"""The watchdog sees when the GUI thread is blocked, and what blocks it."""
from __future__ import annotations

import json
import time
from pathlib import Path

import pytest
from PyQt5.QtCore import QObject

from process_visualizer.gui.app.watchdog import VARIABLE, Watchdog, read_report, watch_if_wanted


@pytest.fixture
def file(tmp_path: Path) -> str:
    return str(tmp_path / 'watchdog')


def doze() -> None:
    time.sleep(0.2)


def test_a_block_is_measured_and_its_stack_taken(qtbot, file):
    watchdog = Watchdog(file)
    qtbot.waitUntil(lambda: watchdog._beats > 2)
    doze()
    beats = watchdog._beats
    qtbot.waitUntil(lambda: watchdog._beats > beats + 2)
    watchdog.close()
    report = read_report(file)
    longest = max(report.blocks, key=lambda block: block['blocked_ms'])
    assert 195.0 < longest['blocked_ms'] == report.longest_ms < 1000.0
    own_ms = max(block['blocked_ms'] - block['waited_ms'] for block in report.blocks)
    assert report.longest_own_ms == pytest.approx(own_ms, abs=0.02)
    assert longest['computed_ms'] < 195.0  # it slept
    assert 'in doze' in longest['stack'] and longest['at'] == pytest.approx(time.time(), abs=10.0)


def test_a_thread_that_is_free_has_no_block(qtbot, file):
    watchdog = Watchdog(file, limit_s=5.0)
    qtbot.wait(150)
    watchdog.close()
    report = read_report(file)
    assert report.blocks == [] and 0.0 < report.longest_own_ms <= report.longest_ms
    last = json.loads(Path(file).read_text().splitlines()[-1])
    assert last['blocks'] == 0 and last['beats'] > 3


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
