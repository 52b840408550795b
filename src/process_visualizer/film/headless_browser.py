# SPDX-License-Identifier: BSD-3-Clause
"""A headless Chromium that draws a page, controlled by the DevTools protocol."""
from __future__ import annotations

import base64
import json
import os
import re
import shutil
import signal
import subprocess
import tempfile
import threading
from collections import deque
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import IO, Any, Callable, Deque, Dict, Tuple

import websocket

_NAMES = ('chromium', 'chromium-browser', 'google-chrome', 'google-chrome-stable')
_LOADED = 'Page.loadEventFired'
_LISTENS = re.compile(r'DevTools listening on (ws://\S+)')
_LIMIT_S = 120.0
"""Time limit for an answer; a large page on a busy computer is slow."""


class BrowserError(Exception):
    """The browser is missing or fails."""


class HeadlessBrowser:
    """A page in a separate browser; a context manager that ends the browser."""

    def __init__(self, page: Path, size: Tuple[int, int], fragment: str = '') -> None:
        """Open a file, and wait until its script reports that it is ready.

        Args:
            page: the file.
            size: width and height [pixels].
            fragment: fragment of the address, after the #.

        Raises:
            BrowserError: there is no browser, or it does not show the page.
        """
        self._number, self._session = 0, ''
        self._passed: Deque[str] = deque(maxlen=100)  # events received before an answer
        with ExitStack() as stack:
            self._socket = _started(stack)
            stack.callback(self._socket.shutdown)
            targets = self._call('Target.getTargets')['targetInfos']
            target = next(it['targetId'] for it in targets if it['type'] == 'page')
            self._session = self._call('Target.attachToTarget', targetId=target,
                                       flatten=True)['sessionId']
            self._call('Emulation.setDeviceMetricsOverride', width=size[0], height=size[1],
                       deviceScaleFactor=1, mobile=False)
            self._call('Page.enable')
            self.open(page, fragment)
            self._stack = stack.pop_all()

    def open(self, page: Path, fragment: str = '') -> None:
        """Show another page, and wait until it is ready.

        Raises:
            BrowserError: the browser does not show it.
        """
        self._passed.clear()
        self._call('Page.navigate', url=f'{page.absolute().as_uri()}#{fragment}')
        if _LOADED not in self._passed:
            self._receive(lambda it: it.get('method') == _LOADED)
        self.evaluate('''new Promise((done) => {
          const ask = () => document.documentElement.dataset.ready ? done(true)
            : setTimeout(ask, 20);
          ask(); })''')

    def __enter__(self) -> 'HeadlessBrowser':
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()

    def evaluate(self, expression: str) -> Any:
        """Return the value of an expression in the page; a promise is awaited.

        Raises:
            BrowserError: the expression fails, or the browser has ended.
        """
        found = self._call('Runtime.evaluate', expression=expression, awaitPromise=True,
                           returnByValue=True)
        if 'exceptionDetails' in found:
            details = found['exceptionDetails']
            raise BrowserError(details.get('exception', {}).get('description', details['text']))
        return found['result'].get('value')

    def picture(self) -> bytes:
        """Return a picture of the page as PNG.

        Raises:
            BrowserError: the browser has ended.
        """
        return base64.b64decode(self._call('Page.captureScreenshot', format='png',
                                           optimizeForSpeed=True)['data'])

    def _call(self, method: str, **parameters: Any) -> Any:
        self._number += 1
        message = {'id': self._number, 'method': method, 'params': parameters}
        if self._session:
            message['sessionId'] = self._session
        try:
            self._socket.send(json.dumps(message))
        except (OSError, websocket.WebSocketException) as error:
            raise BrowserError(f'the browser has ended: {error}') from error
        answer = self._receive(lambda it: it.get('id') == self._number)
        if 'error' in answer:
            raise BrowserError(f'{method}: {answer["error"]["message"]}')
        return answer['result']

    def _receive(self, is_wanted: Callable[[Dict[str, Any]], bool]) -> Dict[str, Any]:
        """Return the first wanted message; discard those before it."""
        try:
            while True:
                message: Dict[str, Any] = json.loads(self._socket.recv() or '{"ended": true}')
                if 'ended' in message:
                    raise BrowserError('the browser has ended')
                if is_wanted(message):
                    return message
                self._passed.append(message.get('method', ''))
        except (OSError, websocket.WebSocketException) as error:
            raise BrowserError(f'the browser has stopped answering: {error}') from error


def _started(stack: ExitStack) -> Any:
    """Return a connection to a new browser, which ends with the stack."""
    program = next((it for it in map(shutil.which, _NAMES) if it), None)
    if program is None:
        raise BrowserError('Chromium draws the pictures, and is missing; install it (Debian: '
                           '"apt install chromium")')
    profile = tempfile.mkdtemp(prefix='process_visualizer-')
    stack.callback(shutil.rmtree, profile, ignore_errors=True)
    process = subprocess.Popen(
        [program, '--headless=new', '--remote-debugging-port=0', '--use-angle=swiftshader',
         '--enable-unsafe-swiftshader', '--hide-scrollbars', '--no-first-run', '--mute-audio',
         '--disable-background-networking', '--disable-component-update', '--disable-sync',
         '--force-color-profile=srgb', f'--user-data-dir={profile}',
         *(['--no-sandbox'] if os.geteuid() == 0 else []), 'about:blank'],
        stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE,
        text=True, errors='replace', start_new_session=True,
        env={**os.environ, 'TMPDIR': profile})  # a killed browser leaves files behind
    stack.callback(_end, process)
    assert process.stderr is not None
    timer = threading.Timer(_LIMIT_S, process.kill)
    timer.start()
    try:
        said = []
        for line in process.stderr:
            said.append(line.strip())
            address = _LISTENS.search(line)
            if address is not None:
                break
        else:
            raise BrowserError(f'{program} does not start: {" ".join(said[-3:]) or "no reason"}')
    finally:
        timer.cancel()
    threading.Thread(target=_read_all, args=(process.stderr,), daemon=True).start()
    return websocket.create_connection(address.group(1), timeout=_LIMIT_S, suppress_origin=True)


def _read_all(stream: IO[str]) -> None:
    """Read and discard the output, so that the browser does not block on a full pipe."""
    with suppress(ValueError):  # closed meanwhile
        for _ in stream:
            pass


def _end(process: 'subprocess.Popen[str]') -> None:
    """Kill the browser and the processes that it has started."""
    with suppress(ProcessLookupError):
        os.killpg(process.pid, signal.SIGKILL)
    process.wait()
    if process.stderr is not None:
        process.stderr.close()
