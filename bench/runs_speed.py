# SPDX-License-Identifier: BSD-3-Clause
"""Time and memory of comparisons: an hour of cycles, many long runs, two bags.

    bench/run runs_speed [--folder FOLDER]

The bag of an hour is kept in the folder. Each part runs in a process of its own.
"""
from __future__ import annotations

import argparse
import multiprocessing
import resource
import time
from pathlib import Path
from typing import Callable, Tuple

import numpy as np
from bag_maker import DEFAULT_FOLDER
from curves import robots_bag

from process_visualizer.cell.xml_parser import XmlParser
from process_visualizer.runs.comparison.good_runs import GoodRuns
from process_visualizer.runs.recorded.chosen_runs import ChosenRuns
from process_visualizer.runs.run import Channel, ChannelKind, Run, ToolMotion

_CONFIGURATION = Path(__file__).resolve().parents[1] / 'sewing_cell/devices/simulated.xml'
_LONG_RUNS, _CHANNELS, _SAMPLES, _RATE_HZ = 30, 20, 100_000, 125.0


def two_runs(folder: str) -> str:
    """Compare two cycles of 20 s, from the bag to the departures."""
    path = robots_bag(folder, 1.0).path
    begin_s = time.monotonic()
    first, second = ChosenRuns(XmlParser().parse(str(_CONFIGURATION))).runs([str(path)])[:2]
    found = GoodRuns(first).compare(second)
    return f'two runs of {second.duration_s:.0f} s, of a bag of a minute: ' \
           f'{time.monotonic() - begin_s:.2f} s, {len(found.columns)} signals'


def an_hour(folder: str) -> str:
    """Compare each cycle of an hour with the first."""
    path = robots_bag(folder, 60.0).path
    begin_s = time.monotonic()
    runs = ChosenRuns(XmlParser().parse(str(_CONFIGURATION))).runs([str(path)])
    read_s = time.monotonic() - begin_s
    good = GoodRuns(runs[0])
    departed = sum(bool(good.compare(run).departures) for run in runs)
    return f'an hour with {len(runs)} cycles: read {read_s:.1f} s, all ' \
           f'{time.monotonic() - begin_s:.1f} s ({departed} leave the band)'


def long_runs(_folder: str) -> str:
    """Many long runs, made one by one: the band of all but one, and the verdict on that one."""
    begin_s = time.monotonic()
    good = GoodRuns(_long_run(0), map(_long_run, range(1, _LONG_RUNS - 1)))
    good.compare(_long_run(_LONG_RUNS - 1))
    return f'{_LONG_RUNS} runs of {_CHANNELS} channels of {_SAMPLES} samples: ' \
           f'{time.monotonic() - begin_s:.1f} s'


def _long_run(seed: int) -> Run:
    random = np.random.default_rng(seed)
    times_s = np.arange(_SAMPLES) / _RATE_HZ
    process_s = times_s * random.uniform(0.97, 1.03)
    path = np.column_stack([np.sin(process_s * rate) for rate in (0.3, 0.47, 0.61)])
    channels = tuple(
        Channel('machine', f'number {number}', '', ChannelKind.VARIABLE, times_s,
                np.sin(0.1 * (number + 1) * process_s) + 0.01 * random.standard_normal(_SAMPLES))
        for number in range(_CHANNELS))
    return Run(f'run {seed}', float(times_s[-1]), channels, (ToolMotion('robot', times_s, path),))


def _measured(part: Callable[[str], str], folder: str) -> Tuple[str, float]:
    text = part(folder)
    return text, resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024.0


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--folder', default=DEFAULT_FOLDER)
    folder = parser.parse_args().folder
    for part in (two_runs, an_hour, long_runs):
        with multiprocessing.get_context('spawn').Pool(1) as pool:
            text, memory_mb = pool.apply(_measured, (part, folder))
        print(f'{text}; {memory_mb:.0f} MB', flush=True)


if __name__ == '__main__':
    main()
