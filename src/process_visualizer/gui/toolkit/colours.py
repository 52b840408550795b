# SPDX-License-Identifier: BSD-3-Clause
"""Makes colours that were chosen for RViz readable behind and on those of the launcher."""
from __future__ import annotations

from functools import lru_cache
from typing import Tuple

from PyQt5.QtGui import QColor

from process_visualizer.gui.toolkit.theme import theme

_LEAST_CONTRAST = 3.6  # to the paper; WCAG 2.1 asks for 3 for graphics and 4.5 for small text
_SATURATION = 0.85
_STEP = 0.05


def readable_colour(colour: Tuple[float, float, float]) -> QColor:
    """Return a colour (red, green, blue, 0 to 1) that is less saturated, and seen on the paper."""
    return QColor(_readable(colour, theme().paper))


@lru_cache(maxsize=256)
def _readable(colour: Tuple[float, float, float], paper_name: str) -> QColor:
    """Curves ask for the same few colours at each picture."""
    chosen = QColor.fromRgbF(*(min(max(part, 0.0), 1.0) for part in colour))
    readable = QColor.fromHsvF(max(chosen.hsvHueF(), 0.0), _SATURATION * chosen.hsvSaturationF(),
                               chosen.valueF())
    paper = QColor(paper_name)
    while contrast(readable, paper) < _LEAST_CONTRAST:
        readable = _farther(readable, paper)
    return readable


def translucent(name: str, alpha: int) -> QColor:
    """Return a colour of the theme (#rrggbb) with an opacity from 0 to 255."""
    colour = QColor(name)
    colour.setAlpha(alpha)
    return colour


def _farther(colour: QColor, paper: QColor) -> QColor:
    """Darker on light paper; on dark paper brighter, and paler where that is not enough."""
    hue, saturation, value, _alpha = colour.getHsvF()
    if _luminance(paper) > 0.5:
        return QColor.fromHsvF(max(hue, 0.0), saturation, value * (1.0 - _STEP))
    return QColor.fromHsvF(max(hue, 0.0), saturation if value < 1.0 else saturation * 0.9,
                           min(value + _STEP, 1.0))


def contrast(one: QColor, other: QColor) -> float:
    """Return the contrast ratio of WCAG 2.1 (1.4.3) of two colours, at least 1."""
    darker, lighter = sorted(map(_luminance, (one, other)))
    return (lighter + 0.05) / (darker + 0.05)


def _luminance(colour: QColor) -> float:
    red, green, blue = (_linear(part) for part in colour.getRgbF()[:3])
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue


def _linear(part: float) -> float:
    return part / 12.92 if part <= 0.03928 else ((part + 0.055) / 1.055) ** 2.4
