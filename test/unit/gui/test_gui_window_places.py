# SPDX-License-Identifier: BSD-3-Clause
"""The windows share a screen: inside it, next to each other, and as large as they can be."""
from __future__ import annotations

import itertools
from typing import List

import pytest
from hypothesis import given
from hypothesis import strategies as st

from process_visualizer.gui.app.window_places import (
    MIN_LAUNCHER_PX,
    MIN_RVIZ_PX,
    MIN_TIMELINE_PX,
    MIN_UPPER_PX,
    Sizes,
    WindowFrame,
    WindowPlaces,
    followed,
    places,
    settings_of,
    sizes_from,
)
from process_visualizer.rviz.window_geometry import Rectangle

FRAME = WindowFrame(1, 20, 1, 2)
FRAMES = st.builds(WindowFrame, *(4 * [st.integers(0, 40)]))
SIZES = st.builds(Sizes, st.integers(-10, 9000), st.none() | st.integers(-10, 9000), st.booleans())
POSITIONS = st.integers(-4000, 4000)
SCREENS = st.builds(Rectangle, POSITIONS, POSITIONS, st.integers(240, 8000),
                    st.integers(240, 5000))


def framed(found: WindowPlaces, frame: WindowFrame) -> List[Rectangle]:
    """The geometry of the windows with their frames."""
    upper = [Rectangle(it.x, it.y, it.width + frame.left + frame.right,
                       it.height + frame.top + frame.bottom) for it in found[:2]]
    return [*upper, found.timeline]


def is_inside(one: Rectangle, room: Rectangle) -> bool:
    return (room.x <= one.x and one.x + one.width <= room.x + room.width
            and room.y <= one.y and one.y + one.height <= room.y + room.height)


def overlap(one: Rectangle, other: Rectangle) -> bool:
    return (one.x < other.x + other.width and other.x < one.x + one.width
            and one.y < other.y + other.height and other.y < one.y + one.height)


@pytest.mark.parametrize('height, timeline', [
    (700, 266), (1000, 380), (1040, 420), (1080, 454), (2000, 840)])
def test_the_timeline_has_a_larger_part_of_a_screen_with_room(height: int, timeline: int) -> None:
    found = places(Rectangle(0, 0, 1600, height), WindowFrame(), Sizes())
    assert found.timeline.height == timeline


@given(SCREENS, FRAMES, SIZES)
def test_inside_the_screen_and_beside_each_other(room: Rectangle, frame: WindowFrame,
                                                 sizes: Sizes) -> None:
    found = places(room, frame, sizes)
    windows = framed(found, frame)
    assert all(is_inside(it, room) for it in windows), windows
    assert not any(overlap(*two) for two in itertools.combinations(windows, 2)), windows
    assert sum(it.width * it.height for it in windows) == room.width * room.height


@given(SCREENS, FRAMES, SIZES)
def test_no_window_is_too_small_unless_the_screen_is(room: Rectangle, frame: WindowFrame,
                                                     sizes: Sizes) -> None:
    launcher, rviz, timeline = places(room, frame, sizes)
    sides = frame.left + frame.right
    if room.width >= MIN_LAUNCHER_PX + MIN_RVIZ_PX + 2 * sides:
        assert launcher.width >= MIN_LAUNCHER_PX and rviz.width >= MIN_RVIZ_PX
    if room.height >= MIN_UPPER_PX + MIN_TIMELINE_PX:
        assert timeline.height >= MIN_TIMELINE_PX
        assert launcher.height + frame.top + frame.bottom >= MIN_UPPER_PX


@given(st.builds(Rectangle, POSITIONS, POSITIONS, st.integers(-5, 300), st.integers(-5, 300)),
       FRAMES, SIZES)
def test_every_screen_has_an_answer(room: Rectangle, frame: WindowFrame, sizes: Sizes) -> None:
    found = places(room, frame, sizes)
    assert all(it.width > 0 and it.height > 0 for it in found)


@pytest.mark.parametrize('width, height', [(1024, 700), (1600, 1000), (1920, 1080), (960, 540)])
def test_what_the_operator_chose_is_kept(width: int, height: int) -> None:
    sizes = Sizes(455, 240)
    launcher, rviz, timeline = places(Rectangle(0, 0, width, height), FRAME, sizes)
    assert launcher == Rectangle(0, 0, 455, height - 22)
    assert rviz == Rectangle(457, 0, width - 459, height - 240 - 22)
    assert timeline == Rectangle(457, height - 240, width - 457, 240)


def test_launcher_at_the_right() -> None:
    launcher, rviz, timeline = places(Rectangle(10, 30, 1600, 970), WindowFrame(),
                                      Sizes(timeline_height=300, is_right=True))
    assert launcher == Rectangle(1150, 30, 460, 970)
    assert rviz == Rectangle(10, 30, 1140, 670)
    assert timeline == Rectangle(10, 700, 1140, 300)


ROOM, ASKED = Rectangle(0, 0, 1600, 1000), Rectangle(0, 0, 460, 980)


@pytest.mark.parametrize('launcher, expected', [
    (Rectangle(30, 40, 460, 980), Sizes(500, 200)),
    (Rectangle(0, 0, 520, 980), Sizes(520, 200)),
    (Rectangle(900, 0, 460, 980), Sizes(500, 200, is_right=True))])
def test_sizes_follow_the_launcher(launcher: Rectangle, expected: Sizes) -> None:
    """A width that did not fit on the screen is kept until the operator changes it."""
    assert followed(Sizes(500, 200), ROOM, launcher, ASKED) == expected


@given(SIZES)
def test_sizes_are_stored(sizes: Sizes) -> None:
    assert sizes_from(settings_of(sizes)) == sizes
    assert sizes_from(list(settings_of(sizes))) == sizes


@pytest.mark.parametrize('values', [None, [], 'broken', [1, 2], ['a', None, False],
                                    [400, 'b', False]])
def test_sizes_of_another_version(values: object) -> None:
    assert sizes_from(values) == Sizes()
