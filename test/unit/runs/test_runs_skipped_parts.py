# SPDX-License-Identifier: BSD-3-Clause
"""A part of the process that only one run has, and paths to another position."""
from __future__ import annotations

from typing import Sequence, Tuple

import numpy as np
import pytest

from process_visualizer.runs.alignment.alignment import AlignmentMethod, aligned_at
from process_visualizer.runs.comparison.good_runs import GoodRuns
from process_visualizer.runs.run import Channel, ChannelKind, Run, RunEvent, ToolMotion

Step = Tuple[int, float, Tuple[float, float, float]]
"""Step of a process: state, duration [s], and the tool's target."""
HOME, ABOVE, LEFT, RIGHT = (0.5, 0.0, 0.5), (0.6, -0.2, 0.4), (0.6, -0.2, 0.3), (0.6, 0.2, 0.3)
WORK: Sequence[Step] = ((10, 1.0, HOME), (20, 1.5, ABOVE), (30, 1.0, LEFT), (40, 3.0, RIGHT),
                        (50, 2.0, ABOVE), (60, 1.5, HOME), (70, 1.0, HOME))


def stepped(steps: Sequence[Step], name: str = 'run', has_states: bool = True,
            **more: object) -> Run:
    begins_s = np.concatenate(([0.0], np.cumsum([it[1] for it in steps])))
    times_s = np.arange(0.0, begins_s[-1], 0.01)
    places = np.empty((len(times_s), 3))
    at = HOME
    for (_, took_s, to), begin_s in zip(steps, begins_s):
        u = np.clip((times_s - begin_s) / took_s, 0.0, 1.0)
        here = times_s >= begin_s
        share = (u * u * (3.0 - 2.0 * u))[here, np.newaxis]
        places[here] = np.array(at) + share * (np.array(to) - at)
        at = to
    plc_s = np.arange(0.0, begins_s[-1], 0.05)
    row = np.searchsorted(begins_s, plc_s, 'right') - 1
    state = np.array([it[0] for it in steps], float)[row]
    force = np.interp(times_s, [0.0, begins_s[-1]], [1.0, 2.0])
    channels = [Channel('robot', 'tool force', 'N', ChannelKind.FORCE, times_s, force)]
    if has_states:
        channels.append(Channel('plc', 'state', '', ChannelKind.VARIABLE, plc_s, state))
    return Run(name, float(begins_s[-1]), tuple(channels),
               (ToolMotion('robot', times_s, places),))._replace(**more)  # type: ignore[arg-type]


@pytest.mark.parametrize('has_states', [True, False])
def test_a_step_that_comes_once_more_is_dated_to_where_it_begins(has_states: bool) -> None:
    again = [*WORK[:5], (30, 1.0, LEFT), (40, 3.0, RIGHT), (50, 2.0, ABOVE), *WORK[5:]]
    found = GoodRuns(stepped(WORK, has_states=has_states)).compare(
        stepped(again, 'again', has_states))
    lost = next(it for it in found.departures if it.signal.label == 'time lost')
    assert found.run_s(lost.onset_s) == pytest.approx(8.5, abs=0.1)
    assert lost.in_all_s == pytest.approx(6.0, abs=0.2)
    beside = [it for it in found.departures if it.signal.label.startswith('tool')
              and it.signal.label != 'tool force']
    assert not has_states or not beside  # by motion alone, moments are less exact


def test_a_state_that_is_interrupted_goes_on_behind_it() -> None:
    """The strokes share a state, so its order alone does not show where the extra ones end."""
    strokes: Sequence[Step] = ((30, 1.0, LEFT), (40, 3.0, RIGHT), (40, 2.5, LEFT), (40, 3.0, RIGHT))
    usual = [*WORK[:2], *strokes, *WORK[4:]]
    again = [*WORK[:2], *strokes[:2], *strokes, *WORK[4:]]
    found = GoodRuns(stepped(usual)).compare(stepped(again, 'again'))
    lost = next(it for it in found.departures if it.signal.label == 'time lost')
    assert found.run_s(lost.onset_s) == pytest.approx(6.5, abs=0.2)
    assert lost.in_all_s == pytest.approx(4.0, abs=0.5)


def test_a_rest_that_is_longer_is_so_where_its_states_tell() -> None:
    rest: Sequence[Step] = ((10, 1.0, HOME), (41, 1.0, RIGHT))
    usual = [*WORK[:4], rest[1], *WORK[4:]]
    good = GoodRuns(stepped(usual, events=(RunEvent('begins', 0.2),)))
    for at, onset_s in ((1, 1.0), (5, 7.5)):
        to = usual[at - 1][2]
        longer = [*usual[:at], (usual[at][0], 0.5, to), *usual[at:]]
        found = good.compare(stepped(longer, 'longer', events=(RunEvent('begins', 0.2),)))
        assert found.departures[0].signal.label == 'time lost'
        assert found.run_s(found.departures[0].onset_s) == pytest.approx(onset_s, abs=0.2)


def test_a_short_piece_of_motion_is_aligned_as_well() -> None:
    run = stepped([(30, 0.6, LEFT)], has_states=False)
    slower = stepped([(30, 0.75, LEFT)], has_states=False)
    found = aligned_at(run, slower, ())
    assert found.method is AlignmentMethod.MOTION
    assert found.time_map.to_run(np.array([0.3])) == pytest.approx([0.375], abs=0.01)


def test_a_step_that_is_missing_is_not_spread_over_what_is_around_it() -> None:
    found = GoodRuns(stepped(WORK)).compare(stepped([*WORK[:4], *WORK[5:]], 'short'))
    assert found.departures[0].words == '50 is missing'
    assert found.run_s(found.departures[0].onset_s) == pytest.approx(6.5, abs=0.1)


def test_a_rest_with_more_states_is_longer_where_they_are() -> None:
    rest: Sequence[Step] = ((41, 1.0, RIGHT), (42, 1.0, RIGHT))
    usual = [*WORK[:4], *rest, *WORK[4:]]
    found = aligned_at(stepped(usual), stepped([*WORK[:4], *rest, *rest, *WORK[4:]], 'more'), ())
    assert found.time_map.to_run(np.array([8.4, 8.6])) == pytest.approx([8.4, 10.6], abs=0.07)


def test_a_message_that_is_wrong_moves_nothing() -> None:
    run = stepped(WORK, 'wrong')
    force, plc = run.channels
    values = plc.values.copy()
    values[80:90] = 99.0
    wrong = run._replace(channels=(force, plc._replace(values=values)))
    found = aligned_at(stepped(WORK), wrong, ())
    times_s = np.arange(1.5, 10.0, 0.1)
    assert found.time_map.to_run(times_s) == pytest.approx(times_s, abs=0.02)


def to_place(number: float, offset_m: float, pace: float = 1.0) -> Run:
    target = (0.6 + offset_m, 0.2, 0.3)
    steps = [(state, took_s * pace, target if to is RIGHT else to) for state, took_s, to in WORK]
    return stepped(steps, f'place {number:g}', place=(('index', number),))


def test_the_way_to_another_place_is_aligned_by_states() -> None:
    good = GoodRuns(to_place(0.0, 0.0), [to_place(1.0, 0.1), to_place(2.0, 0.2),
                                         to_place(3.0, 0.3)])
    found = good.compare(to_place(4.0, 0.4))
    assert found.alignment.method is AlignmentMethod.STATES
    assert not found.departures
    slow = good.compare(to_place(5.0, 0.4, 1.3)).departures
    assert slow[0].signal.label == 'pace'


def test_a_step_that_is_missing_on_the_way_to_another_place_is_dated_to_where_it_is() -> None:
    good = GoodRuns(to_place(0.0, 0.0), [to_place(1.0, 0.1), to_place(2.0, 0.2),
                                         to_place(3.0, 0.3)])
    whole = to_place(4.0, 0.4)
    short = stepped([*WORK[:2], (40, 3.0, (1.0, 0.2, 0.3)), *WORK[4:]], 'short')
    found = good.compare(short._replace(place=whole.place))
    assert found.departures[0].words == '30 is missing'
    onsets_s = [found.run_s(it.onset_s) for it in found.departures]
    assert min(onsets_s) == pytest.approx(2.5, abs=0.2)


def test_what_all_places_have_in_common_is_judged_at_an_unknown_one() -> None:
    good = GoodRuns(to_place(0.0, 0.0), [to_place(float(number), 0.1 * number, 1.0 + 0.005 * number)
                                         for number in range(1, 5)])
    beside = to_place(5.0, 0.45, 1.01)
    assert not good.compare(beside).departures
    motion = beside.motions[0]
    moved = motion._replace(positions=motion.positions + np.array([0.0, 0.0, 0.004]))
    found = good.compare(beside._replace(motions=(moved,)))
    assert found.departures[0].signal.label == 'tool up'


def test_signals_have_the_order_of_the_devices_in_every_process() -> None:
    names = [f'robot {number}' for number in range(6)]

    def moved(run: Run) -> Run:
        return run._replace(motions=tuple(run.motions[0]._replace(device=it) for it in names))

    good = GoodRuns(moved(to_place(0.0, 0.0)), [
        moved(to_place(float(number), 0.1 * number, 1.0 + 0.005 * number))
        for number in range(1, 5)])
    found = good.compare(moved(to_place(5.0, 0.45, 1.01)))
    devices = dict.fromkeys(it.device for it in found.band.signals if it.label == 'tool up')
    assert list(devices) == names


@pytest.mark.parametrize('late_s', [-0.06, 0.06])
def test_messages_of_states_that_are_late_are_no_other_place(late_s: float) -> None:
    """Only the messages show when the tool moves to a position that no good run has."""
    good = GoodRuns(to_place(0.0, 0.0), [
        to_place(float(number % 2), 0.1 * (number % 2), 1.0 + 0.004 * number)
        for number in range(1, 9)])
    run = to_place(5.0, 0.4, 1.01)
    force, plc = run.channels
    plc_s = np.maximum(plc.times_s + late_s * np.sin(7.0 * plc.values), 0.0)
    late = run._replace(channels=(force, plc._replace(times_s=np.sort(plc_s))))
    assert not [it.signal.name for it in good.compare(late).departures]


def test_a_rest_beside_its_place_is_no_lost_time() -> None:
    beside = [(state, took_s, (to[0], to[1], to[2] + 0.002)) for state, took_s, to in WORK]
    found = GoodRuns(stepped(WORK)).compare(stepped(beside, 'beside'))
    assert not [it for it in found.departures if it.signal.label == 'time lost']
