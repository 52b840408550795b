# SPDX-License-Identifier: BSD-3-Clause
from __future__ import annotations

import json
from typing import Sequence

import numpy as np
import pytest
from made_runs import made_run, progress

from process_visualizer.commands.compare_command import as_json, as_text
from process_visualizer.figures import clock_text
from process_visualizer.page.robots import PageSpan
from process_visualizer.page.run_page import run_words
from process_visualizer.runs.comparison.comparison import Comparison, Missing, incomparable
from process_visualizer.runs.comparison.good_runs import GoodRuns
from process_visualizer.runs.comparison.timeline_bands import timeline_bands
from process_visualizer.runs.comparison.wording import amount, unjudged_texts, verdict
from process_visualizer.runs.deviation.band import TooFewRuns
from process_visualizer.runs.run import Channel, ChannelKind, Run, RunPhase, part_of
from process_visualizer.runs.series import inside


def pushed(process_s: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Let the force jump 3 s after the beginning of the process."""
    return values + np.where(process_s > 3.0, 4.0, 0.0)


def beside(process_s: np.ndarray, at: np.ndarray) -> np.ndarray:
    return at + np.where(process_s > 2.0, 1.0, 0.0)[:, np.newaxis] * (0.0, 0.02, 0.0)


def goods(count: int) -> Sequence[Run]:
    return [made_run(seed, speed=1.0 + 0.002 * (seed % 7), start_s=2.0 + 0.1 * (seed % 5))
            for seed in range(1, count + 1)]


@pytest.fixture(scope='module')
def learned() -> GoodRuns:
    return GoodRuns(made_run(), goods(24))


def test_a_good_run_stays_within_a_learned_band(learned: GoodRuns) -> None:
    assert learned.band.rate == 0.05
    assert learned.compare(made_run(77)).departures == ()


def test_a_run_stays_within_the_tolerance_of_itself() -> None:
    good = GoodRuns(made_run())
    found = good.compare(made_run())
    assert verdict(found) == 'in range'
    assert found.notes == ('it is the reference itself',)


def test_the_cause_is_named_with_time_event_and_size(learned: GoodRuns) -> None:
    found = learned.compare(made_run(77, speed=1.01, start_s=4.0, value=pushed))
    assert found.departures[0].signal.name == 'robot tool force'
    assert verdict(found).startswith('out of range first at 0:0'), verdict(found)
    assert found.run_s(found.departures[0].onset_s) == pytest.approx(7.03, abs=0.1)
    assert '(go + 2.0 s): robot tool force, +4' in verdict(found)


def test_a_tool_beside_its_path_is_told_as_sideways(learned: GoodRuns) -> None:
    found = learned.compare(made_run(77, place=beside))
    assert found.departures[0].signal.name == 'robot tool sideways'
    assert '20 mm to the right of its path (band' in verdict(found)


@pytest.mark.parametrize('longer_s', [0.4, 2.0, 5.0])
def test_all_of_the_time_that_was_lost_is_told(longer_s: float) -> None:
    """Also during a rest, over which a time mapping distributes it."""
    [found] = [it for it in GoodRuns(made_run()).compare(made_run(1, dwell_s=longer_s)).departures
               if it.signal.label == 'time lost']
    assert found.in_all_s == pytest.approx(longer_s, rel=0.1)
    assert amount(found).startswith(f'{found.in_all_s:+.3g} s')


def test_a_dwell_is_told_as_time_lost(learned: GoodRuns) -> None:
    first = learned.compare(made_run(77, dwell_s=0.2)).departures[0]
    assert first.signal.label == 'time lost'
    assert first.deviation == pytest.approx(0.2, abs=0.02)


def test_a_slow_run_is_told_as_slower(learned: GoodRuns) -> None:
    found = learned.compare(made_run(77, speed=1.1))
    assert 'pace' in [it.signal.label for it in found.departures]
    assert '% slower (band' in as_text(learned, [found])
    faster = learned.compare(made_run(77, speed=0.9))
    assert '% faster (band' in as_text(learned, [faster])


def test_one_of_the_good_runs_is_judged_by_the_others() -> None:
    runs = [*goods(24), made_run(30, value=pushed)]
    good = GoodRuns(made_run(), runs)
    assert good.compare(runs[-1]).departures[0].signal.name == 'robot tool force'
    assert good.notes == ('run 30 stands out from the other good runs (robot tool force); it is '
                          'left out',)


def test_good_runs_that_differ_by_more_than_is_allowed_are_told() -> None:
    def limited(run: Run) -> Run:
        return run._replace(channels=tuple(it._replace(max_tolerance=0.3) for it in run.channels))
    gains = np.random.default_rng(1).uniform(0.8, 1.2, 8)
    runs = [limited(made_run(seed, value=lambda process_s, values, gain=gain: gain * values))
            for seed, gain in enumerate(gains)]
    note, = GoodRuns(runs[0], runs[1:]).notes
    assert 'the max_tolerance of robot tool force, 0.3 N: more good runs' in note
    assert not GoodRuns(runs[0], [limited(made_run(seed)) for seed in range(8)]).notes


def test_a_rate_that_so_few_runs_cannot_support_is_refused() -> None:
    with pytest.raises(TooFewRuns, match='3 good runs beside the reference .* it takes 99'):
        GoodRuns(made_run(), goods(3), rate=0.01)


def test_a_good_run_that_is_named_twice_counts_once() -> None:
    assert GoodRuns(made_run(), [made_run(1), made_run(), made_run(1)]).band.runs == 2


def test_few_runs_give_a_tolerance() -> None:
    good = GoodRuns(made_run(), goods(2))
    assert good.band.rate is None
    assert good.compare(made_run(77, value=pushed)).departures


def test_a_run_that_stops_half_way_is_compared_as_far_as_it_goes(learned: GoodRuns) -> None:
    whole = made_run(77, value=pushed)
    half = whole._replace(duration_s=5.5)
    found = learned.compare(half)
    assert found.departures[0].signal.name == 'robot tool force'
    assert any(note.startswith('it covers 4') for note in found.notes)


def test_a_channel_that_one_of_them_lacks_is_told() -> None:
    run = made_run(77)
    other = run._replace(channels=(run.channels[0]._replace(label='torque'),))
    found = GoodRuns(made_run()).compare(other)
    assert 'only the reference has robot tool force' in found.notes
    assert 'only the run has robot torque' in found.notes


def test_runs_of_different_cells_are_not_comparable() -> None:
    run = made_run(77)
    other = run._replace(channels=(run.channels[0]._replace(device='other'),))
    reason = incomparable(made_run(), other)
    assert reason is not None and 'of different cells' in reason


def test_values_that_are_no_numbers() -> None:
    run = made_run(77, value=lambda s, values: np.where(s > 3.0, np.nan, values))
    assert GoodRuns(made_run()).compare(run).departures == ()
    everywhere = made_run(77, value=lambda s, values: values * np.nan)
    assert GoodRuns(made_run()).compare(everywhere).departures == ()


def test_a_reference_without_anything_is_refused() -> None:
    with pytest.raises(ValueError, match='nothing|no variable'):
        GoodRuns(made_run()._replace(channels=(), motions=()))


def test_json_has_what_the_text_has(learned: GoodRuns) -> None:
    found = [learned.compare(made_run(77, value=pushed)), learned.compare(made_run(78))]
    read = json.loads(as_json(learned, found))
    assert [it['is_within'] for it in read['runs']] == [False, True]
    first = read['runs'][0]['departures'][0]
    assert (first['device'], first['signal'], first['unit']) == ('robot', 'tool force', 'N')
    assert first['onset_s'] == pytest.approx(5.0, abs=0.1)
    assert as_text(learned, found).endswith('1 of 2 runs out of range')


def test_bands_on_the_timeline_of_a_recording(learned: GoodRuns) -> None:
    """The recording continues for 5 s after the run, which begins 10 s after its start."""
    found = learned.compare(made_run(77, value=pushed)._replace(begin_s=10.0))
    bands = timeline_bands([found], 28.0, 280)
    force = bands['robot', 'tool force']
    assert np.isnan(force.low[:100]).all() and np.isnan(force.high[231:]).all()
    known = slice(105, 220)
    assert (force.low[known] < force.high[known]).all()
    np.testing.assert_allclose(0.5 * (force.low + force.high)[known],
                               10.0 * progress(np.arange(105, 220) * 0.1 + 0.05 - 12.0), atol=0.2)
    assert not force.departed[:149].any()
    assert force.departed[152:].sum() > 60
    assert ('robot', 'tool sideways') not in bands


@pytest.mark.parametrize('time_s, text', [(0.0, '0:00.00'), (6.42, '0:06.42'), (59.999, '1:00.00'),
                                          (3725.5, '1:02:05.50'), (-1.5, '-0:01.50')])
def test_clock(time_s: float, text: str) -> None:
    assert clock_text(time_s) == text


def interrupted(run: Run, begin_s: float, end_s: float) -> Run:
    """The run without the data of a while."""
    def kept(times_s: np.ndarray) -> np.ndarray:
        return (times_s < begin_s) | (times_s > end_s)
    return run._replace(
        channels=tuple(it._replace(times_s=it.times_s[kept(it.times_s)],
                                   values=it.values[kept(it.times_s)]) for it in run.channels),
        motions=tuple(it._replace(times_s=it.times_s[kept(it.times_s)],
                                  positions=it.positions[kept(it.times_s)]) for it in run.motions))


def held_up(run: Run, at_s: float, late_s: float) -> Run:
    """The run with all messages delayed for a moment, and then delivered at once."""
    def arrival(times_s: np.ndarray) -> np.ndarray:
        waits = (times_s >= at_s) & (times_s < at_s + late_s)
        behind = waits.sum() - np.cumsum(waits)
        return np.where(waits, at_s + late_s - 1e-4 * (1 + behind), times_s)
    return run._replace(
        channels=tuple(it._replace(times_s=arrival(it.times_s)) for it in run.channels),
        motions=tuple(it._replace(times_s=arrival(it.times_s)) for it in run.motions))


@pytest.mark.parametrize('begin_s, end_s', [(4.5, 6.0), (5.0, 5.4), (9.0, 11.0), (2.5, 3.5)])
def test_a_gap_in_the_recording_is_no_fault_of_the_process(learned: GoodRuns, begin_s: float,
                                                           end_s: float) -> None:
    for good in (learned, GoodRuns(made_run())):
        found = good.compare(interrupted(made_run(77, speed=1.01), begin_s, end_s))
        assert found.departures == ()
        text = as_text(good, [found])
        assert f'not judged: anything from {clock_text(begin_s - 0.4)[:-1]}' in text
        assert json.loads(as_json(good, [found]))['runs'][0]['not_judged']
        notes = run_words(found.run, found, (), PageSpan(0.0, found.run.duration_s))['notes']
        assert any('not judged: anything from ' in it for it in notes)
        bands = timeline_bands([found], found.run.duration_s, 140)
        assert not any(it.departed.any() for it in bands.values())


def test_a_run_that_begins_within_a_gap_has_lost_no_time(learned: GoodRuns) -> None:
    """Its event happened within the gap, and was noticed with the first message after it."""
    whole = interrupted(made_run(77), 1.0, 5.5)
    late = whole._replace(events=tuple(
        it._replace(time_s=5.5) if it.name == 'go' else it for it in whole.events))
    run = part_of(late, 2.5, late.duration_s, 'cut')
    for good in (learned, GoodRuns(made_run())):
        found = good.compare(run)
        assert found.departures == () and found.has_gaps
        assert not any('motion took' in it for it in found.notes)


def only_moving(run: Run) -> Run:
    """The run with a driver that sends nothing while its robot is at rest."""
    motion, = run.motions
    moves = np.zeros(len(motion.times_s), bool)
    goes = np.linalg.norm(np.diff(motion.positions, axis=0), axis=1) > 1e-5
    moves[1:] |= goes
    moves[:-1] |= goes
    return run._replace(motions=(motion._replace(times_s=motion.times_s[moves],
                                                 positions=motion.positions[moves]),))


def test_a_late_start_of_a_robot_that_is_silent_at_rest_is_found() -> None:
    """Other topics are present before it moves: nothing was lost."""
    good = GoodRuns(only_moving(made_run(1)), [only_moving(made_run(it)) for it in (2, 3)])
    assert good.compare(only_moving(made_run(77))).departures == ()
    late = made_run(78, start_s=2.6)
    late = late._replace(events=tuple(it._replace(time_s=it.time_s - 0.6) if it.name == 'go' else it
                                      for it in late.events))
    found = good.compare(only_moving(late))
    assert found.departures and found.departures[0].signal.label == 'time lost'
    assert found.departures[0].deviation == pytest.approx(0.6, abs=0.05)


@pytest.mark.parametrize('begin_s, end_s', [(3.1, 3.9), (4.5, 5.3), (8.2, 9.1)])
def test_a_gap_in_the_reference_is_no_fault_of_a_run(begin_s: float, end_s: float) -> None:
    """Only the motion is missing: after the gap, force means only use values of both runs."""
    reference = made_run()
    motion, = reference.motions
    kept = (motion.times_s < begin_s) | (motion.times_s > end_s)
    reference = reference._replace(motions=(motion._replace(
        times_s=motion.times_s[kept], positions=motion.positions[kept]),))
    assert GoodRuns(reference).compare(made_run(77)).departures == ()


def test_a_value_that_is_the_same_behind_a_gap_was_not_stuck(learned: GoodRuns) -> None:
    run = made_run(77)
    force, *others = run.channels
    kept = (force.times_s < 7.3) | (force.times_s > 7.9)
    rounded = force._replace(times_s=force.times_s[kept], values=np.where(
        np.abs(force.times_s - 7.6) < 0.42, 5.0, force.values)[kept])
    found = learned.compare(run._replace(channels=(rounded, *others)))
    assert found.departures == ()


def test_a_short_hole_in_the_motion_leaves_little_unjudged(learned: GoodRuns) -> None:
    run = made_run(77)
    missing = [it._replace(times_s=np.delete(it.times_s, hole), positions=np.delete(
        it.positions, hole, axis=0)) for it in run.motions
        for hole in [(it.times_s > 5.0) & (it.times_s < 5.12)]]
    found = learned.compare(run._replace(motions=tuple(missing)))
    assert found.departures == ()
    assert all(it.begin_s > 4.7 and it.end_s < 5.5 for it in found.unjudged)


def test_a_short_piece_of_motion_before_a_hole_does_not_show_the_moment(learned: GoodRuns) -> None:
    """In it, the tool is slightly below its path: a moment later it would be on it."""
    run = made_run(77, start_s=-0.7)
    motion, = run.motions
    positions = motion.positions - (motion.times_s < 0.3)[:, np.newaxis] * (0.0, 0.0, 0.02)
    kept = (motion.times_s < 0.7) | (motion.times_s > 1.2)
    moved = motion._replace(positions=positions)
    assert learned.compare(run._replace(motions=(moved,))).departures[0].signal.label == 'tool up'
    found = learned.compare(run._replace(motions=(moved._replace(
        times_s=motion.times_s[kept], positions=positions[kept]),)))
    assert found.departures == ()
    assert any(it.why is Missing.MOTION and it.begin_s < 0.1 for it in found.unjudged)


def test_a_force_that_is_missing_beside_a_hole_in_the_motion_is_told_itself(
        learned: GoodRuns) -> None:
    run = made_run(77)
    motion, = run.motions
    moves = (motion.times_s < 5.0) | (motion.times_s > 5.12)
    force, *others = run.channels
    kept = (force.times_s < 4.4) | (force.times_s > 5.7)
    found = learned.compare(run._replace(
        motions=(motion._replace(times_s=motion.times_s[moves],
                                 positions=motion.positions[moves]),),
        channels=(force._replace(times_s=force.times_s[kept], values=force.values[kept]),
                  *others)))
    assert ('robot tool force', Missing.DATA) in {(it.signal.name, it.why)
                                                  for it in found.unjudged}


def test_small_deviations_beside_missing_data_may_come_from_late_messages() -> None:
    """On a busy computer, three of 27 good runs were out of range, each beside late messages."""
    good = GoodRuns(made_run(), [made_run(seed) for seed in range(1, 5)])

    def run(extra: float, kept: bool) -> Comparison:
        found = made_run(77, value=lambda process_s, values: values + extra * (
            (process_s > 5.12) & (process_s < 5.4)))
        motion, = found.motions
        rows = kept | (motion.times_s < 6.5) | (motion.times_s > 7.05)
        return good.compare(found._replace(motions=(motion._replace(
            times_s=motion.times_s[rows], positions=motion.positions[rows]),)))

    band = good.band.signals[next(it for it in good.band.signals if it.label == 'tool force')]
    half = float(np.nanmedian(band.half_width))
    assert run(1.5 * half, True).departures and not run(1.5 * half, False).departures
    assert run(3.0 * half, False).departures


def test_nothing_is_out_of_range_where_the_verdict_says_that_nothing_is_judged() -> None:
    """A force had values in a stretch in which the moment was unknown, and left its range there."""
    good = GoodRuns(made_run(), [made_run(seed) for seed in range(1, 5)])
    found = made_run(77)
    motion, = found.motions
    rows = (motion.times_s < 6.5) | (motion.times_s > 7.05)
    run = found._replace(motions=(motion._replace(
        times_s=motion.times_s[rows], positions=motion.positions[rows]),))
    compared = good.compare(run)
    stretches = np.array([(it.begin_s, it.end_s) for it in compared.unjudged
                          if it.why is Missing.MOTION])
    at_s = run.begin_s + compared.alignment.time_map.to_run(good.times_s)
    within = inside(at_s, stretches)
    assert within.any() and all(np.isnan(values[within]).all()
                                for values in compared.columns.values())


@pytest.mark.parametrize('at_s', [2.9, 4.3, 5.01, 8.6, 10.2])
def test_messages_that_were_held_up_are_no_fault_of_the_process(learned: GoodRuns,
                                                                at_s: float) -> None:
    for good in (learned, GoodRuns(made_run())):
        for late_s in (0.04, 0.09, 0.3):
            assert good.compare(held_up(made_run(77), at_s, late_s)).departures == ()


@pytest.mark.parametrize('at_s', [6.8, 7.0, 7.2])
def test_messages_that_were_held_up_at_an_edge_are_no_fault(at_s: float) -> None:
    """The mean over a longer time: values next to the gap are the edge's, and mean little."""
    def edged(seed: int) -> Run:
        late_s = 0.03 * abs(np.random.default_rng([seed, 5]).standard_normal())
        return made_run(seed, noise=0.5, value=lambda process_s, values: values + 60.0 * (
            process_s > 5.0 + late_s))
    good = GoodRuns(edged(1), [held_up(edged(seed), 1.0 + 0.45 * seed, 0.09)
                               for seed in range(2, 25)])
    assert good.compare(held_up(edged(77), at_s, 0.09)).departures == ()


def test_a_fault_beside_a_gap_is_found(learned: GoodRuns) -> None:
    found = learned.compare(interrupted(made_run(77, value=pushed), 7.0, 8.0))
    assert found.departures[0].signal.name == 'robot tool force'
    assert found.departures[0].onset_s == pytest.approx(5.0, abs=0.2)


def with_channel(run: Run, label: str, times_s: np.ndarray, values: np.ndarray,
                 unit: str = '') -> Run:
    return run._replace(channels=(*run.channels, Channel(
        'oven', label, unit, ChannelKind.VARIABLE, times_s, values)))


def heated(seed: int, degrees: float = 45.0) -> Run:
    """A run with a temperature once per second."""
    run = made_run(seed)
    times_s = np.arange(0.0, run.duration_s, 1.0)
    noise = 0.1 * np.random.default_rng(seed).standard_normal(len(times_s))
    return with_channel(run, 'temperature', times_s, degrees + noise, '°C')


@pytest.mark.parametrize('count', [1, 4, 24])
def test_what_comes_once_a_second_is_judged_by_the_value_that_holds(count: int) -> None:
    good = GoodRuns(heated(1), [heated(seed) for seed in range(2, count + 1)])
    assert good.compare(heated(77)).departures == ()
    found, = good.compare(heated(77, 50.0)).departures
    assert found.signal.name == 'oven temperature' and found.onset_s < 0.5
    assert found.deviation == pytest.approx(5.0, abs=0.4)


def stepped(seed: int, *states: float, late_s: float = 0.0) -> Run:
    """A run whose states change every two seconds, sent ten times per second."""
    run = made_run(seed)
    times_s = np.arange(0.0, run.duration_s, 0.1)
    row = np.floor((times_s - 2.0 - late_s * (times_s >= 6.0)) / 2.0).astype(int)
    row = np.clip(np.maximum.accumulate(row), 0, len(states) - 1)
    return with_channel(run, 'state', times_s, np.array(states)[row])


@pytest.mark.parametrize('count', [1, 5, 24])
@pytest.mark.parametrize('states, late_s, said, onset_s', [
    ((10, 20, 40, 50, 60), 0.0, '30 is missing', 6.0),
    ((10, 20, 30, 99, 50, 60), 0.0, '99 instead of 40', 8.0),
    ((10, 20, 30, 40, 20, 50, 60), 0.0, '20 occurs once too often', 10.0),
    ((10, 20, 30, 40, 50), 0.0, '60 is missing', 12.0),
    ((10, 20, 30, 40, 50, 60), 0.8, '30 occurs 0.80 s later', 6.0)])
def test_a_wrong_state_is_told_in_words(count: int, states: Sequence[float], late_s: float,
                                        said: str, onset_s: float) -> None:
    usual = (10, 20, 30, 40, 50, 60)
    good = GoodRuns(stepped(1, *usual), [stepped(seed, *usual) for seed in range(2, count + 1)])
    assert good.compare(stepped(77, *usual)).departures == ()
    found = good.compare(stepped(77, *states, late_s=late_s))
    assert said in verdict(found), verdict(found)
    assert 'oven state' in verdict(found)
    assert found.departures[0].onset_s == pytest.approx(onset_s, abs=0.25)


def test_a_bit_that_is_sent_only_when_it_changes_has_the_value_that_holds() -> None:
    def done(seed: int, *times_s: float) -> Run:
        return with_channel(made_run(seed), 'done', np.array(times_s),
                            np.array([0.0, 1.0])[:len(times_s)])
    good = GoodRuns(done(1, 0.0, 9.0), [done(seed, 0.0, 9.0 + 0.02 * seed) for seed in range(2, 8)])
    assert good.compare(done(77, 0.0, 9.06)).departures == ()
    assert 'oven done: 1 is missing' in verdict(good.compare(done(77, 0.0)))


def test_a_counter_that_came_first_behind_the_reference_is_no_measurement() -> None:
    def counted(seed: int) -> Run:
        sent = seed > 0
        return with_channel(made_run(seed), 'count', np.zeros(1)[:sent],
                            np.full(1, 7.0 * seed)[:sent])
    good = GoodRuns(counted(0), [counted(seed) for seed in range(1, 6)])
    assert not good.compare(counted(20)).departures


def test_what_was_sent_before_a_run_holds_in_it() -> None:
    """For a bit that is sent when it changes; a measurement from before the run does not count."""
    bit = with_channel(made_run(), 'done', np.array([1.0, 3.0]), np.array([0.0, 1.0]))
    heat = with_channel(bit, 'heat', np.arange(14.0), np.where(np.arange(14) < 5, 20.0, 30.0), '°C')
    part = part_of(heat, 4.5, 9.0, 'part')
    assert part.by_key['oven', 'done'].values.tolist() == [1.0]
    assert part.by_key['oven', 'done'].times_s.tolist() == [0.0]
    assert part.by_key['oven', 'heat'].values[0] == 30.0


@pytest.mark.parametrize('count', [5, 10, 25])
def test_a_reference_that_is_none_is_left_out(count: int) -> None:
    """Also if it is the first one, whose clock is the reference for all."""
    for place in (0, 2):
        runs = list(goods(count))
        runs[place] = made_run(50, value=lambda process_s, values: 1.6 * values)
        good = GoodRuns(runs[0], runs[1:])
        assert [it for it in good.notes if 'run 50 stands out' in it] and len(good.notes) == 1
        found = good.compare(made_run(77, value=lambda process_s, values: 1.2 * values))
        assert found.departures[0].signal.name == 'robot tool force'


def test_a_run_is_judged_by_those_of_its_variant() -> None:
    def of(seed: int, variant: float, force: float = 1.0) -> Run:
        run = made_run(seed, value=lambda process_s, values: force * values)
        return run._replace(group=(('variant', variant),))
    good = GoodRuns(of(1, 1.0), [*(of(seed, 1.0) for seed in range(2, 7)),
                                 *(of(seed, 2.0, 2.0) for seed in range(7, 13))])
    assert good.compare(of(77, 1.0)).departures == ()
    assert good.compare(of(77, 2.0, 2.0)).departures == ()
    assert good.compare(of(77, 1.0, 2.0)).departures != ()
    unknown = good.compare(of(77, 3.0))
    assert verdict(unknown) == 'is not judged: there is no good run of variant 3'
    judged = json.loads(as_json(good, [unknown]))['runs'][0]
    assert (judged['is_judged'], judged['is_within']) == (False, False)


def test_numbers_with_names_are_states_though_they_change_quickly() -> None:
    """Sent only when it changes, every 0.4 s, a state looks like a measurement."""
    def of(seed: int, more: Sequence[float] = ()) -> Run:
        times_s = np.array([*np.arange(0.2, 12.0, 0.4), *more])
        values = np.where(np.isin(times_s, more), 9.0, np.arange(len(times_s)) % 4)
        order = np.argsort(times_s)
        run = with_channel(made_run(seed), 'state', times_s[order], values[order])
        state = run.channels[-1]._replace(value_names=((3.0, 'screw'),))
        return run._replace(channels=(*run.channels[:-1], state))
    found = GoodRuns(of(1), [of(2), of(3)]).compare(of(77, [5.1])).departures
    assert [it.words for it in found] == ['9 occurs in addition']


def test_a_state_that_began_in_a_hole_of_all_data_is_not_missing() -> None:
    """Sent only when it changes, it came while nothing was recorded."""
    def of(seed: int) -> Run:
        return with_channel(made_run(seed), 'state', np.array([2.0, 4.0, 6.0, 8.0]), np.arange(4.0))

    def kept(times_s: np.ndarray) -> np.ndarray:
        return (times_s < 5.5) | (times_s > 6.5)
    good, run = GoodRuns(of(1), [of(2), of(3)]), of(77)
    missing = run._replace(channels=(*run.channels[:-1], run.channels[-1]._replace(
        times_s=np.array([2.0, 4.0, 8.0]), values=np.array([0.0, 1.0, 3.0]))))
    assert [it.words for it in good.compare(missing).departures] == ['2 is missing']
    found = good.compare(run._replace(
        channels=tuple(it._replace(times_s=it.times_s[kept(it.times_s)],
                                   values=it.values[kept(it.times_s)]) for it in run.channels),
        motions=tuple(it._replace(times_s=it.times_s[kept(it.times_s)],
                                  positions=it.positions[kept(it.times_s)])
                      for it in run.motions)))
    assert found.departures == ()
    assert any('oven state from 0:05.49 to 0:06.51' in it for it in unjudged_texts(found))


def test_slow_topics_that_pause_together_are_no_hole() -> None:
    """Each is sent as always; a state that comes late between two messages is late."""
    def of(seed: int, since_s: float = 4.05) -> Run:
        run = made_run(seed, has_motion=False)
        for number in range(3):
            times_s = np.arange(0.01 * number, run.duration_s, 0.125)
            run = with_channel(run, f'flow {number}', times_s, np.sin(times_s) + number)
        run = run._replace(channels=run.channels[1:])
        return with_channel(run, 'state', np.array([0.0, since_s, 8.0]), np.array([0.0, 1.0, 0.0]))
    found = GoodRuns(of(1), [of(2), of(3), of(4)]).compare(of(77, 5.25)).departures
    assert [it.words.split(' (')[0] for it in found] == ['1 occurs 1.20 s later than usual']


def test_the_number_of_the_run_before_is_no_wrong_state() -> None:
    """The variant or position is sent when it changes, shortly before its run begins."""
    def of(seed: int, before: float, number: float) -> Run:
        run = with_channel(made_run(seed), 'number', np.array([0.0, 0.3]),
                           np.array([before, number]))
        return run._replace(group=(('number', number),), place=(('number', number),))
    good = GoodRuns(of(1, 1.0, 1.0), [of(2, 1.0, 1.0), of(3, 1.0, 1.0)])
    assert good.compare(of(77, 2.0, 1.0)).departures == ()


def test_the_place_of_a_pattern_is_that_of_good_runs_at_it() -> None:
    def at(seed: int, index: int, offset_m: float) -> Run:
        def aside(process_s: np.ndarray, places: np.ndarray) -> np.ndarray:
            share = np.clip(process_s - 2.0, 0.0, 1.0) * np.clip(8.0 - process_s, 0.0, 1.0)
            return places + share[:, np.newaxis] * (0.0, offset_m, 0.0)
        return made_run(seed, place=aside)._replace(place=(('index', float(index)),))
    good = GoodRuns(at(1, 0, 0.0), [at(seed, seed % 4, 0.1 * (seed % 4)) for seed in range(2, 14)])
    assert good.compare(at(77, 2, 0.2)).departures == ()
    wrong = good.compare(at(77, 2, 0.3)).departures[0]
    assert wrong.signal.kind.value == 'place'
    assert 'no good run of index 9' in as_text(good, [good.compare(at(77, 9, 0.2))])


def test_where_a_place_was_aligned_less_exactly_its_good_runs_are_no_worse() -> None:
    """The states of the first run at a position came late once: all its runs seem to lose time."""
    def at(seed: int, index: int, late_s: float = 0.0) -> Run:
        def aside(process_s: np.ndarray, places: np.ndarray) -> np.ndarray:
            share = np.clip(process_s - 2.0, 0.0, 1.0) * np.clip(8.0 - process_s, 0.0, 1.0)
            return places + share[:, np.newaxis] * (0.0, 0.05 * index, 0.0)
        run = made_run(seed, place=aside)._replace(place=(('index', float(index)),))
        times_s = np.arange(0.0, run.duration_s, 0.05)
        held = (times_s >= 6.0) & (times_s < 6.0 + late_s)
        states = np.where(held, 3, np.clip(np.floor(times_s - 2.0), 0, 9))
        return with_channel(run, 'state', times_s, states)
    good = GoodRuns(at(1, 0), [at(seed, seed % 8, 0.1 * (seed == 2)) for seed in range(2, 25)])
    assert good.notes == ()
    assert good.compare(at(77, 2)).departures == ()
    assert good.compare(at(77, 3)).departures == ()


def waiting(seed: int, wait_s: float, late_s: float = 0.0) -> Run:
    """A run that waits, and continues ``late_s`` too late."""
    run = made_run(seed, dwell_s=wait_s + late_s, events=(('waits', 2.999), ('goes on', 3.001)))
    waits, goes_on = run.events
    return run._replace(events=(waits, goes_on._replace(time_s=goes_on.time_s - late_s)),
                        phases=(RunPhase('operator', 'waits', 'goes on', True),))


def test_a_wait_may_take_any_time() -> None:
    good = GoodRuns(waiting(1, 1.0))
    for wait_s in (0.3, 1.2, 9.0):
        assert good.compare(waiting(77, wait_s)).departures == ()
    assert GoodRuns(waiting(1, 1.0)._replace(phases=())).compare(waiting(77, 9.0)).departures != ()


def test_who_starts_late_behind_a_wait_has_lost_time() -> None:
    good = GoodRuns(waiting(1, 1.0), [waiting(seed, 0.2 * seed) for seed in range(2, 8)])
    assert good.compare(waiting(77, 1.4)).departures == ()
    found = good.compare(waiting(77, 1.4, late_s=0.3)).departures[0]
    assert found.signal.label == 'time lost'
    assert found.deviation == pytest.approx(0.3, abs=0.08)


def test_what_lasts_is_found_though_no_single_moment_shows_it() -> None:
    noisy = [made_run(seed, noise=1.0) for seed in range(1, 25)]
    good = GoodRuns(noisy[0], noisy[1:])
    assert good.compare(made_run(77, noise=1.0)).departures == ()
    found = good.compare(made_run(77, noise=1.0, value=lambda process_s, values: values + 0.6))
    assert found.departures[0].signal.name == 'robot tool force'
    assert 'in the mean of' in verdict(found)
