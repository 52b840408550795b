# SPDX-License-Identifier: BSD-3-Clause
"""Attacks of a hostile cell on a viewer: endless data, and nonsense."""
from __future__ import annotations

import threading
from pathlib import Path
from types import SimpleNamespace
from typing import Any, List, Tuple

import pytest
from std_msgs.msg import String
from surroundings import PATIENCE_S, wait_until

from process_visualizer.launching.cell_watch import MASTER_SILENT, CellLook
from process_visualizer.launching.part_report import NodeReport
from process_visualizer.remote.offer import Offer, OfferedTopic
from process_visualizer.remote.packets import Message
from process_visualizer.viewing import viewer
from process_visualizer.viewing.relay_connection import RelaySource
from process_visualizer.viewing.viewer import OwnScene, Viewer

RVIZ_HANGS, ALL_ANSWERS = CellLook(frozenset({'/rviz'})), CellLook()


class Nothing:
    """Stand-in for a publisher or a sender."""

    def __init__(self, *_arguments: Any, **_values: Any) -> None:
        pass

    def start(self) -> None:
        pass

    def close(self) -> None:
        pass


@pytest.fixture(autouse=True)
def no_ros(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(viewer.rospy, 'Publisher', Nothing)
    monkeypatch.setattr(viewer, 'TimedSender', Nothing)


def test_problems_of_messages_are_told_up_to_a_limit() -> None:
    scene = OwnScene(lambda: None)
    told = []
    for number in range(1000):
        scene.show(RelaySource(f'/t{number}', 'a/B', '', '/c', False), Message(1, 0, b''))
        told += scene.take_problems()
    assert len(told) == len(set(told)) == 101
    assert told[-1] == 'there are more problems like these, which are not told'


@pytest.mark.parametrize('is_latched', [False, True])
def test_a_message_stays_for_later_subscribers_only_if_the_cell_latches_it(
        monkeypatch: pytest.MonkeyPatch, is_latched: bool) -> None:
    """Otherwise they would get joints from the time when the last subscriber left."""
    done: List[str] = []

    class Publisher(Nothing):
        def publish(self, source: int, pieces: List[bytes], due_ns: int) -> None:
            done.append('publish')

        def withdraw(self, source: int, due_ns: int) -> None:
            done.append('withdraw')

    monkeypatch.setattr(viewer, 'TopicPublisher', Publisher)
    scene = OwnScene(lambda: None)
    scene.advertise({'/a': OfferedTopic(String._type, String._md5sum, String._full_text)})
    scene.show(RelaySource('/a', String._type, String._md5sum, '/c', is_latched),
               Message(1, 0, b'\x01\x00\x00\x00a'))
    assert scene.take_problems() == []
    assert done == (['publish'] if is_latched else ['publish', 'withdraw'])


def test_an_rviz_that_hangs_is_told_and_that_it_is_over(tmp_path: Path) -> None:
    address: Tuple[str, int] = ('127.0.0.1', 1)
    said: List[str] = []
    it = Viewer('cell', address, lambda: address, str(tmp_path), said.append, True)
    for look in (RVIZ_HANGS, ALL_ANSWERS, CellLook(master_problem=MASTER_SILENT)):
        it._take_look(look)
    assert said[0] == 'RViz is not responding'
    assert said[1].startswith('RViz is not responding: over')
    assert said[2].startswith('ROS master')


def test_an_rviz_that_was_killed_is_told_with_its_last_words(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(viewer, 'RelayConnection', Nothing)
    said: List[str] = []
    it = Viewer('cell', ('127.0.0.1', 1), lambda: ('127.0.0.1', 1), str(tmp_path), said.append,
                True)
    failed = NodeReport('/rviz').started().exited(-9, ('no screen',))
    run: Any = SimpleNamespace(failed_required=failed, reports=list, stop=list)
    it._run, it._is_ended = run, True
    assert it.run() == 1
    it.close()
    assert said[-1] == 'RViz: killed by SIGKILL\n  no screen'


def test_topics_of_a_former_cell_are_not_advertised_any_more(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    closed: List[str] = []

    class Publisher(Nothing):
        subscriber_count = 1

        def __init__(self, name: str, *_arguments: Any) -> None:
            self.name = name

        def close(self) -> None:
            closed.append(self.name)

    monkeypatch.setattr(viewer, 'TopicPublisher', Publisher)
    it = Viewer('cell', ('127.0.0.1', 1), lambda: ('127.0.0.1', 1), str(tmp_path), print, False)
    offer = Offer(viewer._own_version(), 'realtime', 'a', {}, {}, 'pc:1')
    topic = OfferedTopic(String._type, String._md5sum, String._full_text)
    it.on_offer(offer)
    it.on_topics({'/a': topic})
    it.on_offer(offer)  # connected again
    assert it._scene.wanted() == {'/a'} and not closed
    it.on_offer(offer._replace(view='b'))
    it.on_topics({'/b': topic})
    assert it._scene.wanted() == {'/b'} and closed == ['/a']


def test_nothing_is_latched_that_nobody_follows_any_more(
        tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A frame was moved meanwhile, and the next subscriber got its former place first."""
    done: List[str] = []

    class Publisher(Nothing):
        subscriber_count = 1

        def publish(self, source: int, pieces: List[bytes], due_ns: int) -> None:
            done.append('publish')

        def withdraw(self, source: int, due_ns: int) -> None:
            done.append('withdraw')

    monkeypatch.setattr(viewer, 'TopicPublisher', Publisher)
    it = Viewer('cell', ('127.0.0.1', 1), lambda: ('127.0.0.1', 1), str(tmp_path), print, False)
    it.on_topics({'/a': OfferedTopic(String._type, String._md5sum, String._full_text)})
    it._changed_wants()
    it.on_message(RelaySource('/a', String._type, String._md5sum, '/c', True),
                  Message(1, 0, b'\x01\x00\x00\x00a'))
    it._changed_wants()
    assert done == ['publish']
    Publisher.subscriber_count = 0
    it._changed_wants()
    assert done == ['publish', 'withdraw']


def test_the_newest_wish_is_sent_last(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A cloud never came: two topics got their subscribers at the same time."""
    it = Viewer('cell', ('127.0.0.1', 1), lambda: ('127.0.0.1', 1), str(tmp_path), print, False)
    wanted, sent, other = {'/a'}, [], threading.Thread(target=it._changed_wants)

    def want(topics: Tuple[str, ...]) -> None:
        if topics == ('/a',):
            wanted.add('/b')
            other.start()
            other.join(0.2)  # ends only if it does not wait for this one
        sent.append(topics)

    monkeypatch.setattr(it._scene, 'wanted', lambda: set(wanted))
    monkeypatch.setattr(it._connection, 'want', want)
    it._changed_wants()
    other.join(PATIENCE_S)
    assert sent == [('/a',), ('/a', '/b')]


def test_advice_comes_only_after_attempts_to_connect(tmp_path: Path,
                                                     monkeypatch: pytest.MonkeyPatch) -> None:
    """A viewer that stood still for minutes gave it at once, and was connected a moment later."""
    now_s, said = [1000.0], []  # type: List[float], List[str]
    monkeypatch.setattr(viewer.time, 'monotonic', lambda: now_s[0])
    it = Viewer('cell', ('127.0.0.1', 1), lambda: ('127.0.0.1', 1), str(tmp_path), said.append,
                False)
    it._take_loss('this viewer stood still for 300 s', 700.0)
    it._step()
    assert not any('--check' in text for text in said)
    now_s[0] += 16.0
    it._step()
    assert '--check' in said[-1]


def test_the_mode_is_said_whenever_it_changes(tmp_path: Path,
                                              monkeypatch: pytest.MonkeyPatch) -> None:
    said, shown = [], []  # type: List[str], List[str]
    it = Viewer('cell', ('127.0.0.1', 1), lambda: ('127.0.0.1', 1), str(tmp_path), said.append,
                True)
    monkeypatch.setattr(it, '_start', lambda _offer: None)
    monkeypatch.setattr(it._scene, 'tell', lambda text, _frame: shown.append(text))
    live = Offer(viewer._own_version(), 'realtime', 'a', {}, {}, 'pc:1')
    it._take_loss('no answer', 1.0)  # before it was ever connected
    it._take_offer(live)
    assert said[1:] == ['connected: the cell is in realtime mode'] and shown[-1] == ''
    it._take_loss('no answer', 1.0)
    del said[:]
    it._take_offer(live._replace(mode='playback', view='b'))
    assert said.pop(0).startswith('connected again after')
    assert said == ['the cell is in playback mode', 'the cell shows something else now']
    for _ in range(2):  # RViz may not have started the first time
        del shown[:]
        it._step()
        assert shown == ['a recording, not live']
    it._take_offer(live._replace(cell='pc:2'))
    it._step()
    assert said[-1] == 'another cell is there now' and shown[-1] == ''


def test_what_a_cell_sends_waits_until_there_is_time(tmp_path: Path) -> None:
    address: Tuple[str, int] = ('127.0.0.1', 1)
    it = Viewer('cell', address, lambda: address, str(tmp_path), lambda _text: None, False)

    def flood() -> None:
        while not it._is_closing:
            it.on_left_out({})

    flooding = threading.Thread(target=flood)
    flooding.start()
    wait_until(lambda: it._events.qsize() == viewer._MAX_WAITING, 'the flood')
    for _ in range(100):
        it._next_event(PATIENCE_S)()
        assert it._events.qsize() <= viewer._MAX_WAITING
    it._is_closing = True
    flooding.join(PATIENCE_S)
    assert not flooding.is_alive()


def test_a_loss_and_a_slow_link_are_not_told_in_turns(tmp_path: Path,
                                                      monkeypatch: pytest.MonkeyPatch) -> None:
    """While the link was cut, two reasons alternated ten times."""
    now_s = [100.0]
    monkeypatch.setattr(viewer.time, 'monotonic', lambda: now_s[0])
    said: List[str] = []
    it = Viewer('cell', ('127.0.0.1', 1), lambda: ('127.0.0.1', 1), str(tmp_path), said.append,
                False)
    for _ in range(5):
        it._take_loss('no answer', now_s[0])
        it._take_loss('No route to host', now_s[0])
    assert len(said) == 2
    for _ in range(5):
        it._take_left_out({'/cloud': 3})
        now_s[0] += 2.0
        it._take_left_out({})
    assert len(said) == 3 and 'not everything of /cloud arrives' in said[2]
    now_s[0] += 30.0
    it._take_left_out({})
    assert said[3:] == ['the link carries everything']
