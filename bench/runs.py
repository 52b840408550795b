# SPDX-License-Identifier: BSD-3-Clause
"""Accuracy of the alignment of runs and the detection of faults, on simulated runs of known truth.

    bench/run runs.py [--faults 200] [--good 500] [--jobs 2]

Prints the tables of docs/benchmarks.md ("Runs held against each other").
"""
from __future__ import annotations

import argparse
import multiprocessing
import time
from functools import partial
from typing import Dict, List, NamedTuple, Sequence, Tuple

import numpy as np
from other_alignments import ALIGNERS
from simulated_runs import REST_S, SimulatedRun, simulated_run, varied_run

from process_visualizer.runs.deviation.band import Band, learned_band
from process_visualizer.runs.deviation.departures import Departure, departures
from process_visualizer.runs.deviation.signals import Columns, grid_s, signals
from sewing_cell.cycle import SewingCycle
from sewing_cell.faults import KINDS, FaultyCycle, drawn_fault

RATE, GOOD_RUNS, POOL = 0.05, 39, 300
REFERENCE_SEED, POOL_SEED, FAULT_SEED, JUDGED_SEED = 1, 20_000, 40_000, 60_000
WANTED: Dict[str, Tuple[str, ...]] = {
    'edge_drift': ('edge {arm}',), 'friction': ('{arm} tool force',),
    'slip': ('edge {arm}', '{arm} tool force'), 'sensor_offset': ('edge {arm}',),
    'late_feed': ('feed',), 'dwell': ('time lost',), 'feed_wobble': ('feed',),
    'calibration': ('{arm} tool sideways', '{arm} tool along', '{arm} tool up'),
    'force_noise': ('{arm} tool force',)}
"""The channels at fault; a channel's noise counts as the channel."""


class Found(NamedTuple):
    """Rank of the channel at fault (0: not found), and the error of its onset [s].

    ``lost_s`` is the greatest time lost.
    """

    kind: str
    place: int
    onset_s: float
    lost_s: float


def reference() -> SimulatedRun:
    return simulated_run(REFERENCE_SEED)


def columns(seed: int, aligner: str) -> Columns:
    good = reference().run
    run = varied_run(seed).run
    return signals(good, run, ALIGNERS[aligner](good, run))


def faulty(seed: int, aligner: str) -> Tuple[str, str, float, Columns]:
    """Return kind, arm and moment [s of the process] of a drawn fault, and the run's signals."""
    kind = KINDS[seed % len(KINDS)]
    fault = drawn_fault(kind, SewingCycle('good', seed), seed)
    good = reference().run
    run = varied_run(seed, FaultyCycle(fault, 'good', seed)).run
    return kind, fault.arm, fault.start_s, signals(good, run, ALIGNERS[aligner](good, run))


def map_errors_s(seed: int, aligner: str) -> np.ndarray:
    """Return errors of the map during the process, for ±10 % of speed and ±5 s of start."""
    good, other = reference(), varied_run(seed, speed=0.1, start_s=5.0)
    process_s = np.arange(0.3, 18.5, 0.02)
    found = ALIGNERS[aligner](good.run, other.run).to_run(good.true_s(process_s))
    return np.abs(found - other.true_s(process_s))


def found_fault(times_s: np.ndarray, band: Band,
                fault: Tuple[str, str, float, Columns]) -> Found:
    kind, arm, start_s, run = fault
    found = departures(times_s, run, band)
    wanted = [name.format(arm=arm) for name in WANTED[kind]]
    place = next((number for number, it in enumerate(found, start=1)
                  if it.signal.name.endswith(tuple(wanted + [f'{it} noise' for it in wanted]))), 0)
    begin_s = 0.0 if kind == 'calibration' else REST_S + start_s  # present before the process
    onset_s = found[place - 1].onset_s - begin_s if place else np.nan
    return Found(kind, place, onset_s, _lost_s(found))


def _lost_s(found: Sequence[Departure]) -> float:
    return next((it.deviation for it in found if it.signal.label == 'time lost'), np.nan)


def is_alarm(times_s: np.ndarray, pool: Sequence[Columns], judged: Sequence[Columns],
             number: int) -> bool:
    """Return whether a good run leaves the band of good runs drawn for it alone."""
    drawn = np.random.default_rng([number, 5]).permutation(len(pool))[:GOOD_RUNS]
    return bool(departures(times_s, judged[number], learned_band([pool[it] for it in drawn], RATE)))


def interval(count: int, number: int) -> Tuple[float, float]:
    """Return the 95 % interval of a rate (Wilson 1927)."""
    z, share = 1.96, count / number
    middle = (share + z * z / (2 * number)) / (1 + z * z / number)
    half = z / (1 + z * z / number) * np.sqrt(share * (1 - share) / number
                                              + z * z / (4 * number * number))
    return middle - half, middle + half


def print_maps(pool: 'multiprocessing.pool.Pool') -> None:
    print('| alignment | error of the map, median | p95 | largest |\n|---|---|---|---|')
    for name in ALIGNERS:
        errors = np.concatenate(pool.map(partial(map_errors_s, aligner=name), range(100, 140)))
        print(f'| {name} | {1e3 * np.median(errors):.1f} ms | '
              f'{1e3 * np.percentile(errors, 95):.1f} ms | {1e3 * errors.max():.0f} ms |')


def print_faults(pool: 'multiprocessing.pool.Pool', count: int) -> None:
    times_s = grid_s(reference().run)
    print('\n| alignment | found | ranked first | among the first three | onset, p95 | dwell |')
    print('|---|---|---|---|---|---|')
    kinds: List[Found] = []
    for name in ALIGNERS:
        good = pool.map(partial(columns, aligner=name), range(POOL_SEED, POOL_SEED + GOOD_RUNS))
        band = learned_band(good, RATE)
        seeds = range(FAULT_SEED, FAULT_SEED + count)
        found = [found_fault(times_s, band, it)
                 for it in pool.imap(partial(faulty, aligner=name), seeds)]
        kinds = found
        places = np.array([it.place for it in found])
        onsets = np.abs([it.onset_s for it in found if it.place and it.kind != 'calibration'])
        lost = np.array([it.lost_s for it in found if it.kind == 'dwell'])
        lost = lost[np.isfinite(lost)]
        spread = f'{1e3 * lost.min():.0f} to {1e3 * lost.max():.0f} ms' if len(lost) else 'none'
        print(f'| {name} | {np.mean(places > 0):.1%} | {np.mean(places == 1):.1%} | '
              f'{np.mean((places > 0) & (places <= 3)):.1%} | '
              f'{1e3 * np.percentile(onsets, 95):.0f} ms | {spread} |')
    print_kinds(kinds)


def print_kinds(found: Sequence[Found]) -> None:
    print('\n| fault (ours) | runs | ranked first | onset, median | p95 |\n|---|---|---|---|---|')
    for kind in KINDS:
        of_kind = [it for it in found if it.kind == kind]
        onsets = np.abs([it.onset_s for it in of_kind if it.place])
        first = sum(it.place == 1 for it in of_kind)
        shown = 'before the process' if kind == 'calibration' or not len(onsets) else \
            f'{1e3 * np.median(onsets):.0f} ms | {1e3 * np.percentile(onsets, 95):.0f} ms'
        print(f'| {kind} | {len(of_kind)} | {first} | {shown} |')


def print_alarms(pool: 'multiprocessing.pool.Pool', count: int) -> None:
    times_s = grid_s(reference().run)
    good = pool.map(partial(columns, aligner='ours'), range(POOL_SEED, POOL_SEED + POOL))
    judged = pool.map(partial(columns, aligner='ours'), range(JUDGED_SEED, JUDGED_SEED + count))
    alarms = sum(is_alarm(times_s, good, judged, number) for number in range(count))
    low, high = interval(alarms, count)
    print(f'\n{alarms} of {count} good runs leave the band of {GOOD_RUNS} others: '
          f'{alarms / count:.1%}, 95 % interval {low:.1%} to {high:.1%}; stated {RATE:.0%}')
    own = signals(reference().run, reference().run,
                  ALIGNERS['ours'](reference().run, reference().run))
    print(f'a run against itself: {len(departures(times_s, own, learned_band(good, RATE)))} '
          'departures')


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--faults', type=int, default=200)
    parser.add_argument('--good', type=int, default=500)
    parser.add_argument('--jobs', type=int, default=2)
    options = parser.parse_args()
    begin_s = time.monotonic()
    with multiprocessing.Pool(options.jobs) as pool:
        print_maps(pool)
        print_faults(pool, options.faults)
        print_alarms(pool, options.good)
    print(f'took {time.monotonic() - begin_s:.0f} s')


if __name__ == '__main__':
    main()
