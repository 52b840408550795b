# SPDX-License-Identifier: BSD-3-Clause
"""Adds the errors of a Kinect to true depths: disparity steps, noise, shadows and holes."""

from __future__ import annotations

import numpy as np

from sewing_cell import picture_library

_NOISE_STEPS = 0.35
_HOLE_SHARE = 4e-4


class DepthNoise:
    """The errors of pictures of a shape, drawn once in a few variants: a frame gets one of them."""

    def __init__(self, shape: tuple[int, int], random: np.random.Generator,
                 variants: int = 1) -> None:
        self._noise_steps = [_noise(shape, random) for _ in range(variants)]

    def measured(self, depth_m: np.ndarray, variant: int = 0) -> np.ndarray:
        """Depth in mm (uint16) as it is measured, 0 in shadows and holes.

        ``depth_m`` is the true one, float32.
        """
        return picture_library.measure(depth_m, self._noise_steps[variant])


def _noise(shape: tuple[int, int], random: np.random.Generator) -> np.ndarray:
    """Noise of the disparity in steps, NaN in holes."""
    noise = np.float32(_NOISE_STEPS) * random.standard_normal(shape, dtype=np.float32)
    noise[random.random(shape) < _HOLE_SHARE] = np.nan
    return noise
