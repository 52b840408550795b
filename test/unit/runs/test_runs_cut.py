# SPDX-License-Identifier: BSD-3-Clause
"""``cell cut`` of a run, and around an alarm: the verdict on the smaller bag is unchanged."""
from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from cycle_bags import write_bag

from process_visualizer.bagio.recording import Recording
from process_visualizer.cell.errors import Location
from process_visualizer.cell.model import RunSpan
from process_visualizer.commands.command_line import main
from process_visualizer.runs.recorded.chosen_runs import cut_into_runs
from process_visualizer.runs.run import Channel, ChannelKind, Run, RunEvent


def test_a_run_that_is_cut_out_is_a_run_by_itself(tmp_path: Path,
                                                  capsys: pytest.CaptureFixture[str]) -> None:
    whole, part = write_bag(tmp_path, cycles=3, poor=1), str(tmp_path / 'part.bag')
    assert main(['cut', f'{whole}#2', '-o', part]) == 0
    capsys.readouterr()
    assert main(['runs', part]) == 0
    assert [line.split()[0] for line in capsys.readouterr().out.splitlines()] == ['part.bag#1']
    assert main(['compare', part, '--reference', f'{whole}#1', f'{whole}#3']) == 2
    assert 'starts + 2.0 s): arm tool force' in capsys.readouterr().out


def test_what_happened_around_an_alarm(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    whole, part = write_bag(tmp_path, cycles=1), str(tmp_path / 'part.bag')
    config = tmp_path / 'limits.xml'
    config.write_text((tmp_path / 'cell.xml').read_text(encoding='utf-8').replace(
        'tolerance="0.02"', 'high="0.04"'), encoding='utf-8')
    words = ['cut', whole, '--config', str(config), '--margin', '0.5', '-o', part, '--around']
    assert main([*words, 'feed']) == 0
    with Recording([whole]) as recording, Recording([part]) as cut_out:
        span_s = [(it - recording.begin_ns) / 1e9 for it in (cut_out.begin_ns, cut_out.end_ns)]
    assert span_s == pytest.approx([0.5, 9.5], abs=0.1)
    capsys.readouterr()
    assert main([*words, 'quietly']) == 1
    reason, known = capsys.readouterr().err.splitlines()
    assert 'no mark or alarm with "quietly"' in reason and '0:01.0  machine: feed' in known


def test_the_variant_of_a_run_is_the_number_that_holds_during_its_cycle() -> None:
    """It is sent when it changes, shortly before the cycle begins and after the last cycle's."""
    variant = Channel('plc', 'variant', '', ChannelKind.VARIABLE, np.array([0.0, 21.8, 41.8, 52.2]),
                      np.array([2.0, 1.0, 2.0, 5.0]))
    whole = Run('shift.bag', 60.0, (variant,), events=tuple(
        RunEvent(name, at_s) for at_s in (2.0, 22.0, 42.0)
        for name, at_s in (('begins', at_s), ('ends', at_s + 10.0))))
    span = RunSpan('begins', 'ends', 0.5, 0.5, Location('cell.xml', 1), group='variant',
                   place='variant')
    runs = cut_into_runs(whole, span)
    assert [it.group[0][1] for it in runs] == [2.0, 1.0, 2.0]
    assert [it.place[0][1] for it in runs] == [2.0, 1.0, 2.0]


def test_a_run_that_was_broken_off_has_nothing_of_the_next_one() -> None:
    """The tools of the next one, on their way to its begin, were far beside the path."""
    whole = Run('shift.bag', 60.0, (), events=(
        RunEvent('begins', 5.0), RunEvent('ends', 15.0), RunEvent('begins', 25.0),
        RunEvent('begins', 32.0), RunEvent('ends', 42.0), RunEvent('begins', 45.0),
        RunEvent('begins', 57.0)))
    runs = cut_into_runs(whole, RunSpan('begins', 'ends', 4.0, 2.0, Location('cell.xml', 1)))
    assert [(it.begin_s, it.begin_s + it.duration_s, it.is_broken_off) for it in runs] == [
        (1.0, 17.0, False), (21.0, 28.0, True), (28.0, 44.0, False), (41.0, 53.0, True)]


def test_a_run_whose_end_came_while_all_data_was_missing_is_broken_off() -> None:
    """A driver that began anew was "489 mm ahead" in the run that it had not ended."""
    def whole(*seen_s: float) -> Run:
        times_s = np.arange(0.0, 80.0, 0.02)
        hole = (times_s > seen_s[0]) & (times_s < seen_s[1])
        feed = Channel('machine', 'feed', '', ChannelKind.VARIABLE, times_s[~hole],
                       np.ones(np.count_nonzero(~hole)))
        return Run('shift.bag', 80.0, (feed,), events=tuple(
            RunEvent(name, at_s) for name, at_s in (
                ('begins', 5.0), ('ends', 15.0), ('begins', 25.0), ('ends', 35.0), ('begins', 45.0),
                ('ends', 55.0), ('begins', 65.0), ('ends', 75.0))
            if not (seen_s[0] < at_s < seen_s[1] and name == 'begins')))

    span = RunSpan('begins', 'ends', 1.0, 1.0, Location('cell.xml', 1))

    def ends_s(*seen_s: float) -> 'list[tuple[float, bool]]':
        return [(round(it.begin_s + it.duration_s, 1), it.is_broken_off)
                for it in cut_into_runs(whole(*seen_s), span)]

    good = [(16.0, False), (36.0, False), (56.0, False), (76.0, False)]
    assert ends_s(50.0, 53.0) == good, 'the rest of a run after a hole counts'
    assert ends_s(52.0, 58.0) == [*good[:2], (52.0, True), good[3]]
    without = whole(50.0, 50.5)
    without = without._replace(events=tuple(it for it in without.events if it.time_s not in (
        35.0, 45.0)))
    assert [it.is_broken_off for it in cut_into_runs(without, span)] == [False] * 3
    hidden = whole(30.0, 46.0)
    hidden = hidden._replace(events=tuple(it for it in hidden.events if it.time_s != 35.0))
    assert [(round(it.begin_s + it.duration_s, 1), it.is_broken_off)
            for it in cut_into_runs(hidden, span)] == [(16.0, False), (30.0, True), (76.0, False)]
