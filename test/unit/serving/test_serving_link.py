# SPDX-License-Identifier: BSD-3-Clause
"""The node of a live page and its master: it registers completely again after a restart."""
from __future__ import annotations

from typing import Any, Iterator, List, Set, Tuple, cast

import pytest
import rosgraph

from process_visualizer.serving import cell_link
from process_visualizer.serving.cell_link import CellLink, PageClock
from process_visualizer.serving.live_cell import LiveCell


class Master:
    """Master that loses all nodes when it is restarted; answers some requests only."""

    def __init__(self) -> None:
        self.topics: Set[str] = set()
        self.answers, self.is_one = 1000, True

    def __call__(self, *_arguments: Any, **_values: Any) -> 'Master':
        """Stand in for the classes that ask the master."""
        return self

    def __enter__(self) -> 'Master':
        return self

    def __exit__(self, *_error: object) -> None:
        pass

    def getPid(self) -> int:  # noqa: N802
        """See MasterClient."""
        if not self.is_one:
            raise rosgraph.MasterException('the answer of the master is invalid')
        return 1

    def lookupNode(self, _name: str) -> str:  # noqa: N802
        """See MasterClient."""
        if not self.topics:
            raise rosgraph.MasterException('unknown node')
        return 'http://node'

    def registerSubscriber(  # noqa: N802
            self, _caller: str, topic: str, _kind: str, _uri: str) -> Tuple[int, str, List[str]]:
        """See rosgraph.Master."""
        if self.answers == 0:
            raise OSError('timed out')
        self.answers -= 1
        self.topics.add(topic)
        return 1, '', []

    def publisherUpdate(self, *_arguments: Any) -> None:  # noqa: N802
        """See rospy's node."""


class Subscriber:
    """Stand-in for rospy's class."""

    type = 'a/B'

    def __init__(self, topic: str, *_arguments: Any, **_values: Any) -> None:
        self.resolved_name = topic


@pytest.fixture
def master(monkeypatch: pytest.MonkeyPatch) -> Master:
    made = Master()
    for name in ('MasterClient', 'ServerProxy'):
        monkeypatch.setattr(cell_link, name, made)
    monkeypatch.setattr(cell_link, 'is_registered', lambda _name: True)
    monkeypatch.setattr(cell_link, '_MASTER_S', 600.0)
    monkeypatch.setattr(cell_link.rospy, 'Subscriber', Subscriber)
    monkeypatch.setattr(cell_link.rospy, 'get_node_uri', lambda: 'http://node')
    return made


@pytest.fixture
def link(master: Master) -> Iterator[CellLink]:
    made = CellLink(cast(LiveCell, None), (), PageClock())
    yield made
    made.close()


def test_a_registration_that_was_cut_off_goes_on(master: Master, link: CellLink) -> None:
    wanted = {it.resolved_name for it in link._subscribers}
    master.answers = 3
    assert link._problem() == ''
    assert len(master.topics) == 3
    master.answers = 1000
    assert link._problem() == ''
    assert master.topics == wanted
    master.topics, master.answers = {'/a'}, 0
    assert link._problem() == '', 'the master knows the node, and is asked nothing more'


def test_what_is_no_master_is_told(master: Master, link: CellLink) -> None:
    master.is_one = False
    assert link._problem() == 'The ROS master does not answer'
