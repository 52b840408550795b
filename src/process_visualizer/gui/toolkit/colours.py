# SPDX-License-Identifier: BSD-3-Clause
"""Makes colours for a dark background readable on a light one."""
from __future__ import annotations

from typing import Tuple

from PyQt5.QtCore import Qt
from PyQt5.QtGui import QColor

_LEAST_CONTRAST = 3.6  # to white; WCAG 2.1 asks for 3 for graphics and 4.5 for small text
_SATURATION = 0.85


def readable_colour(colour: Tuple[float, float, float]) -> QColor:
    """Return a colour (red, green, blue, 0 to 1) less saturated, and dark enough on white."""
    chosen = QColor.fromRgbF(*(min(max(part, 0.0), 1.0) for part in colour))
    readable = QColor.fromHsvF(max(chosen.hsvHueF(), 0.0), _SATURATION * chosen.hsvSaturationF(),
                               chosen.valueF())
    while contrast_to_white(readable) < _LEAST_CONTRAST:
        hue, saturation, value, _alpha = readable.getHsvF()
        readable = QColor.fromHsvF(max(hue, 0.0), saturation, value * 0.95)
    return readable


def contrast_to_white(colour: QColor) -> float:
    """Return the contrast ratio of WCAG 2.1 (1.4.3) with white."""
    return contrast(colour, QColor(Qt.white))


def contrast(one: QColor, other: QColor) -> float:
    """Return the contrast ratio of WCAG 2.1 (1.4.3) of two colours, at least 1."""
    darker, lighter = sorted(map(_luminance, (one, other)))
    return (lighter + 0.05) / (darker + 0.05)


def _luminance(colour: QColor) -> float:
    red, green, blue = (_linear(part) for part in colour.getRgbF()[:3])
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue


def _linear(part: float) -> float:
    return part / 12.92 if part <= 0.03928 else ((part + 0.055) / 1.055) ** 2.4
