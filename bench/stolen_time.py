# SPDX-License-Identifier: BSD-3-Clause
"""Measures the time taken by a virtual machine's host, which distorts short measurements."""
from __future__ import annotations

import os
from pathlib import Path
from typing import Callable, NamedTuple, Tuple, TypeVar

Result = TypeVar('Result')
MAX_STOLEN = 0.003
_TRIES = 8


class CpuTime(NamedTuple):
    """Time of all processors since the start of the machine [s]: total, and stolen."""

    total_s: float
    stolen_s: float


def cpu_time() -> CpuTime:
    """Return the processors' times; see proc(5), /proc/stat."""
    ticks = [int(word) for word in Path('/proc/stat').read_text().split('\n')[0].split()[1:9]]
    per_s = os.sysconf('SC_CLK_TCK')
    return CpuTime(sum(ticks) / per_s, ticks[7] / per_s)


def with_share_stolen(run: Callable[[], Result]) -> Tuple[Result, float]:
    """Return the result of a run and the share of the time taken by the host during it."""
    before = cpu_time()
    result = run()
    after = cpu_time()
    return result, (after.stolen_s - before.stolen_s) / (after.total_s - before.total_s)


def undisturbed(run: Callable[[], Result]) -> Tuple[Result, float]:
    """Return the first run with almost no time taken by the host, or the best of some, as above.

    Compared programs must be treated alike: use this for each run of each of them.
    """
    tries = []
    for _ in range(_TRIES):
        tries.append(with_share_stolen(run))
        if tries[-1][1] <= MAX_STOLEN:
            break
    return min(tries, key=lambda it: it[1])
