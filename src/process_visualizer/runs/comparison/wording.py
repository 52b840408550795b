# SPDX-License-Identifier: BSD-3-Clause
"""Verdicts, deviations and times in the words that operators read."""
from __future__ import annotations

import math
from typing import Dict, List, Optional, Tuple

from process_visualizer.figures import clock_text
from process_visualizer.runs.comparison.comparison import Comparison, Missing
from process_visualizer.runs.comparison.features import phase_at
from process_visualizer.runs.deviation.band import Band
from process_visualizer.runs.deviation.departures import Departure
from process_visualizer.runs.deviation.signals import (
    FORCE_DIRECTION,
    SLOWER_LABEL,
    TORQUE_DIRECTION,
    Signal,
    SignalKind,
)

_NEAR_EVENT_S, _MAX_UNCERTAINTY_S = 60.0, 0.5
"""Maximum age of the event that dates a moment, and maximum uncertainty of one time [s]: above it,
the text names two times."""
_MAX_NAMES = 4
_SIDES = {'tool along': ('ahead along its path', 'behind along its path'),
          'tool sideways': ('to the left of its path', 'to the right of its path'),
          'tool up': ('above its path', 'below its path')}
"""Words for the place of a tool: for values above 0, and below."""


def moment(comparison: Comparison, reference_s: float) -> str:
    """Return a time of the reference as the run's, with the event before it.

    The clock is that of the run's recording, so that the moment can be found in the player.
    """
    run = comparison.run
    run_s = comparison.run_s(reference_s)
    text = clock_text(run.begin_s + run_s)
    before = [event for event in run.events if run_s - _NEAR_EVENT_S < event.time_s <= run_s + 0.05]
    if not before:
        return text
    event = max(before, key=lambda it: it.time_s)
    return f'{text} ({event.name} + {max(run_s - event.time_s, 0.0):.1f} s)'


def began(comparison: Comparison, departure: Departure) -> str:
    """Return when a departure began: a moment and its uncertainty, or the time between two moments.

    Between two values of a signal that is sent rarely, it is unknown when it began.
    """
    at = moment(comparison, departure.onset_s)
    if not _is_between(departure):
        return f'{at} ± {departure.uncertainty_s:.2f} s'
    return _between(comparison, departure)


def _is_between(departure: Departure) -> bool:
    return departure.signal.period_s > 0.0 or departure.uncertainty_s > _MAX_UNCERTAINTY_S


def _between(comparison: Comparison, departure: Departure) -> str:
    earliest_s = max(departure.onset_s - departure.uncertainty_s, 0.0)
    latest_s = departure.onset_s + departure.uncertainty_s
    if not departure.signal.period_s:  # it began at the latest when it left
        latest_s = min(latest_s, max(departure.left_s, departure.onset_s))
    end = clock_text(comparison.run.begin_s + comparison.run_s(latest_s))
    every = f', with a value every {departure.signal.period_s:g} s' if departure.signal.period_s \
        else ''
    return f'between {moment(comparison, earliest_s)} and {end}{every}'


def unjudged_texts(comparison: Comparison) -> List[str]:
    """Return sentences about what is not judged, one for all signals that lack the same data.

    Where the motion lacks data, nothing is judged.
    """
    stretches: Dict[Tuple[str, Missing], List[Tuple[float, float]]] = {}
    for it in sorted(comparison.unjudged, key=lambda it: it.begin_s):
        name = 'anything' if it.why is Missing.MOTION else it.signal.name
        known = stretches.setdefault((name, it.why), [])
        begin_s, end_s = it.begin_s, it.end_s
        if known and begin_s <= known[-1][1]:
            begin_s, before_s = known.pop()
            end_s = max(end_s, before_s)
        known.append((begin_s, end_s))
    names: Dict[str, List[str]] = {}
    for (name, why), known in stretches.items():
        if why is not Missing.SELDOM:
            named = ', '.join(f'{clock_text(begin_s)} to {clock_text(end_s)}'
                              for begin_s, end_s in known[:3])
            more = f' and {len(known) - 3} more' if len(known) > 3 else ''
            names.setdefault(f'{named}{more} ({why.value})', []).append(name)
    texts = [f'not judged: {_some(of_these)} from {when}' for when, of_these in names.items()]
    seldom = [name for name, why in stretches if why is Missing.SELDOM]
    if seldom:
        texts.append(f'not judged: {", ".join(seldom)} ({Missing.SELDOM.value})')
    return texts


def _some(names: List[str]) -> str:
    """Return the first names, and how many others there are."""
    more = len(names) - _MAX_NAMES
    return ', '.join(names[:_MAX_NAMES]) + (f' and {more} more' if more > 0 else '')


def nearest_text(comparison: Comparison) -> str:
    """Return which signal came nearest to leaving its band, how near, and in which phase, or ''."""
    nearest = comparison.nearest
    if nearest is None or comparison.why_not:
        return ''
    time_s = comparison.run_s(nearest.time_s)
    return (f'{nearest.signal.name}, {100 * nearest.share:.0f} % of its band at '
            f'{clock_text(comparison.run.begin_s + time_s)} ({phase_at(comparison.run, time_s)})')


def amount(departure: Departure) -> str:
    """Return how far a signal was out at its worst, and how wide the band is there."""
    signal, value, half = departure.signal, departure.deviation, departure.half_width
    if departure.words:
        return departure.words
    if signal.kind is SignalKind.NOISE:
        at = '' if departure.frequency_hz is None else \
            f', it vibrates at {departure.frequency_hz:.3g} Hz'
        band = f'up to {math.exp(half):.2g}' if value > 0.0 else f'from {math.exp(-half):.2g}'
        return f'{math.exp(value):.2g} times as rough (band {band}){at}'
    if signal.label == SLOWER_LABEL:
        pace = 'slower' if value > 0.0 else 'faster'
        return f'{100 * abs(value):.1f} % {pace} (band ±{100 * half:.1f} %)'
    if departure.in_all_s is not None:
        in_all = _with_minus(f'{departure.in_all_s:+.3g}')
        return f'{in_all} {signal.unit} (band ±{quantity(signal, half)})'
    if signal.label in (FORCE_DIRECTION, TORQUE_DIRECTION):
        return f'turned by {value:.2g}° (band up to {half:.2g}°)'
    over = f' in the mean of {signal.over_s:g} s' if signal.over_s else ''
    sides = _SIDES.get(signal.label)
    if sides is not None and signal.kind is SignalKind.PLACE:
        far = quantity(signal, abs(value), digits=3)
        return f'{far} {sides[value < 0.0]}{over} (band ±{quantity(signal, half)})'
    return f'{quantity(signal, value, sign=True)}{over} (band ±{quantity(signal, half)})'


def said(departure: Departure) -> str:
    """Return which signal was out, and how far; for the place of a tool as one phrase."""
    signal = departure.signal
    if signal.label in _SIDES and signal.kind is SignalKind.PLACE and not departure.words:
        return f'{signal.device} tool {amount(departure)}'.strip()
    if signal.label == SLOWER_LABEL:
        return amount(departure)
    return f'{signal.name}{":" if departure.words else ","} {amount(departure)}'


def quantity(signal: Signal, value: float, sign: bool = False, digits: Optional[int] = None) -> str:
    """Return a value with its unit; places are in mm. With a sign it has 3 digits, else 2."""
    unit = signal.unit
    if signal.kind is SignalKind.PLACE:
        value, unit = 1000.0 * value, 'mm'
    text = f'{value:+.{digits or 3}g}' if sign else f'{value:.{digits or 2}g}'
    if 'e' in text and 1e-3 <= abs(value) < 1e6:
        text = f'{value:+.0f}' if sign else f'{value:.0f}'
    return f'{_with_minus(text)} {unit}'.strip()


def _with_minus(number: str) -> str:
    """Return a number with the minus sign that curves and axes have."""
    return number.replace('-', '−')


# The verdict on a run, in one sentence.

_MAX_FOLLOWERS = 2


def _without_departures(comparison: Comparison) -> str:
    if not comparison.has_gaps:
        return 'in range'
    unjudged_s = max(comparison.unjudged_s, 0.1)
    if comparison.is_judged_in_part:
        return (f'{unjudged_s:.1f} of {comparison.run.duration_s:.1f} s not judged (data '
                'missing or late); the rest is in range')
    return f'in range, {unjudged_s:.1f} s not judged (data missing or late)'


def verdict(comparison: Comparison) -> str:
    """Return whether a run left the band, when and with which signal first, and what followed.

    The noise of a value that left does not count as something else.
    """
    found = comparison.departures
    if comparison.why_not:
        return f'is not judged: {comparison.why_not}'
    if not found:
        return _without_departures(comparison)
    first = found[0]
    since = _between(comparison, first) if _is_between(first) \
        else f'at {moment(comparison, first.onset_s)}'
    text = f'out of range first {since}: {said(first)}'
    others = [it for it in found[1:] if it.channel != first.channel]
    for other in others[:_MAX_FOLLOWERS]:
        later_s = comparison.run_s(other.onset_s) - comparison.run_s(first.onset_s)
        text += f'; {_later(later_s)} {other.signal.name}'
    rest = len(others) - _MAX_FOLLOWERS
    return text + (f'; and {rest} more' if rest > 0 else '')


def _later(seconds: float) -> str:
    if abs(seconds) < 0.1:
        return 'at the same time'
    return f'{seconds:.1f} s later' if seconds > 0 else \
        f'already {-seconds:.1f} s earlier, but weakly,'


def band_text(band: Band) -> str:
    """Return in words what a band is made of."""
    if band.rate is None:
        runs = 'one good run' if band.runs == 1 else f'{band.runs} good runs'
        return f'what {runs} did, and a tolerance around it'
    return f'learned from {band.runs} good runs: {100 * band.rate:g} % of good runs leave it'
