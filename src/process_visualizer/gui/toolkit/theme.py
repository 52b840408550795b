# SPDX-License-Identifier: BSD-3-Clause
"""The colours of the launcher: a light theme and a dark one, each with one accent colour."""
from __future__ import annotations

from dataclasses import dataclass

from PyQt5.QtGui import QGuiApplication, QPalette


@dataclass(frozen=True)
class Theme:
    """Colours by what they are for, as Qt writes them (#rrggbb)."""

    accent: str
    text: str
    quiet: str  # text of less weight: units, hints, axes
    grid: str  # lines behind curves
    line: str  # borders and grids
    window: str
    good: str
    warning: str
    bad: str
    selected: str  # behind a selected row
    paper: str  # behind lists, fields and curves
    on_signal: str  # text on accent, warning, bad, text
    behind_bad: str  # backgrounds of notices
    behind_warning: str
    behind_good: str
    used: str  # of a disk: the accent colour, quiet
    shape: str  # of an icon without a meaning of its own
    waiting: str
    tick: str  # marks of a scale
    band: str  # what good runs do, behind a curve, and the line in its middle
    band_line: str
    disabled_text: str
    disabled_shape: str
    indicator: str  # of a check box or radio button, inside
    indicator_tick: str
    indicator_off: str  # where nothing can be ticked
    indicator_off_tick: str
    groove: str  # of a slider
    loop: str
    loop_off: str
    row: str  # behind every other row
    button: str
    light: str  # edges of buttons and frames, from light to dark
    midlight: str
    mid: str
    dark: str
    shadow: str
    primary: str  # the button that launches, and behind selected text
    primary_hovered: str
    primary_pressed: str
    primary_focus: str
    primary_off: str
    primary_off_text: str


LIGHT = Theme(
    accent='#1f6f9f', text='#23292f', quiet='#5c6670', grid='#e9ecef', line='#d3d8dd',
    window='#f3f5f6', good='#247a4b', warning='#9a5b00', bad='#c0392b', selected='#e6f0f6',
    paper='#ffffff', on_signal='#ffffff', behind_bad='#fdf4f3', behind_warning='#fdf8ef',
    behind_good='#f2f9f4', used='#93b4c8', shape='#3c454d', waiting='#7a8590', tick='#aab2b9',
    band='#cfe0ea', band_line='#7fa3b8',
    disabled_text='#a3abb2', disabled_shape='#b4bbc1', indicator='#ffffff',
    indicator_tick='#23292f', indicator_off='#f3f5f6', indicator_off_tick='#a3abb2',
    groove='#dde2e6', loop='#8a5fb0', loop_off='#a0a8af', row='#f7f8f9', button='#fafbfb',
    light='#ffffff', midlight='#eceff1', mid='#c3c9ce', dark='#9aa3ab', shadow='#6b747c',
    primary='#1f6f9f', primary_hovered='#2a7fb3', primary_pressed='#185a82',
    primary_focus='#8fb8d0', primary_off='#d9dee2', primary_off_text='#87919a')

DARK = Theme(
    accent='#62b0de', text='#e3e7ea', quiet='#a4aeb7', grid='#262c32', line='#3c444c',
    window='#1f2428', good='#5fc48b', warning='#e2a44a', bad='#f28577', selected='#24384a',
    paper='#171b1e', on_signal='#14181b', behind_bad='#38221f', behind_warning='#352b1a',
    behind_good='#1b3025', used='#3f6d8a', shape='#c4ccd3', waiting='#8d99a4', tick='#69737c',
    band='#26404f', band_line='#55798d',
    disabled_text='#69727a', disabled_shape='#59626a', indicator='#d3dae0',
    indicator_tick='#14181b', indicator_off='#454e56', indicator_off_tick='#98a3ad',
    groove='#363e45', loop='#b794dc', loop_off='#77818a', row='#1b2024', button='#2a3036',
    light='#3a424a', midlight='#323940', mid='#454e56', dark='#101316', shadow='#0a0c0e',
    primary='#1f6f9f', primary_hovered='#2a7fb3', primary_pressed='#185a82',
    primary_focus='#8fb8d0', primary_off='#2c3339', primary_off_text='#77818a')


def theme() -> Theme:
    """Return the theme in which the application is: the one to which its palette belongs."""
    return DARK if is_dark(QGuiApplication.palette()) else LIGHT


def is_dark(palette: QPalette) -> bool:
    """Return whether a palette has light text on a dark window."""
    return bool(palette.color(QPalette.Window).lightness()
                < palette.color(QPalette.WindowText).lightness())
