# SPDX-License-Identifier: BSD-3-Clause
"""In backward playback, an image is stamped with the time at which the robot was in its pose."""
from __future__ import annotations

from typing import List, Tuple

import pytest
from hypothesis import given
from hypothesis import strategies as st
from playback_stage import MS, PICTURE, Message, Shown, Stage

ROBOT = 0
ROBOT_MS, PICTURE_MS, END_MS = 4, 32, 1000


def recording(age_ms: int, picture_ms: int = PICTURE_MS) -> List[Message]:
    """A robot whose states have no delay, and images that are recorded at this age."""
    pictures = range(0, END_MS - age_ms, picture_ms)
    return [*(Message(ROBOT, time_ms) for time_ms in range(0, END_MS, ROBOT_MS)),
            *(Message(PICTURE, stamp_ms + age_ms, stamp_ms) for stamp_ms in pictures)]


class Walk:
    """A recording that is played backward from its end until it is paused at one of its times."""

    def __init__(self, messages: List[Message], rate: float = 1.0, stop_ms: int = 0) -> None:
        self.stage = Stage(messages)
        self.stage.control.set_rate(-rate)
        self.stage.control.play()
        self._end_ms = self.stage.messages[-1].time_ms
        self._rate = rate
        pause_ms = int((self._end_ms - stop_ms) / rate)
        self.stage.clock.at(pause_ms, self.stage.control.pause)
        self.stage.run()
        self._until_ns = self.stage.clock.begin_ns + pause_ms * MS

    def shown(self, connection: int) -> List[Tuple[Shown, Message]]:
        """The published messages of a connection between the first scene and the pause."""
        return [(it, self.stage.messages[it.number]) for it in self.stage.viewer.log
                if it.connection == connection
                and self.stage.clock.begin_ns < it.now_ns < self._until_ns]

    def wall_ns(self, shown: Shown) -> int:
        """The time of publishing."""
        return shown.now_ns + self.stage.clock.wall_offset_ns

    def place_ms(self, shown: Shown) -> float:
        """The position in the recording at the time of publishing."""
        return self._end_ms - (shown.now_ns - self.stage.clock.begin_ns) / MS * self._rate


def robot_ms_at(walk: Walk, wall_ns: int) -> float:
    """The recorded time [ms] of the robot state that was received last at a wall time."""
    return next(float(message.time_ms) for shown, message in reversed(walk.shown(ROBOT))
                if walk.wall_ns(shown) <= wall_ns)


@pytest.mark.parametrize('age_ms', [0, 15, 60])
@pytest.mark.parametrize('rate', [0.25, 1.0, 4.0])
def test_at_the_stamp_of_a_picture_the_robot_is_where_it_was_taken(age_ms: int,
                                                                   rate: float) -> None:
    walk = Walk(recording(age_ms), rate, stop_ms=200)
    pictures = walk.shown(PICTURE)[1:]
    assert len(pictures) > 15
    for shown, message in pictures:
        assert abs(robot_ms_at(walk, shown.stamp_ns) - message.stamp_ms) <= 2 * ROBOT_MS
        assert shown.stamp_ns <= walk.wall_ns(shown)


@pytest.mark.parametrize('picture_ms', [300, 450])
def test_a_slow_sensor_is_not_behind_for_long(picture_ms: int) -> None:
    walk = Walk(recording(15, picture_ms))
    for shown, message in walk.shown(PICTURE):
        behind_ms = message.time_ms + picture_ms - walk.place_ms(shown)
        assert 200 <= behind_ms <= 200 + 2 * ROBOT_MS


def test_pictures_alone_are_not_shown_later_than_one_picture() -> None:
    walk = Walk([it for it in recording(15) if it.connection == PICTURE], stop_ms=200)
    shown = walk.shown(PICTURE)
    assert len(shown) > 15
    assert all(abs(walk.place_ms(it) - message.stamp_ms) <= PICTURE_MS for it, message in shown)


@given(st.lists(st.tuples(st.integers(0, 500), st.integers(-50, 250)), min_size=2, max_size=30))
def test_whatever_the_stamps_pictures_keep_their_order(pictures: List[Tuple[int, int]]) -> None:
    robot = [Message(ROBOT, time_ms) for time_ms in range(0, 600, ROBOT_MS)]
    messages = [Message(PICTURE, time_ms, max(time_ms - age_ms, 0)) for time_ms, age_ms in pictures]
    numbers = [shown.number for shown, _ in Walk([*robot, *messages]).shown(PICTURE)]
    assert numbers == sorted(numbers, reverse=True)


@pytest.mark.parametrize('seek_ms, stamp_ms', [(500, 448), (490, 448), (511, 448), (552, 512)])
def test_at_rest_the_last_picture_recorded_is_seen(seek_ms: int, stamp_ms: int) -> None:
    stage = Stage(recording(40))
    stage.clock.at(10, lambda: stage.control.seek(1e-3 * seek_ms))
    stage.run()
    assert stage.messages[stage.viewer.seen[PICTURE]].stamp_ms == stamp_ms


def test_at_the_beginning_of_the_recording_the_first_picture_is_seen_backwards_too() -> None:
    stage = Stage([Message(PICTURE, 0, 0), Message(PICTURE, 1, 1)])
    stage.clock.at(10, lambda: stage.control.seek(0.001))
    stage.clock.at(500, lambda: stage.control.set_rate(-0.1))  # it has been idle for a long time
    stage.clock.at(900, stage.control.play)
    stage.run()
    assert stage.timeline.position_ns() == stage.timeline.state.begin_ns
    assert stage.viewer.seen[PICTURE] == 0


def test_a_pause_backwards_shows_the_last_picture_recorded() -> None:
    walk = Walk(recording(40), stop_ms=500)
    assert walk.stage.messages[walk.stage.viewer.seen[PICTURE]].stamp_ms == 448
