# SPDX-License-Identifier: BSD-3-Clause
"""Colors: all defined in one module, and legible in use, in both themes (WCAG 2.1)."""
from __future__ import annotations

import re
from pathlib import Path
from typing import List, Optional

import pytest
from hypothesis import given
from hypothesis import strategies as st
from PyQt5.QtCore import QRect, Qt
from PyQt5.QtGui import QColor
from PyQt5.QtWidgets import QRadioButton, QTreeWidget, QTreeWidgetItem, QVBoxLayout, QWidget

from process_visualizer.gui.toolkit.theme import (
    DARK,
    LIGHT,
    Theme,
    apply_style,
    apply_theme,
    contrast,
    readable_color,
    theme,
)
from process_visualizer.gui.toolkit.widgets import RowDelegate

GUI = Path(__file__).parents[3] / 'src/process_visualizer/gui'
LITERAL = re.compile(r"'#[0-9a-fA-F]{3,8}'|Qt\.white|Qt\.black|QColor\(\d")
TEXT_CONTRAST, GRAPHICS_CONTRAST = 4.5, 3.0
EVERYWHERE = ('paper', 'window', 'selected')
PAIRS = [(text, behind) for text in ('text', 'quiet', 'good', 'warning', 'bad', 'accent')
         for behind in EVERYWHERE]
PAIRS += [(text, behind) for text in ('text', 'quiet', 'bad')
          for behind in ('behind_bad', 'behind_warning', 'behind_good')]
PAIRS += [('on_signal', behind) for behind in ('accent', 'warning', 'bad', 'text', 'loop')]
PAIRS += [('text', 'button'), ('text', 'row')]
INDICATORS = (('indicator', 'window'), ('indicator', 'paper'), ('indicator_tick', 'indicator'),
              ('indicator_off_tick', 'indicator_off'))

parts = st.floats(0.0, 1.0)
themes = pytest.mark.parametrize('colors', [LIGHT, DARK], ids=['light', 'dark'])


@themes
@pytest.mark.parametrize('text, behind', PAIRS)
def test_texts_are_legible(colors: Theme, text: str, behind: str) -> None:
    assert contrast(QColor(getattr(colors, text)),
                    QColor(getattr(colors, behind))) >= TEXT_CONTRAST


@themes
def test_the_button_that_launches_is_legible(colors: Theme) -> None:
    assert contrast(QColor(colors.primary), QColor('white')) >= TEXT_CONTRAST


@themes
@pytest.mark.parametrize('shape', ['shape', 'waiting'])
def test_icons_are_seen(colors: Theme, shape: str) -> None:
    for behind in EVERYWHERE:
        assert contrast(QColor(getattr(colors, shape)),
                        QColor(getattr(colors, behind))) >= GRAPHICS_CONTRAST


@themes
@given(color=st.tuples(parts, parts, parts))
def test_curves_are_seen_whatever_color_the_configuration_gives(
        qapp, colors: Theme, color: 'tuple[float, float, float]') -> None:
    if theme() != colors:
        apply_theme(qapp, colors)
    assert contrast(readable_color(color), QColor(colors.paper)) >= GRAPHICS_CONTRAST


@pytest.fixture(autouse=True)
def light_again(qapp):
    yield
    if theme() != LIGHT:
        apply_theme(qapp, LIGHT)


def test_the_order_does_not_matter() -> None:
    black, white = QColor('black'), QColor('white')
    assert contrast(black, white) == contrast(white, black) == pytest.approx(21.0)
    assert contrast(white, white) == 1.0


def test_colors_are_in_one_place() -> None:
    found: List[str] = [path.name for folder in ('views', 'app') for path in
                        (GUI / folder).rglob('*.py')
                        if LITERAL.search(path.read_text(encoding='utf-8'))]
    assert found == []


@pytest.mark.parametrize('inside, behind', INDICATORS)
def test_boxes_and_ticks_are_seen_on_dark_windows(inside: str, behind: str) -> None:
    """In light windows they have an outline."""
    assert contrast(QColor(getattr(DARK, inside)),
                    QColor(getattr(DARK, behind))) >= GRAPHICS_CONTRAST


def pixels(widget: QWidget, area: QRect) -> List[QColor]:
    image = widget.grab(area).toImage()
    return [image.pixelColor(x, y) for x in range(image.width()) for y in range(image.height())]


def close_to(color: QColor, name: str) -> bool:
    wanted = QColor(getattr(theme(), name))
    return max(abs(a - b) for a, b in zip(color.getRgb(), wanted.getRgb())) < 60


@themes
def test_ticks_of_rows_are_seen_whatever_color_the_row_has(qtbot, qapp, colors: Theme) -> None:
    apply_style(qapp, colors)
    tree = QTreeWidget()
    tree.setItemDelegate(RowDelegate(tree))
    qtbot.addWidget(tree)
    states = (Qt.Unchecked, Qt.PartiallyChecked, Qt.Checked)
    for state in states:
        item = QTreeWidgetItem(tree, ['curve'])
        item.setCheckState(0, state)
        item.setForeground(0, QColor(colors.indicator))  # as the box: no contrast at all
    tree.show()
    inked = {}
    for row, state in enumerate(states):
        place = tree.visualItemRect(tree.topLevelItem(row))
        box = QRect(place.left() + 5, place.center().y() - 3, 9, 8)  # inside its outline
        found = pixels(tree.viewport(), box)
        inked[state] = sum(close_to(it, 'indicator_tick') for it in found)
        assert sum(close_to(it, 'indicator') for it in found) > len(found) // 3
    assert inked[Qt.Unchecked] == 0
    assert min(inked[Qt.PartiallyChecked], inked[Qt.Checked]) >= 8


@themes
@pytest.mark.parametrize('before', [None, LIGHT, DARK], ids=['at first', 'light', 'dark'])
def test_radio_buttons_are_rings_and_the_chosen_one_has_a_dot(
        qtbot, qapp, colors: Theme, before: Optional[Theme]) -> None:
    apply_style(qapp, before or colors)
    group = QWidget()
    qtbot.addWidget(group)
    layout = QVBoxLayout(group)
    buttons = [QRadioButton('') for _ in range(2)]
    for button in buttons:
        layout.addWidget(button)
    buttons[0].setChecked(True)
    group.show()
    for button in buttons:
        button.grab()  # draws it once
    if before is not None:
        apply_theme(qapp, colors)
    for button in buttons:
        found = pixels(button, QRect(0, 0, 16, button.height()))
        ink = sum(close_to(it, 'text') for it in found)
        assert (ink > 30) is button.isChecked() and ink > 8, ink
