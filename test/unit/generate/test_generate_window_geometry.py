# SPDX-License-Identifier: BSD-3-Clause
"""RViz's window beside the launcher's."""
from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from process_visualizer.rviz.window_geometry import (
    TITLE_BAR_PX,
    Rectangle,
    view_rectangle,
    window_geometry,
)


@pytest.mark.parametrize('room, launcher, expected', [
    (Rectangle(0, 0, 1920, 1080), (0, 440), Rectangle(440, 0, 1480, 1080 - TITLE_BAR_PX)),
    (Rectangle(0, 0, 1280, 800), (0, 440), Rectangle(440, 0, 840, 800 - TITLE_BAR_PX)),
    (Rectangle(1920, 27, 1920, 1053), (1930, 450), Rectangle(2380, 27, 1460, 1053 - TITLE_BAR_PX)),
    (Rectangle(0, 0, 1920, 1080), (1480, 440), Rectangle(0, 0, 1480, 1080 - TITLE_BAR_PX)),
    (Rectangle(0, 0, 800, 600), (0, 440), Rectangle(160, 0, 640, 600 - TITLE_BAR_PX)),
    (Rectangle(0, 0, 480, 20), (0, 440), Rectangle(0, 0, 480, 1))])
def test_screens(room: Rectangle, launcher: 'tuple[int, int]', expected: Rectangle) -> None:
    """The launcher is given by its left edge and its width."""
    assert view_rectangle(room, Rectangle(launcher[0], 50, launcher[1], 700)) == expected


@given(st.builds(Rectangle, st.integers(-4000, 4000), st.integers(-4000, 4000),
                 st.integers(300, 8000), st.integers(200, 4000)),
       st.integers(-500, 9000), st.integers(1, 2000))
def test_any_screen(room: Rectangle, offset: int, width: int) -> None:
    launcher = Rectangle(room.x + offset, room.y, width, 500)
    window = view_rectangle(room, launcher)
    assert room.x <= window.x and window.x + window.width <= room.x + room.width
    assert window.y == room.y and 0 < window.height <= room.height
    if max(offset, room.width - offset - width) >= 640:
        assert window.x >= launcher.x + width or window.x + window.width <= launcher.x


def test_large_window_shows_the_displays() -> None:
    section = window_geometry(Rectangle(440, 30, 1480, 1000))
    assert (section['X'], section['Y'], section['Width'], section['Height']) == (
        440, 30, 1480, 1000)
    assert (section['Hide Left Dock'], section['Displays']) == (False, {'collapsed': False})
    assert (section['Hide Right Dock'], section['Views']) == (True, {'collapsed': True})
    assert 'QMainWindow State' not in section


def test_small_window_shows_the_scene_only() -> None:
    section = window_geometry(Rectangle(440, 30, 840, 700))
    assert (section['Hide Left Dock'], section['Displays']) == (True, {'collapsed': True})
    assert 'Displays'.encode('utf-16-be') in bytes.fromhex(section['QMainWindow State'])


def test_docks_that_the_operator_has_chosen() -> None:
    window = Rectangle(440, 30, 840, 700)
    section = window_geometry(window, {
        'X': 0, 'Y': 0, 'Width': 1, 'Height': 1, 'Hide Left Dock': False, 'Views': {'a': 1},
        'QMainWindow State': '00ff'})
    assert section == {**window_geometry(window), 'Hide Left Dock': False, 'Views': {'a': 1},
                       'QMainWindow State': '00ff'}
    assert window_geometry(window, 'broken by hand') == window_geometry(window)
