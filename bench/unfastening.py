# SPDX-License-Identifier: BSD-3-Clause
"""Verdicts on recorded screws: the torque while loosening each, with released ones as good runs.

    bench/run unfastening FOLDER [--references 25] [--good 20] [--sets 1]

FOLDER is dataset1 of https://github.com/AAAipa/dataset_unfastening (Fraunhofer IPA), which is not
part of this repository. For each head and size, good runs are drawn evenly from its programs,
repeated ``--sets`` times.
"""
from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Dict, List, NamedTuple, Sequence, Tuple

import numpy as np
from verdict_peers import WarpedDistance

from process_visualizer.runs.comparison.good_runs import GoodRuns
from process_visualizer.runs.run import Channel, ChannelKind, Run

_SCREWS = (('Torx', 'M5'), ('Kreuz', 'M5'), ('Kreuz', 'M6'), ('Kreuz', 'M8'))


class Screw(NamedTuple):
    """A run, and the tool's program that made it."""

    run: Run
    program: str


def screw(path: Path) -> Screw:
    """Read one file."""
    found = json.loads(path.read_text(encoding='utf-8'))
    times_s: List[float] = []
    values: List[float] = []
    for step in found['tightening steps']:
        graph = step['graph']
        begin_s = times_s[-1] + 0.01 if times_s else 0.0
        times_s += [begin_s + it for it in graph['time values']]
        values += graph['torque values']
    order = np.argsort(times_s, kind='stable')
    channel = Channel('tool', 'torque', 'Nm', ChannelKind.VARIABLE, np.array(times_s)[order],
                      np.array(values)[order])
    return Screw(Run(path.name, float(max(times_s)), (channel,)), str(found['prg name']))


def balanced(screws: Sequence[Screw], count: int, seed: int) -> Tuple[List[Run], List[Run]]:
    """Draw this many runs, evenly from all programs; return them and the rest."""
    random = np.random.default_rng(seed)
    by_program: Dict[str, List[Run]] = {}
    for number in random.permutation(len(screws)).tolist():
        by_program.setdefault(screws[number].program, []).append(screws[number].run)
    turns = max(map(len, by_program.values()))
    drawn = [runs[turn] for turn in range(turns) for _, runs in sorted(by_program.items())
             if turn < len(runs)]
    return drawn[:count], drawn[count:]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('folder', type=Path)
    parser.add_argument('--references', type=int, default=25)
    parser.add_argument('--good', type=int, default=20)
    parser.add_argument('--sets', type=int, default=1)
    options = parser.parse_args()
    print('| screws | not released: found | DTW | released: "leave" | DTW |\n|---|---|---|---|---|')
    for head, size in _SCREWS:
        good, bad = ([it for it in map(screw, sorted(options.folder.glob(f'*/{kind}/*.json')))
                      if head in it.program and it.program.endswith(size)]
                     for kind in ('loesbar', 'nicht_loesbar'))
        ours, theirs = np.zeros(2, int), np.zeros(2, int)
        for seed in range(1, options.sets + 1):
            references, others = balanced([it for it in good if 'NIO' not in it.program],
                                          options.references, seed)
            learned, peer = GoodRuns(references[0], references[1:]), WarpedDistance(references)
            judged = [it.run for it in bad], others[:options.good]
            ours += [sum(bool(learned.compare(it).departures) for it in runs) for runs in judged]
            theirs += [sum(peer.cause(it) is not None for it in runs) for runs in judged]
        poor, left = (options.sets * len(runs) for runs in judged)
        print(f'| {head} {size} | {ours[0]} of {poor} | {theirs[0]} | {ours[1]} of {left} | '
              f'{theirs[1]} |', flush=True)


if __name__ == '__main__':
    main()
