# SPDX-License-Identifier: BSD-3-Clause
"""The moment of a live run in its reference: at any speed, on paths that cross themselves."""
from __future__ import annotations

import math
from typing import Callable, Dict, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from process_visualizer.runs.alignment.live_alignment import (
    PERIOD_S,
    FollowedSpan,
    LiveAlignment,
    PhaseHistory,
)

RATE_HZ, DURATION_S, GO_S, STOP_S = 30.0, 14.0, 2.0, 12.0
SPAN = FollowedSpan('go', 'stop')
EVENTS = {'go': (GO_S,), 'stop': (STOP_S,)}
Path = Callable[[np.ndarray], np.ndarray]


def there_and_back(time_s: np.ndarray) -> np.ndarray:
    """At rest, along a line, back on the same line, at rest."""
    along = 0.5 - 0.5 * np.cos(2.0 * math.pi * np.clip((time_s - GO_S) / 10.0, 0.0, 1.0))
    return np.column_stack((along, np.zeros_like(along), np.zeros_like(along)))


def eight(time_s: np.ndarray) -> np.ndarray:
    """A path that crosses itself twice."""
    angle = 4.0 * math.pi * np.clip((time_s - GO_S) / 10.0, 0.0, 1.0)
    rise = np.clip((time_s - GO_S) / 10.0, 0.0, 1.0)
    return np.column_stack((0.3 * np.sin(angle), 0.2 * np.sin(2.0 * angle), 0.05 * rise))


def circles(time_s: np.ndarray) -> np.ndarray:
    """The same circle three times."""
    angle = 6.0 * math.pi * np.clip((time_s - GO_S) / 10.0, 0.0, 1.0)
    return np.column_stack((0.2 * np.cos(angle), 0.2 * np.sin(angle), np.zeros_like(angle)))


PATHS = (there_and_back, eight, circles)


class Live(NamedTuple):
    """Live run: true moments of the reference (n,) at its times (n,), and the estimated ones."""

    times_s: np.ndarray
    true_s: np.ndarray
    found_s: np.ndarray

    @property
    def errors_s(self) -> np.ndarray:
        """The errors while the robot moves and the moment is known."""
        moves = (self.true_s > GO_S + 0.3) & (self.true_s < STOP_S - 0.3)
        found = np.abs(self.found_s - self.true_s)[moves]
        return np.asarray(found[np.isfinite(found)])


def reference(path: Path) -> np.ndarray:
    return path(np.arange(0.0, DURATION_S, PERIOD_S))


def alignment_of(path: Path, events: bool = True) -> LiveAlignment:
    return LiveAlignment(reference(path), EVENTS if events else {}, SPAN if events else None)


def follow(alignment: LiveAlignment, path: Path, speed: float = 1.0, begin_s: float = 0.0,
           pauses: Sequence[Tuple[float, float]] = (), noise_m: float = 0.0, now_s: float = 100.0,
           events: Optional[Dict[str, Sequence[float]]] = None) -> Live:
    """Let a run continue from a moment of the reference to its end."""
    length_s = (DURATION_S - begin_s) / speed + sum(pause_s for _, pause_s in pauses)
    times_s = np.arange(0.0, length_s, 1.0 / RATE_HZ)
    true_s = begin_s + speed * times_s
    for at_s, pause_s in pauses:
        true_s = np.where(true_s > at_s, np.maximum(true_s - speed * pause_s, at_s), true_s)
    places = path(true_s) + np.random.default_rng(1).normal(0.0, noise_m, (len(times_s), 3))
    found_s: List[float] = []
    for number, place in enumerate(places):
        for name, moments in (EVENTS if events is None else events).items():
            for at_s in moments:
                if number and true_s[number - 1] < at_s <= true_s[number]:
                    alignment.take_event(name, now_s + float(times_s[number]))
        alignment.advance(now_s + float(times_s[number]), place)
        phase_s = alignment.phase_s
        found_s.append(math.nan if phase_s is None else phase_s)
    return Live(times_s, true_s, np.array(found_s))


@pytest.mark.parametrize('path', PATHS)
@pytest.mark.parametrize('speed', [0.8, 0.9, 1.0, 1.1, 1.25])
def test_each_speed_on_each_path(path: Path, speed: float) -> None:
    live = follow(alignment_of(path), path, speed)
    assert len(live.errors_s) > 0.95 * 9.4 / speed * RATE_HZ
    assert np.quantile(live.errors_s, 0.95) < 0.05


@settings(max_examples=25)
@given(st.sampled_from(PATHS), st.floats(0.8, 1.25),
       st.lists(st.tuples(st.floats(3.0, 11.0), st.floats(0.1, 4.0)), max_size=2),
       st.sampled_from([0.0, 0.0005]))
def test_it_never_goes_back_within_a_run(path: Path, speed: float,
                                         pauses: List[Tuple[float, float]],
                                         noise_m: float) -> None:
    live = follow(alignment_of(path), path, speed, pauses=sorted(pauses), noise_m=noise_m)
    known = live.found_s[live.true_s > GO_S + 0.1]
    known = known[np.isfinite(known)]
    assert np.diff(known).min() >= 0.0
    assert np.median(live.errors_s) < 0.05


def test_a_pause_counts_as_behind() -> None:
    alignment = alignment_of(there_and_back)
    live = follow(alignment, there_and_back, pauses=((5.0, 30.0),))
    assert np.quantile(live.errors_s, 0.95) < 0.05
    alignment = alignment_of(there_and_back)
    times_s = np.arange(0.0, 9.0, 1.0 / RATE_HZ)
    alignment.take_event('go', 0.0)
    for time_s, place in zip(times_s, there_and_back(GO_S + np.minimum(times_s, 4.0))):
        alignment.advance(float(time_s), place)
    assert alignment.elapsed_s == pytest.approx(9.0, abs=0.05)
    assert alignment.behind_s == pytest.approx(5.0, abs=0.1)


@pytest.mark.parametrize('is_first', [True, False])
def test_an_event_that_is_noticed_after_a_gap_does_not_tell_the_delay(is_first: bool) -> None:
    """The run continued while all data were missing: it is not ahead of the reference."""
    alignment = alignment_of(there_and_back)
    times_s = np.arange(-2.0, 6.0, 1.0 / RATE_HZ)
    for time_s, place in zip(times_s, there_and_back(GO_S + times_s)):
        if not -1.0 < time_s < 1.5:
            if is_first and abs(time_s - 1.5) < 0.5 / RATE_HZ:
                alignment.take_event('go', float(time_s))
            alignment.advance(float(time_s), place)
        if not is_first and abs(time_s - 1.52) < 0.5 / RATE_HZ:
            alignment.take_event('go', float(time_s))
    assert alignment.phase_s == pytest.approx(GO_S + 6.0, abs=0.1)
    assert math.isnan(alignment.behind_s)


@pytest.mark.parametrize('path', [there_and_back, eight])
def test_without_events_it_is_found_where_it_moves(path: Path) -> None:
    live = follow(alignment_of(path, events=False), path, begin_s=5.0)
    assert len(live.errors_s) > 150 and np.quantile(live.errors_s, 0.95) < 0.05


def test_a_robot_at_rest_may_be_in_no_run() -> None:
    alignment = alignment_of(there_and_back, events=False)
    for number in range(300):
        alignment.advance(number / RATE_HZ, there_and_back(np.array([0.0]))[0])
        assert alignment.phase_s is None


def test_an_event_that_never_comes_and_one_that_comes_twice() -> None:
    for events in ({}, {'go': (GO_S, GO_S + 0.05)}, {'stop': (STOP_S, STOP_S + 0.1)}):
        live = follow(alignment_of(eight), eight, events=events)
        assert len(live.errors_s) > 200 and np.quantile(live.errors_s, 0.95) < 0.08


def test_a_machine_that_stops_amid_the_run_and_goes_on_is_the_same_run() -> None:
    events = {'go': (GO_S, 6.02), 'stop': (6.01, STOP_S)}
    live = follow(alignment_of(there_and_back), there_and_back, 1.1, pauses=((6.01, 2.0),),
                  events=events)
    assert np.quantile(live.errors_s, 0.95) < 0.05


def test_the_next_run_follows_the_last_one() -> None:
    alignment = alignment_of(eight)
    for now_s in (100.0, 120.0, 140.0):
        live = follow(alignment, eight, now_s=now_s)
        assert np.quantile(live.errors_s, 0.95) < 0.05
        alignment.advance(now_s + 15.0, eight(np.array([DURATION_S]))[0])
        assert alignment.phase_s is None, 'the run is over'


def test_an_event_of_the_reference_tells_two_circles_apart() -> None:
    """The circle is passed three times; from its middle, it is not known which one it is."""
    half = {'half': (7.0,)}
    alignment = LiveAlignment(reference(circles), half)
    live = follow(alignment, circles, begin_s=6.0, events=half)
    assert np.quantile(live.errors_s[-100:], 0.95) < 0.05


def test_a_robot_that_jumps_is_lost_and_found() -> None:
    alignment = alignment_of(there_and_back)
    follow(alignment, there_and_back)
    alignment.take_event('go', 200.0)
    for number in range(100):  # somewhere else altogether
        alignment.advance(200.0 + number / RATE_HZ, np.array([5.0, 5.0, 5.0]))
    assert alignment.phase_s is None and math.isnan(alignment.elapsed_s)
    live = follow(alignment, there_and_back, begin_s=4.0, now_s=210.0)
    assert np.quantile(live.errors_s, 0.95) < 0.05


def test_unknown_places_go_on_evenly() -> None:
    alignment = alignment_of(eight)
    alignment.take_event('go', 0.0)
    for number in range(int(3.0 * RATE_HZ)):
        alignment.advance(number / RATE_HZ, np.full(3, math.nan))
    assert alignment.phase_s == pytest.approx(GO_S + 3.0, abs=0.1)


def test_a_reference_with_gaps_and_one_without_any_place() -> None:
    places = reference(eight)
    places[:3] = places[300:310] = math.nan
    live = follow(LiveAlignment(places, EVENTS, SPAN), eight)
    assert np.quantile(live.errors_s, 0.95) < 0.05
    nowhere = LiveAlignment(np.full((100, 3), math.nan), {})
    nowhere.advance(0.0, np.zeros(3))
    nowhere.advance(1.0, np.zeros(3))
    assert nowhere.phase_s is None


def test_a_run_that_was_found_without_its_events_is_over_at_its_end() -> None:
    """A comparison that begins within a run receives neither of its events."""
    live = follow(alignment_of(there_and_back), there_and_back, begin_s=6.0, events={},
                  pauses=[(DURATION_S - 0.02, 5.0)])
    known = np.isfinite(live.found_s)
    assert known[:int(3.0 * RATE_HZ)].any()
    assert not known[live.times_s > live.times_s[-1] - 3.0].any()


def test_a_run_that_is_longer_than_its_reference_stays_at_its_end() -> None:
    alignment = LiveAlignment(reference(there_and_back)[:350], {'go': (GO_S,)}, SPAN)
    alignment.take_event('go', 0.0)
    for number in range(int(8.0 * RATE_HZ)):
        place = there_and_back(np.array([min(GO_S + number / RATE_HZ, 7.2)]))[0]
        alignment.advance(number / RATE_HZ, place)
    assert alignment.phase_s == pytest.approx(6.98, abs=0.05)


def test_a_clock_that_is_set_back_and_a_long_gap_begin_anew() -> None:
    for later_s in (-50.0, 400.0):
        alignment = alignment_of(eight)
        follow(alignment, eight)
        alignment.take_event('go', 150.0)
        alignment.advance(150.0, eight(np.array([GO_S]))[0])
        assert alignment.phase_s is not None
        alignment.advance(150.0 + later_s, eight(np.array([GO_S]))[0])
        assert alignment.phase_s is None
        live = follow(alignment, eight, now_s=150.0 + later_s)
        assert np.quantile(live.errors_s, 0.95) < 0.05


def test_a_place_may_be_a_little_older_than_an_event() -> None:
    alignment = alignment_of(eight)
    alignment.advance(10.0, eight(np.array([GO_S]))[0])
    alignment.take_event('go', 10.04)
    alignment.advance(10.02, eight(np.array([GO_S]))[0])
    assert alignment.phase_s == pytest.approx(GO_S, abs=0.05)


def test_moments_between_phases() -> None:
    history = PhaseHistory(60.0)
    assert np.isnan(history.at(np.array([1.0]))).all()
    for time_s, moment_s in ((10.0, 1.0), (10.2, 1.2), (10.4, None), (10.6, 1.6), (10.8, 1.6),
                             (11.0, 0.0), (11.2, 0.2), (13.0, 2.0)):
        history.add(time_s, moment_s)
    found = history.at(np.array([9.9, 10.1, 10.3, 10.5, 10.7, 10.9, 11.1, 12.0, 13.0, 13.1]))
    assert found == pytest.approx([math.nan, 1.1, math.nan, math.nan, 1.6, math.nan, 0.1,
                                   math.nan, math.nan, math.nan], nan_ok=True)
    history.add(5.0, 0.0)  # the clock was set back
    history.add(5.2, 0.2)
    assert history.at(np.array([5.1, 10.1])) == pytest.approx([0.1, math.nan], nan_ok=True)


def test_what_is_older_than_is_kept_is_forgotten() -> None:
    history = PhaseHistory(10.0)
    for number in range(1000):
        history.add(0.1 * number, 0.1 * number)
    assert history.at(np.array([95.05])) == pytest.approx([95.05])
    assert np.isnan(history.at(np.array([50.0]))).all()
    assert history.last_s == pytest.approx(99.9)


@pytest.mark.parametrize('late_s', [0.35, 0.75, 1.5])
def test_a_begin_that_comes_late_moves_no_tool(late_s: float) -> None:
    """A late feed was in range live, as its run was assumed to begin with it, and *0.4 s ahead*."""
    alignment = alignment_of(eight)
    live = follow(alignment, eight, events={'go': (GO_S + late_s,)}, begin_s=0.5)
    assert live.errors_s.max() < 0.15
    assert not abs(alignment.behind_s) > 0.1, 'or unknown, far from the begin'
