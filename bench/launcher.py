# SPDX-License-Identifier: BSD-3-Clause
"""The launcher with the simulated cell: time to launch, and cost of the window.

usage: bench/run launcher [--runs 3]

From the click on "Launch nodes" to RViz having every display OK, and, while a Kinect bag of 20 s is
played (46 MB/s), the share of a core that the window's process takes and the longest block of its
GUI thread (with and without the wait for a processor).
"""
from __future__ import annotations

import argparse
import os
import statistics
import time
from pathlib import Path
from typing import Callable, List

from bag_maker import DEFAULT_FOLDER
from cell_bag import cell_bag
from PyQt5.QtCore import QEventLoop, QTimer

from process_visualizer.cell.model import Mode
from process_visualizer.gui.app.launcher import Launcher
from process_visualizer.gui.app.launcher_app import LauncherApp
from process_visualizer.gui.app.main import make_application
from process_visualizer.gui.app.settings import Settings
from process_visualizer.gui.app.watchdog import Watchdog, read_report

_CELL = str(Path(__file__).parents[1] / 'sewing_cell' / 'devices' / 'simulated.xml')
_PLAYED_S = 15.0
_PERIOD_MS = 20


def main() -> None:
    options = _options()
    os.environ['XDG_CONFIG_HOME'] = os.environ['ROS_HOME']
    app = make_application()
    launcher = Launcher(app)
    window = LauncherApp(launcher, Settings())
    window.resize(460, 1000)
    window.show()
    watched = os.path.join(os.environ['ROS_HOME'], 'watchdog.jsonl')
    launcher.begin()
    launcher.cell.open(_CELL)
    try:
        times = [_launch(launcher, window) for _ in range(options.runs)]
        print(f'launch to all displays OK, s: {", ".join(f"{it:.1f}" for it in times)} '
              f'(median {statistics.median(times):.1f})', flush=True)
        _play(launcher, window, watched)
    finally:
        window.leave()
        _until(lambda: not window.isVisible(), 60.0)
        launcher.close()


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--runs', type=int, default=3)
    return parser.parse_args()


def _launch(launcher: Launcher, window: LauncherApp) -> float:
    """Launch, wait until everything is drawn, quit; return the time of the first part [s]."""
    displays: List[bool] = []
    connection = launcher.link.displays.connect(
        lambda found: displays.append(all(it.level == 0 for it in found)))
    _until(window.launch.launch.isEnabled, 60.0)
    begin = time.monotonic()
    window.launch.launch.click()
    _until(lambda: bool(displays) and displays[-1], 120.0)
    taken_s = time.monotonic() - begin
    launcher.link.displays.disconnect(connection)
    _quit(launcher, window)
    return taken_s


def _play(launcher: Launcher, window: LauncherApp, watched: str) -> None:
    bag = cell_bag(DEFAULT_FOLDER, 20.0)
    launcher.cell.set_mode(Mode.PLAYBACK)
    launcher.bag.open([str(bag.path)])
    _until(lambda: launcher.bag.path == str(bag.path), 30.0)
    window.launch.launch.click()
    _until(lambda: launcher.playback.is_available and launcher.launch.is_running, 120.0)
    _until(lambda: bool(launcher.bag.curves.curves), 60.0)
    launcher.playback.set_rate(1.0)
    launcher.playback.seek(0.0)
    launcher.playback.play()
    _until(lambda: launcher.playback.is_playing, 20.0)
    watchdog = Watchdog(watched)
    cpu_s, begin = time.process_time(), time.monotonic()
    _until(lambda: time.monotonic() - begin > _PLAYED_S, _PLAYED_S + 5.0)
    share = (time.process_time() - cpu_s) / (time.monotonic() - begin)
    watchdog.close()
    report = read_report(watched)
    print(f'playing a Kinect bag: window {100.0 * share:.0f} % of a core; GUI thread blocked '
          f'{report.longest_ms:.0f} ms at most ({report.longest_own_ms:.0f} ms without waiting for '
          'a processor)', flush=True)
    _quit(launcher, window)


def _quit(launcher: Launcher, window: LauncherApp) -> None:
    launcher.launch.quit()
    _until(lambda: launcher.launch.is_idle, 90.0)


def _until(condition: Callable[[], bool], timeout_s: float) -> None:
    """Process events until a condition is true; raise TimeoutError otherwise."""
    loop, timer = QEventLoop(), QTimer()
    deadline = time.monotonic() + timeout_s
    timer.timeout.connect(lambda: loop.quit() if condition() or time.monotonic() > deadline
                          else None)
    timer.start(_PERIOD_MS)
    loop.exec_()
    if not condition():
        raise TimeoutError('the launcher did not come to the state that was waited for')


if __name__ == '__main__':
    main()
