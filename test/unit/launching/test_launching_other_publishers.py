# SPDX-License-Identifier: BSD-3-Clause
"""Other publishers, as reported by a small master; each of its nodes has its own answer."""
from __future__ import annotations

import threading
from typing import Any, Dict, Iterator, List

import pytest

from process_visualizer.health import other_publishers as module
from process_visualizer.health.other_publishers import (
    OtherPublisher,
    PublisherWatch,
    described,
    other_publishers,
    publishing_players,
)

STATE: Dict[str, Any] = {
    'publishers': [['/q', ['/driver', '/dead', '/bag_player']], ['/f', ['/play_17']],
                   ['/rosout', ['/driver']]],
    'services': [['/bag_player/seek', ['/bag_player']], ['/bag_player/set_loop', ['/bag_player']],
                 ['/bag_player/set_rate', ['/bag_player']], ['/play_17/pause_playback',
                                                             ['/play_17']],
                 ['/driver/seek', ['/driver']], ['/bag_player/set_rate', ['/other']]]}


@pytest.fixture(autouse=True)
def master(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    class Master:
        def __init__(self, _caller: str, timeout_s: float) -> None:
            pass

        def getSystemState(self) -> List[Any]:
            return [STATE['publishers'], [], STATE['services']]

    monkeypatch.setattr(module, 'MasterClient', Master)
    monkeypatch.setattr(module, 'is_registered', lambda node: node != '/dead')
    yield


def test_all_that_live_but_the_own() -> None:
    assert other_publishers(['/q', '/nobody'], {'/bag_player'}) == (
        OtherPublisher('/q', '/driver'),)
    assert other_publishers(['/f', '/q']) == (
        OtherPublisher('/f', '/play_17'), OtherPublisher('/q', '/bag_player'),
        OtherPublisher('/q', '/driver'))


def test_players_are_known_by_their_services() -> None:
    assert publishing_players(['/q', '/f', '/rosout']) == (
        OtherPublisher('/q', '/bag_player'), OtherPublisher('/f', '/play_17'))


def test_a_sentence_for_each_node() -> None:
    assert described([OtherPublisher(topic, '/driver') for topic in ('/a', '/b', '/c', '/d')]
                     + [OtherPublisher('/a', '/play_1')]) == [
        '/a, /b and 2 more are published by /driver', '/a is published by /play_1']


def test_a_watch_tells_changes_only() -> None:
    a, b = OtherPublisher('/q', '/a'), OtherPublisher('/q', '/b')
    looks = [(), (a,), OSError('no master'), (a,), (a, b), ()]
    told: List[Any] = []
    ended = threading.Event()

    def look() -> Any:
        if not looks:
            ended.set()
            return ()
        found = looks.pop(0)
        if isinstance(found, Exception):
            raise found
        return found

    watch = PublisherWatch(look, told.append)
    watch.look()
    watch.begin()
    assert ended.wait(60.0)
    watch.close()
    assert told == [(a,), (a, b), ()]
