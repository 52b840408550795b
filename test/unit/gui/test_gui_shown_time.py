# SPDX-License-Identifier: BSD-3-Clause
"""The visible part of a recording: it never leaves the recording, and keeps what matters."""
from __future__ import annotations

from typing import Callable, Dict, Tuple

import pytest
from hypothesis import given
from hypothesis import strategies as st

from process_visualizer.gui.toolkit.time_axis import MIN_S, ShownTime, whole

HOUR = whole(3600.0)
LENGTHS, SHARES = st.floats(0.0, 40_000.0), st.floats(0.0, 1.0)


def test_closer_around_a_moment() -> None:
    assert HOUR.zoomed(0.5, 900.0) == ShownTime(450.0, 1800.0, 3600.0)
    assert HOUR.zoomed(0.5, 0.0) == ShownTime(0.0, 1800.0, 3600.0)


def test_never_less_than_a_second_or_more_than_all() -> None:
    assert HOUR.zoomed(1e-9, 900.0).duration_s == MIN_S
    assert HOUR.zoomed(0.1, 900.0).zoomed(1e9, 900.0) == HOUR
    assert whole(0.4).zoomed(0.1, 0.2) == whole(0.4)


@given(LENGTHS, SHARES, SHARES, st.floats(0.01, 1.0))
def test_the_moment_under_the_mouse_stays_there(length_s: float, begin: float, place: float,
                                                factor: float) -> None:
    before = whole(length_s).part(begin * length_s, length_s / 4)
    around_s = before.begin_s + place * before.duration_s
    after = before.zoomed(factor, around_s)
    assert after.begin_s + place * after.duration_s == pytest.approx(around_s, abs=1e-6)


STEPS: Dict[str, Callable[[ShownTime, float, float], ShownTime]] = {
    'zoom': lambda shown, time_s, number: shown.zoomed(number, time_s),
    'move': lambda shown, time_s, _: shown.beginning_at(time_s),
    'show': lambda shown, time_s, _: shown.showing(min(max(time_s, 0.0), shown.length_s)),
    'part': lambda shown, time_s, number: shown.part(time_s, number)}


@given(LENGTHS, st.lists(st.tuples(st.sampled_from(sorted(STEPS)),
                                   st.floats(-5e4, 5e4), st.floats(1e-4, 1e4))))
def test_it_never_leaves_the_recording(length_s: float,
                                       steps: 'list[Tuple[str, float, float]]') -> None:
    shown = whole(length_s)
    for name, time_s, number in steps:
        shown = STEPS[name](shown, time_s, number)
        assert shown.begin_s >= 0.0 and shown.end_s <= length_s * (1 + 1e-9)
        assert shown.duration_s >= min(MIN_S, length_s)


@given(SHARES, SHARES)
def test_what_is_to_be_seen_is_seen(begin: float, place: float) -> None:
    shown = HOUR.part(begin * 3600.0, 60.0)
    assert shown.showing(place * 3600.0).contains(place * 3600.0)


def test_what_is_seen_already_moves_nothing() -> None:
    shown = HOUR.part(600.0, 60.0)
    assert shown.showing(659.0) is shown
    assert shown.showing(661.0).begin_s == pytest.approx(655.0)
    assert shown.showing(599.0).end_s == pytest.approx(605.0)
