# SPDX-License-Identifier: BSD-3-Clause
"""Measurement noise that is a function of time, so that runs repeat."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import numpy.typing as npt  # numpy has it since 1.20

_SIZE = 65521  # prime: a stride never falls into a short loop
_STRIDE = 9973
_TICKS_PER_SECOND = 1000


class Noise:
    """Standard normal noise; the same seed, channel and time give the same value."""

    def __init__(self, seed: int) -> None:
        self._table = np.random.default_rng([seed, 1]).standard_normal(_SIZE)

    def __call__(self, channel: npt.ArrayLike, time_s: npt.ArrayLike) -> np.ndarray:
        """Noise of ``channel`` (whole numbers) at ``time_s``; both are broadcast."""
        tick = np.rint(np.asarray(time_s) * _TICKS_PER_SECOND).astype(np.int64)
        return self._table[(tick + np.asarray(channel) * _STRIDE) % _SIZE]
