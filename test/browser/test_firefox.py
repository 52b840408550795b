# SPDX-License-Identifier: BSD-3-Clause
"""Firefox opens the page of ``cell share`` as a file and plays it (WebDriver BiDi)."""
from __future__ import annotations

import json
import re
import subprocess
from pathlib import Path
from typing import Any, Dict, Iterator, List

import pytest
import websocket
from cycle_bags import write_bag
from live_stand import LiveStand

from process_visualizer.commands.command_line import main

_LISTENS = re.compile(r'WebDriver BiDi listening on (ws://\S+)')
_LIMIT_S = 120


class Firefox:
    """A browser without a window, and its messages."""

    def __init__(self, profile: Path) -> None:
        self._process = subprocess.Popen(
            ['firefox-esr', '--headless', '--no-remote', '--profile', str(profile),
             '--remote-debugging-port', '0', 'about:blank'],
            stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True)
        assert self._process.stderr is not None
        found = next(filter(None, map(_LISTENS.search, self._process.stderr)))
        self._socket = websocket.create_connection(
            f'{found.group(1)}/session', timeout=_LIMIT_S, suppress_origin=True)
        self._number = 0
        self.events: List[Dict[str, Any]] = []
        self.call('session.new', capabilities={})
        self.call('session.subscribe', events=['log.entryAdded', 'network.beforeRequestSent'])
        tree = self.call('browsingContext.getTree')
        self.context = tree['contexts'][0]['context']

    def call(self, method: str, **parameters: Any) -> Any:
        self._number += 1
        self._socket.send(json.dumps({'id': self._number, 'method': method,
                                      'params': parameters}))
        while True:
            answer = json.loads(self._socket.recv())
            if answer.get('id') == self._number:
                assert answer['type'] == 'success', answer
                return answer['result']
            self.events.append(answer)

    def evaluate(self, expression: str) -> Any:
        result = self.call('script.evaluate', expression=expression, awaitPromise=True,
                           target={'context': self.context})
        assert result['type'] == 'success', result
        return result['result'].get('value')

    def until(self, condition: str) -> None:
        """Wait until a condition is true, checking it in each frame of the page."""
        self.evaluate(f'''new Promise((done) => {{
          const ask = () => {condition} ? done(true) : requestAnimationFrame(ask);
          ask(); }})''')

    def close(self) -> None:
        self._socket.close()
        self._process.terminate()
        self._process.wait(_LIMIT_S)


@pytest.fixture
def firefox(tmp_path: Path) -> Iterator[Firefox]:
    (tmp_path / 'profile').mkdir()
    browser = Firefox(tmp_path / 'profile')
    yield browser
    browser.close()


def test_it_opens_plays_and_seeks(firefox: Firefox, tmp_path: Path) -> None:
    bag, page = write_bag(tmp_path, cycles=3, poor=1), tmp_path / 'page.html'
    assert main(['share', f'{bag}#2', '--reference', f'{bag}#1', f'{bag}#3', '-o',
                 str(page)]) == 0
    url = page.as_uri()
    firefox.call('browsingContext.navigate', context=firefox.context, url=f'{url}#t=14',
                 wait='complete')
    firefox.until('document.documentElement.dataset.time === "14.0000"')
    firefox.evaluate('page.transport.toggle()')
    firefox.until('document.documentElement.dataset.time > 14.5')
    firefox.evaluate('page.transport.pause(), page.transport.seek(16)')
    firefox.until('document.documentElement.dataset.time === "16.0000"')
    force = firefox.evaluate('document.querySelectorAll("#numbers td")[1].textContent')
    assert force.startswith('F ')
    asked = [it['params']['request']['url'] for it in firefox.events
             if it['method'] == 'network.beforeRequestSent']
    assert [it for it in asked if not it.startswith((url, 'data:', 'about:', 'blob:'))] == []
    told = [it['params'] for it in firefox.events if it['method'] == 'log.entryAdded']
    assert [it['text'] for it in told if it['level'] == 'error'] == []


def test_it_shows_a_running_cell(firefox: Firefox, tmp_path: Path) -> None:
    stand = LiveStand(tmp_path)
    try:
        firefox.call('browsingContext.navigate', context=firefox.context, url=stand.url,
                     wait='complete')
        firefox.until('globalThis.page && page.curves.length > 100 && page.transport.end > 0')
        firefox.until('document.getElementById("link").textContent === "Live"')
        end_s = firefox.evaluate('page.transport.end')
        firefox.until(f'page.transport.time > {end_s + 1.0}')
        force = firefox.evaluate('document.querySelector("#numbers td").textContent')
        assert force.startswith('F ')
        told = [it['params'] for it in firefox.events if it['method'] == 'log.entryAdded']
        assert [it['text'] for it in told if it['level'] == 'error'] == []
    finally:
        stand.close()
