# SPDX-License-Identifier: BSD-3-Clause
"""The operator matches moments of two runs, and the rest follows."""
from __future__ import annotations

from typing import List, Tuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from made_runs import made_run

from process_visualizer.runs.alignment.alignment import (
    AlignmentMethod,
    Anchor,
    aligned,
    aligned_at,
    with_anchor,
)
from process_visualizer.runs.comparison.good_runs import GoodRuns
from process_visualizer.runs.comparison.timeline_bands import (
    AnchoredRun,
    MomentKind,
    timeline_moments,
)

TIMES = st.floats(0.0, 13.0)
ANCHORS = st.lists(st.tuples(TIMES, TIMES), min_size=1, max_size=4)


def chosen(pairs: List[Tuple[float, float]]) -> Tuple[Anchor, ...]:
    anchors: Tuple[Anchor, ...] = ()
    for pair in pairs:
        anchors = with_anchor(anchors, Anchor(*pair))
    return anchors


@given(ANCHORS)
def test_the_last_anchor_stays_and_all_rise(pairs: List[Tuple[float, float]]) -> None:
    anchors = chosen(pairs)
    assert Anchor(*pairs[-1]) in anchors
    assert (np.diff(np.array(anchors), axis=0) > 0.0).all()


@settings(max_examples=15)
@given(ANCHORS, st.booleans())
def test_the_map_goes_through_anchors_and_rises(pairs: List[Tuple[float, float]],
                                                has_motion: bool) -> None:
    anchors = chosen(pairs)
    found = aligned_at(made_run(has_motion=has_motion), made_run(1, has_motion=has_motion),
                       anchors).time_map
    for anchor in anchors:
        assert found.to_run(np.array([anchor.reference_s]))[0] == pytest.approx(anchor.run_s,
                                                                                abs=1e-3)
    assert (np.diff(found.to_run(np.linspace(-2.0, 15.0, 300))) >= 0.0).all()


def test_an_anchor_where_the_motion_has_it_changes_nothing() -> None:
    reference, run = made_run(), made_run(1, 1.05, 4.0)
    times_s = np.concatenate((np.arange(3.5, 6.5, 0.05), np.arange(8.5, 10.5, 0.05)))
    found = aligned_at(reference, run, [Anchor(7.5, 4.0 + 1.05 * 5.5)])
    assert found.method is AlignmentMethod.MOTION
    plain = aligned(reference, run).time_map
    assert np.abs(found.time_map.to_run(times_s) - plain.to_run(times_s)).max() < 0.02


def test_without_motion_an_anchor_is_a_shift() -> None:
    reference, run = (made_run(seed, has_motion=False, events=()) for seed in (0, 1))
    found = aligned_at(reference, run, [Anchor(3.0, 5.0)])
    assert found.method is AlignmentMethod.ANCHORS
    np.testing.assert_allclose(found.time_map.to_run(np.array([1.0, 8.0])), [3.0, 10.0])


def test_a_run_that_was_aligned_wrongly_is_put_right() -> None:
    """Nothing moves, and the value jumps 2 s later, as the run began 2 s earlier."""
    reference = made_run(has_motion=False, events=())
    late = made_run(1, start_s=4.0, has_motion=False, events=())
    good = GoodRuns(reference)
    assert good.compare(late).departures
    assert not good.compare(late, [Anchor(3.0, 5.0)]).departures


def test_moments_are_where_the_run_has_them() -> None:
    run = made_run(1, start_s=3.0, value=lambda process_s, values: values + np.where(
        process_s > 3.0, 4.0, 0.0))._replace(begin_s=100.0)
    good = GoodRuns(made_run())
    found = timeline_moments(good.reference, [AnchoredRun(5, good.compare(run))])
    shown = [it for it in found if not it.label.endswith('noise')]
    assert [(it.kind, it.label) for it in shown] == [
        (MomentKind.EVENT, 'go'), (MomentKind.DEPARTURE, 'robot tool force'),
        (MomentKind.EVENT, 'back')]
    assert [it.position_s for it in shown] == pytest.approx([104.0, 106.0, 109.0], abs=0.05)
    assert {it.run for it in found} == {5}
    anchors = (Anchor(3.0, 4.5), Anchor(5.5, 7.0))
    found = timeline_moments(good.reference, [AnchoredRun(0, good.compare(run, anchors), anchors)])
    placed = [(it.label, it.position_s) for it in found if it.kind is MomentKind.ANCHOR]
    assert placed == [('go', pytest.approx(104.5)), ('anchor', pytest.approx(107.0))]
