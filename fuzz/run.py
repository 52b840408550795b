# SPDX-License-Identifier: BSD-3-Clause
"""Feeds the parts of this package with bad input: prints the number of inputs, and the failures.

usage: python3 fuzz/run.py [--inputs 1000000] [--seconds 300] [--first 0] [TARGET …]

(in the environment of the workspace.) Inputs are counted from ``--first`` on; one that failed is
repeated with ``--first NUMBER --inputs 1 TARGET``. It ends with 1 if something failed: an
unexpected exception, more than 2 s, or more than 300 MB of memory.
"""
from __future__ import annotations

import argparse
import resource
import sys
import time
import traceback
from pathlib import Path
from typing import List, NamedTuple

from targets import TARGETS, Target, temporary_folder

_MAX_S, _MAX_KB = 2.0, 300 << 10
_MAX_FINDS = 20


class Result(NamedTuple):
    """Numbers of a target's inputs and refusals, its time [s], and the failures."""

    inputs: int
    refused: int
    took_s: float
    finds: List[str]


def feed(target: Target, first: int, inputs: int, seconds: float) -> Result:
    """Feed a target until it has had all inputs, or the time is up."""
    with temporary_folder() as folder:
        fed = target.begin(Path(folder))
        begin_s, count, refused = time.monotonic(), 0, 0
        finds: List[str] = []
        before_kb = _peak_kb()
        while count < inputs and time.monotonic() - begin_s < seconds and len(finds) < _MAX_FINDS:
            number = first + count
            count += 1
            start_s = time.process_time()
            try:
                refused += fed(number)
            except Exception as error:  # the failures to be found
                place = traceback.extract_tb(error.__traceback__)[-1]
                finds.append(f'{target.name} {number}: {error!r:.200} '
                             f'({Path(place.filename).name}:{place.lineno})')
            if time.process_time() - start_s > _MAX_S:
                finds.append(f'{target.name} {number}: {time.process_time() - start_s:.1f} s')
            if _peak_kb() - before_kb > _MAX_KB:
                finds.append(f'{target.name} {number}: {(_peak_kb() - before_kb) >> 10} MB')
                before_kb = _peak_kb()
        return Result(count, refused, time.monotonic() - begin_s, finds)




def _peak_kb() -> int:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def main() -> int:
    """Feed the targets; return 1 if something failed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--inputs', type=int, default=1_000_000)
    parser.add_argument('--seconds', type=float, default=300.0)
    parser.add_argument('--first', type=int, default=0)
    parser.add_argument('targets', nargs='*', metavar='TARGET',
                        help=f'default: {", ".join(it.name for it in TARGETS)}')
    options = parser.parse_args()
    chosen = [it for it in TARGETS if not options.targets or it.name in options.targets]
    shares = sum(it.share for it in chosen)
    print('| target | inputs | refused | s |\n|---|---|---|---|')
    finds: List[str] = []
    end_s, total = time.monotonic() + options.seconds, 0
    for target in chosen:
        found = feed(target, options.first, round(options.inputs * target.share / shares),
                     end_s - time.monotonic())
        print(f'| {target.name} | {found.inputs:,} | {found.refused / max(found.inputs, 1):.0%} | '
              f'{found.took_s:.0f} |', flush=True)
        finds, total = [*finds, *found.finds], total + found.inputs
    print(f'{total:,} inputs, {len(finds)} finds', *finds, sep='\n')
    return 1 if finds else 0


if __name__ == '__main__':
    sys.exit(main())
