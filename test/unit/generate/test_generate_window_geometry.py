# SPDX-License-Identifier: BSD-3-Clause
"""RViz's window: its position on the screen, and its docks."""
from __future__ import annotations

from process_visualizer.rviz.window_geometry import Rectangle, moved_aside, window_geometry


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


def test_a_second_window_stays_on_its_screen() -> None:
    """On screens to the left of the first one, or above it, coordinates are negative."""
    room = Rectangle(-1920, -1080, 1920, 1080)
    window = {'X': -1900, 'Y': -1080, 'Width': 1000, 'Height': 70, 'Views': {}}
    assert moved_aside(window, room) == {
        'X': -1840, 'Y': -1020, 'Width': 940, 'Height': 60, 'Views': {}}
    for broken in (['X', 1], 'wide', None, {'X': 'left', 'Width': 'wide'}):
        assert moved_aside(broken, room) == (broken if isinstance(broken, dict) else {})
