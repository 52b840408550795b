# SPDX-License-Identifier: BSD-3-Clause
"""An operator: clicks widgets by their names, reads them, and checks ROS behind the window."""
from __future__ import annotations

import os
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
from running_program import SMALL_CELL
from surroundings import PATIENCE_S, marked_processes

from process_visualizer.gui.app.launcher import Launcher
from process_visualizer.gui.app.launcher_app import LauncherApp
from process_visualizer.gui.app.settings import Settings
from process_visualizer.gui.app.window_keeper import WindowKeeper
from process_visualizer.gui.toolkit.widgets import MeaningGuard

Kind = TypeVar('Kind', bound=QWidget)
Found = TypeVar('Found')


class Operator:
    """Operates a launcher in this process; ``close`` ends it and all that it started."""

    def __init__(self, qtbot: Any) -> None:
        self._qtbot = qtbot
        self._is_closed = False
        self.launcher = Launcher()
        settings = Settings()
        self.window = LauncherApp(self.launcher, settings)
        self.keeper = WindowKeeper(self.window, self.launcher, settings)
        with qtbot.waitExposed(self.window):
            self.window.show()
        QApplication.setActiveWindow(self.window)  # there is no window manager to do it
        self.launcher.begin()

    def widget(self, name: str, kind: Type[Kind] = QWidget) -> Kind:  # type: ignore[assignment]
        """Return the widget of that name, in the window or in a dialog of it."""
        found = self.window.findChild(kind, name)
        assert found is not None, f'there is no {kind.__name__} "{name}"'
        return found

    def let_it_be_meant(self, name: str) -> None:
        """Wait until a button, or its key, no longer ignores a click as a second one."""
        guard = self.widget(name, QAbstractButton).findChild(MeaningGuard)
        if guard is not None:
            self.wait(lambda: not guard.is_ignoring, f'"{name}" takes clicks again')

    def click(self, name: str) -> None:
        """Click a button that is visible and enabled."""
        button = self.widget(name, QAbstractButton)
        self.let_it_be_meant(name)
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
        """Press the mouse, move it along and release it."""
        QTest.mousePress(widget, Qt.LeftButton, Qt.NoModifier, begin)
        for place in places:
            QApplication.sendEvent(widget, QMouseEvent(
                QEvent.MouseMove, QPointF(place), Qt.NoButton, Qt.LeftButton, Qt.NoModifier))
            QApplication.processEvents()
        QTest.mouseRelease(widget, Qt.LeftButton, Qt.NoModifier, places[-1])

    def press(self, key: int, modifier: Qt.KeyboardModifier = Qt.NoModifier) -> None:
        """Press a key in the window."""
        QTest.keyClick(QApplication.focusWidget() or self.window, key, modifier)

    def text(self, name: str) -> str:
        """Return the text of a label or button."""
        widget = self.widget(name)
        assert isinstance(widget, (QLabel, QAbstractButton))
        return widget.text()

    def wait(self, condition: Callable[[], bool], what: str,
             instead: Callable[[], object] = lambda: '') -> None:
        """Wait until a condition holds; otherwise fail with the result of ``instead``."""
        try:
            self._qtbot.waitUntil(condition, timeout=round(1000 * PATIENCE_S))
        except TimeoutError as error:
            raise AssertionError(f'not seen in {PATIENCE_S} s: {what}; status: '
                                 f'{self.text("status")}; {self.messages()}; {instead()}'
                                 ) from error

    def is_seen(self, condition: Callable[[], bool], within_s: float) -> bool:
        """Return whether a condition holds within a time."""
        try:
            self._qtbot.waitUntil(condition, timeout=round(1000 * within_s))
        except TimeoutError:
            return False
        return True

    def beside(self, function: Callable[[], Found]) -> Found:
        """Run a function in a thread, beside the window; return its result."""
        with ThreadPoolExecutor(1) as thread:
            found = thread.submit(function)
            self.wait(found.done, 'the answer')
            return found.result()

    def messages(self) -> str:
        """Return the text of the open dialog; empty without one."""
        found: Optional[QWidget] = self.window.findChild(QWidget, 'message')
        return found.text() if found is not None else ''  # type: ignore[attr-defined]

    def close(self) -> None:
        """Close the window and wait until everything has ended."""
        if self._is_closed:
            return
        self._is_closed = True
        self.window.leave()
        self.wait(lambda: not self.window.isVisible(), 'the window closes')
        self.launcher.close()


def launch_small_cell(operator: Operator, folder: Path) -> None:
    """Launch SMALL_CELL, which records into the folder, and wait until RViz shows something."""
    displays: List[Any] = []
    operator.launcher.link.displays.connect(displays.append)
    config = folder / 'cell.xml'
    config.write_text(SMALL_CELL)
    operator.launcher.recording.choices.set_folder(str(folder))
    operator.launcher.cell.open(str(config))
    operator.wait(lambda: operator.widget('launch').isEnabled(), 'it can be launched')
    operator.click('launch')
    operator.wait(lambda: operator.widget('record').isEnabled(), 'it can record')
    operator.wait(lambda: bool(displays), 'RViz draws')


def nodes() -> Set[str]:
    """Return the nodes that the master knows."""
    return set(registrations())


def registrations() -> Dict[str, List[str]]:
    """Return each node's published and subscribed topics and its services, from the master."""
    found: Dict[str, List[str]] = {}
    for kind, part in zip(('publishes', 'hears', 'serves'),
                          rosgraph.Master('/test').getSystemState()):
        for name, names in part:
            for node in names:
                found.setdefault(node, []).append(f'{kind} {name}')
    return found


def processes(mark: str) -> Set[str]:
    """Return the command lines of the processes that have the mark's value in their environment."""
    return marked_processes(f'{mark}={os.environ[mark]}')
