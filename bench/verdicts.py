# SPDX-License-Identifier: BSD-3-Clause
"""Verdicts on five cells with known faults, by the number of good runs used for the judgment.

    bench/run verdicts [--references 1 5 25] [--cells grinding …] [--good 20] [--bad 0] [--seed 1]
                       [--peers] [--sets N]

Prints the faults found, whether the right cause ranks first, and how many good runs leave their
band. ``--bad`` is the share of the references that are faulty. With ``--sets N``, it draws N sets
of references for each cell instead, and prints how many good runs leave the band of each.
"""
from __future__ import annotations

import argparse
import time
from typing import Dict, List, NamedTuple, Sequence

import numpy as np
from process_cells import CELLS, SIZES, Fault, MadeRun, ProcessCell, faulty_run, good_run
from verdict_peers import PEERS, Peer

from process_visualizer.runs.comparison.comparison import Comparison
from process_visualizer.runs.comparison.good_runs import GoodRuns

_REFERENCE_SEED, _FAULT_SEED, _GOOD_SEED, _BAD_SEED = 1_000, 20_000, 40_000, 60_000


class Tried(NamedTuple):
    """The result for a faulty run: found or not, right cause first or not, onset error [s]."""

    fault: Fault
    is_found: bool
    is_first: bool
    onset_s: float
    said: str


def references(cell: ProcessCell, count: int, bad: float, seed: int) -> List[MadeRun]:
    """Return good runs, a share of which has large faults."""
    found = [good_run(cell, _REFERENCE_SEED * seed + number) for number in range(count)]
    random = np.random.default_rng([seed, count, 3, CELLS.index(cell)])  # they differ between cells
    for number in random.choice(count, int(bad * count), replace=False).tolist():
        kind = cell.kinds[int(random.integers(len(cell.kinds)))]
        found[number] = faulty_run(cell, kind, 'large', _BAD_SEED + 100 * seed + number)
    return found


def tried(made: MadeRun, comparison: Comparison) -> Tried:
    """Return the result for a faulty run, given its comparison."""
    fault, found = made.fault, comparison.departures
    assert fault is not None
    if not found:
        return Tried(fault, False, False, np.nan, '')
    first = found[0]
    is_first = first.signal.name.replace(' noise', '').endswith(fault.wanted)
    onset_s = comparison.run_s(first.onset_s) - fault.begin_s if is_first else np.nan
    return Tried(fault, True, is_first, onset_s, first.signal.name)


def judged(cell: ProcessCell, good: GoodRuns, seed: int) -> List[Tried]:
    """Return the results for faulty runs, one of each kind and size."""
    found = []
    for number, kind in enumerate(cell.kinds):
        for place, size in enumerate(SIZES):
            made = faulty_run(cell, kind, size, _FAULT_SEED * seed + 10 * number + place)
            found.append(tried(made, good.compare(made.run)))
    return found


def alarms(cell: ProcessCell, good: GoodRuns, count: int, seed: int) -> List[str]:
    """Return the first signal that left its band in each good run that did not stay in range."""
    found = [good.compare(good_run(cell, _GOOD_SEED * seed + number).run)
             for number in range(count)]
    return [it.departures[0].signal.name for it in found if it.departures]


def judged_by(cell: ProcessCell, peer: Peer, excess: Sequence[float], seed: int,
              scale: float) -> np.ndarray:
    """Return the middle and large faults: all, found, right cause; and good runs that leave (4,).

    The limits of the peer are multiplied by ``scale``; ``excess`` is that of the good runs.
    """
    count = found = right = 0
    for number, kind in enumerate(cell.kinds):
        for place in (1, 2):
            made = faulty_run(cell, kind, SIZES[place], _FAULT_SEED * seed + 10 * number + place)
            assert made.fault is not None
            cause = peer.cause(made.run, scale)
            count += 1
            found += cause is not None
            right += cause is not None and any(it in cause for it in made.fault.wanted)
    return np.array([count, found, right, sum(it > scale for it in excess)])


def _print_sets(count: int, options: argparse.Namespace) -> None:
    """Print for each drawn set of references how many good runs leave its band."""
    found: List[int] = []
    for cell in CELLS:
        if cell.name not in options.cells:
            continue
        left: List[int] = []
        for number in range(options.sets):
            first, *others = references(cell, count, options.bad, options.seed + number)
            good = GoodRuns(first.run, [it.run for it in others])
            left.append(len(alarms(cell, good, options.good, options.seed + number)))
        print(f'| {count} | {cell.name} | {left} | {_share(sum(left), len(left), options)} |',
              flush=True)
        found += left
    print(f'| {count} | all | at most {max(found)} of {options.good} in {len(found)} sets | '
          f'{_share(sum(found), len(found), options)} |', flush=True)


def _share(left: int, sets: int, options: argparse.Namespace) -> str:
    return f'{left / (sets * options.good):.1%}'


def _print_peers(count: int, options: argparse.Namespace, ours: Dict[str, int]) -> None:
    """Print the results of the peers, given how many good runs of each cell leave our band.

    Also with limits scaled for each cell, on these very runs, so that as many leave as with ours.
    """
    for name, peer in PEERS.items():
        textbook, equal = np.zeros(4, int), np.zeros(4, int)
        for cell in CELLS:
            if cell.name in options.cells:
                made = references(cell, count, options.bad, options.seed)
                judge = peer([it.run for it in made])
                excess = [judge.excess(good_run(cell, _GOOD_SEED * options.seed + number).run)
                          for number in range(options.good)]
                scale = sorted(excess)[options.good - 1 - ours[cell.name]]
                textbook += judged_by(cell, judge, excess, options.seed, 1.0)
                equal += judged_by(cell, judge, excess, options.seed, scale)
        for title, sums in ((name, textbook), (f'{name}, as few alarms as ours', equal)):
            print(f'| {count} | {title} | {sums[1]}/{sums[0]} ({sums[1] / sums[0]:.0%}) | '
                  f'{sums[2]} ({sums[2] / sums[0]:.0%}) | - | - | - | {sums[3]} |', flush=True)


def _counts(names: Sequence[str]) -> str:
    by_name: Dict[str, int] = {}
    for name in names:
        by_name[name] = by_name.get(name, 0) + 1
    return ', '.join(f'{name} {count}' for name, count in
                     sorted(by_name.items(), key=lambda it: -it[1])[:6])


def _shares(found: Sequence[Tried]) -> str:
    number = max(len(found), 1)
    return (f'{sum(it.is_found for it in found)}/{len(found)} '
            f'({sum(it.is_found for it in found) / number:.0%}) | '
            f'{sum(it.is_first for it in found)} '
            f'({sum(it.is_first for it in found) / number:.0%})')


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--references', type=int, nargs='+', default=[1, 5, 25])
    parser.add_argument('--cells', nargs='+', default=[it.name for it in CELLS])
    parser.add_argument('--good', type=int, default=20)
    parser.add_argument('--bad', type=float, default=0.0)
    parser.add_argument('--seed', type=int, default=1)
    parser.add_argument('--missed', action='store_true', help='also print what was missed')
    parser.add_argument('--peers', action='store_true', help='also three usual ways to judge')
    parser.add_argument('--sets', type=int, default=0, help='only draw so many references')
    options = parser.parse_args()
    if options.sets:
        for count in options.references:
            _print_sets(count, options)
        return
    print('| references | cell | found, middle and large | right first | small | right first | '
          'onset p95 | good runs that leave |\n|---|---|---|---|---|---|---|---|')
    begin_s = time.process_time()
    for count in options.references:
        of_all: List[Tried] = []
        left: Dict[str, int] = {}
        for cell in CELLS:
            if cell.name not in options.cells:
                continue
            first, *others = references(cell, count, options.bad, options.seed)
            good = GoodRuns(first.run, [it.run for it in others])
            found = judged(cell, good, options.seed)
            false = alarms(cell, good, options.good, options.seed)
            of_all += found
            left[cell.name] = len(false)
            _print(str(count), cell.name, found, f'{len(false)} of {options.good} '
                                                 f'({_counts(false)})')
            if options.missed:
                _print_missed(found)
        _print(str(count), 'all', of_all, str(sum(left.values())))
        if options.peers and count > 1:
            _print_peers(count, options, left)
    print(f'took {time.process_time() - begin_s:.0f} s of processor time')


def _print(count: str, name: str, found: Sequence[Tried], left: str) -> None:
    small = [it for it in found if it.fault.size == 'small']
    larger = [it for it in found if it.fault.size != 'small']
    onsets = np.abs([it.onset_s for it in larger if np.isfinite(it.onset_s)])
    p95 = f'{np.percentile(onsets, 95):.2f} s' if len(onsets) else '-'
    print(f'| {count} | {name} | {_shares(larger)} | {_shares(small)} | {p95} | {left} |',
          flush=True)


def _print_missed(found: Sequence[Tried]) -> None:
    for it in found:
        if not it.is_first:
            print(f'    {it.fault.kind} {it.fault.size}: {it.said or "not found"}')
        elif abs(it.onset_s) > 0.3:
            print(f'    {it.fault.kind} {it.fault.size}: onset off by {it.onset_s:+.2f} s')


if __name__ == '__main__':
    main()
