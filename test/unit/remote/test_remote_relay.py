# SPDX-License-Identifier: BSD-3-Clause
"""Attacks on the relay from the network: requests without reading, and mere connections."""
from __future__ import annotations

import queue
import socket
import threading
from contextlib import ExitStack
from pathlib import Path
from typing import Any, Collection, Dict, Iterator, List

import pytest
from surroundings import PATIENCE_S, wait_until

from process_visualizer.nodes import viewer_link
from process_visualizer.nodes.view_relay import ViewRelay
from process_visualizer.nodes.viewer_link import FeedChannel, TopicFeed, ViewerLink
from process_visualizer.remote.offer import Offer, OfferedTopic
from process_visualizer.remote.packets import (
    GREETING,
    Kind,
    PacketReader,
    json_packet,
    number_packet,
)

OFFER = Offer('1.0', 'realtime', '', {}, {})


@pytest.fixture
def both_ends() -> Iterator[List[socket.socket]]:
    """A connection: the relay's end and the viewer's."""
    with socket.create_server(('127.0.0.1', 0)) as server, \
            socket.create_connection(server.getsockname()) as viewer:
        relay, _ = server.accept()
        with relay:
            yield [relay, viewer]


@pytest.mark.parametrize('packet', [
    number_packet(Kind.PING, 1), json_packet(Kind.FETCH, uri='mesh', channel=1 << 31)])
def test_a_viewer_that_asks_and_does_not_read_is_dropped(
        packet: bytes, both_ends: List[socket.socket]) -> None:
    """It does not acknowledge either, so nothing is sent, and all answers wait."""
    relay, viewer = both_ends
    ended = threading.Event()
    link = ViewerLink(relay, 'viewer', TopicFeed(), lambda _link: ended.set())
    link.start(OFFER, {'mesh': lambda: bytes(1 << 20)}, {})
    viewer.sendall(GREETING)
    try:
        for _ in range(300):
            viewer.sendall(1000 * packet)
    except OSError:
        assert ended.wait(60.0)
        return
    pytest.fail('the relay has taken 300,000 questions')


def test_connections_that_say_nothing_do_not_become_many(tmp_path: Path) -> None:
    relay = ViewRelay('127.0.0.1', range(0, 1), str(tmp_path / 'none.rviz'), '')
    host, port = relay.address.split(':')
    relay.run()
    before = threading.active_count()
    with ExitStack() as stack:
        silent = [stack.enter_context(socket.create_connection((host, int(port))))
                  for _ in range(300)]
        assert silent[0].recv(1) == b''
        wait_until(lambda: threading.active_count() <= before + 64,
                   'the threads of silent connections end')
        silent[-1].sendall(GREETING)
        assert silent[-1].recv(len(GREETING)) == GREETING
    relay.close()


def test_a_relay_greets_at_once_and_makes_an_offer_once_for_all_that_wait(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """On a busy computer, viewers gave up before each had an offer of its own, for minutes."""
    view = tmp_path / 'cell.rviz'
    view.write_text('Visualization Manager: {}', encoding='utf-8')
    relay = ViewRelay('127.0.0.1', range(0, 1), str(view), '')
    host, port = relay.address.split(':')
    may_go_on, made = threading.Event(), []

    def offer(_view: str) -> Any:
        made.append(1)
        may_go_on.wait(PATIENCE_S)
        return OFFER, {}

    monkeypatch.setattr(relay, '_offer', offer)
    monkeypatch.setattr(relay, '_topics', dict)
    relay.run()
    with ExitStack() as stack:
        viewers = []
        for _ in range(4):
            viewer = stack.enter_context(socket.create_connection((host, int(port))))
            viewer.settimeout(PATIENCE_S)
            viewer.sendall(GREETING)
            assert viewer.recv(len(GREETING)) == GREETING
            viewers.append(viewer)
        viewers.pop().close()  # it gives up
        may_go_on.set()
        for viewer in viewers:
            assert viewer.recv(1) == bytes([Kind.OFFER])
    assert made == [1]
    relay.close()


def test_a_relay_that_ends_lets_nobody_in(tmp_path: Path) -> None:
    """Otherwise a viewer reports that it is connected again, just before the next loss."""
    relay = ViewRelay('127.0.0.1', range(0, 1), str(tmp_path / 'none.rviz'), '')
    host, port = relay.address.split(':')
    relay.run()
    with socket.create_connection((host, int(port))) as first:  # it accepts
        first.sendall(GREETING)
        assert first.recv(len(GREETING)) == GREETING
    relay.close()
    with pytest.raises(ConnectionRefusedError):
        socket.create_connection((host, int(port)))


def test_a_shortage_of_threads_does_not_end_the_relay(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    relay = ViewRelay('127.0.0.1', range(0, 1), str(tmp_path / 'none.rviz'), '')
    host, port = relay.address.split(':')
    relay.run()
    start, short = threading.Thread.start, [True]

    def start_if_possible(thread: threading.Thread) -> None:
        if thread.name.startswith('welcome') and short:
            short.clear()
            raise RuntimeError("can't start new thread")
        start(thread)

    monkeypatch.setattr(threading.Thread, 'start', start_if_possible)
    with socket.create_connection((host, int(port))) as first:
        first.settimeout(PATIENCE_S)
        assert first.recv(1) == b'', 'it is closed'
    with socket.create_connection((host, int(port))) as second:
        second.settimeout(PATIENCE_S)
        second.sendall(GREETING)
        assert second.recv(len(GREETING)) == GREETING
    relay.close()


def test_messages_that_are_too_large_are_told_as_long_as_they_are(
        both_ends: List[socket.socket], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(viewer_link, 'MAX_BYTES', 10)
    monkeypatch.setattr(viewer_link, '_REPORT_PERIOD_S', 0.0)
    relay, viewer = both_ends
    relay.sendall(GREETING)
    link = ViewerLink(relay, 'viewer', TopicFeed(), lambda _link: None)
    link.start(OFFER, {}, {})
    cloud = FeedChannel(1, '/cloud', 'a/B', '', '/camera', False)
    viewer.settimeout(PATIENCE_S)
    viewer.sendall(GREETING)
    reader = PacketReader()

    def left_out() -> Dict[str, Any]:
        viewer.sendall(number_packet(Kind.PING, 1))
        while True:
            for packet in reader.take(viewer.recv(1000)):
                if packet.kind == Kind.LEFT_OUT:
                    return packet.json()

    assert left_out() == {}
    for channel in (cloud, cloud._replace(number=2, is_latched=True)):
        link.take(channel, 0, bytes(11))
        assert left_out() == left_out() == {'/cloud': 1}
        link.take(channel, 0, bytes(10))
        assert left_out() == {}
    link.close()


class Wishes(TopicFeed):
    """Feed that notes the requests of a viewer."""

    def __init__(self) -> None:
        super().__init__()
        self.wanted: 'queue.Queue[Collection[str]]' = queue.Queue()

    def want(self, taker: Any, topics: Collection[str]) -> None:
        self.wanted.put(topics)


def test_a_viewer_that_wants_something_else_all_the_time_does_not_keep_the_master_busy(
        both_ends: List[socket.socket]) -> None:
    """Each change is a request to the master; of several at once, only the last one counts."""
    relay, viewer = both_ends
    feed = Wishes()
    link = ViewerLink(relay, 'viewer', feed, lambda _link: None)
    link.start(OFFER, {}, {name: OfferedTopic('a/B', '', '') for name in ('/a', '/b')})
    viewer.sendall(GREETING + 500 * (
        json_packet(Kind.WANT, topics=['/a']) + json_packet(Kind.WANT, topics=[]))
        + json_packet(Kind.WANT, topics=['/b']))
    taken = [feed.wanted.get(timeout=PATIENCE_S)]
    while taken[-1] != {'/b'}:
        taken.append(feed.wanted.get(timeout=PATIENCE_S))
    assert len(taken) < 50
    link.close()
