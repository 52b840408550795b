# SPDX-License-Identifier: BSD-3-Clause
"""The file of a page: its text as HTML (web/templates), and the script that plays the runs."""
from __future__ import annotations

import json
import os
from base64 import b64encode
from datetime import datetime, timezone
from hashlib import sha256
from typing import Any, Dict, NamedTuple, Sequence

import rospkg

from process_visualizer.figures import clock_text
from process_visualizer.page.packed import Packed
from process_visualizer.robot.arrows import (
    DEVIATION_COLOR,
    DEVIATION_DIAMETER_M,
    EXAGGERATION,
    GHOST_COLOR,
    MAX_DEVIATION_M,
    MIN_DEVIATION_M,
)

_PACKAGE = 'process_visualizer'
GHOST_STYLE = {
    'color': GHOST_COLOR, 'deviation': DEVIATION_COLOR, 'diameter': DEVIATION_DIAMETER_M,
    'exaggeration': EXAGGERATION, 'least': MIN_DEVIATION_M, 'longest': MAX_DEVIATION_M}
"""Look of the reference run on a page, for JSON."""


class PageParts(NamedTuple):
    """Contents of a page: data of runs and meshes, the columns to which they refer, and texts.

    ``listed`` has the texts of further runs, which have no data.
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
    """Return the page: one file that loads nothing from the network."""
    script, style = web_file('page.js'), web_file('page.css')
    policy = (f"default-src 'none'; script-src {_hash(script)}; style-src {_hash(style)}; "
              "img-src data:; form-action 'none'; base-uri 'none'")
    data = {'runs': parts.runs, 'meshes': parts.meshes, 'ghost': GHOST_STYLE}
    return _rendered('page.html', {
        **parts._asdict(), 'policy': policy, 'script': script, 'style': style, 'data': _json(data),
        'columns': parts.packed.text(), 'origin': _origin(parts)})


def _rendered(name: str, values: Dict[str, Any]) -> str:
    """Return a template of web/templates filled with values; their texts are escaped."""
    import jinja2  # imported late: other commands start 30 ms faster
    folder = os.path.join(rospkg.RosPack().get_path(_PACKAGE), 'web', 'templates')
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(folder), autoescape=True, trim_blocks=True,
        lstrip_blocks=True, undefined=jinja2.StrictUndefined)
    environment.filters['clock'] = clock_text
    return environment.get_template(name).render(values).lstrip()


def _origin(parts: PageParts) -> str:
    """Return the time of the recording, the cell, and the program that made the page."""
    runs = list(parts.runs)
    recorded = '' if not runs else datetime.fromtimestamp(
        runs[0]['recorded'], timezone.utc).strftime('Recorded %Y-%m-%d %H:%M UTC. ')
    version = rospkg.RosPack().get_manifest(_PACKAGE).version
    return (f'{recorded}{f"Cell: {parts.cell}. " if parts.cell else ""}Made by {_PACKAGE} '
            f'{version}; three.js (MIT) draws the scene.')


def _json(data: Dict[str, Any]) -> str:
    """Return JSON that cannot end the element that contains it; NaN is refused."""
    text = json.dumps(data, separators=(',', ':'), allow_nan=False)
    return text.replace('<', '\\u003c').replace('>', '\\u003e').replace('&', '\\u0026')


def _hash(text: str) -> str:
    """Return the hash source with which a policy allows an inline script or style."""
    return f"'sha256-{b64encode(sha256(text.encode()).digest()).decode()}'"


def web_file(name: str) -> str:
    """Return a file of web/dist.

    Raises:
        OSError: the file is missing or cannot be read.
    """
    path = os.path.join(rospkg.RosPack().get_path(_PACKAGE), 'web', 'dist', name)
    with open(path, encoding='utf-8') as file:
        return file.read()


LIVE_POLICY = ("default-src 'none'; script-src 'self'; style-src 'self'; img-src data:; "
               "connect-src 'self'; form-action 'none'; base-uri 'none'; frame-ancestors 'none'")
"""Content security policy of the page of a running cell: it uses no other address."""


def live_html(title: str, notes: Sequence[str]) -> str:
    """Return the page of a running cell, which loads everything else from its own server."""
    return _rendered('live.html', {'title': title, 'notes': notes})
