# SPDX-License-Identifier: BSD-3-Clause
"""Bag times from the player's states: rates, pauses, steps, jumps, slips, and the age of data."""
import pytest

from process_visualizer.playback.playback_clock import ClockState, PlaybackClock


def clock_of(*states):
    clock = PlaybackClock()
    for state in states:
        clock.add(ClockState(*state))
    return clock


def test_without_a_player():
    clock = PlaybackClock()
    assert clock.bag_time(100.0) is None
    assert not clock.follows_player(100.0)
    assert clock.data_time_s(100.0) == 100.0


@pytest.mark.parametrize('rate', [0.25, 1.0, 4.0, -1.0])
def test_bag_time_runs_with_the_rate(rate):
    clock = clock_of((100.0, 20.0, rate, False, 3))
    assert clock.bag_time(102.0) == (3, 20.0 + 2.0 * rate, rate)


def test_each_state_holds_from_its_stamp():
    clock = clock_of((100.0, 20.0, 1.0, False, 0), (101.0, 21.0, 4.0, False, 0),
                     (102.0, 25.0, -1.0, False, 0))
    times = [clock.bag_time(wall_s).time_s for wall_s in (100.5, 101.0, 101.5, 102.5)]
    assert times == [20.5, 21.0, 23.0, 24.5]


def test_before_the_first_state_is_its_position():
    assert clock_of((100.0, 20.0, 1.0, False, 2)).bag_time(99.9)[:2] == (2, 20.0)


def test_while_paused_each_step_has_its_position():
    clock = clock_of((100.0, 5.0, 1.0, True, 0), (101.0, 5.008, 1.0, True, 0))
    assert [clock.bag_time(wall_s) for wall_s in (100.9, 101.001)] == [(0, 5.0, 0.0),
                                                                       (0, 5.008, 0.0)]


def test_a_jump_is_another_segment():
    clock = clock_of((100.0, 5.0, 1.0, False, 0), (101.0, 50.0, 1.0, False, 1))
    assert clock.bag_time(100.999).segment == 0
    assert clock.bag_time(101.001)[:2] == (1, pytest.approx(50.001))


def test_at_present_the_newest_state_holds_whatever_the_clocks_say():
    clock = clock_of((100.0, 20.0, 4.0, False, 0), (100.5, 22.0, 4.0, True, 0))
    assert clock.present(100.498) == (0, 22.0, 0.0)
    assert clock.bag_time(100.498).time_s == pytest.approx(21.992)
    assert PlaybackClock().present(100.0) is None


def test_at_present_time_goes_on_while_it_plays():
    clock = clock_of((100.0, 20.0, 4.0, False, 0))
    assert [clock.present(wall_s).time_s for wall_s in (99.999, 100.5)] == [20.0, 22.0]


@pytest.mark.parametrize('rate, position', [(4.0, 22.0), (-4.0, 18.0)])
def test_where_the_player_could_not_keep_up_time_waits_for_it(rate, position):
    clock = clock_of((100.0, 20.0, rate, False, 0), (101.0, position, rate, False, 0))
    assert clock.bag_time(100.25).time_s == pytest.approx(20.0 + 0.25 * rate)
    assert clock.bag_time(100.9).time_s == position


def test_a_clock_that_was_set_back_starts_anew():
    clock = clock_of((100.0, 5.0, 1.0, False, 0), (40.0, 6.0, 1.0, False, 0))
    assert clock.bag_time(41.0).time_s == 7.0


def test_a_player_is_lost_after_a_second():
    clock = clock_of((100.0, 5.0, 1.0, False, 0))
    assert clock.follows_player(100.9)
    assert not clock.follows_player(101.1)


def test_data_does_not_age_while_paused_and_slowly_in_slow_motion():
    clock = clock_of((100.0, 5.0, 1.0, False, 0))
    begin = clock.data_time_s(100.0)
    for second in range(101, 111):
        clock.add(ClockState(float(second), 6.0, 1.0, True, 0))
    assert clock.data_time_s(110.5) - begin == pytest.approx(1.0, abs=1e-3)
    clock.add(ClockState(111.0, 6.0, -0.1, False, 0))
    assert clock.data_time_s(111.5) - begin == pytest.approx(1.05, abs=1e-3)
    clock.add(ClockState(112.0, 6.0, 8.0, False, 0))
    assert clock.data_time_s(112.5) - begin == pytest.approx(1.6, abs=1e-3)


def test_data_ages_again_when_the_player_is_lost():
    clock = clock_of((100.0, 5.0, 1.0, True, 0))
    assert clock.data_time_s(105.0) - clock.data_time_s(100.0) == pytest.approx(4.0, abs=1e-3)


def test_what_came_before_the_player_grows_old_while_it_is_paused():
    """Data left from a live cell is not part of the recording; played data is."""
    clock = PlaybackClock()
    live, played = clock.data_time_s(99.0), clock.data_time_s(100.2)
    clock.add(ClockState(100.5, 5.0, 1.0, True, 0, since_s=100.0))
    for second in range(101, 111):
        clock.add(ClockState(float(second), 5.0, 1.0, True, 0, since_s=100.0))
    assert clock.age_s(live, 110.0) == pytest.approx(11.0)
    assert clock.age_s(played, 110.0) == pytest.approx(0.3, abs=1e-3)
    live = clock.data_time_s(115.0)  # after the player has ended
    assert clock.age_s(live, 117.0) == pytest.approx(2.0)
    for second in range(120, 131):
        clock.add(ClockState(float(second), 5.0, 1.0, True, 0, since_s=120.0))
    assert clock.age_s(live, 130.0) == pytest.approx(15.0)
    assert clock.age_s(played, 130.0) > 10.0


def test_another_recording_begins_at_once_and_what_came_before_is_not_of_it():
    clock = PlaybackClock()
    clock.add(ClockState(100.0, 5.0, 1.0, True, 0, since_s=99.0, recording='one.bag'))
    played = clock.data_time_s(100.1)
    assert not clock.is_from_before(played)
    clock.add(ClockState(100.2, 5.0, 1.0, True, 1, since_s=100.1, recording='one.bag'))
    assert not clock.is_from_before(played)  # a seek in the same recording
    clock.add(ClockState(100.9, 0.0, 1.0, True, 0, since_s=100.8, recording='another.bag'))
    assert clock.is_from_before(played)
    assert clock.age_s(played, 105.0) == pytest.approx(4.5, abs=0.01)
    assert not clock.is_from_before(clock.data_time_s(100.9))


def test_what_a_player_sent_before_its_first_state_was_heard_is_of_it():
    """Its first state may belong to a later command, such as to play."""
    clock = PlaybackClock()
    clock.add(ClockState(100.0, 5.0, 1.0, True, 0, since_s=99.0, recording='one.bag'))
    before, sent = clock.data_time_s(100.1), clock.data_time_s(101.0)
    clock.add(ClockState(101.6, 0.1, 1.0, False, 9, since_s=101.5, recording='another.bag'))
    assert clock.is_from_before(before) and not clock.is_from_before(sent)


def test_a_player_that_hung_is_the_same_one():
    clock = clock_of((100.0, 5.0, 1.0, True, 0))
    played = clock.data_time_s(100.2)
    clock.add(ClockState(105.0, 5.0, 1.0, True, 0, since_s=100.0))
    age_s = clock.age_s(played, 105.0)
    clock.add(ClockState(106.0, 5.0, 1.0, True, 0, since_s=100.0))
    assert clock.age_s(played, 106.5) == pytest.approx(age_s, abs=1e-4)


@pytest.mark.parametrize(('position', 'rate'), [
    (float('nan'), 1.0), (5.0, float('nan')), (float('inf'), 1.0), (1e308, 1.0), (5.0, 1e308)])
def test_what_no_player_says_changes_nothing(position, rate):
    """Anyone can publish a state; NaN was kept, so that data never became old again."""
    clock = clock_of((100.0, 5.0, 1.0, False, 0), (101.0, position, rate, False, 0),
                     (102.0, 7.0, 1.0, False, 0))
    assert clock.age_s(clock.data_time_s(102.0), 102.5) == pytest.approx(0.5)
    assert clock.bag_time(101.5) == (0, 6.5, 1.0)


def test_memory_is_bounded():
    clock = PlaybackClock()
    for step in range(10_000):
        clock.add(ClockState(100.0 + 0.1 * step, 0.1 * step, 1.0, False, 0))
    assert clock.bag_time(1099.95).time_s == pytest.approx(999.95)
    assert clock.bag_time(100.0).time_s > 900.0  # forgotten long ago


def test_a_state_that_is_told_late_holds_since_the_command():
    clock = clock_of((100.0, 20.0, 1.0, False, 0, 99.0), (101.0, 23.0, 4.0, False, 0, 100.5),
                     (101.1, 50.1, 1.0, False, 1, 101.0), (101.3, 60.0, 1.0, True, 2, 101.2))
    expected = {100.25: (0, 20.25), 100.75: (0, 22.0), 101.05: (1, 50.05), 101.25: (2, 60.0)}
    for wall_s, (segment, time_s) in expected.items():
        assert clock.bag_time(wall_s)[:2] == (segment, pytest.approx(time_s))


def test_play_that_begins_in_a_moment_stands_until_then():
    clock = clock_of((100.0, 20.0, 4.0, False, 0, 100.05))
    assert [clock.bag_time(wall_s).time_s for wall_s in (100.0, 100.04)] == [20.0, 20.0]
    assert clock.bag_time(100.3).time_s == pytest.approx(21.0)
