# SPDX-License-Identifier: BSD-3-Clause
"""Mismatching runs are reported in a sentence, and comparable ones are compared."""
from __future__ import annotations

from pathlib import Path
from typing import Tuple

import numpy as np
import pytest
from cycle_bags import write_bag
from made_runs import made_run, progress

from process_visualizer.commands.command_line import main
from process_visualizer.runs.comparison.good_runs import GoodRuns
from process_visualizer.runs.run import Run

RUN = made_run(1, value=lambda process_s, values: values + np.where(process_s > 3.0, 4.0, 0.0))
"""A poor run."""


def long_run() -> Run:
    """One hour, with the process after half of it."""
    times_s = np.arange(0.0, 3600.0, 0.02)
    along = progress(times_s - 1800.0)
    short = made_run(1)
    noise = 0.05 * np.random.default_rng(1).standard_normal(len(along))
    channel = short.channels[0]._replace(times_s=times_s, values=10.0 * along + noise)
    motion = short.motions[0]._replace(times_s=times_s, positions=np.column_stack(
        (along, 0.2 * along ** 2, np.full(len(along), 0.3))))
    return short._replace(duration_s=3600.0, channels=(channel,), motions=(motion,), events=())


@pytest.mark.parametrize('run, sentence', [
    (RUN._replace(channels=(*RUN.channels, RUN.channels[0]._replace(label='torque'))),
     'only the run has robot torque'),
    (RUN._replace(motions=(RUN.motions[0]._replace(device='renamed'),)),
     'aligned by their events: the runs have no motion in common'),
    (RUN._replace(events=RUN.events[:1]),
     'the event "back" occurs once in the reference, but not here; it is ignored'),
    (RUN._replace(events=(*RUN.events, RUN.events[0])),
     'the event "go" occurs once in the reference, but twice here; it is ignored'),
    (RUN._replace(events=(RUN.events[0]._replace(name='back'), RUN.events[1]._replace(name='go'))),
     '1 of 2 events occur in a different order than in the reference; they are ignored'),
    (RUN._replace(duration_s=6.5), 'it covers 5'),
    (RUN._replace(configuration='another'),
     'it was recorded with another configuration than the reference')],
    ids=['channel', 'robot renamed', 'event never', 'event twice', 'order', 'stops half way',
         'configuration'])
def test_a_poor_run_is_found_all_the_same(run: Run, sentence: str) -> None:
    found = GoodRuns(made_run()._replace(configuration='one')).compare(run)
    assert any(note.startswith(sentence) for note in found.notes), found.notes
    assert 'robot tool force' in [it.signal.name for it in found.departures]


def test_no_numbers_are_no_departure_and_spoil_no_other() -> None:
    values = np.where(RUN.channels[0].times_s > 8.0, np.nan, RUN.channels[0].values)
    found = GoodRuns(made_run()).compare(
        RUN._replace(channels=(RUN.channels[0]._replace(values=values),)))
    assert found.departures[0].signal.name == 'robot tool force'
    assert np.isfinite(found.departures[0].deviation)


def test_an_hour_is_held_against_twenty_seconds_and_back() -> None:
    there, back = GoodRuns(made_run()).compare(long_run()), GoodRuns(long_run()).compare(made_run())
    assert '13.0 s of its 3600.0 s are compared: the reference is shorter' in there.notes
    assert 'it covers 0% of the reference' in back.notes
    for found in (there, back):
        assert 'robot tool force' not in [it.signal.name for it in found.departures]


def test_runs_that_have_some_channels_in_common_are_compared(
        tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    good, other = write_bag(tmp_path, poor=1), write_bag(tmp_path, 'other.bag', robot='renamed')
    config = Path(tmp_path, 'cell.xml')
    config.write_text(config.read_text(encoding='utf-8').replace('"machine"', '"press"'),
                      encoding='utf-8')
    assert main(['compare', other, '--config', str(config), '--reference', good]) == 0
    both: Tuple[str, str] = (f'{good}#2', other)
    assert main(['compare', *both, '--reference', f'{good}#1']) == 2
    assert 'other.bag#1' in capsys.readouterr().out


def test_runs_of_another_cell_are_left_out(tmp_path: Path,
                                           capsys: pytest.CaptureFixture[str]) -> None:
    """The others are compared anyway."""
    good = write_bag(tmp_path, poor=1)
    other = write_bag(tmp_path, 'other.bag', robot='renamed', machine='press')
    assert main(['compare', f'{good}#2', other, '--reference', f'{good}#1']) == 2
    told = capsys.readouterr()
    assert 'a.bag#2: out of range first' in told.out and 'other.bag' not in told.out
    assert 'cell: left out: other.bag#2 has no channel of a.bag#1' in told.err
