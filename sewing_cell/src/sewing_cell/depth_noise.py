# SPDX-License-Identifier: BSD-3-Clause
"""Adds the errors of a Kinect to true depths: disparity steps, noise, and holes.

Its disparity has steps of 1/8 pixel at a focal length of 580 px and a baseline of 75 mm, so that
a step is Z^2 * 2.87e-3 m: 1 cm at 1.9 m (Khoshelham and Elberink 2012, Sensors 12, eq. 5 and 10).
"""

from __future__ import annotations

import numpy as np

_FOCAL_LENGTH_PX, _BASELINE_M = 580.0, 0.075
_STEPS_M = 8 * _FOCAL_LENGTH_PX * _BASELINE_M
_NOISE_STEPS = 0.35
_HOLE_SHARE = 4e-4


def measured(depth_m: np.ndarray, random: np.random.Generator) -> np.ndarray:
    """Depth in mm (uint16) with steps, noise and scattered holes (0), shaped like ``depth_m``."""
    steps = _STEPS_M / depth_m + _NOISE_STEPS * random.standard_normal(depth_m.shape)
    depth_mm = np.rint(1000 * _STEPS_M / np.maximum(np.rint(steps), 1.0))
    holes = random.random(depth_m.shape) < _HOLE_SHARE
    return np.where(holes, 0, np.minimum(depth_mm, 65535)).astype(np.uint16)


def stepped(depth_m: np.ndarray) -> np.ndarray:
    """Depth in mm (uint16) with the steps alone."""
    return (1000 * _STEPS_M / np.rint(_STEPS_M / depth_m)).astype(np.uint16)


def shadow(depth_m: np.ndarray) -> np.ndarray:
    """Pixels without light of the projector: beside near objects; shape of ``depth_m``."""
    disparity = _FOCAL_LENGTH_PX * _BASELINE_M / depth_m
    hidden = np.zeros(depth_m.shape, dtype=bool)
    widest = int(np.ptp(disparity)) + 1
    for shift in range(1, min(widest, depth_m.shape[1] - 1) + 1):
        hidden[:, :-shift] |= disparity[:, shift:] - disparity[:, :-shift] > shift
    return hidden
