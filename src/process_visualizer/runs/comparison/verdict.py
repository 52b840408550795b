# SPDX-License-Identifier: BSD-3-Clause
"""The verdict on a run, in one sentence."""
from __future__ import annotations

from process_visualizer.runs.comparison.comparison import Comparison
from process_visualizer.runs.comparison.wording import moment, said
from process_visualizer.runs.deviation.band import Band

_MOST_FOLLOWERS = 2


def verdict(comparison: Comparison) -> str:
    """Return whether, when and with what a run left the band first, and what followed."""
    found = comparison.departures
    if comparison.why_not:
        return f'is not judged: {comparison.why_not}'
    if not found:
        return 'in range'
    first = found[0]
    text = f'out of range first at {moment(comparison, first.onset_s)}: {said(first)}'
    for other in found[1:1 + _MOST_FOLLOWERS]:
        later_s = comparison.run_s(other.onset_s) - comparison.run_s(first.onset_s)
        text += f'; {_later(later_s)} {other.signal.name}'
    rest = len(found) - 1 - _MOST_FOLLOWERS
    return text + (f'; and {rest} more' if rest > 0 else '')


def _later(seconds: float) -> str:
    if abs(seconds) < 0.1:
        return 'at the same time'
    return f'{seconds:.1f} s later' if seconds > 0 else f'{-seconds:.1f} s before, faintly,'


def band_text(band: Band) -> str:
    """Return what a band is made of."""
    if band.rate is None:
        runs = 'one good run' if band.runs == 1 else f'{band.runs} good runs'
        return f'what {runs} did, and a tolerance around it'
    return f'learned from {band.runs} good runs: {100 * band.rate:g} % of good runs leave it'
