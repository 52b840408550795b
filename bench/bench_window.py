# SPDX-License-Identifier: BSD-3-Clause
"""The launcher's real window for benchmarks, with the simulated cell."""
from __future__ import annotations

import os
import time
from pathlib import Path
from typing import Callable, List

from PyQt5.QtCore import QEventLoop, QTimer
from PyQt5.QtWidgets import QAbstractButton

from process_visualizer.gui.app.launcher import Launcher
from process_visualizer.gui.app.launcher_app import LauncherApp
from process_visualizer.gui.app.main import make_application
from process_visualizer.gui.app.settings import Settings
from process_visualizer.gui.app.window_keeper import WindowKeeper

CELL = str(Path(__file__).parents[1] / 'sewing_cell' / 'devices' / 'simulated.xml')
_PERIOD_MS = 5


def until(condition: Callable[[], bool], timeout_s: float) -> None:
    """Process events until a condition is true; raise TimeoutError otherwise."""
    loop, timer = QEventLoop(), QTimer()
    deadline = time.monotonic() + timeout_s
    timer.timeout.connect(lambda: loop.quit() if condition() or time.monotonic() > deadline
                          else None)
    timer.start(_PERIOD_MS)
    loop.exec_()
    if not condition():
        raise TimeoutError('the launcher did not come to the state that was waited for')


def pause(seconds: float) -> None:
    """Process events for a time."""
    loop = QEventLoop()
    QTimer.singleShot(round(1000 * seconds), loop.quit)
    loop.exec_()


class BenchWindow:
    """Operates a window, RViz and the timeline as an operator does; ``close`` ends everything."""

    def __init__(self) -> None:
        os.environ['XDG_CONFIG_HOME'] = os.environ['ROS_HOME']
        self._app = make_application()
        self.launcher = Launcher(self._app)
        settings = Settings()
        self.window = LauncherApp(self.launcher, settings)
        self._keeper = WindowKeeper(self.window, self.launcher, settings)
        self.window.show()
        self.launcher.begin()
        self.launcher.cell.open(CELL)
        until(self.window.launch.launch.isEnabled, 60.0)

    def click(self, name: str) -> None:
        """Click a button as soon as it is enabled."""
        button = self.window.findChild(QAbstractButton, name)
        until(button.isEnabled, 60.0)
        button.click()

    def launch(self) -> float:
        """Launch, and wait until every display of RViz is OK; return how long that took [s]."""
        displays: List[bool] = []
        connection = self.launcher.link.displays.connect(
            lambda found: displays.append(all(it.level == 0 for it in found)))
        until(self.window.launch.launch.isEnabled, 60.0)
        begin_s = time.monotonic()
        self.click('launch')
        until(lambda: bool(displays) and displays[-1], 120.0)
        taken_s = time.monotonic() - begin_s
        self.launcher.link.displays.disconnect(connection)
        return taken_s

    def quit(self) -> None:
        """Quit all nodes."""
        self.launcher.launch.quit()
        until(lambda: self.launcher.launch.is_idle, 90.0)

    def record(self, seconds: float) -> str:
        """Record for a time; return the path of the bag."""
        path = self.begin_recording()
        until(lambda: self.launcher.recording.elapsed_s > seconds, seconds + 60.0)
        self.end_recording()
        return path

    def begin_recording(self) -> str:
        """Begin to record; return the path of the bag."""
        recording = self.launcher.recording
        recording.choices.set_folder(os.environ['ROS_HOME'])
        self.click('record')
        until(lambda: recording.elapsed_s > 1.0, 60.0)
        return recording.state.path

    def end_recording(self) -> None:
        """Finish the bag."""
        self.click('record')
        until(lambda: not self.launcher.recording.is_recording, 30.0)

    def close(self) -> None:
        """Quit everything."""
        self.window.leave()
        until(lambda: not self.window.isVisible(), 60.0)
        self.launcher.close()
