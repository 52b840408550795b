# SPDX-License-Identifier: BSD-3-Clause
"""The web server of a live page: access, refusals, and independence of the viewers."""
from __future__ import annotations

import asyncio
import gzip
import socket
import ssl
import subprocess
from contextlib import ExitStack
from pathlib import Path
from typing import Any, Callable, Optional

import pytest
from surroundings import PATIENCE_S
from tornado.httpclient import AsyncHTTPClient, HTTPClientError, HTTPRequest, HTTPResponse
from tornado.websocket import WebSocketClientConnection, websocket_connect

from process_visualizer.page.live_feed import Admission, LiveFeed, Slot
from process_visualizer.serving.web_server import MAX_VIEWERS, LiveServer, served_file

TOKEN = 'aVeryLongToken'


class Site:
    """Server with a small page, on a free port of this computer."""

    def __init__(self, token: str = '', context: Optional[ssl.SSLContext] = None) -> None:
        self.feed = LiveFeed()
        files = {'': served_file('text/html; charset=utf-8', '<p>page</p>')}
        self.server = LiveServer(files, self.feed, Admission(token), self.feed.recent)
        self.port = self.server.listen('127.0.0.1', 0, context)
        self.scheme = 'http' if context is None else 'https'

    def url(self, path: str) -> str:
        return f'{self.scheme}://127.0.0.1:{self.port}{path}'

    async def get(self, path: str, **options: Any) -> HTTPResponse:
        return await AsyncHTTPClient(force_instance=True).fetch(
            HTTPRequest(self.url(path), validate_cert=False, **options), raise_error=False)

    async def viewer(self, path: str = '/live', **headers: str) -> WebSocketClientConnection:
        return await websocket_connect(HTTPRequest(
            f'ws://127.0.0.1:{self.port}{path}', headers={
                'Origin': f'http://127.0.0.1:{self.port}', **headers}))

    async def until(self, condition: Callable[[], bool]) -> None:
        """Wait until a condition holds; other tasks run in the meantime."""
        async def ask() -> None:
            while not condition():
                await asyncio.sleep(0)
        await asyncio.wait_for(ask(), PATIENCE_S)


def test_the_page_comes_with_its_headers_and_without_the_servers_name() -> None:
    async def test() -> None:
        answer = await Site().get('/')
        assert answer.body == b'<p>page</p>'
        headers = answer.headers
        assert "script-src 'self'" in headers['Content-Security-Policy']
        assert "frame-ancestors 'none'" in headers['Content-Security-Policy']
        assert 'unsafe' not in headers['Content-Security-Policy']
        assert headers['X-Content-Type-Options'] == 'nosniff'
        assert headers['Referrer-Policy'] == 'no-referrer'
        assert 'Server' not in headers
    asyncio.run(test())


@pytest.mark.parametrize('path', ['/', '/live', f'/{TOKEN}x/', '/recent?after=0&before=1'])
def test_without_the_token_there_is_nothing(path: str) -> None:
    async def test() -> None:
        answer = await Site(TOKEN).get(path)
        assert answer.code == 403
        assert TOKEN.encode() not in answer.body
        assert answer.headers['X-Content-Type-Options'] == 'nosniff'
    asyncio.run(test())


def test_with_the_token_there_is_the_page() -> None:
    async def test() -> None:
        assert (await Site(TOKEN).get(f'/{TOKEN}/')).body == b'<p>page</p>'
    asyncio.run(test())


def test_a_viewer_is_sent_what_is_there_and_what_comes() -> None:
    async def test() -> None:
        site = Site()
        site.feed.put(Slot.LAYOUT, 'layout')
        viewer = await site.viewer()
        assert await viewer.read_message() == 'layout'
        await viewer.write_message('1')
        site.feed.put_frame(1.0, 1, b'frame')
        site.server.send()
        assert await viewer.read_message() == b'frame'
        assert site.server.viewers == ('127.0.0.1',)
        viewer.close()
        await site.until(lambda: site.server.viewers == ())
    asyncio.run(test())


@pytest.mark.parametrize('origin', ['http://evil.example', 'null', 'http://127.0.0.1:1'])
def test_another_page_gets_no_connection(origin: str) -> None:
    async def test() -> None:
        with pytest.raises(HTTPClientError, match='403'):
            await Site().viewer(Origin=origin)
    asyncio.run(test())


@pytest.mark.parametrize('message', ['5', '-1', 'x', '9' * 31, '1' * 40, b'\x01', ''])
def test_a_viewer_that_says_anything_else_is_disconnected(message: Any) -> None:
    async def test() -> None:
        site = Site()
        viewer = await site.viewer()
        await viewer.write_message(message, binary=isinstance(message, bytes))
        assert await viewer.read_message() is None
        await site.until(lambda: site.server.viewers == ())
    asyncio.run(test())


def test_a_flood_of_pings_ends_the_connection() -> None:
    async def test() -> None:
        site = Site()
        viewer = await site.viewer()
        await site.until(lambda: len(site.server.viewers) == 1)
        for _ in range(20):
            viewer.ping()
        await site.until(lambda: site.server.viewers == ())
    asyncio.run(test())


@pytest.mark.parametrize('said', [
    b'', b'GET /live HTT', b'GET /wrong/ HTTP/1.1\r\nHost: a\r\n\r\n'])
def test_connections_without_the_token_keep_nobody_out(said: bytes) -> None:
    async def test() -> None:
        site = Site(TOKEN)
        viewer = await site.viewer(f'/{TOKEN}/live')
        with ExitStack() as stack:
            for _ in range(200):
                silent = stack.enter_context(socket.create_connection(('127.0.0.1', site.port)))
                silent.sendall(said)
                await asyncio.sleep(0)
            assert (await site.get(f'/{TOKEN}/')).body == b'<p>page</p>'
        site.feed.put(Slot.LAYOUT, 'layout')
        site.server.send()
        assert await viewer.read_message() == 'layout'
    asyncio.run(test())


def test_a_viewer_that_stops_reading_slows_nobody_and_nothing_queues_for_it() -> None:
    async def test() -> None:
        site = Site()
        stuck = socket.create_connection(('127.0.0.1', site.port))
        stuck.sendall(f'GET /live HTTP/1.1\r\nHost: 127.0.0.1:{site.port}\r\n'
                      f'Origin: http://127.0.0.1:{site.port}\r\nUpgrade: websocket\r\n'
                      'Connection: Upgrade\r\nSec-WebSocket-Version: 13\r\n'
                      'Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n'.encode())
        await site.until(lambda: len(site.server.viewers) == 1)
        held, = site.server._served.viewers
        reader = await site.viewer()
        for number in range(400):
            site.feed.put_frame(0.04 * number, 1, b'%4d' % number + bytes(20_000))
            site.server.send()
            message = await reader.read_message()
            assert isinstance(message, bytes)
            assert message[:4] == b'%4d' % number
            await reader.write_message(str(number + 1))
        stream: Any = held.ws_connection.stream
        assert len(stream._write_buffer) < 25_000
        held.drop()
        await site.until(lambda: len(site.server.viewers) == 1)
        stuck.close()
    asyncio.run(test())


def test_there_is_room_for_a_number_of_viewers_and_the_next_one_is_told() -> None:
    async def test() -> None:
        site = Site()
        viewers = [await site.viewer() for _ in range(MAX_VIEWERS)]
        with pytest.raises(HTTPClientError, match='503'):
            await site.viewer()
        assert b'16 people are watching' in (await site.get('/why')).body
        viewers.pop().close()
        await site.until(lambda: len(site.server.viewers) < MAX_VIEWERS)
        assert (await site.get('/why')).body == b''
        viewers.append(await site.viewer())
    asyncio.run(test())


@pytest.mark.parametrize(('method', 'code'), [('POST', 405), ('PUT', 405), ('DELETE', 405),
                                              ('OPTIONS', 405)])
def test_nothing_can_be_sent_to_it(method: str, code: int) -> None:
    async def test() -> None:
        body = b'x' if method in ('POST', 'PUT') else None
        answer = await Site().get('/', method=method, body=body, allow_nonstandard_methods=True)
        assert answer.code == code
        assert 'Traceback' not in answer.body.decode()
    asyncio.run(test())


@pytest.mark.parametrize('asked', [b'recent?after=%ff&before=1', b'live?clouds=%ff'])
def test_no_request_is_logged(asked: bytes, caplog: pytest.LogCaptureFixture) -> None:
    """It contains the token, and could send commands to the terminal."""
    async def test() -> None:
        site = Site(TOKEN)
        host = b'127.0.0.1:%d' % site.port
        reader, writer = await asyncio.open_connection('127.0.0.1', site.port)
        writer.write(b'GET /%s/%s&\x1b]0;title\x07 HTTP/1.1\r\nHost: %s\r\nOrigin: http://%s\r\n'
                     b'Connection: Upgrade\r\nUpgrade: websocket\r\nSec-WebSocket-Version: 13\r\n'
                     b'Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n'
                     % (TOKEN.encode(), asked, host, host))
        await asyncio.wait_for(reader.readline(), PATIENCE_S)
        writer.close()
        assert (await site.get(f'/{TOKEN}/')).code == 200
    asyncio.run(test())
    assert not [it for it in caplog.messages if TOKEN in it or '\x1b' in it]


@pytest.mark.parametrize('request_', [
    b'GET /' + b'a' * 20_000 + b' HTTP/1.1\r\nHost: localhost\r\n\r\n',
    b'GET / HTTP/1.1\r\nHost: localhost\r\nX: ' + b'a' * 20_000 + b'\r\n\r\n',
    b'GET / HTTP/1.1\r\nHost: localhost\r\nContent-Length: 1000000000\r\n\r\n',
    b'POST / HTTP/1.1\r\nHost: localhost\r\nContent-Length: 5000\r\n\r\n',
    b'\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03\r\n\r\n', b'\r\n\r\n\r\n'])
def test_unreasonable_requests_end_the_connection(request_: bytes,
                                                  caplog: pytest.LogCaptureFixture) -> None:
    async def test() -> None:
        site = Site()
        reader, writer = await asyncio.open_connection('127.0.0.1', site.port)
        writer.write(request_)
        answer = await asyncio.wait_for(reader.read(), PATIENCE_S)
        assert b'200 OK' not in answer
        assert (await site.get('/')).code == 200
        writer.close()
    asyncio.run(test())
    assert not [it for it in caplog.records if it.exc_info]


@pytest.mark.parametrize('query', ['', '?after=0', '?after=nan&before=1', '?after=0&before=inf',
                                   '?after=x&before=1'])
def test_the_past_needs_two_times(query: str) -> None:
    async def test() -> None:
        assert (await Site().get(f'/recent{query}')).code == 400
    asyncio.run(test())


def test_the_past_is_given_compressed_and_not_too_often() -> None:
    async def test() -> None:
        site = Site()
        site.feed.put_frame(1.0, 1, b'frame')
        answer = await site.get('/recent?after=0&before=2', decompress_response=False,
                                headers={'Accept-Encoding': 'gzip'})
        assert gzip.decompress(answer.body) == b'\x05\0\0\0frame'
        codes = [(await site.get('/recent?after=0&before=2')).code for _ in range(40)]
        assert 503 in codes
    asyncio.run(test())


def test_more_connections_than_there_is_room_for_are_closed() -> None:
    async def test() -> None:
        site = Site()
        held = [await asyncio.open_connection('127.0.0.1', site.port) for _ in range(65)]
        assert await asyncio.wait_for(held[0][0].read(), PATIENCE_S) == b''
        for _, writer in held:
            writer.close()
        await site.until(lambda: site.server._server is not None
                         and site.server._server._open == 0)
        assert (await site.get('/')).code == 200
    asyncio.run(test())


def test_with_a_certificate_it_is_encrypted(tmp_path: Path) -> None:
    key, certificate = tmp_path / 'key.pem', tmp_path / 'certificate.pem'
    subprocess.run(['openssl', 'req', '-x509', '-newkey', 'rsa:2048', '-nodes', '-days', '1',
                    '-subj', '/CN=localhost', '-keyout', key, '-out', certificate],
                   check=True, stderr=subprocess.DEVNULL)
    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(certificate, key)

    async def test() -> None:
        site = Site(TOKEN, context)
        assert (await site.get(f'/{TOKEN}/')).body == b'<p>page</p>'
    asyncio.run(test())


def test_a_port_that_is_taken_is_an_error() -> None:
    async def test() -> None:
        with socket.create_server(('127.0.0.1', 0)) as taken:
            site = Site()
            with pytest.raises(OSError, match='in use'):
                site.server.listen('127.0.0.1', taken.getsockname()[1], None)
    asyncio.run(test())
