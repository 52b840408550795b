# SPDX-License-Identifier: BSD-3-Clause
"""Texts about signals out of range."""
from __future__ import annotations

from types import SimpleNamespace

import pytest

from process_visualizer.runs.comparison.comparison import Missing, Unjudged
from process_visualizer.runs.comparison.wording import said, unjudged_texts
from process_visualizer.runs.deviation.departures import Departure
from process_visualizer.runs.deviation.signals import SLOWER_LABEL, Signal, SignalKind


def departed(label: str, unit: str, kind: SignalKind, deviation: float) -> Departure:
    return Departure(Signal('lower', label, unit, kind), 1.0, None, 1.0, 0.1, 2.0, deviation,
                     abs(deviation) / 4.0)


@pytest.mark.parametrize('label, deviation_m, words', [
    ('tool along', -0.0425, 'lower tool 42.5 mm behind along its path (band ±11 mm)'),
    ('tool along', 0.0425, 'lower tool 42.5 mm ahead along its path (band ±11 mm)'),
    ('tool sideways', 0.0012, 'lower tool 1.2 mm to the left of its path (band ±0.3 mm)'),
    ('tool up', -0.0012, 'lower tool 1.2 mm below its path (band ±0.3 mm)')])
def test_where_a_tool_was_is_said_by_its_side(label: str, deviation_m: float, words: str) -> None:
    assert said(departed(label, 'm', SignalKind.PLACE, deviation_m)) == words


def test_other_signals_have_a_sign() -> None:
    assert said(departed('tool force', 'N', SignalKind.FORCE, -8.0)) == (
        'lower tool force, −8 N (band ±2 N)')


def test_where_the_pace_was_not_judged_is_a_sentence() -> None:
    """It was "slower by from 0:01.00 to 0:01.50 … and 1 more times"."""
    signal = Signal('', SLOWER_LABEL, '', SignalKind.TIMING)
    found = SimpleNamespace(unjudged=tuple(
        Unjudged(signal, float(begin_s), begin_s + 0.5) for begin_s in range(1, 5)))
    assert unjudged_texts(found) == [  # type: ignore[arg-type]
        'not judged: pace from 0:01.00 to 0:01.50, 0:02.00 to 0:02.50, 0:03.00 to 0:03.50 and 1 '
        'more (data missing or late)']


def test_signals_that_lack_the_same_data_are_one_sentence() -> None:
    found = SimpleNamespace(unjudged=tuple(
        Unjudged(Signal('arm', f'joint {it}', 'rad', SignalKind.JOINT), 1.0, 1.5)
        for it in range(6)))
    assert unjudged_texts(found) == [  # type: ignore[arg-type]
        'not judged: arm joint 0, arm joint 1, arm joint 2, arm joint 3 and 2 more from 0:01.00 to '
        '0:01.50 (data missing or late)']


def test_where_the_motion_lacks_data_one_sentence_says_so_for_all_signals() -> None:
    force, current, flow = (Signal('arm', it, '', SignalKind.VARIABLE)
                            for it in ('force', 'current', 'flow'))
    found = SimpleNamespace(unjudged=(
        Unjudged(force, 1.0, 1.5, Missing.MOTION), Unjudged(current, 1.1, 1.48, Missing.MOTION),
        Unjudged(flow, 1.0, 3.0), Unjudged(force, 4.0, 4.5, Missing.MOTION)))
    assert unjudged_texts(found) == [  # type: ignore[arg-type]
        'not judged: anything from 0:01.00 to 0:01.50, 0:04.00 to 0:04.50 (messages of the '
        'motion are missing or arrived late, so the moment of the process is unknown)',
        'not judged: arm flow from 0:01.00 to 0:03.00 (data missing or late)']
