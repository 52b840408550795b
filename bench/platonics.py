# SPDX-License-Identifier: BSD-3-Clause
"""Runs of an arm at a board that is at a different pose each time: displacement, and verdicts.

    bench/run platonics FOLDER

FOLDER is execution_data of https://github.com/platonics-delft/platonics_dataset, which is not part
of this repository. The files have no times; rows are taken as 50 Hz.
"""
from __future__ import annotations

import argparse
import math
from pathlib import Path

import numpy as np

from process_visualizer.runs.alignment.alignment import aligned
from process_visualizer.runs.alignment.displacement import displacement
from process_visualizer.runs.comparison.good_runs import GoodRuns
from process_visualizer.runs.comparison.wording import verdict
from process_visualizer.runs.run import Channel, ChannelKind, Run, ToolForce, ToolMotion

_RATE_HZ = 50.0


def read(path: Path) -> Run:
    """Return one execution as a run."""
    rows = np.genfromtxt(path, delimiter=',', names=True)
    times_s = np.arange(len(rows)) / _RATE_HZ
    force, places = (np.column_stack([rows[f'{name}_{axis}'] for axis in 'xyz'])
                     for name in ('force', 'current_pos'))
    joints = [Channel('arm', f'joint {number}', 'rad', ChannelKind.JOINT, times_s,
                      rows[f'joint_{number}']) for number in range(1, 8)]
    return Run(path.stem, float(times_s[-1]), (
        Channel('arm', 'tool force', 'N', ChannelKind.FORCE, times_s,
                np.linalg.norm(force, axis=1)), *joints),
        (ToolMotion('arm', times_s, places),), forces=(ToolForce('arm', '', times_s, force),))


def _print_apart(reference: Run, run: Run) -> None:
    found = displacement(reference, run)
    if found is None:
        print(f'{run.name}: no displacement of {reference.name}')
        return
    moved = found.of_run(run)
    at_s = np.arange(0.0, reference.duration_s, 0.02)
    run_s = aligned(reference, moved).time_map.to_run(at_s)
    here, there = (np.column_stack([np.interp(times_s, motion.times_s, axis)
                                    for axis in motion.positions.T])
                   for times_s, motion in ((at_s, reference.motions[0]), (run_s, moved.motions[0])))
    apart_mm = 1000.0 * np.linalg.norm(here - there, axis=1)
    median, p95 = np.percentile(apart_mm, (50, 95))
    print(f'{run.name}: turned by {math.degrees(found.turn_rad):.1f}°; then the tools are '
          f'{median:.1f} mm apart (median; p95 {p95:.1f})')


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('folder', type=Path)
    runs = [read(it) for it in sorted(parser.parse_args().folder.glob('*.csv'))]
    for run in runs[1:]:
        _print_apart(runs[0], run)
    for judged in runs:
        first, *others = (it for it in runs if it is not judged)
        print(f'{judged.name}: {verdict(GoodRuns(first, others).compare(judged))}')


if __name__ == '__main__':
    main()
