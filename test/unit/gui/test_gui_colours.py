# SPDX-License-Identifier: BSD-3-Clause
"""Colours: all in one place, and legible where they are used, in both themes (WCAG 2.1)."""
from __future__ import annotations

import re
from pathlib import Path
from typing import List

import pytest
from hypothesis import given
from hypothesis import strategies as st
from PyQt5.QtGui import QColor

from process_visualizer.gui.toolkit.colours import contrast, readable_colour
from process_visualizer.gui.toolkit.style import apply_theme
from process_visualizer.gui.toolkit.theme import DARK, LIGHT, Theme, theme

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
INDICATORS = ('indicator', 'window'), ('indicator', 'paper'), ('text', 'indicator')

parts = st.floats(0.0, 1.0)
themes = pytest.mark.parametrize('colours', [LIGHT, DARK], ids=['light', 'dark'])


@themes
@pytest.mark.parametrize('text, behind', PAIRS)
def test_texts_are_legible(colours: Theme, text: str, behind: str) -> None:
    assert contrast(QColor(getattr(colours, text)),
                    QColor(getattr(colours, behind))) >= TEXT_CONTRAST


@themes
def test_the_button_that_launches_is_legible(colours: Theme) -> None:
    assert contrast(QColor(colours.primary), QColor('white')) >= TEXT_CONTRAST


@themes
@pytest.mark.parametrize('shape', ['shape', 'waiting'])
def test_icons_are_seen(colours: Theme, shape: str) -> None:
    for behind in EVERYWHERE:
        assert contrast(QColor(getattr(colours, shape)),
                        QColor(getattr(colours, behind))) >= GRAPHICS_CONTRAST


@themes
@given(colour=st.tuples(parts, parts, parts))
def test_curves_are_seen_whatever_colour_the_configuration_gives(
        qapp, colours: Theme, colour: 'tuple[float, float, float]') -> None:
    if theme() != colours:
        apply_theme(qapp, colours)
    assert contrast(readable_colour(colour), QColor(colours.paper)) >= GRAPHICS_CONTRAST


@pytest.fixture(autouse=True)
def light_again(qapp):
    yield
    if theme() != LIGHT:
        apply_theme(qapp, LIGHT)


def test_the_order_does_not_matter() -> None:
    black, white = QColor('black'), QColor('white')
    assert contrast(black, white) == contrast(white, black) == pytest.approx(21.0)
    assert contrast(white, white) == 1.0


def test_colours_are_in_one_place() -> None:
    found: List[str] = [path.name for folder in ('views', 'app') for path in
                        (GUI / folder).rglob('*.py')
                        if LITERAL.search(path.read_text(encoding='utf-8'))]
    assert found == []


@pytest.mark.parametrize('inside, behind', INDICATORS)
def test_boxes_and_ticks_are_seen_on_dark_windows(inside: str, behind: str) -> None:
    """On a light one they have an outline."""
    assert contrast(QColor(getattr(DARK, inside)),
                    QColor(getattr(DARK, behind))) >= GRAPHICS_CONTRAST
