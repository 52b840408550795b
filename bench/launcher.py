# SPDX-License-Identifier: BSD-3-Clause
"""The launcher with the simulated cell: time to launch, and cost of the window.

usage: bench/run launcher [--runs 3]

From the click on "Launch nodes" until every display of RViz is OK, and, while a Kinect bag of 20 s
is played (46 MB/s), the share of a core that the window's process takes and the longest block of
its GUI thread (with and without the wait for a processor).
"""
from __future__ import annotations

import argparse
import os
import statistics
import time

from bag_maker import DEFAULT_FOLDER
from bench_window import BenchWindow, pause, until
from cell_bag import cell_bag

from process_visualizer.cell.model import Mode
from process_visualizer.gui.app.watchdog import Watchdog, read_report

_PLAYED_S = 15.0


def main() -> None:
    options = _options()
    window = BenchWindow()
    try:
        times = []
        for _ in range(options.runs):
            times.append(window.launch())
            window.quit()
        print(f'launch to all displays OK, s: {", ".join(f"{it:.1f}" for it in times)} '
              f'(median {statistics.median(times):.1f})', flush=True)
        _play(window)
    finally:
        window.close()


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--runs', type=int, default=3)
    return parser.parse_args()


def _play(window: BenchWindow) -> None:
    launcher, bag = window.launcher, cell_bag(DEFAULT_FOLDER, 20.0)
    launcher.session.set_mode(Mode.PLAYBACK)
    launcher.bag.open([str(bag.path)])
    until(lambda: launcher.session.paths == (str(bag.path),), 30.0)
    window.click('launch')
    until(lambda: launcher.playback.state.is_available and launcher.launch.is_running, 120.0)
    until(lambda: bool(launcher.bag.curves.curves), 60.0)
    launcher.playback.set_rate(1.0)
    launcher.playback.seek(0.0)
    launcher.playback.play()
    until(lambda: launcher.playback.state.is_playing, 20.0)
    watched = os.path.join(os.environ['ROS_HOME'], 'watchdog.jsonl')
    watchdog = Watchdog(watched)
    cpu_s, begin_s = time.process_time(), time.monotonic()
    pause(_PLAYED_S)
    share = (time.process_time() - cpu_s) / (time.monotonic() - begin_s)
    watchdog.close()
    report = read_report(watched)
    print(f'playing a Kinect bag: window {100.0 * share:.0f} % of a core; GUI thread blocked '
          f'{report.longest_ms:.0f} ms at most ({report.longest_own_ms:.0f} ms without waiting for '
          'a processor)', flush=True)
    window.quit()


if __name__ == '__main__':
    main()
