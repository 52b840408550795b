# SPDX-License-Identifier: BSD-3-Clause
"""Stand-ins for a node's handle have all of its methods, with the same names."""
from __future__ import annotations

import inspect
import logging
import threading
from typing import List

import pytest
from rospy import AnyMsg
from rospy.impl.rosout import RosOutHandler
from simulated_node import SimulatedNode

from process_visualizer.msg import GhostRobot
from process_visualizer.nodes.common.node_handle import NodeHandle, log_without_waiting
from process_visualizer.srv import ShowGhost, ShowGhostRequest

OF_PLAYER = 'thread'  # only the player has threads of its own, and simulated_player schedules them
NAMES = [name for name, value in vars(NodeHandle).items()
         if inspect.isfunction(value) and not name.startswith('_') and name != OF_PLAYER]


def parameters(owner: type, name: str) -> List[str]:
    return [it.lstrip('_') for it in inspect.signature(getattr(owner, name)).parameters]


@pytest.mark.parametrize('name', NAMES)
def test_the_simulated_node_takes_the_same(name: str) -> None:
    assert parameters(SimulatedNode, name) == parameters(NodeHandle, name)


@pytest.mark.parametrize('name', [
    pytest.param('/a' * 500, id='long'), '/arm\x1b[31m/joint_states', '/arm\n', '/a\ud800',
    '/\u202e', ''])
def test_a_name_that_rospy_would_repeat_for_ever_is_refused(name: str) -> None:
    """A subscriber with it kept the lock that all others of the node need."""
    node = NodeHandle()
    for use in (lambda: node.subscribe(name, AnyMsg, lambda _: None), lambda: node.param(name)):
        with pytest.raises(ValueError, match='is not a name of a topic|has 1000 characters'):
            use()


@pytest.mark.parametrize(('name', 'reason'), [
    pytest.param('x' * 1_000_000, 'joints has 1000000 characters; at most 255', id='long'),
    ('a\nb', r"joints: 'a\nb' is not a name")])
def test_a_request_with_what_is_no_name_is_refused_in_a_sentence(name: str, reason: str) -> None:
    node = SimulatedNode()
    node.serve('~show', ShowGhost, lambda _: pytest.fail('it is handled'))
    request = ShowGhostRequest(robots=[GhostRobot(device='arm', joints=['slide', name])])
    answer = node.services[node.resolve('~show')](request)
    assert not answer.success
    assert answer.message.startswith(reason)
    assert len(answer.message) < 100


def test_who_logs_does_not_wait_for_a_master_that_hangs() -> None:
    is_back, texts, all_sent = threading.Event(), [], threading.Event()

    class Hanging(RosOutHandler):
        def emit(self, record: logging.LogRecord) -> None:
            assert is_back.wait(20.0)
            texts.append(record.getMessage())
            if len(texts) == 2:
                all_sent.set()

    log = logging.Logger('a log')
    log.addHandler(Hanging())
    log_without_waiting(log)
    log.warning('the master does not answer: %s', 'timed out')
    log.warning('again')
    assert texts == []
    is_back.set()
    assert all_sent.wait(20.0)
    assert texts == ['the master does not answer: timed out', 'again']
