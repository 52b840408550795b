# SPDX-License-Identifier: BSD-3-Clause
"""Bag stamps to wall stamps: proportions, equality, and no stamps in the future."""
import pytest
from bags_fake_clock import FakeClock

from process_visualizer.playback.stamp_mapping import MEMORY, StampMapping
from process_visualizer.playback.timeline import NS_PER_S, Timeline

BEGIN = 1_600_000_000 * NS_PER_S
MS = 1_000_000


@pytest.fixture
def clock():
    return FakeClock()


@pytest.fixture
def timeline(clock):
    timeline = Timeline(BEGIN, BEGIN + 1000 * NS_PER_S, clock)
    timeline.seek(BEGIN + 500 * NS_PER_S)
    return timeline


@pytest.fixture
def mapping(clock):
    return StampMapping(clock)


def played(timeline, clock, mapping, messages):
    """Return the wall stamps of (message time, stamp) [ns after the state], each when it is due."""
    origin, walls = timeline.state.bag_ns, []
    for message, stamp in messages:
        state = timeline.state
        clock.now_ns = max(clock.now_ns, state.due_ns(origin + message))
        walls.append(mapping.stamp(state, origin + stamp, origin + message))
        assert walls[-1] <= clock.wall_ns()
    return walls


@pytest.mark.parametrize('rate', [0.1, 0.5, 1.0, 4.0, 16.0, -0.1, -1.0, -8.0])
def test_intervals_keep_their_proportions(timeline, clock, mapping, rate):
    """Messages at 125 Hz that arrive with jitter; the stamps are evenly spaced."""
    timeline.set_rate(rate)
    timeline.play()
    sign = 1 if rate > 0 else -1
    messages = [(sign * index * 8 * MS + index % 3 * MS, sign * index * 8 * MS - 2 * MS)
                for index in range(500)]
    walls = played(timeline, clock, mapping, sorted(messages, key=lambda it: sign * it[0]))
    steps = [after - before for before, after in zip(walls, walls[1:])][20:]
    assert steps
    assert all(abs(step - 8 * MS / abs(rate)) <= 5 for step in steps)


def test_delay_of_a_slow_topic_remains(timeline, clock, mapping):
    """An image from 50 ms ago is stamped like a joint state from 50 ms ago, not like the latest."""
    timeline.set_rate(0.5)
    timeline.play()
    joints = [(index * 10 * MS, index * 10 * MS) for index in range(100)]
    picture = (999 * MS, 940 * MS + 5 * MS)
    *walls, wall = played(timeline, clock, mapping, [*joints, picture])
    assert walls[94] < wall < walls[95]


def test_delay_of_a_slow_topic_remains_backwards(timeline, clock, mapping):
    timeline.set_rate(-1.0)
    timeline.play()
    messages = []
    for index in range(100):
        messages.append((-index * 10 * MS, -index * 10 * MS))
        if index % 5 == 0:
            messages.append((-index * 10 * MS - 1, -index * 10 * MS - 55 * MS))
    walls = played(timeline, clock, mapping, messages)
    by_stamp = dict(zip((stamp for _, stamp in messages), walls))
    assert by_stamp[-700 * MS] < by_stamp[-705 * MS] < by_stamp[-710 * MS]


def test_stepped_messages_are_stamped_now_and_equal_ones_alike(timeline, clock, mapping):
    stamp = BEGIN + 501 * NS_PER_S
    timeline.step_to(stamp + MS)
    image = mapping.stamp(timeline.state, stamp, stamp + MS)
    assert image == clock.wall_ns()
    clock.now_ns += NS_PER_S
    timeline.step_to(stamp + 2 * MS)
    assert mapping.stamp(timeline.state, stamp, stamp + 2 * MS) == image
    assert mapping.stamp(timeline.state, stamp + MS, stamp + 2 * MS) == clock.wall_ns()


def test_equal_stamps_stay_equal_from_playing_to_stepping_to_playing(timeline, clock, mapping):
    origin = timeline.state.bag_ns
    timeline.play()
    first, _ = played(timeline, clock, mapping, [(100 * MS, 90 * MS), (120 * MS, 115 * MS)])
    timeline.pause()
    clock.now_ns += NS_PER_S
    timeline.step_to(origin + 130 * MS)
    assert mapping.stamp(timeline.state, origin + 90 * MS, origin + 130 * MS) == first
    timeline.set_rate(2.0)
    timeline.play()
    assert mapping.stamp(timeline.state, origin + 90 * MS, origin + 140 * MS) == first


@pytest.mark.parametrize('again', [
    lambda timeline: timeline.seek(BEGIN + 500 * NS_PER_S),
    lambda timeline: timeline.step_to(BEGIN + 499 * NS_PER_S)])
def test_what_is_published_again_is_stamped_now(timeline, clock, mapping, again):
    stamp = timeline.state.bag_ns - 10 * MS
    first = mapping.present(timeline.state, stamp)
    clock.now_ns += 60 * NS_PER_S
    again(timeline)
    second = mapping.present(timeline.state, stamp)
    assert first < second == clock.wall_ns()


@pytest.mark.parametrize('rate', [1.0, -1.0, 0.01])
def test_restored_while_playing_is_now_and_goes_on_from_there(timeline, clock, mapping, rate):
    timeline.set_rate(rate)
    timeline.play()
    clock.now_ns += 20 * MS
    old = mapping.present(timeline.state, BEGIN)
    assert old == clock.wall_ns()
    sign = 1 if rate > 0 else -1
    walls = played(timeline, clock, mapping,
                   [(sign * index * MS, sign * index * MS - 50 * MS) for index in range(300)])
    assert all(wall >= old for wall in walls)
    assert walls == sorted(walls)
    assert walls[-1] - walls[-2] == MS / abs(rate)


@pytest.mark.parametrize('rate', [1.0, -1.0, 0.01, -0.01])
@pytest.mark.parametrize('far_s', [-10_000_000, -400, 3 * 3600])
def test_clock_of_another_computer_disturbs_nobody(timeline, clock, mapping, rate, far_s):
    timeline.set_rate(rate)
    timeline.play()
    sign = 1 if rate > 0 else -1
    messages = []
    for index in range(2000):
        messages.append((sign * index * 5 * MS, sign * index * 5 * MS))
        messages.append((sign * index * 5 * MS, sign * index * 5 * MS + far_s * NS_PER_S))
    origin, walls = timeline.state.bag_ns, []
    for message, stamp in messages:
        clock.now_ns = timeline.state.due_ns(origin + message)
        wall = mapping.stamp(timeline.state, origin + stamp, origin + message)
        assert -6.001 * NS_PER_S <= wall - clock.wall_ns() <= 0
        walls.append(wall)
    assert walls[-2] - walls[-4] == walls[-1] - walls[-3] == 5 * MS / abs(rate)


def test_slip_keeps_order(timeline, clock, mapping):
    timeline.play()
    first, = played(timeline, clock, mapping, [(100 * MS, 99 * MS)])
    clock.now_ns += 300 * MS
    timeline.slip_to(timeline.state.bag_ns + 110 * MS, timeline.state.version)
    # From here on, times are relative to the slipped message.
    earlier, later = played(timeline, clock, mapping, [(0, -12 * MS), (MS, MS)])
    assert earlier == first < later


def test_slewed_wall_clock_is_followed(timeline, clock, mapping):
    timeline.play()
    origin = timeline.state.bag_ns
    for index in range(1, 5000):
        clock.now_ns = timeline.state.due_ns(origin + index * MS)
        clock.wall_offset_ns -= 500
        wall = mapping.stamp(timeline.state, origin + index * MS, origin + index * MS)
        assert 0 <= clock.wall_ns() - wall <= 2 * MS


@pytest.mark.parametrize('set_by_s', [3600, -3600])
def test_wall_clock_that_is_set_is_followed(timeline, clock, mapping, set_by_s):
    timeline.play()
    played(timeline, clock, mapping, [(index * MS, index * MS) for index in range(10)])
    clock.wall_offset_ns += set_by_s * NS_PER_S
    wall, = played(timeline, clock, mapping, [(11 * MS, 11 * MS)])
    assert wall == clock.wall_ns()


def test_memory_is_bounded(timeline, clock, mapping):
    timeline.play()
    played(timeline, clock, mapping, [(index, index) for index in range(3 * MEMORY)])
    assert len(mapping._known) <= MEMORY
    assert len(mapping._order._keys) <= MEMORY
