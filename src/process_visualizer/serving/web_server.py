# SPDX-License-Identifier: BSD-3-Clause
"""The web server of a live page: serves the page and the feed, and accepts no commands.

Everything runs in the thread of its loop. Clients can only send a few kinds of GET requests, and a
viewer only the number of messages that it has received.
"""
from __future__ import annotations

import gzip
import logging
import math
import socket
import ssl
import time
from asyncio import Future
from typing import Any, Callable, Dict, NamedTuple, Optional, Set, Tuple, Union

from tornado.httpserver import HTTPServer
from tornado.ioloop import IOLoop
from tornado.iostream import IOStream
from tornado.netutil import bind_sockets
from tornado.web import Application, HTTPError, RequestHandler
from tornado.websocket import WebSocketClosedError, WebSocketHandler

from process_visualizer.page.html_page import LIVE_POLICY
from process_visualizer.page.live_feed import Admission, LiveFeed, Refusal, ViewerPace

MAX_VIEWERS = 16
_MAX_CONNECTIONS = 64
_MAX_HEADER_BYTES, _MAX_BODY_BYTES, _MAX_ANSWER_BYTES = 8 << 10, 1 << 10, 32
_IDLE_S = 20.0
_SEND_BUFFER_BYTES = 32 << 10
"""Size of the kernel's buffer for each viewer; the viewer sees its contents late."""
_LOOK_S = 1.0
_RECENT_PER_S, _PINGS_PER_S = 8, 2
_HEADERS = {
    'Content-Security-Policy': LIVE_POLICY, 'X-Content-Type-Options': 'nosniff',
    'X-Frame-Options': 'DENY', 'Referrer-Policy': 'no-referrer',
    'Cross-Origin-Opener-Policy': 'same-origin', 'Cross-Origin-Resource-Policy': 'same-origin',
    'Cache-Control': 'no-cache'}


class ServedFile(NamedTuple):
    """A file of the page, compressed once."""

    kind: str
    packed: bytes


def served_file(kind: str, content: Union[str, bytes]) -> ServedFile:
    """Return a file by its type and content."""
    data = content.encode() if isinstance(content, str) else content
    return ServedFile(kind, gzip.compress(data, 7, mtime=0))


class Served(NamedTuple):
    """Data shared by all connections. ``recent`` returns the kept data between two times.

    ``strangers`` are the connections without an admitted request so far, the oldest first.
    """

    files: Dict[str, ServedFile]
    feed: LiveFeed
    admission: Admission
    recent: Callable[[float, float], bytes]
    viewers: 'Set[_Viewer]'
    budget: '_Budget'
    on_viewer: Callable[[str], None]
    strangers: Dict[IOStream, None]


class _Budget:
    """A limit on the number of requests in each second."""

    def __init__(self, most: int) -> None:
        self._most, self._second, self._count = most, 0, 0

    def take(self) -> bool:
        second = int(time.monotonic())
        self._count = self._count + 1 if second == self._second else 1
        self._second = second
        return self._count <= self._most


class LiveServer:
    """Listens until it is closed."""

    def __init__(self, files: Dict[str, ServedFile], feed: LiveFeed, admission: Admission,
                 recent: Callable[[float, float], bytes],
                 on_viewer: Callable[[str], None] = lambda _text: None) -> None:
        """Set the data to serve, see `Served`; call ``on_viewer`` when a viewer comes or goes."""
        self._served = Served(files, feed, admission, recent, set(),
                              _Budget(_RECENT_PER_S), on_viewer, {})
        shared = {'served': self._served}
        self._application = Application(
            [(r'.*/live', _Viewer, shared), (r'.*', _Asked, shared)], log_function=_no_log,
            websocket_max_message_size=_MAX_ANSWER_BYTES)
        self._server: Optional[_LimitedServer] = None
        self._loop = IOLoop.current()
        self._loop.call_later(_LOOK_S, self._look)

    @property
    def viewers(self) -> Tuple[str, ...]:
        """Return the addresses of the viewers."""
        return tuple(sorted(it.address for it in self._served.viewers))

    @property
    def has_clouds(self) -> bool:
        """Return whether any viewer wants clouds."""
        return any(it.pace is not None and it.pace.has_clouds for it in self._served.viewers)

    def listen(self, address: str, port: int, context: Optional[ssl.SSLContext]) -> int:
        """Begin to listen; return the port.

        Raises:
            OSError: the address or the port cannot be used.
        """
        sockets = bind_sockets(port, address)
        self._server = _LimitedServer(
            self._application, ssl_options=context, max_header_size=_MAX_HEADER_BYTES,
            max_body_size=_MAX_BODY_BYTES, idle_connection_timeout=_IDLE_S,
            body_timeout=_IDLE_S)
        self._server.strangers = self._served.strangers
        self._server.add_sockets(sockets)
        return int(sockets[0].getsockname()[1])

    def send(self) -> None:
        """Send new messages to the viewers that are ready for them."""
        for viewer in list(self._served.viewers):
            viewer.send()

    def _look(self) -> None:
        now_s = time.monotonic()
        for viewer in list(self._served.viewers):
            if viewer.pace is not None and viewer.pace.is_gone(now_s):
                viewer.drop()
        self._loop.call_later(_LOOK_S, self._look)

    def close(self) -> None:
        """Stop listening, and end all connections."""
        if self._server is not None:
            self._server.stop()
        for viewer in list(self._served.viewers):
            viewer.close(1001)


def _no_log(_handler: RequestHandler) -> None:
    """Log no requests, because their paths contain the token."""


class _LimitedServer(HTTPServer):
    """A server with a limited number of connections, which drops stalled ones.

    A new connection replaces the oldest one without an admitted request. Otherwise, clients without
    a token could keep all others out by connections that send nothing.
    """

    strangers: Dict[IOStream, None]
    _open = 0

    def handle_stream(self, stream: IOStream, address: Any) -> None:
        if self._open >= _MAX_CONNECTIONS:
            oldest = next(iter(self.strangers), stream)
            self.strangers.pop(oldest, None)
            oldest.close()
            if oldest is stream:
                return
        self._open += 1
        self.strangers[stream] = None
        stream.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, int(1000 * _IDLE_S))
        super().handle_stream(stream, address)

    def on_close(self, server_conn: Any) -> None:
        self._open -= 1
        self.strangers.pop(server_conn.stream, None)
        super().on_close(server_conn)


class _Handler(RequestHandler):
    """Checks each request first, and refuses it with a plain text."""

    served: Served
    is_socket = False

    def initialize(self, served: Served) -> None:
        self.served = served

    def set_default_headers(self) -> None:
        self.clear_header('Server')
        for name, value in _HEADERS.items():
            self.set_header(name, value)

    def prepare(self) -> None:
        request = self.request
        refusal = self.served.admission.refusal(
            request.path, request.host, request.headers.get('Origin'), self.is_socket)
        if refusal is None and self.is_socket and not _has_room(self.served.viewers):
            refusal = Refusal(503, _full())
        if refusal is not None:
            self._refuse(refusal)
        else:
            connection: Any = self.request.server_connection
            self.served.strangers.pop(connection.stream, None)

    def _refuse(self, refusal: Refusal) -> None:
        self.set_status(refusal.status)
        self.set_header('Content-Type', 'text/plain; charset=utf-8')
        self.finish(refusal.text)

    def log_exception(self, _kind: Any, error: Any, trace: Any) -> None:
        """Log the place of a program error, but not the request, which contains the token."""
        if error is not None and not isinstance(error, HTTPError):
            logging.getLogger('tornado.application').error(
                'a request could not be answered', exc_info=(type(error), error, trace))

    def write_error(self, status_code: int, **_values: Any) -> None:
        self.set_header('Content-Type', 'text/plain; charset=utf-8')
        self.finish(f'{status_code}\n')

    @property
    def asked(self) -> str:
        """The requested path after the token."""
        return self.served.admission.asked(self.request.path) or ''


def _has_room(viewers: 'Set[_Viewer]') -> bool:
    """Return whether another viewer may watch; drop those that do not answer if need be."""
    if len(viewers) >= MAX_VIEWERS:
        now_s = time.monotonic()
        for viewer in list(viewers):
            if viewer.pace is not None and viewer.pace.is_gone(now_s, is_awaited=True):
                viewer.drop()
    return len(viewers) < MAX_VIEWERS


def _full() -> str:
    return f'{MAX_VIEWERS} people are watching this cell already; this page tries again.'


class _Asked(_Handler):
    """Serves the files of the page, and the kept data."""

    def get(self) -> None:
        if self.asked == 'why':
            has_room = _has_room(self.served.viewers)
            self._answer(served_file('text/plain; charset=utf-8', '' if has_room else _full()))
        elif self.asked == 'recent':
            self._answer_recent()
        elif self.asked in self.served.files:
            self._answer(self.served.files[self.asked])
        else:
            self._refuse(Refusal(404, 'There is no such page.'))

    def _answer_recent(self) -> None:
        after_s, before_s = _number(self.get_query_argument('after', '')), _number(
            self.get_query_argument('before', ''))
        if after_s is None or before_s is None:
            self._refuse(Refusal(400, 'Two times are needed: after and before.'))
        elif not self.served.budget.take():
            self._refuse(Refusal(503, 'Too many ask for the past; try again.'))
        else:
            data = self.served.recent(after_s, before_s)
            self._answer(ServedFile('application/octet-stream', gzip.compress(data, 1)))

    def _answer(self, file: ServedFile) -> None:
        self.set_header('Content-Type', file.kind)
        if 'gzip' in self.request.headers.get('Accept-Encoding', ''):
            self.set_header('Content-Encoding', 'gzip')
            self.finish(file.packed)
        else:
            self.finish(gzip.decompress(file.packed))


def _number(text: Optional[str]) -> Optional[float]:
    try:
        number = float(text or '')
    except ValueError:
        return None
    return number if math.isfinite(number) else None


class _Viewer(_Handler, WebSocketHandler):
    """A WebSocket that shows the cell to a viewer."""

    is_socket = True
    pace: Optional[ViewerPace] = None
    _is_sending = False

    def initialize(self, served: Served) -> None:
        super().initialize(served)
        self._pings = _Budget(_PINGS_PER_S)

    @property
    def address(self) -> str:
        """The IP address of the viewer."""
        return str(self.request.remote_ip)

    def check_origin(self, origin: str) -> bool:
        """Accept any origin, which `prepare` has checked already."""
        return True

    def open(self, *_arguments: str, **_values: str) -> None:
        self.set_nodelay(True)
        assert self.ws_connection is not None
        stream: Any = self.ws_connection.stream
        stream.socket.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, _SEND_BUFFER_BYTES)
        self.pace = ViewerPace(self.served.feed, time.monotonic(),
                               self.get_query_argument('clouds', '') == '1')
        self.served.viewers.add(self)
        self.served.on_viewer(f'{self.address} watches')
        self.send()

    def send(self) -> None:
        """Send new messages, one after the other."""
        if self._is_sending or self.pace is None:
            return
        message = self.pace.next(time.monotonic())
        if message is None:
            return
        try:
            sent = self.write_message(message, binary=isinstance(message, bytes))
        except WebSocketClosedError:
            self.on_close()
            return
        self._is_sending = True
        IOLoop.current().add_future(sent, self._sent)

    def _sent(self, future: 'Future[None]') -> None:
        self._is_sending = False
        if isinstance(future.exception(), WebSocketClosedError):
            self.on_close()
        else:
            self.send()

    def on_message(self, message: Union[str, bytes]) -> None:
        """Process the number of received messages, the only valid message of a viewer."""
        count = int(message) if isinstance(message, str) and message.isdecimal() else -1
        if self.pace is None or not self.pace.answered(count, time.monotonic()):
            self.close(1008)
            return
        self.send()

    def on_ping(self, data: bytes) -> None:
        """Drop a viewer that sends too many pings; browsers send none."""
        if not self._pings.take():
            self.drop()

    def on_close(self) -> None:
        if self.pace is not None:
            self.pace = None
            self.served.viewers.discard(self)
            self.served.on_viewer(f'{self.address} watches no longer')

    def drop(self) -> None:
        """End the connection at once, because the viewer does not read."""
        connection: Any = self.ws_connection
        self.on_close()
        if connection is not None:
            connection.stream.close()


# Periodic calls in the loop, which continue when the computer's clock is set. tornado's
# PeriodicCallback uses the time of day: if that is set back by an hour, it waits an hour.

class Ticks:
    """Calls a function in a loop once in a period, from ``start`` to ``stop``."""

    def __init__(self, loop: IOLoop, act: Callable[[], None], period_s: float) -> None:
        """Exceptions raised by ``act`` are logged by the loop, and do not end the calls."""
        self._loop, self._act, self._period_s = loop, act, period_s
        self._next_s = 0.0
        self._handle: Any = None

    def start(self) -> None:
        """Begin to call."""
        self._next_s = time.monotonic()
        self._wait()

    def stop(self) -> None:
        """End the calls."""
        if self._handle is not None:
            self._loop.remove_timeout(self._handle)
        self._handle = None

    def _wait(self) -> None:
        now_s = time.monotonic()
        self._next_s = max(self._next_s + self._period_s, now_s)  # late calls are not made up for
        self._handle = self._loop.call_later(self._next_s - now_s, self._call)

    def _call(self) -> None:
        self._wait()
        self._act()
