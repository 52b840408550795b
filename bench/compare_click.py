# SPDX-License-Identifier: BSD-3-Clause
"""Measures the time from the click on "Compare" to the bands of the curves and the ghost.

usage: bench/run compare_click CONFIG BAG [--columns N] [--times N]

It uses the window's models. The first run of the bag is the good one, the second is compared. The
ghost counts as present when its request to the node is complete, as bytes; the time to read the
bag ("Find runs") is printed too.
"""
from __future__ import annotations

import argparse
import io
import statistics
import time
from typing import Callable, Dict, Sequence

from PyQt5.QtCore import QEventLoop, QTimer

from process_visualizer.bagio.catalog import read_catalog
from process_visualizer.bagio.recording import Recording
from process_visualizer.cell.model import Mode
from process_visualizer.cell.xml_parser import XmlParser
from process_visualizer.clients.ghost_client import ghost_request
from process_visualizer.generate.choice import Choice
from process_visualizer.generate.plan import BAG_PART
from process_visualizer.gui.app.main import make_application
from process_visualizer.gui.compare.compare_model import BandsModel, CompareModel
from process_visualizer.gui.compare.ghost_model import GhostModel
from process_visualizer.gui.session import Session
from process_visualizer.gui.toolkit.tasks import Tasks
from process_visualizer.launching.part_report import PartReport, PartState
from process_visualizer.runs.comparison.ghost import GhostTrack, ReferenceArrow

_TIMEOUT_S, _PERIOD_MS = 120.0, 2


class Stand:
    """The models of the tab, of the timeline's bands and of the ghost, without their views."""

    def __init__(self, config: str, bag: str, columns: int) -> None:
        self.tasks = Tasks()
        self.session = Session()
        self.model = CompareModel(self.tasks, self.session)
        self.bands = BandsModel(self.tasks, self.model)
        self.ghost = GhostModel(self.tasks, self.model, self.session, self._show,
                                lambda *_what: None)
        self.ghost_bytes = 0
        cell = XmlParser().parse(config)
        self.session.set_cell(cell, cell.devices)
        self.session.set_recording(read_catalog([bag]))
        with Recording([bag]) as recording:
            self.bands.set_columns((recording.end_ns - recording.begin_ns) / 1e9, columns)
        self.session.set_run(Choice(cell, Mode.PLAYBACK, cell.devices), True,
                             {BAG_PART: PartReport(BAG_PART, PartState.RUNNING)})

    def find(self) -> float:
        """Find the runs, and keep the first two; return the time it took [s]."""
        begin_s = time.monotonic()
        self.model.find_runs()
        until(lambda: bool(self.model.runs))
        return time.monotonic() - begin_s

    def compare(self) -> Dict[str, float]:
        """Compare; return the time of each result [s from the click]."""
        self.model.set_good(0, False)
        until(lambda: not self.bands.bands)
        self.model.set_good(0, True)
        self.ghost_bytes = 0
        begin_s = time.monotonic()
        self.model.compare()
        found = {}
        for name, condition in (('departures', lambda: self.model.compared is not None),
                                ('curves', lambda: bool(self.bands.bands)),
                                ('ghost', lambda: self.ghost_bytes > 0)):
            until(condition)
            found[name] = time.monotonic() - begin_s
        return found

    def _show(self, tracks: Sequence[GhostTrack], arrows: Sequence[ReferenceArrow]) -> None:
        buffer = io.BytesIO()
        ghost_request(tracks, arrows).serialize(buffer)
        self.ghost_bytes = buffer.tell() if tracks else 0


def until(condition: Callable[[], bool]) -> None:
    """Let the models work until a condition holds."""
    loop, timer = QEventLoop(), QTimer()
    end_s = time.monotonic() + _TIMEOUT_S
    timer.timeout.connect(lambda: loop.quit() if condition() or time.monotonic() > end_s else None)
    timer.start(_PERIOD_MS)
    loop.exec_()
    assert condition()


def main() -> None:
    """Print the results."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('config')
    parser.add_argument('bag')
    parser.add_argument('--columns', type=int, default=20_000)
    parser.add_argument('--times', type=int, default=5)
    options = parser.parse_args()
    app = make_application()
    stand = Stand(options.config, options.bag, options.columns)
    print(f'runs are found after {stand.find():.2f} s')
    runs = stand.model.runs
    print(f'{len(runs)} runs, {runs[0].run.duration_s:.1f} s and {runs[1].run.duration_s:.1f} s')
    times = [stand.compare() for _ in range(options.times)]
    for name in times[0]:
        found = [it[name] for it in times]
        print(f'{name} after {statistics.median(found):.2f} s (at most {max(found):.2f} s)')
    print(f'the ghost takes {stand.ghost_bytes / 1e6:.1f} MB')
    stand.tasks.close()
    app.quit()


if __name__ == '__main__':
    main()
