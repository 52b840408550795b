# SPDX-License-Identifier: BSD-3-Clause
"""The report on many runs: a table by phase, their margins, causes, and drift."""
from __future__ import annotations

import csv
import io
import json
from typing import Sequence, Tuple

import numpy as np
import pytest
from made_runs import made_run

from process_visualizer.commands.compare_command import as_json, as_text
from process_visualizer.runs.comparison.features import as_csv, drifts
from process_visualizer.runs.comparison.good_runs import GoodRuns
from process_visualizer.runs.recorded.chosen_runs import ChosenRuns
from process_visualizer.runs.run import Run, RunPhase


def higher(seed: int, by: float, begin_s: float = 0.0) -> Run:
    run = made_run(seed, value=lambda _, values: values + by)
    return run._replace(begin_s=begin_s, name=f'shift.bag#{seed}', recording=('shift.bag',))


GOOD = GoodRuns(made_run(100), [made_run(101), made_run(102), made_run(103)])


def test_the_table_has_a_row_for_each_run_phase_and_channel() -> None:
    run = made_run(1)._replace(phases=(RunPhase('there', 'go', 'back', False),))
    rows = list(csv.DictReader(io.StringIO(as_csv([GOOD.compare(run)]))))
    assert [it['phase'] for it in rows] == ['there', 'whole run']
    assert float(rows[0]['duration_s']) == pytest.approx(5.0)
    values = run.channels[0].values[(run.channels[0].times_s >= 3.0)
                                    & (run.channels[0].times_s <= 8.0)]
    assert float(rows[0]['largest']) == pytest.approx(values.max(), abs=1e-4)
    assert float(rows[0]['mean']) == pytest.approx(values.mean(), abs=1e-4)


def test_a_channel_without_values_in_a_phase_has_all_columns() -> None:
    run = made_run(1)
    channel, *others = run.channels
    silent = channel._replace(values=np.full_like(channel.values, np.nan))
    text = as_csv([GOOD.compare(run._replace(channels=(silent, *others)))])
    rows = list(csv.reader(io.StringIO(text)))
    assert {len(it) for it in rows} == {11}
    assert rows[1][-3:] == ['', '', '']


def test_a_run_in_range_tells_how_near_it_came_and_where() -> None:
    found = GOOD.compare(higher(1, 0.05))
    assert 0.0 < found.badness < 1.0
    text = as_text(GOOD, [found]).splitlines()[-1]
    assert text.startswith('nearest to leaving: ')
    assert '% of its band at' in text
    nearest = json.loads(as_json(GOOD, [found]))['runs'][0]['nearest']
    assert nearest['share_of_band'] == pytest.approx(found.badness, abs=1e-3)
    assert nearest['phase'] in ('go to back', 'whole run')


def test_causes_are_counted() -> None:
    found = [GOOD.compare(higher(seed, by)) for seed, by in ((1, 0.0), (2, 3.0), (3, 3.0))]
    assert 'out of range first by: robot tool force (2)' in as_text(GOOD, found)


def test_what_drifts_from_run_to_run_is_told_before_it_leaves() -> None:
    found = [GOOD.compare(higher(seed, 0.02 * max(seed - 8, 0), 20.0 * seed))
             for seed in range(1, 18)]
    drift = drifts(found)[0]
    assert drift.signal.label == 'tool force'
    assert drift.per_run == pytest.approx(0.02, rel=0.1)
    assert drift.since in ('shift.bag#7', 'shift.bag#8', 'shift.bag#9')
    assert f'robot tool force grows by 0.02 N a run since {drift.since}' in as_text(GOOD, found)


def test_runs_that_only_spread_do_not_drift() -> None:
    random = np.random.default_rng(3)
    found = [GOOD.compare(higher(seed, 0.05 * random.standard_normal(), 20.0 * seed))
             for seed in range(1, 15)]
    assert not drifts(found)


FOUR = tuple(made_run(it) for it in range(4))


class OfFour(ChosenRuns):
    def of_recording(self, _paths: Sequence[str]) -> Tuple[Run, ...]:
        return FOUR


@pytest.mark.parametrize('word, said', [('a.bag#3-2', 'the smaller number first'),
                                        ('a.bag#2-9', 'the runs 1 to 4, not 9')])
def test_a_range_that_is_none_is_an_error(word: str, said: str) -> None:
    chosen = OfFour()
    assert chosen.runs(['a.bag#2-4']) == list(FOUR[1:4])
    with pytest.raises(ValueError, match=said):
        chosen.runs([word])
