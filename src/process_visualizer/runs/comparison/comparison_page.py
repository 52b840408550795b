# SPDX-License-Identifier: BSD-3-Clause
"""Comparisons as one page of HTML that needs nothing else."""
from __future__ import annotations

from base64 import b64encode
from html import escape
from typing import List, Optional, Sequence

from process_visualizer.runs.comparison.comparison import Comparison, GoodRuns
from process_visualizer.runs.comparison.comparison_text import drift_text
from process_visualizer.runs.comparison.curve_drawing import curve_drawing
from process_visualizer.runs.comparison.drift import drifts
from process_visualizer.runs.comparison.scene_pair import ScenePair
from process_visualizer.runs.comparison.verdict import band_text, verdict
from process_visualizer.runs.comparison.wording import (
    amount,
    clock,
    moment,
    nearest_text,
    unjudged_texts,
)

_MOST_DRAWN, _MOST_ROWS, _MOST_CURVES = 40, 12, 4
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
    pictures = dict(zip(map(id, comparisons), scenes))
    drawn = {id(it) for it in sorted(poor, key=lambda it: -it.badness)[:_MOST_DRAWN]}
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
            for number, it in enumerate(comparison.departures[:_MOST_ROWS], start=1)]
    parts.append(_table(('', 'what', 'began', 'was worst', 'by how much'), rows))
    parts += [] if scene is None else _pictures(good, comparison, scene)
    parts += [f'<figure>{curve_drawing(good, comparison, it)}<figcaption>'
              f'{escape(it.signal.name)}: the run (red where it is outside), the band and its '
              'middle</figcaption></figure>'
              for it in comparison.departures[:_MOST_CURVES if is_drawn else 0]]
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
