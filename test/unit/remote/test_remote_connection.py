# SPDX-License-Identifier: BSD-3-Clause
"""The connection to a relay: fast to reconnect, and it knows the reason of a loss."""
from __future__ import annotations

import queue
import socket
from contextlib import suppress
from typing import Any, Iterator, List, Tuple, cast

import pytest
from surroundings import PATIENCE_S, wait_until

from process_visualizer.nodes import view_relay
from process_visualizer.nodes.view_relay import ViewRelay
from process_visualizer.nodes.viewer_link import ViewerLink
from process_visualizer.remote.offer import Offer
from process_visualizer.remote.packets import (
    GREETING,
    Kind,
    Packet,
    PacketReader,
    json_packet,
)
from process_visualizer.viewing import relay_connection
from process_visualizer.viewing.find_relay import CellNotFound
from process_visualizer.viewing.relay_connection import Listener, RelayConnection


class Losses:
    """Collected reports of lost connections."""

    def __init__(self) -> None:
        self.told: 'queue.Queue[Tuple[str, float]]' = queue.Queue()

    def on_lost(self, reason: str, heard_s: float) -> None:
        self.told.put((reason, heard_s))


@pytest.fixture
def server() -> Iterator[socket.socket]:
    with socket.create_server(('127.0.0.1', 0)) as made:
        made.settimeout(PATIENCE_S)
        yield made


@pytest.fixture
def losses() -> Losses:
    return Losses()


@pytest.fixture
def connection(server: socket.socket, losses: Losses) -> Iterator[RelayConnection]:
    made = RelayConnection(server.getsockname(), cast(Listener, losses))
    yield made
    made.close()


def first_packet(there: socket.socket) -> Packet:
    reader, packets = PacketReader(), cast(List[Packet], [])
    there.settimeout(PATIENCE_S)
    while not packets:
        packets = reader.take(there.recv(1000))
    return packets[0]


def test_a_viewer_that_is_back_says_at_once_what_it_wants(
        server: socket.socket, connection: RelayConnection) -> None:
    connection.want(['/b', '/a'])
    connection.start()
    for _ in range(2):
        with server.accept()[0] as there:
            packet = first_packet(there)
            assert packet.kind == Kind.WANT and packet.json() == {'topics': ['/a', '/b']}


def test_a_loss_says_when_anything_came_last(
        server: socket.socket, connection: RelayConnection, losses: Losses) -> None:
    connection.start()
    with server.accept()[0] as there:
        there.sendall(GREETING)
        first_packet(there)  # it has connected, and sends something from time to time
    heard_s = losses.told.get(timeout=PATIENCE_S)[1]
    assert losses.told.get(timeout=PATIENCE_S)[1] == heard_s  # nothing has arrived since then


def test_a_cell_that_has_another_port_is_found_again(
        server: socket.socket, losses: Losses, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(relay_connection, '_LOOK_S', 0.01)
    with socket.create_server(('127.0.0.1', 0)) as old:
        before: Tuple[str, int] = old.getsockname()
    answers: Iterator[Tuple[str, int]] = iter([before, server.getsockname()])

    def find() -> Tuple[str, int]:
        try:
            return next(answers)
        except StopIteration:
            raise CellNotFound(('its master is away',)) from None

    connection = RelayConnection(before, cast(Listener, losses), find)
    connection.start()
    try:
        with server.accept()[0] as there:
            assert there.recv(len(GREETING)) == GREETING
    finally:
        connection.close()


def test_all_addresses_of_a_name_are_tried(
        server: socket.socket, losses: Losses, monkeypatch: pytest.MonkeyPatch) -> None:
    port = server.getsockname()[1]
    closed, nowhere, here = ((socket.AF_INET, socket.SOCK_STREAM, 6, '', it) for it in (
        ('127.0.0.1', 1), ('255.255.255.255', port), ('127.0.0.1', port)))
    monkeypatch.setattr(socket, 'getaddrinfo', lambda *_, **__: [closed, nowhere, here])
    connection = RelayConnection(('cell', port), cast(Listener, losses))
    connection.start()
    try:
        with server.accept()[0] as there:
            assert there.recv(len(GREETING)) == GREETING
            assert losses.told.empty()
    finally:
        connection.close()


def test_large_packets_that_are_lost_are_told(
        server: socket.socket, connection: RelayConnection, losses: Losses,
        monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(relay_connection, '_DEAD_S', 0.2)
    connection.start()
    with server.accept()[0] as there:
        there.sendall(GREETING)
        assert 'only small packets arrive' in losses.told.get(timeout=PATIENCE_S)[0]


@pytest.mark.parametrize('packets', [
    [json_packet(Kind.CHANNEL, channel=number, topic='/a', type='b/C', md5sum='', caller='/d')
     for number in range(20_000)],
    [json_packet(Kind.CHANNEL, channel=1, topic='/a', type='b/C', md5sum='', caller=5000 * 'd')]],
    ids=['many', 'long'])
def test_publishers_without_end_end_the_connection(
        packets: List[bytes], server: socket.socket, connection: RelayConnection,
        losses: Losses) -> None:
    connection.start()
    with server.accept()[0] as there:
        with suppress(ConnectionError):
            there.sendall(GREETING + b''.join(packets))
        assert 'channels without end' in losses.told.get(timeout=PATIENCE_S)[0]


def test_an_attempt_that_is_not_answered_holds_up_no_other(
        server: socket.socket, connection: RelayConnection,
        monkeypatch: pytest.MonkeyPatch) -> None:
    connect, unanswered = relay_connection._attempt, cast(List[socket.socket], [])

    def attempt(found: Any) -> socket.socket:
        if len(unanswered) == 4:
            return connect(found)
        here, there = socket.socketpair()
        here.setblocking(False)
        with pytest.raises(BlockingIOError):
            while True:
                here.send(bytes(1 << 16))
        unanswered.append(there)
        return here

    monkeypatch.setattr(relay_connection, '_CONNECT_S', PATIENCE_S)
    monkeypatch.setattr(relay_connection, '_NO_ANSWER_S', PATIENCE_S)
    monkeypatch.setattr(relay_connection, '_ATTEMPT_S', 0.01)
    monkeypatch.setattr(relay_connection, '_attempt', attempt)
    connection.start()
    with server.accept()[0] as there:
        assert there.recv(len(GREETING)) == GREETING
        for end in unanswered:  # all are closed
            with end:
                end.settimeout(PATIENCE_S)
                wait_until(lambda it=end: not it.recv(1 << 20), 'its end')  # type: ignore[misc]


class Link:
    """Viewer that has been silent for some time."""

    def __init__(self, silent_s: float) -> None:
        self.silent_s, self.is_closed = silent_s, False

    def close(self) -> None:
        self.is_closed = True


def test_a_silent_viewer_gives_its_place_to_another_one() -> None:
    relay = ViewRelay('127.0.0.1', range(1 << 15, 1 << 16), '', '')
    links = [Link(9.0 if number == 3 else 0.1) for number in range(view_relay._MAX_VIEWERS)]
    relay._links.update(cast(List[ViewerLink], links))
    assert relay._has_room()
    assert [number for number, it in enumerate(links) if it.is_closed] == [3]
    relay._links.add(cast(ViewerLink, Link(0.1)))
    assert not relay._has_room()
    relay._listener.close()


def test_who_connects_and_says_nothing_costs_no_work() -> None:
    relay = ViewRelay('127.0.0.1', range(1 << 15, 1 << 16), '/no/such/view', '')
    here, there = socket.socketpair()
    there.close()
    relay._welcome(here, 'viewer')
    assert here.fileno() == -1, 'it is closed'
    here, there = socket.socketpair()
    with there:
        there.sendall(GREETING)
        relay._welcome(here, 'viewer')
        assert first_packet(there).kind == Kind.REFUSED, 'the view was read'
    relay._listener.close()


def test_another_cell_of_the_computer_is_not_taken_for_the_one_that_was_watched(
        server: socket.socket, losses: Losses, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(relay_connection, '_LOOK_S', 0.01)
    offers: List[Offer] = []
    losses.on_offer = offers.append  # type: ignore[attr-defined]

    def offered(there: socket.socket, cell: str) -> None:
        values = Offer('1', 'realtime', '', {}, {}, cell).values()
        there.sendall(GREETING + json_packet(Kind.OFFER, **values))

    with socket.create_server(('127.0.0.1', 0)) as other:
        other.settimeout(PATIENCE_S)
        connection = RelayConnection(server.getsockname(), cast(Listener, losses),
                                     lambda: other.getsockname())
        connection.start()
        try:
            with server.accept()[0] as there:
                offered(there, 'pc:11311')
                wait_until(lambda: bool(offers), 'the offer')
            server.close()
            with other.accept()[0] as there:
                offered(there, 'pc:11312')
                assert first_packet(there).kind == Kind.PING  # requests nothing, and leaves
            with other.accept()[0] as there:  # it checks again: the first cell may be there now
                offered(there, 'pc:11312')
                wait_until(lambda: any('another cell runs there, at port '
                                       f'{other.getsockname()[1]}' in it[0]
                                       for it in list(losses.told.queue)), 'the other cell')
        finally:
            connection.close()
    assert [it.cell for it in offers] == ['pc:11311']


def test_a_view_that_is_away_for_a_while_does_not_end_the_look_for_topics(
        monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(view_relay, '_TOPICS_PERIOD_S', 0.01)
    relay = ViewRelay('127.0.0.1', range(1 << 15, 1 << 16), '/no/such/view', '')
    looks: 'queue.Queue[int]' = queue.Queue()

    def view() -> str:
        looks.put(1)
        raise FileNotFoundError('/no/such/view')

    monkeypatch.setattr(relay, '_view', view)
    relay.run()
    try:
        relay._links.add(cast(ViewerLink, Link(0.1)))
        relay._changed.set()
        for _ in range(3):
            looks.get(timeout=PATIENCE_S)
    finally:
        relay.close()
