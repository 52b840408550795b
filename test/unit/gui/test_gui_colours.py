# SPDX-License-Identifier: BSD-3-Clause
"""Colours: all in one place, and legible where they are used (WCAG 2.1)."""
from __future__ import annotations

import re
from pathlib import Path
from typing import List

import pytest
from hypothesis import given
from hypothesis import strategies as st
from PyQt5.QtGui import QColor

from process_visualizer.gui.toolkit import style
from process_visualizer.gui.toolkit.colours import contrast, readable_colour

VIEWS = Path(__file__).parents[3] / 'src/process_visualizer/gui/views'
LITERAL = re.compile(r"'#[0-9a-fA-F]{3,8}'")
TEXT_CONTRAST, GRAPHICS_CONTRAST = 4.5, 3.0
EVERYWHERE = (style.PAPER, style.WINDOW, style.SELECTED)
PAIRS = [(text, behind) for text in (style.TEXT, style.QUIET, style.GOOD, style.WARNING, style.BAD,
                                     style.ACCENT) for behind in EVERYWHERE]
PAIRS += [(text, behind) for text in (style.TEXT, style.QUIET, style.BAD)
          for behind in (style.BEHIND_BAD, style.BEHIND_WARNING, style.BEHIND_GOOD)]
PAIRS.append((style.PAPER, style.ACCENT))  # the button that launches

parts = st.floats(0.0, 1.0)


@pytest.mark.parametrize('text, behind', PAIRS)
def test_texts_are_legible(text: str, behind: str) -> None:
    assert contrast(QColor(text), QColor(behind)) >= TEXT_CONTRAST


@pytest.mark.parametrize('shape', [style.SHAPE, style.WAITING])
def test_icons_are_seen(shape: str) -> None:
    for behind in EVERYWHERE:
        assert contrast(QColor(shape), QColor(behind)) >= GRAPHICS_CONTRAST


@given(st.tuples(parts, parts, parts))
def test_curves_are_seen_whatever_colour_the_configuration_gives(
        colour: 'tuple[float, float, float]') -> None:
    assert contrast(readable_colour(colour), QColor(style.PAPER)) >= GRAPHICS_CONTRAST


def test_the_order_does_not_matter() -> None:
    black, white = QColor('black'), QColor('white')
    assert contrast(black, white) == contrast(white, black) == pytest.approx(21.0)
    assert contrast(white, white) == 1.0


def test_colours_are_in_one_place() -> None:
    """The timeline has a few of its own."""
    found: List[str] = [path.name for path in VIEWS.rglob('*.py')
                        if LITERAL.search(path.read_text(encoding='utf-8'))]
    assert [name for name in found if not name.startswith('timeline_')] == []
