# SPDX-License-Identifier: BSD-3-Clause
"""Each run of a cell that is followed live adds a row with its verdict."""
from __future__ import annotations

import json
from typing import List, Optional

import pytest

from process_visualizer.runs.comparison.live_comparison import LiveDeparture
from process_visualizer.runs.comparison.live_runs import (
    FinishedRun,
    LiveRuns,
    finished_run,
    with_rest,
)
from process_visualizer.runs.deviation.signals import Signal, SignalKind

NOON_S, LENGTH_S = 1_800_000_000.0, 8.0
FORCE = Signal('arm', 'tool force', 'N', SignalKind.FORCE)


class Following:
    """Cell that is followed: ten moments per second."""

    def __init__(self) -> None:
        self.runs, self.now_s = LiveRuns('a.bag#1', LENGTH_S), 0.0
        self.finished: List[FinishedRun] = []

    def pass_(self, seconds: float, from_s: Optional[float], beyond: float = 0.0,
              is_judged: bool = True) -> None:
        """Let time pass; ``from_s`` is the first moment of the reference, None: in no run."""
        for tenth in range(round(10 * seconds)):
            reference_s = None if from_s is None else from_s + 0.1 * tenth
            found = self.runs.at(NOON_S + self.now_s, reference_s)
            self.finished += [found] if found is not None else []
            if is_judged:
                away = LiveDeparture(FORCE, NOON_S + self.now_s, beyond)
                self.runs.judge([away] if beyond else [])
            self.now_s += 0.1


@pytest.fixture
def following() -> Following:
    return Following()


def test_a_good_run(following: Following) -> None:
    following.pass_(LENGTH_S, 0.0)
    following.pass_(3.0, None)
    [run] = following.finished
    assert (run.verdict, run.is_good, run.reference) == ('in range', True, 'a.bag#1')
    assert run.ended_s - run.began_s == pytest.approx(LENGTH_S - 0.1)


def test_a_fault_that_is_over_before_the_run_is_told_at_its_end(following: Following) -> None:
    following.pass_(3.0, 0.0)
    following.pass_(1.0, 3.0, beyond=2.0)
    following.pass_(1.0, 4.0, beyond=7.9)
    following.pass_(3.0, 5.0)
    following.pass_(3.0, None)
    [run] = following.finished
    assert run.verdict == 'out of range: arm tool force +7.9 N from 0:03.00'
    assert not run.is_good


def test_a_departure_that_was_found_late_is_dated_when_it_began(following: Following) -> None:
    following.pass_(4.1, 0.0)
    following.runs.judge([LiveDeparture(FORCE, NOON_S + 2.5, 7.9)])
    ended = following.runs.end()
    assert ended is not None
    assert ended.verdict.startswith('out of range: arm tool force +7.9 N from 0:02.50')


def test_a_run_behind_another_one(following: Following) -> None:
    following.pass_(LENGTH_S, 0.0, beyond=3.0)
    following.pass_(LENGTH_S, 0.0)
    following.pass_(3.0, None)
    assert [it.is_good for it in following.finished] == [False, True]


def test_a_moment_that_is_not_known_divides_no_run(following: Following) -> None:
    following.pass_(3.0, 0.0)
    following.pass_(0.6, None)
    following.pass_(LENGTH_S - 3.6, 3.6)
    following.pass_(3.0, None)
    assert len(following.finished) == 1


def test_a_run_that_is_broken_off(following: Following) -> None:
    following.pass_(4.1, 0.0)
    ended = following.runs.end()
    assert ended is not None and ended.verdict == 'in range, broken off at 0:04.00'
    assert not ended.is_good and ended.is_good_in_part
    assert following.runs.end() is None


def test_a_run_that_is_no_longer_watched_is_not_called_broken_off(following: Following) -> None:
    """*Apply* and *Quit all nodes* end the comparison; the process continues."""
    following.pass_(4.1, 0.0, beyond=3.0)
    ended = following.runs.end(is_watched=False)
    assert ended is not None and ended.verdict.endswith(', not compared after 0:04.00')
    assert not ended.is_good and finished_run(json.loads(json.dumps(ended.settings()))) == ended
    following.pass_(LENGTH_S, 0.0)
    ended = following.runs.end(is_watched=False)
    assert ended is not None and ended.verdict == 'in range'


def test_a_run_during_which_nodes_were_restarted_is_one(following: Following) -> None:
    following.pass_(4.1, 0.0, beyond=3.0)
    begun = following.runs.end(is_watched=False)
    following.now_s += 2.0
    following.pass_(LENGTH_S - 6.1, 6.1)
    rest = following.runs.end()
    assert begun is not None and rest is not None
    whole = with_rest(begun, rest)
    assert whole is not None and whole.began_s == begun.began_s and whole.ended_s == rest.ended_s
    assert whole.verdict.endswith(', not compared from 0:04.00 to 0:06.10')
    assert whole.departed == begun.departed and not whole.is_good
    assert finished_run(json.loads(json.dumps(whole.settings()))) == whole
    good = with_rest(begun._replace(departed=()), rest)
    assert good is not None and good.verdict == 'in range, not compared from 0:04.00 to 0:06.10'
    assert good.is_good_in_part
    for other in (rest._replace(began_s=rest.began_s + 5.0), rest._replace(seen_from_s=None),
                  rest._replace(reference='b.bag#1')):
        assert with_rest(begun, other) is None


def test_a_run_that_was_not_compared_from_its_beginning(following: Following) -> None:
    following.pass_(LENGTH_S - 4.0, 4.0)
    following.pass_(LENGTH_S, 0.0)
    following.pass_(3.0, None)
    assert [it.verdict for it in following.finished] == ['in range from 0:04.00 on', 'in range']
    assert [(it.is_good, it.is_good_in_part) for it in following.finished] == [
        (False, True), (True, False)]


def test_what_was_not_judged_is_not_good(following: Following) -> None:
    following.pass_(LENGTH_S, 0.0, is_judged=False)
    following.pass_(3.0, None, is_judged=False)
    assert (following.finished[0].verdict, following.finished[0].is_good) == ('no data', False)


def test_channels_that_lacked_values_are_named(following: Following) -> None:
    following.pass_(4.0, 0.0)
    for name, seconds in (('arm tool force', 0.4), ('a', 0.4), ('a', 1.2), ('b', 0.8), ('c', 2.0)):
        following.runs.judge([], {name: seconds})
    following.pass_(LENGTH_S - 4.0, 4.0)
    following.pass_(LENGTH_S, 0.0)
    following.pass_(3.0, None)
    first, second = following.finished
    assert first.verdict == (
        'in range, not judged: c for 2.0 s, a for 1.6 s and 1 more (data missing or late)')
    assert (first.is_good, first.is_good_in_part) == (False, True)
    assert finished_run(json.loads(json.dumps(first.settings()))) == first
    assert second.verdict == 'in range', 'it is another run'


def test_what_is_too_short_is_no_run(following: Following) -> None:
    following.pass_(0.5, 0.0)
    following.pass_(3.0, None)
    assert following.finished == []


def test_it_is_kept() -> None:
    run = FinishedRun(NOON_S, NOON_S + 8.0, 'a.bag#1', ('arm tool force +7.9 N',), True, 4.0)
    for it in (run, run._replace(broken_off_s=None, seen_from_s=9.8)):
        assert finished_run(json.loads(json.dumps(it.settings()))) == it


def test_a_run_is_in_range_only_from_where_its_values_are_known_again() -> None:
    cell = Following()
    cell.pass_(4.0, 0.0)
    cell.runs.lose()
    cell.pass_(1.0, 4.0, is_judged=False)
    cell.pass_(3.0, 5.0)
    cell.pass_(2.0, None)
    assert cell.finished[-1].verdict == 'in range, not compared from 0:03.90 to 0:05.00'
    assert cell.finished[-1].is_good_in_part


def test_a_run_that_ends_just_after_a_gap_is_a_run() -> None:
    cell = Following()
    cell.pass_(6.0, 0.0)
    cell.runs.lose()
    cell.pass_(1.7, 6.0, is_judged=False)
    cell.pass_(0.3, 7.7)
    cell.pass_(2.0, None)
    run, = cell.finished
    assert run.verdict == 'in range, not compared from 0:05.90 to 0:07.70'


def test_a_silent_ghost_is_a_gap_in_the_comparison_that_is_named_once() -> None:
    """*Apply* restarts nodes while the process continues."""
    cell = Following()
    cell.pass_(4.1, 0.0)
    cell.now_s += 2.0
    cell.pass_(1.9, 6.1)
    cell.runs.judge([], {'the moment in the reference': 2.0, 'arm tool force': 2.3, 'feed': 3.9})
    cell.pass_(2.0, None)
    run, = cell.finished
    assert run.verdict == ('in range, not compared from 0:04.00 to 0:06.10, '
                           'not judged: feed for 3.9 s (data missing or late)')


def test_what_moves_after_a_silent_ghost_may_be_another_run() -> None:
    cell = Following()
    cell.pass_(4.1, 0.0)
    cell.now_s += 8.0
    cell.pass_(3.0, 5.0)
    cell.pass_(2.0, None)
    assert [it.verdict for it in cell.finished] == [
        'in range, not compared after 0:04.00', 'in range from 0:05.00 on']


def test_an_interruption_too_short_to_be_missed_is_not_named(following: Following) -> None:
    following.pass_(4.1, 0.0)
    begun = following.runs.end(is_watched=False)
    following.pass_(LENGTH_S - 4.2, 4.2)
    rest = following.runs.end()
    assert begun is not None and rest is not None
    whole = with_rest(begun, rest)
    assert whole is not None and whole.verdict == 'in range'


def test_a_run_whose_beginning_was_lost_is_compared_from_where_its_values_are_known() -> None:
    cell = Following()
    cell.runs.lose()
    cell.pass_(4.0, 0.0, is_judged=False)
    cell.pass_(4.0, 4.0)
    cell.pass_(2.0, None)
    assert cell.finished[-1].verdict == 'in range from 0:04.00 on'


def test_a_run_of_which_nothing_was_seen_for_long_is_still_one_run() -> None:
    """The recorder was killed: a run of 0.00 s was "no data", and the rest of it another run."""
    cell = Following()
    cell.runs.lose()
    cell.pass_(6.0, 0.0, is_judged=False)
    assert not cell.finished
    cell.pass_(2.0, 6.0)
    cell.pass_(2.0, None)
    assert [it.verdict for it in cell.finished] == ['in range from 0:06.00 on']
    cell.runs.lose()
    cell.pass_(LENGTH_S, 0.0, is_judged=False)
    cell.pass_(2.0, None, is_judged=False)
    assert len(cell.finished) == 1, 'nothing was seen of this one'


def test_a_run_whose_values_do_not_come_again_is_not_said_to_be_in_range() -> None:
    cell = Following()
    cell.pass_(4.0, 0.0)
    cell.runs.lose()
    cell.pass_(4.0, 4.0, is_judged=False)
    cell.pass_(2.0, None, is_judged=False)
    run = cell.finished[-1]
    assert run.verdict == 'in range, no data from 0:03.90 on'
    assert not run.is_good and run.is_good_in_part
    cell.pass_(8.0, 0.0)
    cell.pass_(2.0, None)
    assert cell.finished[-1].verdict == 'in range'


def test_what_was_out_of_range_before_the_values_were_lost_is_still_said() -> None:
    cell = Following()
    cell.pass_(4.0, 0.0, beyond=2.0)
    cell.runs.lose()
    cell.pass_(4.0, 4.0, is_judged=False)
    cell.pass_(2.0, None, is_judged=False)
    assert cell.finished[-1].verdict.startswith('out of range: arm tool force +')


def test_a_run_without_values_for_long_ends_and_what_moves_later_is_not_counted_into_it() -> None:
    cell = Following()
    cell.pass_(4.1, 0.0)
    for tenth in range(260):
        cell.runs.lose()
        cell.pass_(0.1, 4.0, is_judged=False)
        assert len(cell.finished) == int(tenth > 49), 'once, and nothing begins without values'
    cell.pass_(3.0, 4.1, beyond=-13.5)
    cell.pass_(2.0, None)
    before, after = cell.finished
    assert (before.verdict, before.is_good) == ('in range, no data from 0:04.00 on', False)
    assert before.ended_s == pytest.approx(NOON_S + 4.1, abs=0.11)
    assert 'out of range' in after.verdict


def test_what_was_out_of_range_is_told_with_where_the_values_ended() -> None:
    cell = Following()
    cell.pass_(4.1, 0.0, beyond=2.0)
    for _ in range(80):
        cell.runs.lose()
        cell.pass_(0.1, 4.0, is_judged=False)
    run, = cell.finished
    assert run.verdict.startswith('out of range: arm tool force +')
    assert run.verdict.endswith(', no data from 0:04.00 on')
    assert finished_run(json.loads(json.dumps(run.settings()))) == run


def test_robots_that_stand_where_the_reference_passes_by_are_in_no_run(
        following: Following) -> None:
    """While a simulator was restarted in mid-run, they stopped in the middle for five seconds."""
    for _ in range(50):
        following.pass_(0.1, 4.0, beyond=3.0)
    following.pass_(3.0, None)
    assert following.finished == []
