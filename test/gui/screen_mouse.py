# SPDX-License-Identifier: BSD-3-Clause
"""The screen as a person uses it: colors in a picture, mouse and keys through the X server."""
from __future__ import annotations

import subprocess
from typing import Optional

import numpy as np
from PyQt5.QtCore import QPoint, QRect
from PyQt5.QtGui import QImage
from PyQt5.QtWidgets import QApplication

_STRONG, _WEAK = 150, 110  # of 255: a strong color has one part above, the others below


def topmost_blue(area: QRect) -> Optional[QPoint]:
    """Return the uppermost strongly blue pixel in an area of the screen; None if there is none."""
    shot = QApplication.primaryScreen().grabWindow(0).toImage().convertToFormat(
        QImage.Format_RGBA8888).copy(area)
    dots = np.frombuffer(shot.bits().asarray(shot.byteCount()), np.uint8).reshape(
        area.height(), area.width(), 4).astype(int)
    is_blue = (dots[..., 2] > _STRONG) & (dots[..., 0] < _WEAK) & (dots[..., 1] < _WEAK)
    found = np.argwhere(is_blue)
    return None if len(found) == 0 else area.topLeft() + QPoint(int(found[0][1]),
                                                                int(found[0][0]))


def press_key_in(title: str, key: str) -> None:
    """Give the window of that title the keyboard focus, and press a key."""
    xdotool('search', '--onlyvisible', '--name', title, 'windowfocus', '--sync', 'key', key)


def move_to(place: QPoint) -> None:
    """Move the mouse to a position on the screen."""
    xdotool('mousemove', str(place.x()), str(place.y()))


def press() -> None:
    """Press the left button."""
    xdotool('mousedown', '1')


def release() -> None:
    """Release the left button."""
    xdotool('mouseup', '1')


def xdotool(*words: str) -> None:
    """Run xdotool, which acts as mouse or keyboard."""
    subprocess.run(['xdotool', *words], check=True, timeout=120)
