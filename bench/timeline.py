# SPDX-License-Identifier: BSD-3-Clause
"""Zooms the timeline on an hour of recording: duration of a frame, and blocking of the window.

usage: bench/run timeline [--pyqtgraph FOLDER]

Seven curves of an hour are zoomed in and out again, in steps as of a touchpad. The measurements
are the time of the window's thread until a step is completely drawn (CPU time, which other programs
do not change), and the longest iteration of the event loop; then the same with the curves overlaid
in two lanes. With the folder of a pyqtgraph
(``pip install --target FOLDER pyqtgraph``), it draws the same curves in turn with the timeline.
"""
from __future__ import annotations

import argparse
import sys
import time
from dataclasses import replace
from typing import Any, Callable, Dict, List, NamedTuple, Tuple, cast
from unittest.mock import Mock

import numpy as np
from PyQt5.QtWidgets import QApplication, QWidget

from process_visualizer.gui.lanes.lane_choice import LaneChoices
from process_visualizer.gui.lanes.timeline_lanes import Lane
from process_visualizer.gui.playback.playback_model import PlaybackModel
from process_visualizer.gui.playback.timeline_view import TimelineView
from process_visualizer.gui.ros.snapshots import PlayerSnapshot
from process_visualizer.gui.toolkit.tasks import Tasks
from process_visualizer.gui.toolkit.theme import apply_style
from process_visualizer.gui.toolkit.time_axis import whole

_LENGTH_S, _COLUMNS, _LANES = 3600.0, 72_000, 7
_AROUND_S, _STEPS, _FACTOR = 1800.0, 120, 1.06
_ROUNDS = 3
_HEIGHT = 520


class Shown(NamedTuple):
    """A widget, the function that shows a range [s, s], and whether it has drawn it."""

    widget: QWidget
    show: Callable[[float, float], None]
    is_drawn: Callable[[], bool]


def lanes() -> List[Lane]:
    """Waves with noise, like a force that is read 20 times a second and more."""
    rng = np.random.default_rng(1)
    time_s = np.linspace(0.0, _LENGTH_S, _COLUMNS)
    found = []
    for number in range(_LANES):
        middle = 10.0 + 10.0 * np.sin(time_s / 60 + number) + rng.normal(0.0, 0.3, _COLUMNS)
        found.append(Lane(f'variable {number}', 'N', (0.8, 0.1 * number, 0.2), middle - 0.1,
                          middle + 0.1, ('', str(number), '')))
    return found


def timeline(tasks: Tasks, shown: List[Lane]) -> Shown:
    """The launcher's own timeline."""
    model = PlaybackModel(tasks, cast(Any, Mock()), RuntimeError, time.monotonic)
    view = TimelineView(model, lambda _key: 1.0, LaneChoices())
    view.set_recording(_LENGTH_S)
    view.set_lanes(shown)
    model.take_state(PlayerSnapshot(
        stamp_s=0.0, begin_s=0.0, duration_s=_LENGTH_S, position_s=_AROUND_S, rate=1.0,
        achieved_rate=0.0, paused=True, segment=1, files=('/a.bag',)))
    return Shown(view, view.zoom.show_part, lambda: view.stack.is_drawn)


def overlaid() -> List[Lane]:
    """The same curves, three and four in a lane, two of which have scales of their own."""
    first, *others = lanes()
    others = [replace(it, unit='m' if number % 3 == 0 else 'N') for number, it in enumerate(others)]
    return [replace(first, overlaid=tuple(others[:2])),
            replace(others[2], overlaid=tuple(others[3:]))]


def pyqtgraph_plots() -> Shown:
    """The same curves in pyqtgraph: reduced to extremes, clipped, scaled to what is visible."""
    import pyqtgraph  # an optional part of this benchmark
    widget = pyqtgraph.GraphicsLayoutWidget()
    widget.setBackground('w')
    times_s = np.repeat(np.linspace(0.0, _LENGTH_S, _COLUMNS), 2)
    plots = []
    for lane in lanes():
        plot = widget.addPlot(row=len(plots), col=0)
        plot.plot(times_s, np.column_stack([lane.low, lane.high]).ravel(), pen='r')
        plot.setDownsampling(auto=True, mode='peak')
        plot.setClipToView(True)
        plot.setAutoVisible(y=True)
        plot.enableAutoRange(y=True)
        plot.showGrid(y=True)
        plot.hideAxis('bottom')
        if plots:
            plot.setXLink(plots[0])
        plots.append(plot)
    return Shown(widget, lambda begin_s, end_s: plots[0].setXRange(begin_s, end_s, padding=0),
                 lambda: True)


def zoomed(shown: Shown) -> Tuple[List[float], float]:
    """Zoom in and out: the time [s] of each frame and of the event loop's longest iteration."""
    frames, longest_s, part = [], 0.0, whole(_LENGTH_S)
    for factor in [1 / _FACTOR] * _STEPS + [_FACTOR] * _STEPS:
        part = part.zoomed(factor, _AROUND_S)
        begin_s = turn_s = time.thread_time()
        shown.show(part.begin_s, part.end_s)
        while True:
            QApplication.processEvents()
            longest_s, turn_s = max(longest_s, time.thread_time() - turn_s), time.thread_time()
            if shown.is_drawn():
                break
        QApplication.processEvents()
        frames.append(time.thread_time() - begin_s)
    return frames, longest_s


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--pyqtgraph', default='', metavar='FOLDER')
    options = parser.parse_args()
    app = QApplication([])
    apply_style(app)
    tasks = Tasks()
    kinds: Dict[str, Shown] = {'timeline': timeline(tasks, lanes()),
                               'overlaid': timeline(tasks, overlaid())}
    if options.pyqtgraph:
        sys.path.append(options.pyqtgraph)
        kinds['pyqtgraph'] = pyqtgraph_plots()
    print(f'{"drawn by":<12}{"width px":>9}{"median ms":>11}{"95 % ms":>9}{"longest turn ms":>17}')
    for width in (390, 1200, 1900):
        for _ in range(_ROUNDS):
            for name, shown in kinds.items():
                _print(name, shown, width)
    tasks.close()


def _print(name: str, shown: Shown, width: int) -> None:
    shown.widget.resize(width, _HEIGHT)
    shown.widget.show()
    QApplication.processEvents()
    zoomed(shown)
    frames, longest_s = zoomed(shown)
    shown.widget.hide()
    print(f'{name:<12}{width:>9}{1e3 * np.median(frames):>11.1f}'
          f'{1e3 * np.percentile(frames, 95):>9.1f}{1e3 * longest_s:>17.1f}', flush=True)


if __name__ == '__main__':
    main()
