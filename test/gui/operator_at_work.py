# SPDX-License-Identifier: BSD-3-Clause
"""An operator: clicks widgets by their names, reads them, and looks at ROS behind the window."""
from __future__ import annotations

import os
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, Callable, Dict, List, Optional, Sequence, Set, Type, TypeVar

import rosgraph
from PyQt5.QtCore import QEvent, QPoint, QPointF, Qt
from PyQt5.QtGui import QMouseEvent
from PyQt5.QtTest import QTest
from PyQt5.QtWidgets import (
    QAbstractButton,
    QApplication,
    QLabel,
    QTreeWidget,
    QTreeWidgetItem,
    QWidget,
)
from pytestqt.exceptions import TimeoutError

from process_visualizer.gui.app.launcher import Launcher
from process_visualizer.gui.app.launcher_app import LauncherApp
from process_visualizer.gui.app.processor_wait import ProcessorWait
from process_visualizer.gui.app.settings import Settings
from process_visualizer.gui.app.watchdog import BEAT_MS, Entry, Watchdog, read_report
from process_visualizer.gui.app.window_keeper import WindowKeeper

LONGEST_BLOCK_MS = 50.0
LONGEST_WAIT_MS = 200.0
"""For what others do, such as the X server, on a machine that draws RViz with its processors."""
MOST_BLOCKS = 1
"""Longer than that, up to twice: one may be the machine's, which nothing tells apart."""
MOST_STOLEN = 0.005
"""Of the time, by the host of a virtual machine: if it took more, everything may have waited."""
MOST_WAITED = 0.25
"""Of the time, by the window for a processor. On two of them it was 0.14 to 0.21 in four runs in
which only the cell and RViz computed, and 0.29 beside a load of ten."""
Kind = TypeVar('Kind', bound=QWidget)
Found = TypeVar('Found')


class Operator:
    """Sits before a launcher in this process; ``close`` ends it and all that it started."""

    def __init__(self, qtbot: Any) -> None:
        self._qtbot = qtbot
        self._is_closed = False
        self._watched = os.path.join(os.environ['HOME_FOLDER'], 'watchdog.jsonl')
        self._watchdog = Watchdog(self._watched)
        self._began = processor_times()
        self._wait = ProcessorWait()
        self._begin_s, self._waited_before_s = time.monotonic(), self._wait.times().waited_s
        self.launcher = Launcher()
        settings = Settings()
        self.window = LauncherApp(self.launcher, settings)
        self.keeper = WindowKeeper(self.window, self.launcher, settings)
        with qtbot.waitExposed(self.window):
            self.window.show()
        QApplication.setActiveWindow(self.window)  # there is no window manager to do it
        self.launcher.begin()

    def widget(self, name: str, kind: Type[Kind] = QWidget) -> Kind:  # type: ignore[assignment]
        """The widget of that name, in the window or in a dialog of it."""
        found = self.window.findChild(kind, name)
        assert found is not None, f'there is no {kind.__name__} "{name}"'
        return found

    def click(self, name: str) -> None:
        """Click a button that is on the screen and can be clicked."""
        button = self.widget(name, QAbstractButton)
        assert button.isVisible(), f'"{name}" is not visible'
        assert button.isEnabled(), f'"{name}" cannot be clicked: {button.toolTip()}'
        self._qtbot.mouseClick(button, Qt.LeftButton)

    def click_check_box(self, tree: QTreeWidget, item: QTreeWidgetItem) -> None:
        """Click the check box of a row."""
        place = tree.visualItemRect(item)
        self._qtbot.mouseClick(tree.viewport(), Qt.LeftButton,
                               pos=QPoint(place.left() + 10, place.center().y()))

    def click_row(self, tree: QTreeWidget, item: QTreeWidgetItem, twice: bool = False) -> None:
        """Click on the text of a row, or double-click."""
        tree.scrollToItem(item)
        place = tree.visualItemRect(item)
        position = QPoint(place.left() + 30, place.center().y())
        self._qtbot.mouseClick(tree.viewport(), Qt.LeftButton, pos=position)
        if twice:
            self._qtbot.mouseDClick(tree.viewport(), Qt.LeftButton, pos=position)

    def drag(self, widget: QWidget, begin: QPoint, places: Sequence[QPoint]) -> None:
        """Press the mouse, move it along and let it go."""
        QTest.mousePress(widget, Qt.LeftButton, Qt.NoModifier, begin)
        for place in places:
            QApplication.sendEvent(widget, QMouseEvent(
                QEvent.MouseMove, QPointF(place), Qt.NoButton, Qt.LeftButton, Qt.NoModifier))
            self._qtbot.wait(20)
        QTest.mouseRelease(widget, Qt.LeftButton, Qt.NoModifier, places[-1])

    def press(self, key: int, modifier: Qt.KeyboardModifier = Qt.NoModifier) -> None:
        """Press a key in the window."""
        QTest.keyClick(QApplication.focusWidget() or self.window, key, modifier)

    def text(self, name: str) -> str:
        """What a label or button says."""
        widget = self.widget(name)
        assert isinstance(widget, (QLabel, QAbstractButton))
        return widget.text()

    def wait(self, condition: Callable[[], bool], what: str, timeout_s: float = 30.0,
             instead: Callable[[], object] = lambda: '') -> None:
        """Wait until something is to be seen; ``instead`` is looked at if it is not."""
        try:
            self._qtbot.waitUntil(condition, timeout=int(timeout_s * 1000))
        except TimeoutError as error:
            raise AssertionError(f'not seen in {timeout_s} s: {what}; status: '
                                 f'{self.text("status")}; {instead()}') from error

    def beside(self, function: Callable[[], Found]) -> Found:
        """What a function returns that is run in a thread, beside the window."""
        with ThreadPoolExecutor(1) as thread:
            found = thread.submit(function)
            self.wait(found.done, 'the answer')
            return found.result()

    def messages(self) -> str:
        """The text of the dialog that is open; empty without one."""
        found: Optional[QWidget] = self.window.findChild(QWidget, 'message')
        return found.text() if found is not None else ''  # type: ignore[attr-defined]

    def close(self) -> None:
        """Close the window and wait until everything has ended."""
        if self._is_closed:
            return
        self._is_closed = True
        self.window.leave()
        self.wait(lambda: not self.window.isVisible(), 'the window closes', 60.0)
        self._watchdog.close()
        self.launcher.close()

    def blocks(self) -> List[str]:
        """When the window's thread was held up for too long, or too often: how long, doing what.

        While others take the processors, only what the program did counts, and four times as long.
        """
        factor = 4.0 if self._is_disturbed() else 1.0
        blocks = read_report(self._watched).blocks
        found = [(block, factor * LONGEST_BLOCK_MS) for block in blocks if is_the_windows(block)]
        if factor == 1.0:
            found += [(block, LONGEST_WAIT_MS) for block in blocks if not is_the_windows(block)]
        found = [(block, limit_ms) for block, limit_ms in found if own_ms(block) > limit_ms]
        is_grave = any(own_ms(block) > min(2.0 * limit_ms, factor * LONGEST_WAIT_MS)
                       for block, limit_ms in found)
        return [described(block) for block, _ in found] if is_grave or len(found) > MOST_BLOCKS \
            else []

    def _is_disturbed(self) -> bool:
        """Whether others took the processors: then everything waits, the X server too."""
        waited_s = self._wait.times().waited_s - self._waited_before_s
        waited = waited_s / (time.monotonic() - self._begin_s)
        stolen = stolen_share(self._began, processor_times())
        print(f'the window waited for a processor {waited:.1%} of the time, stolen {stolen:.2%}')
        return waited > MOST_WAITED or stolen > MOST_STOLEN


def processor_times() -> List[int]:
    """What all processors have done, in ticks: user, nice, system, idle ... steal; proc(5)."""
    return [int(word) for word in Path('/proc/stat').read_text().split('\n')[0].split()[1:9]]


def stolen_share(before: List[int], after: List[int]) -> float:
    """The share of the time between that the host of a virtual machine gave to others."""
    return (after[7] - before[7]) / max(1, sum(after) - sum(before))


def own_ms(block: Entry) -> float:
    """For how long at least the thread was blocked without waiting for a processor.

    What is measured is the time between two beats, which is up to one interval of them longer.
    """
    return float(block['blocked_ms']) - float(block['waited_ms']) - BEAT_MS


def described(block: Entry) -> str:
    """The block as a text."""
    return (f'{own_ms(block):.0f} ms ({block["blocked_ms"]} between beats, {block["waited_ms"]} '
            f'waiting for a processor, {block["ran_ms"]} run, {block["computed_ms"]} computed): '
            f'{block["stack"]}')


def is_the_windows(block: Entry) -> bool:
    """Whether the program did it: its threads have computed, or its code was called last."""
    calls = [line for line in str(block['stack']).splitlines() if 'File' in line]
    return (float(block['computed_ms']) > LONGEST_BLOCK_MS
            or bool(calls) and '/src/process_visualizer/' in calls[0])


def nodes() -> Set[str]:
    """The nodes that the master knows."""
    return set(registrations())


def registrations() -> Dict[str, List[str]]:
    """What the master knows of each node: topics that it publishes, hears, and its services."""
    found: Dict[str, List[str]] = {}
    for kind, part in zip(('publishes', 'hears', 'serves'),
                          rosgraph.Master('/test').getSystemState()):
        for name, names in part:
            for node in names:
                found.setdefault(node, []).append(f'{kind} {name}')
    return found


def processes(mark: str) -> Set[str]:
    """The command lines of the processes that have the mark's value in their environment."""
    return marked_processes(f'{mark}={os.environ[mark]}')


def marked_processes(mark: str) -> Set[str]:
    """The processes, but this one, whose environment has ``NAME=value``: ids, command lines."""
    found = set()
    for path in Path('/proc').iterdir():
        if path.name.isdigit() and int(path.name) != os.getpid():
            command = _command(path, mark.encode())
            if command:
                found.add(f'{path.name} {command}')
    return found


def _command(path: Path, wanted: bytes) -> str:
    try:
        if wanted not in (path / 'environ').read_bytes().split(b'\0'):
            return ''
        return (path / 'cmdline').read_bytes().replace(b'\0', b' ').decode(errors='replace')
    except OSError:
        return ''
