# SPDX-License-Identifier: BSD-3-Clause
"""Icons: all that are promised, in colors that show their state, sharp at any size."""
from __future__ import annotations

from typing import Set

import pytest
from PyQt5.QtCore import QSize
from PyQt5.QtGui import QColor, QIcon, QImage
from PyQt5.QtWidgets import QApplication
from pytestqt.qtbot import QtBot

from process_visualizer.gui.toolkit.icons import icon, names
from process_visualizer.gui.toolkit.theme import LIGHT, apply_style

PROMISED = ('play', 'pause', 'stop', 'to_start', 'to_end', 'step_back', 'step_forward',
            'play_backwards', 'loop', 'loop_begin', 'loop_end', 'mark', 'record', 'restart',
            'reload', 'folder', 'open', 'new', 'view', 'save', 'fit', 'revert', 'help', 'warning',
            'ok', 'died', 'waiting', 'list', 'theme', 'browsers')


def image_of(name: str, side: int, mode: QIcon.Mode = QIcon.Normal,
             state: QIcon.State = QIcon.Off) -> QImage:
    return icon(name).pixmap(QSize(side, side), mode, state).toImage()


def opaque_colors(image: QImage) -> Set[str]:
    colors = [image.pixelColor(x, y) for x in range(image.width()) for y in range(image.height())]
    return {color.name() for color in colors if color.alpha() == 255}


@pytest.mark.parametrize('name', PROMISED)
def test_each_icon_draws_something_and_not_beyond_its_edges(qtbot: QtBot, name: str) -> None:
    image = image_of(name, 48)
    assert opaque_colors(image)
    edge = [image.pixelColor(at, side).alpha() for at in range(48) for side in (0, 47)]
    assert max(edge) == 0


def test_there_is_nothing_but_what_is_promised() -> None:
    assert set(names()) == set(PROMISED)


def test_no_two_icons_look_the_same(qtbot: QtBot) -> None:
    drawn = {bytes(image_of(name, 32).bits().asarray(32 * 32 * 4)) for name in PROMISED}
    assert len(drawn) == len(PROMISED)


def test_a_checked_icon_is_in_the_accent_color_and_a_disabled_one_is_pale(qtbot: QtBot) -> None:
    assert opaque_colors(image_of('play', 32, QIcon.Normal, QIcon.On)) == {LIGHT.accent}
    pale, dark = (QColor(opaque_colors(image_of('play', 32, mode)).pop()).lightness()
                  for mode in (QIcon.Disabled, QIcon.Normal))
    assert pale > dark + 80


def test_the_record_icon_stays_red_when_checked(qtbot: QtBot) -> None:
    assert opaque_colors(image_of('record', 32, QIcon.Normal, QIcon.On)) == {LIGHT.bad}


def test_an_icon_drawn_for_a_fine_screen_has_fine_edges(qtbot: QtBot) -> None:
    """Twice the size is drawn again: it is not the small one with each pixel doubled."""
    small, large = image_of('play', 16), image_of('play', 32)
    doubled = small.scaled(32, 32)
    assert large != doubled


def test_an_unknown_icon_is_refused(qtbot: QtBot) -> None:
    with pytest.raises(FileNotFoundError):
        icon('playy')


def test_the_style_applies_to_an_application(qapp: QApplication) -> None:
    apply_style(qapp)
    assert qapp.palette().highlight().color().name() == LIGHT.accent
