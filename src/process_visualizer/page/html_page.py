# SPDX-License-Identifier: BSD-3-Clause
"""The file of a page: the words as HTML, which need nothing else, and what plays the runs."""
from __future__ import annotations

import json
import os
from base64 import b64encode
from datetime import datetime, timezone
from hashlib import sha256
from html import escape
from typing import Any, Dict, List, NamedTuple, Sequence

import rospkg

from process_visualizer.page.packed import Packed
from process_visualizer.robot.arrows import (
    DEVIATION_COLOR,
    DEVIATION_DIAMETER_M,
    EXAGGERATION,
    GHOST_COLOR,
    MAX_DEVIATION_M,
    MIN_DEVIATION_M,
)
from process_visualizer.runs.comparison.wording import clock

_PACKAGE = 'process_visualizer'
GHOST_STYLE = {
    'color': GHOST_COLOR, 'deviation': DEVIATION_COLOR, 'diameter': DEVIATION_DIAMETER_M,
    'exaggeration': EXAGGERATION, 'least': MIN_DEVIATION_M, 'longest': MAX_DEVIATION_M}
"""Of the reference on a page, for JSON."""


class PageParts(NamedTuple):
    """Contents of a page: runs and meshes as data, the columns that they refer to, and words.

    ``listed`` are the words of further runs, of which there is no data.
    """

    title: str
    subtitle: str
    runs: Sequence[Dict[str, Any]]
    meshes: Sequence[Dict[str, Any]]
    packed: Packed
    notes: Sequence[str] = ()
    listed: Sequence[Dict[str, Any]] = ()
    cell: str = ''


def page_html(parts: PageParts) -> str:
    """Return the page: one file that asks no network for anything."""
    packages = rospkg.RosPack()
    script, style = web_file('page.js'), web_file('page.css')
    data = {'runs': parts.runs, 'meshes': parts.meshes, 'ghost': GHOST_STYLE}
    policy = (f"default-src 'none'; script-src {_hash(script)}; style-src {_hash(style)}; "
              "img-src data:; form-action 'none'; base-uri 'none'")
    return '\n'.join([
        '<!DOCTYPE html>', '<html lang="en">', '<head>', '<meta charset="utf-8">',
        f'<meta http-equiv="Content-Security-Policy" content="{escape(policy)}">',
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        f'<title>{escape(parts.title)}</title>', '<link rel="icon" href="data:,">',
        f'<style>{style}</style>', '</head>', '<body>', *_words(parts),
        f'<footer>{escape(_origin(parts, packages))}</footer>',
        f'<script type="application/json" id="data">{_json(data)}</script>',
        f'<script type="text/plain" id="columns">{parts.packed.text()}</script>',
        f'<script>{script}</script>', '</body>', '</html>', ''])


def _words(parts: PageParts) -> List[str]:
    """Return what is read without any script."""
    shown = 'shown'
    found = ['<header>', f'<h1>{escape(parts.title)}</h1>',
             f'<p class="sub">{escape(parts.subtitle)}</p>']
    found += [f'<p class="note">{escape(it)}</p>' for it in parts.notes]
    if len(parts.runs) + len(parts.listed) > 1:
        found.append(_summary(parts))
    for number, run in enumerate(parts.runs):
        found += [f'<section data-run="{number}" class="{shown if number == 0 else ""}">',
                  f'<p class="verdict {run["state"]}">{_verdict(run)}</p>', '</section>']
    found += ['</header>', '<main>', '<div id="player"></div>',
              '<section id="side" aria-label="Departures and values">']
    for number, run in enumerate(parts.runs):
        if run['departures']:
            found += [f'<section data-run="{number}" id="departures" class="panel '
                      f'{shown if number == 0 else ""}">' if number == 0 else
                      f'<section data-run="{number}" class="panel">',
                      '<h2>What differed, the first one first</h2>',
                      _departures(number, run), '</section>']
    found += ['<section class="panel" id="values"><h2>At this moment</h2>'
              '<table><tbody id="numbers"></tbody></table></section>', '</section>', '</main>',
              '<aside aria-label="Notes">']
    for number, run in enumerate(parts.runs):
        found += [f'<section data-run="{number}" class="{shown if number == 0 else ""}">',
                  *(f'<p class="note">{escape(it)}</p>' for it in run['notes']), '</section>']
    return [*found, '</aside>']


def _verdict(run: Dict[str, Any]) -> str:
    """The words before the first colon or comma are what counts."""
    text = str(run['verdict'])
    head, separator, rest = text.partition(' first at ')
    return f'<b>{escape(head)}</b>{escape(separator + rest)}'


def _summary(parts: PageParts) -> str:
    rows = [_row(run, _link(number, run['begin'], run['name']))
            for number, run in enumerate(parts.runs)]
    rows += [_row(run, escape(run['name'])) for run in parts.listed]
    note = '' if not parts.listed else (
        f'<p class="note">The page has room for {len(parts.runs)} of these runs, the worst ones; '
        'the others are listed only.</p>')
    nearest = '<th>nearest to leaving, or farthest out</th>' \
        if any(it['nearest'] for it in parts.runs) else ''
    return (f'<div class="panel runs"><table><tr><th>run</th><th>begins at</th><th>verdict</th>'
            f'{nearest}</tr>' + ''.join(rows) + f'</table>{note}</div>')


def _row(run: Dict[str, Any], name: str) -> str:
    nearest = f'<td>{escape(run["nearest"])}</td>' if run['nearest'] else ''
    return (f'<tr><td>{name}</td><td>{clock(run["begin"])}</td>'
            f'<td class="{run["state"]}-text">{escape(run["verdict"])}</td>{nearest}</tr>')


def _departures(number: int, run: Dict[str, Any]) -> str:
    rows = [f'<tr><td><span class="number">{row}</span></td><td>{escape(it["what"])}<br>'
            f'{escape(it["amount"])}</td><td>{_link(number, it["began_s"], it["began"])}</td>'
            f'<td>{_link(number, it["worst_s"], it["worst"])}</td></tr>'
            for row, it in enumerate(run['departures'], start=1)]
    more = f'<p class="note">and {run["more"]} more</p>' if run.get('more') else ''
    return ('<div class="departures">'
            '<table><tr><td></td><th>what, and by how much</th>'
            '<th>began</th><th>was worst</th></tr>' + ''.join(rows) + f'</table>{more}</div>')


def _link(run: int, time_s: float, text: str) -> str:
    return (f'<a class="go" href="#t={time_s:.2f}" data-run="{run}" data-time="{time_s:.4f}">'
            f'{escape(text)}</a>')


def _origin(parts: PageParts, packages: rospkg.RosPack) -> str:
    """Return where and when it was recorded, and what made the page."""
    runs = list(parts.runs)
    recorded = '' if not runs else datetime.fromtimestamp(
        runs[0]['recorded'], timezone.utc).strftime('Recorded %Y-%m-%d %H:%M UTC. ')
    version = packages.get_manifest(_PACKAGE).version
    return (f'{recorded}{f"Cell: {parts.cell}. " if parts.cell else ""}Made by {_PACKAGE} '
            f'{version}; three.js (MIT) draws the scene.')


def _json(data: Dict[str, Any]) -> str:
    """Return JSON that cannot end the element that it is in; NaN is refused."""
    text = json.dumps(data, separators=(',', ':'), allow_nan=False)
    return text.replace('<', '\\u003c').replace('>', '\\u003e').replace('&', '\\u0026')


def _hash(text: str) -> str:
    """Return how a policy names a script or style in the page itself."""
    return f"'sha256-{b64encode(sha256(text.encode()).digest()).decode()}'"


def web_file(name: str) -> str:
    """Return a file of web/dist.

    Raises:
        OSError: it is not there.
    """
    path = os.path.join(rospkg.RosPack().get_path(_PACKAGE), 'web', 'dist', name)
    with open(path, encoding='utf-8') as file:
        return file.read()


LIVE_POLICY = ("default-src 'none'; script-src 'self'; style-src 'self'; img-src data:; "
               "connect-src 'self'; form-action 'none'; base-uri 'none'; frame-ancestors 'none'")
"""What the page of a running cell may do: nothing with any other address."""


def live_html(title: str, notes: Sequence[str]) -> str:
    """Return the page of a running cell; everything in it comes from beside its own address."""
    return '\n'.join([
        '<!DOCTYPE html>', '<html lang="en">', '<head>', '<meta charset="utf-8">',
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        f'<title>{escape(title)}</title>', '<link rel="icon" href="data:,">',
        '<link rel="stylesheet" href="page.css">', '</head>', '<body>',
        '<header>', f'<h1>{escape(title)}</h1>',
        '<p class="link" id="link" role="status">Connecting …</p>',
        '<noscript><p class="verdict poor">This page needs JavaScript.</p></noscript>',
        '<p class="verdict plain" id="verdict" hidden></p>', '</header>',
        '<main>', '<div id="player"></div>', '<section id="side" aria-label="Values and events">',
        '<section class="panel" id="values"><h2>At this moment</h2>'
        '<table><tbody id="numbers"></tbody></table></section>',
        '<section class="panel" id="happened"><h2>Alarms</h2><ul id="alarms"></ul>'
        '<h2>Recording</h2><p class="sub" id="recording"></p>'
        '<h2>What happened</h2><ul id="events"></ul></section>', '</section>', '</main>',
        '<footer>', *(f'<p class="note">{escape(it)}</p>' for it in notes),
        'This page only shows: nothing on it changes the cell. '
        '<span id="viewers"></span></footer>',
        '<script src="page.js" defer></script>', '</body>', '</html>', ''])
