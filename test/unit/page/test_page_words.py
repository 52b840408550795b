# SPDX-License-Identifier: BSD-3-Clause
"""What a page says of a run is what was judged."""
from __future__ import annotations

from pathlib import Path

from cycle_bags import write_bag

from process_visualizer.page.robots import PageSpan
from process_visualizer.page.run_page import run_words
from process_visualizer.runs.comparison.comparison import GoodRuns, Unjudged
from process_visualizer.runs.recorded.chosen_runs import ChosenRuns


def test_a_run_that_is_not_judged_is_neither_good_nor_poor(tmp_path: Path) -> None:
    reference, run = ChosenRuns().runs([write_bag(tmp_path)])
    judged = GoodRuns(reference, []).compare(run)
    not_judged = judged._replace(why_not='there is no good run of variant 2')
    words = [run_words(run, it, (), PageSpan(0.0, 10.0)) for it in (judged, not_judged)]
    assert [it['state'] for it in words] == ['good', 'plain']
    assert words[1]['verdict'] == 'is not judged: there is no good run of variant 2'


def test_where_a_run_has_no_data_the_page_says_so(tmp_path: Path) -> None:
    reference, run = ChosenRuns().runs([write_bag(tmp_path)])
    found = GoodRuns(reference, []).compare(run)
    force = next(it for it in found.band.signals if it.label == 'tool force')
    with_gap = found._replace(unjudged=(Unjudged(force, 4.0, 5.5),))
    assert run_words(run, with_gap, (), PageSpan(0.0, 10.0))['notes'][-1] == (
        'not judged: arm tool force from 0:04.00 to 0:05.50 (no data)')
