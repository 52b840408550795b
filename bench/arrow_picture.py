# SPDX-License-Identifier: BSD-3-Clause
"""Finds a ball and the tips of arrows in a picture by their colors."""
from __future__ import annotations

import subprocess
from typing import Dict, NamedTuple, Tuple

import numpy as np

BALL, LOCKED, UNLOCKED = 'ball', 'locked', 'unlocked'
_LIT, _DARK = 110, 70  # minimum of a channel that is on, and maximum of one that is off
_ON = {BALL: (True, False, True), LOCKED: (True, False, False), UNLOCKED: (False, False, True)}
_SIGN = {LOCKED: 1, UNLOCKED: -1}  # the side of the picture to which it points
_MIN_PIXELS = 50
_TIP_PIXELS = 3


class Window(NamedTuple):
    """The evaluated part of the screen [pixels]."""

    left: int
    top: int
    width: int
    height: int


def take_picture(window: Window) -> np.ndarray:
    """Return a part of the screen ($DISPLAY) as (height, width, 3) of uint8."""
    place = f'{window.width}x{window.height}+{window.left}+{window.top}'
    raw = subprocess.run(['import', '-silent', '-window', 'root', '-crop', place, '-depth', '8',
                          'rgb:-'], stdout=subprocess.PIPE, check=True).stdout
    return np.frombuffer(raw, np.uint8).reshape(window.height, window.width, 3)


def tips_from_ball(picture: np.ndarray) -> Dict[str, np.ndarray]:
    """Return the tip (2,) [pixels] of each arrow relative to the ball's center.

    Raises:
        ValueError: the ball or an arrow is not in the picture.
    """
    ball = _pixels(picture, BALL).mean(axis=0)
    return {name: _tip(_pixels(picture, name) - ball, sign) for name, sign in _SIGN.items()}


def _pixels(picture: np.ndarray, name: str) -> np.ndarray:
    """Return the positions (n, 2) x y of the pixels of a color."""
    mask = np.ones(picture.shape[:2], bool)
    for channel, on in enumerate(_ON[name]):
        mask &= picture[..., channel] > _LIT if on else picture[..., channel] < _DARK
    rows, columns = np.nonzero(mask)
    if len(rows) < _MIN_PIXELS:
        raise ValueError(f'{name}: only {len(rows)} pixels are in the picture')
    return np.column_stack((columns, rows)).astype(float)


def _tip(places: np.ndarray, sign: int) -> np.ndarray:
    """Return the tip of an arrow that points along a row of pixels.

    Along the arrow, the tip is at the last pixels; across it, in the middle of all pixels.
    """
    reach = np.sort(sign * places[:, 0])[-_TIP_PIXELS:].mean()
    return np.array([sign * reach, places[:, 1].mean()])


def distances(tips: np.ndarray, standing: np.ndarray) -> Tuple[float, float, float]:
    """Return median, 95th percentile and maximum of the tips' (n, 2) distances from rest."""
    lengths = np.linalg.norm(tips - standing, axis=1)
    return float(np.median(lengths)), float(np.percentile(lengths, 95)), float(lengths.max())
