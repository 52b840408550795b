# SPDX-License-Identifier: BSD-3-Clause
"""Obstacles to a connection are found and named before RViz starts."""
from __future__ import annotations

import socket
import threading
from contextlib import contextmanager
from typing import Callable, Iterator

import pytest

from process_visualizer.remote.link_words import Address
from process_visualizer.remote.packets import GREETING, Kind, json_packet
from process_visualizer.viewing import find_relay as module
from process_visualizer.viewing.find_relay import CellNotFound, find_relay

Serve = Callable[[socket.socket], None]


@contextmanager
def served(serve: Serve) -> Iterator[int]:
    """A listening server; yields its port."""
    with socket.create_server(('127.0.0.1', 0)) as server:
        def accept() -> None:
            while True:
                try:
                    connection, _ = server.accept()
                except OSError:
                    return
                threading.Thread(target=answer, args=[connection], daemon=True).start()

        def answer(connection: socket.socket) -> None:
            with connection:
                try:
                    serve(connection)
                except OSError:
                    return

        thread = threading.Thread(target=accept, daemon=True)
        thread.start()
        yield server.getsockname()[1]
        server.shutdown(socket.SHUT_RDWR)
        thread.join()


def sending(data: bytes) -> Serve:
    """Send this once, and then wait for the end."""
    def serve(connection: socket.socket) -> None:
        connection.sendall(data)
        while connection.recv(1000):
            pass
    return serve


def endless(connection: socket.socket) -> None:
    connection.recv(1000)
    connection.sendall(b'HTTP/1.1 200 OK\r\nContent-Type: text/xml\r\n\r\n<?xml version="1.0"?>'
                       b'<methodResponse><params><param><value><string>')
    while True:
        connection.sendall(b'a' * 1_000_000)


def trickling(connection: socket.socket) -> None:
    connection.recv(1000)
    connection.sendall(b'HTTP/1.1 200 OK\r\nContent-Length: 100000\r\n\r\n')
    threading.Event().wait(0.02)
    while True:
        connection.sendall(b'<')
        threading.Event().wait(0.02)


@pytest.fixture(autouse=True)
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, '_ANSWER_S', 0.3)
    monkeypatch.setattr(module, '_WHOLE_S', 0.9)


def test_a_cell_that_begins_to_show_itself_is_found() -> None:
    with served(sending(GREETING + json_packet(Kind.OFFER, view=''))) as port:
        assert find_relay(Address('127.0.0.1', port)) == ('127.0.0.1', port)


@pytest.mark.parametrize('serve, sentence', [
    (sending(GREETING), 'only small packets arrive'),
    (sending(b''), 'accepts the connection, but says nothing'),
    (sending(GREETING + json_packet(Kind.REFUSED, reason='16 viewers watch')), '16 viewers watch'),
    (sending(b'SSH-2.0-\x1b[2JOpenSSH\r\n'),
     r'neither a cell nor a ROS master.*the usual one \(SSH-2.0-\\x1b'),
    (endless, 'nor a ROS master|the answer is too long|does not answer'),
    (trickling, 'does not answer')])
def test_what_answers_instead_is_told(serve: Serve, sentence: str) -> None:
    with served(serve) as port, pytest.raises(CellNotFound, match=sentence):
        find_relay(Address('127.0.0.1', port))


@pytest.mark.parametrize('is_there', [True, False])
def test_a_killed_cell_of_this_computer_is_not_one_that_refuses_others(
        monkeypatch: pytest.MonkeyPatch, is_there: bool) -> None:
    """Its master keeps the address of its relay."""
    with served(sending(GREETING + json_packet(Kind.OFFER, view=''))) as port:
        listens = f'127.0.0.1:{port if is_there else 1}'
        monkeypatch.setattr(module, '_asked', lambda _uri: module._MasterAnswer(listens))
        if is_there:
            assert find_relay(Address('localhost', 2)) == ('127.0.0.1', port)
            return
        with pytest.raises(CellNotFound, match='names a cell at 127.0.0.1:1, but nothing listens '
                                               'there: the cell has been killed'):
            find_relay(Address('localhost', 2))


def test_the_port_that_has_to_be_open_is_the_one_that_is_named(
        monkeypatch: pytest.MonkeyPatch) -> None:
    """The master listens on its own computer only, and a firewall drops packets to the relay."""
    def dropped(host: str, port: int) -> OSError:
        return socket.timeout('timed out')

    monkeypatch.setattr(module, '_problem_at', dropped)
    monkeypatch.setattr(module, 'MASTER_PORT', 1)  # closed
    with pytest.raises(CellNotFound, match='"sudo ufw allow 11411/tcp"'):
        find_relay(Address('127.0.0.1', None))


def test_the_firewall_that_the_page_recommends_is_not_blamed_for_a_cell_that_does_not_run(
        monkeypatch: pytest.MonkeyPatch) -> None:
    """It lets only the cell's port through, where nothing listens; it drops all others."""
    def problem(_host: str, port: int) -> OSError:
        return ConnectionRefusedError() if port == 11411 else socket.timeout('timed out')

    def dropped(_uri: str) -> None:
        raise socket.timeout('timed out')

    monkeypatch.setattr(module, '_problem_at', problem)
    monkeypatch.setattr(module, '_asked', dropped)
    with pytest.raises(CellNotFound, match='port 11411 of 192.0.2.1 is closed') as raised:
        find_relay(Address('192.0.2.1', None))
    assert 'ufw' not in str(raised.value) and '11311' not in str(raised.value)
