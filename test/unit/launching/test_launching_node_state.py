# SPDX-License-Identifier: BSD-3-Clause
"""States of a node, and their order."""
from __future__ import annotations

from typing import Callable, Dict, List

import pytest
from hypothesis import given
from hypothesis import strategies as st

from process_visualizer.launching.part_report import NodeReport, NodeState

Change = Callable[[NodeReport], NodeReport]
CHANGES: Dict[str, Change] = {
    'started': lambda report: report.started(),
    'registered': lambda report: report.registered(),
    'exited': lambda report: report.exited(0),
    'died': lambda report: report.exited(-11),
    'failed': lambda report: report.failed('no such file'),
}


def after(*names: str) -> NodeReport:
    report = NodeReport('/n')
    for name in names:
        report = CHANGES[name](report)
    return report


@pytest.mark.parametrize('changes, text', [
    ([], '/n: starting'), (['started'], '/n: starting'),
    (['started', 'registered'], '/n: running'),
    (['started', 'registered', 'exited'], '/n: ended with code 0'),
    (['started', 'died'], '/n: killed by SIGSEGV'),
    (['started', 'died', 'started'], '/n: starting (restarted 1 time)'),
    (['started', 'died', 'started', 'died', 'started', 'registered'],
     '/n: running (restarted 2 times)'),
    (['failed'], '/n: cannot be started: no such file'),
    (['failed', 'started'], '/n: starting')])
def test_in_words(changes: List[str], text: str) -> None:
    assert str(after(*changes)) == text


@pytest.mark.parametrize('changes', [['started', 'died'], ['failed']])
def test_late_registration_does_not_raise_the_dead(changes: List[str]) -> None:
    assert after(*changes).registered() == after(*changes)


def test_started_again_without_word_of_an_end_is_no_restart() -> None:
    assert after('started', 'registered', 'started').restarts == 0


@given(st.lists(st.sampled_from(sorted(CHANGES))))
def test_any_order_of_events(names: List[str]) -> None:
    report = after(*names)
    assert report.name == '/n'
    assert (report.exit_code is not None) == (report.state is NodeState.EXITED)
    assert bool(report.reason) == (report.state is NodeState.FAILED)
    assert 0 <= report.restarts <= names.count('started')
    assert report.restarts <= names.count('exited') + names.count('died')
    told = ('ended with code', 'killed by') if report.state is NodeState.EXITED \
        else (report.state.value,)
    assert str(report).startswith(tuple(f'/n: {words}' for words in told))


@given(st.lists(st.sampled_from(sorted(CHANGES))), st.sampled_from(sorted(CHANGES)))
def test_last_event_counts(names: List[str], last: str) -> None:
    expected = {'started': NodeState.STARTING, 'exited': NodeState.EXITED,
                'died': NodeState.EXITED, 'failed': NodeState.FAILED}
    before, now = after(*names), after(*names, last)
    if last in expected:
        assert now.state is expected[last]
    else:
        running = before.state in (NodeState.STARTING, NodeState.RUNNING)
        assert now.state is (NodeState.RUNNING if running else before.state)
