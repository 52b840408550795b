# SPDX-License-Identifier: BSD-3-Clause
"""Takes the launcher's pictures that lead from a poor run to its cause, recorded and live.

usage: compare_picture.py CONFIG BAG POOR FOLDER    (started by take_compare_picture)
"""
from __future__ import annotations

import sys
from pathlib import Path

from window_pictures import Photographer

from process_visualizer.cell.model import Mode

_LAUNCH_S = 120.0


class ComparePhotographer(Photographer):
    """Plays a recording, compares its runs, and shows the moment at which the poor one departed."""

    def take(self, bag: str, poor: int) -> None:
        """Take the picture; ``poor`` is the number of the poor run, from 1."""
        launcher, playback = self.launcher, self.launcher.playback
        self._start_with(bag)
        self._click('launch')
        self._until(lambda: playback.state.is_available and launcher.launch.is_running,
                    _LAUNCH_S)
        self._until(lambda: playback.state.is_playing, 60.0)
        playback.toggle()
        self.window.panels.setCurrentIndex(2)
        model = launcher.compare
        model.find_runs()
        self._until(lambda: bool(model.runs), 60.0)
        for number in range(len(model.runs)):
            model.set_good(number, number not in (0, poor - 1))
        model.compare()
        self._until(lambda: model.compared is not None, 60.0)
        departures = self.window.compare.departures
        departures.itemClicked.emit(departures.topLevelItem(0), 0)
        self._pause(1.0)
        position_s = playback.position_s + 1.0
        playback.seek(position_s)
        self.window.playback.timeline.zoom.show_part(position_s - 16.0, position_s + 12.0)
        self._pause(4.0)
        self._picture('compare', whole=True)

    def take_live(self, bag: str, poor: int) -> None:
        """Take the picture of the running cell, whose force departs, over the band of the bag."""
        launcher, model = self.launcher, self.launcher.compare
        if not launcher.launch.is_idle:
            self._quit()
        launcher.cell.open(self._config, {'image_rate': '0', 'fault': 'friction'})
        launcher.session.set_mode(Mode.REALTIME)
        self._until(lambda: not launcher.cell.is_loading
                    and self.window.launch.launch.isEnabled(), 60.0)
        launcher.cell.tick('kinect', False)
        self.window.panels.setCurrentIndex(2)
        model.add(bag)
        self._until(lambda: bool(model.runs) and not model.activity, 60.0)
        for number in range(len(model.runs)):
            model.set_good(number, number not in (0, poor - 1))
        model.compare()
        self._until(lambda: model.compared is not None, 60.0)
        self._click('launch')
        self._until(lambda: bool(launcher.live_comparison.departures), 2.0 * _LAUNCH_S)
        self._pause(0.8)  # the fault lasts to the end of the seam only
        self._picture('compare_live', whole=True)

    def _start_with(self, bag: str) -> None:
        launcher = self.launcher
        launcher.cell.open(self._config)
        self._until(lambda: launcher.session.cell is not None, 60.0)
        launcher.cell.tick('kinect', False)
        launcher.session.set_mode(Mode.PLAYBACK)
        launcher.bag.open([bag])
        self._until(lambda: launcher.session.paths == (bag,)
                    and bool(launcher.bag.curves.curves), 60.0)
        self._until(self.window.launch.launch.isEnabled, 60.0)


def main() -> None:
    config, bag, poor, folder = sys.argv[1:]
    photographer = ComparePhotographer(config, Path(folder))
    try:
        photographer.take(bag, int(poor))
        photographer.take_live(bag, int(poor))
    finally:
        photographer.close()


if __name__ == '__main__':
    main()
