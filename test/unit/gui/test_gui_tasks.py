# SPDX-License-Identifier: BSD-3-Clause
"""Tasks off the GUI thread."""
from __future__ import annotations

import threading
from typing import Any, Iterator, List

import pytest
from PyQt5.QtWidgets import QApplication

from process_visualizer.gui.toolkit.tasks import NewestValue, Tasks


@pytest.fixture
def tasks(qtbot: Any) -> Iterator[Tasks]:
    lines = Tasks()
    yield lines
    lines.close()


def test_result_comes_in_the_gui_thread(tasks: Tasks, qtbot: Any) -> None:
    threads: List[threading.Thread] = []
    results: List[int] = []

    def work() -> int:
        threads.append(threading.current_thread())
        return 42

    def take(result: int) -> None:
        threads.append(threading.current_thread())
        results.append(result)

    tasks.run('a', work, take)
    qtbot.waitUntil(lambda: results == [42])
    assert threads[0] is not threading.main_thread()
    assert threads[1] is threading.main_thread()


def test_tasks_of_a_line_keep_their_order_and_their_thread(tasks: Tasks, qtbot: Any) -> None:
    seen: List[Any] = []
    for number in range(20):
        tasks.run('a', lambda n=number: (n, threading.get_ident()), seen.append)
    qtbot.waitUntil(lambda: len(seen) == 20)
    assert [number for number, _ in seen] == list(range(20))
    assert len({thread for _, thread in seen}) == 1


def test_lines_do_not_wait_for_each_other(tasks: Tasks, qtbot: Any) -> None:
    held = threading.Event()
    results: List[str] = []
    tasks.run('slow', held.wait, lambda _: results.append('slow'))
    tasks.run('fast', lambda: 'fast', results.append)
    qtbot.waitUntil(lambda: results == ['fast'])
    held.set()
    qtbot.waitUntil(lambda: results == ['fast', 'slow'])


def test_error_is_handed_over(tasks: Tasks, qtbot: Any) -> None:
    errors: List[Exception] = []
    tasks.run('a', lambda: 1 / 0, None, errors.append)
    qtbot.waitUntil(lambda: bool(errors))
    assert isinstance(errors[0], ZeroDivisionError)


def test_error_that_nobody_takes_is_raised_in_the_gui_thread(tasks: Tasks, qtbot: Any) -> None:
    with qtbot.captureExceptions() as caught:
        tasks.run('a', lambda: 1 / 0)
        qtbot.waitUntil(lambda: bool(caught))
    assert caught[0][0] is ZeroDivisionError


def test_after_the_end_nothing_is_delivered(qtbot: Any) -> None:
    tasks = Tasks()
    held = threading.Event()
    results: List[Any] = []
    tasks.run('a', lambda: held.wait(60.0), results.append)
    held.set()
    tasks.close()
    QApplication.processEvents()
    assert results == []


def test_a_late_gui_thread_gets_only_the_newest_value(qtbot: Any) -> None:
    """Queued values kept a launcher busy for 45 min: SIGTERM and clicks had no effect."""
    newest, came = NewestValue(), []
    newest.came.connect(came.append)

    def put(values: range) -> None:
        thread = threading.Thread(target=lambda: [newest.put(it) for it in values])
        thread.start()
        thread.join()

    put(range(1000))
    assert came == []
    QApplication.processEvents()
    assert came == [999]
    put(range(3))
    qtbot.waitUntil(lambda: came == [999, 2])
