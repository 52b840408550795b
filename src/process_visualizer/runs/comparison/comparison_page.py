# SPDX-License-Identifier: BSD-3-Clause
"""Comparisons as one page of HTML that needs nothing else."""
from __future__ import annotations

from base64 import b64encode
from html import escape
from typing import Callable, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from process_visualizer.runs.comparison.comparison import Comparison, GoodRuns
from process_visualizer.runs.comparison.comparison_text import drift_text
from process_visualizer.runs.comparison.features import drifts
from process_visualizer.runs.comparison.wording import (
    amount,
    band_text,
    clock,
    moment,
    nearest_text,
    quantity,
    unjudged_texts,
    verdict,
)
from process_visualizer.runs.deviation.departures import Departure, outside

_WIDTH, _HEIGHT, _LEFT, _BOTTOM, _TOP = 900, 220, 90, 24, 8
_BEFORE_S, _BEHIND_S, _MAX_S = 3.0, 5.0, 20.0
_MAX_POINTS = 800

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
                departure.left_s + _MAX_S)
    begin, end = np.searchsorted(times_s, (departure.onset_s - _BEFORE_S, end_s))
    step = max(int(end - begin) // _MAX_POINTS, 1)
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


# Pictures of one moment of two runs, and which moment it is.

_AT_MOST_S = 1.0


class ScenePair(NamedTuple):
    """Pictures (JPEG) of the reference at one of its times [s], and of the run, with a ghost."""

    reference_s: float
    good: bytes
    poor: bytes


def shown_s(departure: Departure) -> float:
    """Return the time of the reference [s] at which a departure can be seen.

    Where it began there is nothing to be seen yet: it is when it was worst, but at most a second
    after it left the band.
    """
    return min(max(departure.left_s, departure.worst_s), departure.left_s + _AT_MOST_S)


_MAX_DRAWN, _MAX_ROWS, _MAX_CURVES = 40, 12, 4
"""Of so many runs, the worst, there are curves: each takes some 50 kB."""
_STYLE = '''
body { font: 15px/1.45 sans-serif; color: #23292f; background: #fff; max-width: 62em;
       margin: 2em auto; padding: 0 1em; }
h1 { font-size: 1.4em; } h2 { font-size: 1.15em; margin-top: 2em; }
table { border-collapse: collapse; } td, th { text-align: left; padding: .25em .8em .25em 0;
       border-bottom: 1px solid #e2e6ea; vertical-align: top; }
th { color: #5c6670; font-weight: normal; } .poor { color: #c0392b; } .good { color: #247a4b; }
.note { color: #5c6670; } figure { margin: 1em 0; } figcaption { color: #5c6670; }
.pair { display: flex; gap: 1em; } .pair figure { flex: 1; margin: .5em 0; }
img { width: 100%; border-radius: 4px; }
'''


def comparison_page(good: GoodRuns, comparisons: Sequence[Comparison],
                    scenes: Sequence[Optional[ScenePair]] = (), note: str = '') -> str:
    """Return the page: a line for each run, then what departed in the poor ones.

    Args:
        good: the runs that the others were held against.
        comparisons: what came of those.
        scenes: pictures for each of them, or none at all.
        note: what else is to be told, such as why there are no pictures.
    """
    poor = [it for it in comparisons if it.departures]
    title = f'{len(poor)} of {len(comparisons)} runs out of range' if len(comparisons) > 1 \
        else f'{comparisons[0].run.name} {verdict(comparisons[0])}'
    parts = [f'<h1>{escape(title)}</h1>',
             f'<p>Reference: {escape(good.reference.name)}, '
             f'{good.reference.duration_s:.1f} s. Band: {escape(band_text(good.band))}.</p>']
    parts += [f'<p class="note">{escape(it)}</p>' for it in (*good.notes, note) if it]
    if len(comparisons) > 1:
        parts += [f'<p>{escape(drift_text(it))}.</p>' for it in drifts(comparisons)]
        parts.append(_summary(comparisons))
    parts += [f'<p class="note">{escape(f"{it.run.name}: {text}")}</p>'
              for it in comparisons if not it.departures for text in unjudged_texts(it)]
    pictures = dict(zip(map(id, comparisons), scenes))
    drawn = {id(it) for it in sorted(poor, key=lambda it: -it.badness)[:_MAX_DRAWN]}
    for it in poor:
        parts += _details(good.of(it.run) or good, it, pictures.get(id(it)), id(it) in drawn)
    return ('<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8">'
            f'<title>{escape(title)}</title><style>{_STYLE}</style></head>\n<body>\n'
            + '\n'.join(parts) + '\n</body></html>\n')


def _summary(comparisons: Sequence[Comparison]) -> str:
    rows = [f'<tr><td>{escape(it.run.name)}</td><td>{clock(it.run.begin_s)}</td>'
            f'<td class="{"poor" if it.departures or it.why_not else "good"}">'
            f'{escape(verdict(it))}</td><td>{escape(nearest_text(it))}</td></tr>'
            for it in sorted(comparisons, key=lambda it: (not it.why_not, -it.badness))]
    return _table(('run', 'begins at', 'verdict', 'nearest to leaving, or farthest out'), rows)


def _table(head: Sequence[str], rows: Sequence[str]) -> str:
    cells = ''.join(f'<th>{escape(it)}</th>' for it in head)
    return f'<table><tr>{cells}</tr>\n' + '\n'.join(rows) + '</table>'


def _details(good: GoodRuns, comparison: Comparison, scene: Optional[ScenePair],
             is_drawn: bool) -> List[str]:
    name = escape(comparison.run.name)
    parts = [f'<h2>{name}</h2>', f'<p class="poor">{escape(verdict(comparison))}</p>']
    parts += [f'<p class="note">{escape(note)}</p>'
              for note in (*comparison.notes, *unjudged_texts(comparison))]
    rows = [f'<tr><td>{number}</td><td>{escape(it.signal.name)}</td>'
            f'<td>{escape(moment(comparison, it.onset_s))} ± {it.uncertainty_s:.2f} s</td>'
            f'<td>{escape(moment(comparison, it.worst_s))}</td><td>{escape(amount(it))}</td></tr>'
            for number, it in enumerate(comparison.departures[:_MAX_ROWS], start=1)]
    parts.append(_table(('', 'what', 'began', 'was worst', 'by how much'), rows))
    parts += [] if scene is None else _pictures(good, comparison, scene)
    parts += [f'<figure>{curve_drawing(good, comparison, it)}<figcaption>'
              f'{escape(it.signal.name)}: the run (red where it is outside), the band and its '
              'middle</figcaption></figure>'
              for it in comparison.departures[:_MAX_CURVES if is_drawn else 0]]
    return parts


def _pictures(good: GoodRuns, comparison: Comparison, scene: ScenePair) -> List[str]:
    """The good run beside the poor one."""
    reference = good.reference
    return ['<div class="pair">',
            _picture(scene.good, f'Good: {reference.name} at '
                                 f'{clock(reference.begin_s + scene.reference_s)}'),
            _picture(scene.poor, f'Poor: {comparison.run.name} at '
                                 f'{moment(comparison, scene.reference_s)}; the good one as a '
                                 'ghost, and how far each tool is from it'), '</div>']


def _picture(jpeg: bytes, caption: str) -> str:
    return (f'<figure><img src="data:image/jpeg;base64,{b64encode(jpeg).decode()}" '
            f'alt="{escape(caption)}"><figcaption>{escape(caption)}</figcaption></figure>')
