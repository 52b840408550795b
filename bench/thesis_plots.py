# SPDX-License-Identifier: BSD-3-Clause
"""Plots the thesis' figures 6.14, 6.16 and 6.17 with measurements of this system.

The figures themselves are pictures, from which no values are read: beside the curves are the
numbers of table 6.2 and of the text.
"""
from __future__ import annotations

from pathlib import Path
from typing import List, Mapping, Sequence

import numpy as np
from panel_plot import Curve, Level, Panel, write_panels
from thesis_run import Stream, ThesisRun
from thesis_values import FORCE, PLAYED_STEPS_S, TABLE_6_2, TOOL_FRAME

_TOOL_TOPIC, _FORCE_TOPIC = '/ur_rt_lower/tcf', '/ft_lower/ft'
_MAX_SHIFT = 3  # messages
_AXES = (('x', '#1864ab'), ('y', '#2b8a3e'), ('z', '#e67700'))
_MAX_STEPS = 4
_STEP_TICKS_MS = (0.01, 0.1, 1.0, 10.0, 100.0, 1000.0)


def write_plots(folder: str, runs: Mapping[int, ThesisRun]) -> None:
    """Write the three plots of runs with 30, 10 and 0 images a second into a folder."""
    Path(folder).mkdir(parents=True, exist_ok=True)
    _write_forces(f'{folder}/thesis_6_14.png', runs[30])
    _write_steps(f'{folder}/thesis_6_16.png', runs)
    _write_without_kinect(f'{folder}/thesis_6_17.png', runs[0])


def _write_forces(path: str, run: ThesisRun) -> None:
    live, played = run.published[_FORCE_TOPIC], run.played[_FORCE_TOPIC]
    rows = []
    for number, (axis, color) in enumerate(_AXES):
        ticks = round_ticks(np.concatenate([live.values[:, number], played.values[:, number]]))
        rows.append([_component(title, stream, number, axis, color, ticks, 'F{} [N]')
                     for title, stream in (('live', live), ('played', played))])
    write_panels(path, 'Force on the lower tool, 30 images a second (thesis, figure 6.14)', rows,
                 f'{_difference(live, played)} The thesis gives no numbers for its figure; it '
                 'calls force live and played almost identical.')


def _component(title: str, stream: Stream, number: int, axis: str, color: str,
               ticks: Sequence[float], quantity: str) -> Panel:
    return Panel(f'F{axis}, {title}', quantity.format(axis),
                 [Curve(stream.time_s, stream.values[:, number], color=color)], ticks)


def _difference(live: Stream, played: Stream) -> str:
    """Return whether the same numbers came in the same order.

    In live data, the first and last recorded messages are known only by their time, so that there
    may be one message more or less at the ends.
    """
    for shift in sorted(range(-_MAX_SHIFT, _MAX_SHIFT + 1), key=abs):
        ones, others = live.values[max(shift, 0):], played.values[max(-shift, 0):]
        count = min(len(ones), len(others))
        if count and np.array_equal(ones[:count], others[:count]):
            return (f'{count} messages came live and played, with the same numbers, in the same '
                    'order.')
    return f'{len(live.values)} messages came live, {len(played.values)} played; they differ.'



def _write_steps(path: str, runs: Mapping[int, ThesisRun]) -> None:
    rows = [[_steps('live, 30 images a second', runs[30].published[_TOOL_TOPIC],
                    TABLE_6_2[30][TOOL_FRAME].published)]]
    for image_hz in (30, 10):
        rows.append([_steps(f'played, {image_hz} images a second',
                            runs[image_hz].played[_TOOL_TOPIC],
                            TABLE_6_2[image_hz][TOOL_FRAME].played, with_range=True)])
    write_panels(path, 'Time from one tool frame to the next (thesis, figure 6.16)', rows,
                 'Blue: this system, when each message came to a subscriber. Red: the thesis; the '
                 'mean is that of the rate in table 6.2, shortest and longest are those that its '
                 'text gives for both played cases (in ms there, but only s agree with the rates).')


def _steps(title: str, stream: Stream, thesis_hz: float, with_range: bool = False) -> Panel:
    levels: List[Level] = [Level(1e3 / thesis_hz, f'thesis: mean {1e3 / thesis_hz:.1f} ms')]
    if with_range:
        levels += [Level(1e3 * step_s, f'thesis: {word} {1e3 * step_s:g} ms')
                   for word, step_s in zip(('shortest', 'longest'), PLAYED_STEPS_S)]
    steps_ms = 1e3 * stream.steps_s()
    middle, low, high = np.percentile(steps_ms, [50, 0, 100])
    return Panel(f'{title}: median {middle:.2f} ms, {low:.2g} to {high:.3g} ms', 'Δt [ms]',
                 [Curve(stream.time_s[1:], steps_ms, points=True)], _STEP_TICKS_MS, levels, True)


def _write_without_kinect(path: str, run: ThesisRun) -> None:
    curves = [Curve(run.velocity.time_s, run.velocity.values[:, number], f'v{axis}', color)
              for number, (axis, color) in enumerate(_AXES)]
    rows = [
        [Panel('velocity of the lower tool', 'v [m/s]', curves,
               round_ticks(run.velocity.values.flatten()))],
        [_steps('tool frame', run.played[_TOOL_TOPIC], TABLE_6_2[0][TOOL_FRAME].played)],
        [_steps('force', run.played[_FORCE_TOPIC], TABLE_6_2[0][FORCE].played)]]
    write_panels(path, 'Played without the Kinect (thesis, figure 6.17)', rows,
                 'Blue points: this system, when each message came to a subscriber. Red: the mean '
                 'of the rate in table 6.2 (its drivers sent tool frames at 10 Hz in this test, '
                 'here at 125 Hz). The thesis gives no numbers for the velocity; it calls it '
                 'smooth.')


def round_ticks(values: np.ndarray) -> Sequence[float]:
    """Return round values (m,), three to six of them, whose ends enclose all values (n,)."""
    low, high = (float(values.min()), float(values.max())) if len(values) else (0.0, 0.0)
    least = max(high - low, 1e-3) / _MAX_STEPS
    unit = 10.0 ** np.floor(np.log10(least))
    step = unit * next(it for it in (1.0, 2.0, 5.0, 10.0) if it * unit >= least)
    first, last = np.floor(low / step), max(np.ceil(high / step), np.floor(low / step) + 2)
    return tuple(float(it) for it in np.arange(first, last + 1) * step)
