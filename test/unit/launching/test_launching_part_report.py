# SPDX-License-Identifier: BSD-3-Clause
"""The order of a part's states."""
from __future__ import annotations

from typing import Callable, List

import pytest
from hypothesis import given
from hypothesis import strategies as st

from process_visualizer.launching.part_report import NodeReport, NodeState, PartReport, PartState

NAMES = ('/a', '/b')
STARTING = PartReport('arm').starting(NAMES)


def running(name: str) -> NodeReport:
    return NodeReport(name).registered()


def exited(name: str, code: int) -> NodeReport:
    return running(name).exited(code)


UP = STARTING.node_changed(running('/a')).node_changed(running('/b'))


def test_a_part_runs_when_all_of_its_nodes_do() -> None:
    half = STARTING.node_changed(running('/a'))
    assert (STARTING.state, half.state, UP.state) == (
        PartState.STARTING, PartState.STARTING, PartState.RUNNING)
    assert [(node.name, node.state) for node in half.nodes] == [
        ('/a', NodeState.RUNNING), ('/b', NodeState.STARTING)]


@pytest.mark.parametrize('end', [exited('/b', 0), exited('/b', 7), NodeReport('/b').failed('why')])
def test_a_part_is_up_without_a_node_that_has_ended(end: NodeReport) -> None:
    part = STARTING.node_changed(running('/a')).node_changed(end)
    assert part.state is PartState.RUNNING
    assert part.dead_nodes == (() if end.exit_code == 0 else (end,))


def test_a_node_that_dies_does_not_end_its_part() -> None:
    part = UP.node_changed(exited('/a', 1))
    assert (part.state, part.dead_nodes) == (PartState.RUNNING, (exited('/a', 1),))
    again = part.node_changed(exited('/a', 1).started())
    assert (again.state, again.dead_nodes) == (PartState.RUNNING, ())


def test_part_without_nodes() -> None:
    part = PartReport('stand').starting([])
    assert part.launched().state is part.ended(0).state is PartState.RUNNING
    failed = part.ended(1, ('a', 'RLException: the file is wrong', 'b'))
    assert (failed.state, failed.reason) == (PartState.FAILED, 'the file is wrong')
    assert failed.log_tail == ('a', 'RLException: the file is wrong', 'b')


def test_part_whose_work_is_done() -> None:
    done = UP.node_changed(exited('/a', 0)).node_changed(exited('/b', 0)).ended(0)
    assert (done.state, done.reason) == (PartState.STOPPED, '')


@pytest.mark.parametrize('before, code, tail, required, reason', [
    (UP.node_changed(exited('/a', 3)), 0, (), exited('/a', 3),
     'the required node /a: ended with code 3'),
    (UP, 0, (), exited('/a', 0), 'the required node /a: ended with code 0'),
    (UP.node_changed(exited('/a', 0)).node_changed(exited('/b', 5)), 0, (), None,
     'all nodes have ended: /b: ended with code 5'),
    (UP, -9, (), None, 'roslaunch: killed by SIGKILL'),
    (STARTING, 1, ('some text',), None, 'roslaunch: ended with code 1'),
    (STARTING, 0, (), None, 'roslaunch: ended with code 0')])
def test_roslaunch_has_ended_by_itself(before: PartReport, code: int, tail: 'tuple[str, ...]',
                                       required: 'NodeReport | None', reason: str) -> None:
    failed = before.ended(code, tail, required)
    assert (failed.state, failed.reason, failed.log_tail) == (PartState.FAILED, reason, tail)


def test_the_end_that_was_asked_for_is_no_failure() -> None:
    stopping = UP.stopping()
    assert stopping.ended(0) == stopping.node_changed(exited('/a', 1)) == stopping
    assert stopping.stopped() == PartReport('arm') == stopping.stopped().ended(0)


def test_a_failed_part_starts_anew() -> None:
    failed = PartReport('arm').starting(NAMES).failed('no room')
    assert (failed.state, failed.reason) == (PartState.FAILED, 'no room')
    assert failed.stopping().stopped().starting(NAMES) == STARTING


@pytest.mark.parametrize('change', [
    lambda: UP.starting(NAMES), lambda: STARTING.starting(NAMES),
    lambda: UP.stopping().stopping(), lambda: UP.stopping().starting(NAMES),
    lambda: PartReport('arm').failed('x'), lambda: UP.ended(1).starting(NAMES)])
def test_impossible_changes(change: Callable[[], PartReport]) -> None:
    with pytest.raises(ValueError, match='the part "arm" is .*; it cannot become '):
        change()


def test_stopping_what_has_ended_meanwhile() -> None:
    done = UP.node_changed(exited('/a', 0)).node_changed(exited('/b', 0)).ended(0)
    assert done.stopping() == done
    assert done.stopping().stopped() == PartReport('arm')


CHANGES = st.sampled_from([
    lambda part: part.starting(NAMES), lambda part: part.starting([]),
    *(lambda part, it=node: part.node_changed(it) for node in (
        running('/a'), running('/b'), exited('/a', 1), exited('/b', 0), NodeReport('/c'))),
    lambda part: part.launched(), lambda part: part.ended(0), lambda part: part.ended(-9),
    lambda part: part.failed('x'), lambda part: part.stopping(), lambda part: part.stopped()])


@given(st.lists(CHANGES, max_size=30))
def test_any_changes(changes: List[Callable[[PartReport], PartReport]]) -> None:
    """In any order of events: a part is never up with a node missing, and can be stopped."""
    part = PartReport('arm')
    for change in changes:
        before = part
        try:
            part = change(part)
        except ValueError:
            assert part == before
        if before.state is PartState.STARTING and part.state is PartState.RUNNING:
            assert all(node.state is not NodeState.STARTING for node in part.nodes)
        assert (part.reason != '') is (part.state is PartState.FAILED) or part.state in (
            PartState.STOPPING,)
    if part.state is not PartState.STOPPING:
        part = part.stopping()
    assert part.stopped() == PartReport('arm')
