# SPDX-License-Identifier: BSD-3-Clause
"""Refines when a departure began, from the values of the channel that has departed.

A comparison finds departures in means, which change gradually. The values themselves show the
onset more exactly: noise begins with its first fast change, a signal that became too smooth lacks
fast changes from then on, and one that is sent rarely has changed between two of its values.
"""
from __future__ import annotations

from typing import Sequence

import numpy as np

from process_visualizer.runs.alignment.alignment import Alignment
from process_visualizer.runs.deviation.band import Band
from process_visualizer.runs.deviation.channel_faults import (
    UsualCourse,
    rough_since_s,
    seldom_since_s,
    vibration_hz,
)
from process_visualizer.runs.deviation.departures import Departure
from process_visualizer.runs.deviation.signals import RATE_HZ, SignalKind
from process_visualizer.runs.run import Run
from process_visualizer.runs.series import ROUGH_S, period_s

_ROUGH_KNOWN_S, _ROUGH_PERIODS = 0.1, 4.0
"""Uncertainty of when a channel became rough: at least this time [s], and so many periods."""


def refined_onset(it: Departure, found: Sequence[Departure], run: Run, alignment: Alignment,
                  band: Band, times_s: np.ndarray) -> Departure:
    """Return a departure with an onset that is as exact as the channel's own values allow.

    If the value itself departs more clearly at the same time, noise is only the jump of the value:
    its onset is left as it is. ``found`` are all departures of the run, ``times_s`` (t,) the
    moments of the reference.
    """
    if it.signal.period_s:
        return _onset_of_rare_signal(it, run, alignment, band, times_s)
    channel = run.by_key.get(it.channel)
    if channel is not None:  # a value is known to within one period
        it = it._replace(uncertainty_s=max(it.uncertainty_s, period_s(channel.times_s)))
    if any(_is_jump_of(it, other) for other in found):
        return it
    return _onset_of_roughness(_onset_of_smoothness(it, alignment), run, alignment, band)


def with_frequency(it: Departure, run: Run, alignment: Alignment, end_s: float) -> Departure:
    """Return a departure; if it is noise, with the frequency of a vibration, if any.

    A departure without an end lasts to ``end_s`` of the reference [s].
    """
    channel = run.by_key.get(it.channel)
    if it.signal.kind is not SignalKind.NOISE or it.deviation < 0.0 or channel is None:
        return it
    ends_s = np.array([it.left_s, end_s if it.back_s is None else it.back_s])
    frequency_hz = vibration_hz(channel, *alignment.time_map.to_run(ends_s).tolist())
    return it._replace(frequency_hz=frequency_hz)


def _is_jump_of(noise: Departure, value: Departure) -> bool:
    return noise.signal.kind is SignalKind.NOISE and value.signal.kind is not SignalKind.NOISE \
        and value.channel == noise.channel and value.severity > noise.severity \
        and abs(value.left_s - noise.left_s) < ROUGH_S


def _onset_of_smoothness(it: Departure, alignment: Alignment) -> Departure:
    """Return a departure; if it is too smooth, its onset is when its fast changes ended.

    Roughness is measured over ``ROUGH_S``, so it falls that long after the last fast changes.
    """
    if it.signal.kind is not SignalKind.NOISE or it.signal.over_s or it.deviation > 0.0:
        return it
    run_s = alignment.time_map.to_run(np.array([it.left_s])) - ROUGH_S
    since_s = max(float(alignment.time_map.to_reference(run_s)[0]), 0.0)
    return it._replace(onset_s=min(it.onset_s, since_s))


def _onset_of_rare_signal(it: Departure, run: Run, alignment: Alignment, band: Band,
                          times_s: np.ndarray) -> Departure:
    """Return a departure of a signal that is sent rarely: it began between two of its values."""
    if it.channel not in run.by_key:
        return it
    at_s = alignment.time_map.to_run(times_s)
    left_s, worst_s = alignment.time_map.to_run(np.array([it.left_s, it.worst_s])).tolist()
    found = seldom_since_s(run.by_key[it.channel], left_s, worst_s, at_s, band.signals[it.signal])
    if found is None:
        return it
    ends_s = np.maximum(alignment.time_map.to_reference(np.array(found)), 0.0)
    middle_s, half_s = float(ends_s.mean()), 0.5 * float(np.ptp(ends_s))
    return it._replace(onset_s=middle_s, uncertainty_s=half_s)


def _onset_of_roughness(it: Departure, run: Run, alignment: Alignment, band: Band) -> Departure:
    """Return a departure; if it is too rough, its onset is that of its fast changes."""
    if it.signal.kind is not SignalKind.NOISE or it.deviation < 0.0:
        return it
    key = it.channel
    usual = {signal.kind is SignalKind.NOISE: limits.usual for signal, limits in
             band.signals.items() if not signal.over_s and signal.device == key[0]
             and signal.label in (key[1], it.signal.label)}
    rough, value = usual.get(True), usual.get(False)
    if rough is None or value is None or key not in run.by_key:
        return it
    at_s = alignment.time_map.to_run(np.arange(len(rough)) / RATE_HZ)
    about_s, left_s = alignment.time_map.to_run(np.array([it.onset_s, it.left_s])).tolist()
    since = rough_since_s(run.by_key[key], about_s, left_s, UsualCourse(at_s, value, rough))
    if since is None:
        return it
    since_s, known_s = since
    onset_s = float(alignment.time_map.to_reference(np.array([since_s]))[0])
    known_s = max(known_s, _ROUGH_KNOWN_S, _ROUGH_PERIODS * period_s(run.by_key[key].times_s))
    return it._replace(onset_s=max(onset_s, 0.0), uncertainty_s=known_s)
