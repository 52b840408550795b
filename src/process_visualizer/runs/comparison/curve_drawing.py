# SPDX-License-Identifier: BSD-3-Clause
"""A signal of a run over its band, around its first departure, as SVG."""
from __future__ import annotations

from typing import Callable, List, Tuple

import numpy as np

from process_visualizer.runs.comparison.comparison import Comparison, GoodRuns
from process_visualizer.runs.comparison.wording import clock, quantity
from process_visualizer.runs.deviation.departures import Departure, outside

_WIDTH, _HEIGHT, _LEFT, _BOTTOM, _TOP = 900, 220, 90, 24, 8
_BEFORE_S, _BEHIND_S, _LONGEST_S = 3.0, 5.0, 20.0
_MOST_POINTS = 800

Scale = Callable[[np.ndarray], np.ndarray]


def curve_drawing(good: GoodRuns, comparison: Comparison, departure: Departure) -> str:
    """Return an ``<svg>``: time is the run's, in the clock of its recording."""
    rows = _rows(good.times_s, departure)
    times_s = comparison.run.begin_s + comparison.alignment.time_map.to_run(good.times_s[rows])
    values = comparison.columns[departure.signal][rows]
    band = comparison.band.signals[departure.signal]
    middle, half = band.middle[rows], band.half_width[rows]
    x = _scale(times_s, _LEFT, _WIDTH - 4)
    y = _scale(np.concatenate((values, middle - half, middle + half)), _HEIGHT - _BOTTOM, _TOP)
    is_out = outside(comparison.columns[departure.signal], band)[rows]
    parts = [_polygon(x(times_s), y(middle - half), y(middle + half)),
             _line(x(times_s), y(middle), '#7a8590', 1.0), _line(x(times_s), y(values), '#1f6f9f'),
             _line(x(times_s), y(np.where(is_out, values, np.nan)), '#c0392b', 2.5)]
    onset_s = comparison.run.begin_s + comparison.run_s(departure.onset_s)
    parts += _axes(times_s, np.concatenate((values, middle - half, middle + half)), departure, x, y)
    parts.append(f'<path d="M{x(np.array([onset_s]))[0]:.1f} {_TOP}V{_HEIGHT - _BOTTOM}" '
                 'stroke="#c0392b" stroke-dasharray="4 3"/>')
    return (f'<svg viewBox="0 0 {_WIDTH} {_HEIGHT}" width="100%" font-size="12" '
            f'fill="none" role="img">{"".join(parts)}</svg>')


def _rows(times_s: np.ndarray, departure: Departure) -> np.ndarray:
    end_s = min(max(departure.left_s, departure.worst_s) + _BEHIND_S,
                departure.left_s + _LONGEST_S)
    begin, end = np.searchsorted(times_s, (departure.onset_s - _BEFORE_S, end_s))
    step = max(int(end - begin) // _MOST_POINTS, 1)
    return np.arange(begin, end, step)


def _scale(values: np.ndarray, low: float, high: float) -> Scale:
    known = values[np.isfinite(values)]
    least, most = (float(known.min()), float(known.max())) if len(known) else (0.0, 1.0)
    span = most - least or 1.0
    return lambda given: low + (given - least) / span * (high - low)


def _points(x: np.ndarray, y: np.ndarray) -> str:
    return ' '.join(f'{a:.1f},{b:.1f}' for a, b in zip(x.tolist(), y.tolist()))


def _polygon(x: np.ndarray, low: np.ndarray, high: np.ndarray) -> str:
    known = np.isfinite(low) & np.isfinite(high)
    outline = _points(np.concatenate((x[known], x[known][::-1])),
                      np.concatenate((low[known], high[known][::-1])))
    return f'<polygon points="{outline}" fill="#dde6ec"/>'


def _line(x: np.ndarray, y: np.ndarray, color: str, width: float = 1.5) -> str:
    known = np.isfinite(y)
    edges = np.flatnonzero(np.diff(np.concatenate(([False], known, [False])).astype(np.int8)))
    return ''.join(f'<polyline points="{_points(x[begin:end], y[begin:end])}" stroke="{color}" '
                   f'stroke-width="{width}"/>' for begin, end in edges.reshape(-1, 2))


def _axes(times_s: np.ndarray, values: np.ndarray, departure: Departure, x: Scale,
          y: Scale) -> List[str]:
    texts: List[str] = []
    known = values[np.isfinite(values)]
    for value in (float(known.min()), float(known.max())) if len(known) else ():
        place = float(y(np.array([value]))[0])
        texts.append(_text(_LEFT - 6, min(max(place + 4, 14), _HEIGHT - _BOTTOM),
                           quantity(departure.signal, value), 'end'))
    for time_s in _ticks(float(times_s[0]), float(times_s[-1])) if len(times_s) else ():
        place = float(x(np.array([time_s]))[0])
        texts.append(_text(place, _HEIGHT - 6, clock(time_s)[:-3], 'middle'))
    return texts


def _ticks(begin_s: float, end_s: float) -> Tuple[float, ...]:
    step_s = next((it for it in (1, 2, 5, 10, 30, 60, 300) if (end_s - begin_s) / it < 11), 600)
    return tuple(float(it) for it in np.arange(np.ceil(begin_s / step_s), end_s / step_s) * step_s)


def _text(x: float, y: float, text: str, anchor: str) -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}" fill="#5c6670">{text}</text>'
