# SPDX-License-Identifier: BSD-3-Clause
"""Live verdicts of the runs in recordings, as the window would have reached them.

usage: bench/run live_verdicts [--late SECONDS] [--jitter SECONDS] GOOD[#RUNS] BAG...

The messages of each bag arrive as they were recorded, and the moment in the reference is found by
the tools' positions at their arrival, as by the node ghost. It takes them for those of ``--late``
after, and gets them up to ``--jitter`` late. The bag must have positions in Float32MultiArray on
topics named ``…/tcf``. Beside each verdict is that of the recording, which has no such delays.
"""
from __future__ import annotations

import argparse
import math
import sys
from pathlib import Path
from typing import Dict, Iterator, List, Optional, Tuple

import numpy as np
from std_msgs.msg import Float32MultiArray

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / 'test'))
from recent_parts import parts_of

from process_visualizer.bagio.recording import Recording
from process_visualizer.cell.model import RunSpan
from process_visualizer.curves.live_curves import MAX_S, LiveCurves
from process_visualizer.gui.compare.live_comparison_model import judged_values, motions_s
from process_visualizer.runs.alignment.live_alignment import (
    PERIOD_S,
    FollowedSpan,
    LiveAlignment,
    PhaseHistory,
)
from process_visualizer.runs.comparison.good_runs import GoodRuns
from process_visualizer.runs.comparison.live_comparison import LiveComparison
from process_visualizer.runs.comparison.live_runs import FinishedRun, LiveRuns
from process_visualizer.runs.comparison.wording import verdict
from process_visualizer.runs.recorded.chosen_runs import ChosenRuns
from process_visualizer.runs.run import Run

STEP_S, WINDOW_S, GHOST_S = 0.2, 30.0, 1.0 / 30.0


class Positions:
    """The positions of all tools of a bag (n, 3 k) as they arrived, at times (n,) [s]."""

    def __init__(self, path: str) -> None:
        series: Dict[str, Tuple[List[float], List[List[float]]]] = {}
        with Recording([path]) as recording:
            index = recording.index
            for row in range(len(index)):
                topic = index.connections[index.connection[row]].topic
                if topic.endswith('/tcf'):
                    message = Float32MultiArray().deserialize(bytes(recording.message(row)))
                    times_s, places = series.setdefault(topic, ([], []))
                    times_s.append((index.time_ns[row] - recording.begin_ns) / 1e9)
                    places.append(list(message.data[:3]))
            self.begin_ns = recording.begin_ns
        self._series = [(np.array(times_s), np.array(places))
                        for _, (times_s, places) in sorted(series.items())]

    def at(self, time_s: float) -> np.ndarray:
        """Return the newest positions (3 k,) [m] at a time [s]; NaN before the first ones."""
        found = []
        for times_s, places in self._series:
            row = int(np.searchsorted(times_s, time_s)) - 1
            found.append(places[row] if row >= 0 else np.full(3, np.nan))
        return np.concatenate(found)


def phases(path: str, reference: Run, span: Optional[RunSpan], runs: List[Run], late_s: float,
           jitter_s: float) -> Iterator[Tuple[float, Optional[float]]]:
    """Yield stamps [s from the bag's start], and moments of the reference [s] or None."""
    there = Positions(reference.recording[0])
    times_s = reference.begin_s + PERIOD_S * np.arange(int(reference.duration_s / PERIOD_S))
    events: Dict[str, Tuple[float, ...]] = {}
    for event in reference.events:
        events[event.name] = (*events.get(event.name, ()), event.time_s)
    alignment = LiveAlignment(np.array([there.at(it) for it in times_s.tolist()]), events,
                              None if span is None else FollowedSpan(span.begin, span.end))
    here, random = Positions(path), np.random.default_rng(1)
    seen = sorted((run.begin_s + it.time_s, it.name) for run in runs for it in run.events)
    with Recording([path]) as recording:
        end_s = (recording.end_ns - recording.begin_ns) / 1e9
    known_s = -late_s
    for now_s in np.arange(0.0, end_s, GHOST_S).tolist():
        known_s = max(known_s, now_s - late_s - jitter_s * random.random())
        while seen and seen[0][0] <= known_s:
            alignment.take_event(seen[0][1], seen.pop(0)[0])
        alignment.advance(known_s + late_s, here.at(known_s))
        yield known_s + late_s, alignment.phase_s


def live(path: str, good: GoodRuns, runs: List[Run], late_s: float, jitter_s: float
         ) -> Iterator[Tuple[float, FinishedRun]]:
    """Yield the finished runs of a bag, each with its begin [s from the bag's start]."""
    with Recording([path]) as recording:
        begin_s = recording.begin_ns / 1e9
    with ChosenRuns().cell_of_recording([path]) as cell:
        curves, span = LiveCurves(cell.devices), cell.run
    comparison, history = LiveComparison(good), PhaseHistory(MAX_S)
    follower = LiveRuns(good.reference.name, good.reference.duration_s)
    judged_s = 0.0
    coming = phases(path, good.reference, span, runs, late_s, jitter_s)
    stamp_s, moment_s = next(coming)
    for step, part in enumerate(parts_of(path, STEP_S), start=1):
        while stamp_s <= step * STEP_S:
            history.add(begin_s + stamp_s, moment_s)
            over = follower.at(begin_s + stamp_s, moment_s)
            if over is not None:
                yield over.began_s - begin_s, over
            stamp_s, moment_s = next(coming, (math.inf, None))
        curves.add(part)
        window = curves.window(WINDOW_S)
        if not window.curves:
            continue
        times_s, values = judged_values(window)
        reference_s = comparison.certain(
            times_s, values, history.at(times_s), motions_s(window))
        found = comparison.departures(times_s, values, reference_s)
        since_s, judged_s = judged_s, max(
            judged_s, comparison.judged_until_s(times_s, reference_s))
        passed = comparison.passed(times_s, values, reference_s, since_s)
        follower.judge((*found, *passed), comparison.unjudged_s(
            times_s, values, reference_s, since_s))


def main() -> None:
    """Print the verdicts."""
    parser = argparse.ArgumentParser(description=__doc__.split('\n')[0])
    parser.add_argument('--late', type=float, default=0.03)
    parser.add_argument('--jitter', type=float, default=0.0)
    parser.add_argument('good')
    parser.add_argument('bags', nargs='+')
    options = parser.parse_args()
    reference, *others = ChosenRuns().runs([options.good])
    good = GoodRuns(reference, others)
    for bag in options.bags:
        runs = ChosenRuns().runs([bag])
        for began_s, over in live(bag, good, runs, options.late, options.jitter):
            same = min(runs, key=lambda it: abs(it.begin_s - began_s))
            print(f'{began_s:7.1f}  live: {over.verdict}\n         recorded: '
                  f'{verdict(good.compare(same))}', flush=True)


if __name__ == '__main__':
    main()
