# SPDX-License-Identifier: BSD-3-Clause
"""Values of a function of time, computed for many ticks at once."""

from __future__ import annotations

from typing import Callable

import numpy as np


class Lookahead:
    """Row ``tick`` of ``function(times)``, a block at a time.

    numpy needs nearly the same time for one row as for a block of them.  ``function`` takes
    times (n,) in s and returns an array whose first dimension is n.
    """

    def __init__(
        self, function: Callable[[np.ndarray], np.ndarray], rate_hz: float, size: int = 25
    ) -> None:
        self._function, self._rate_hz, self._size = function, rate_hz, size
        self._block = -1
        self._rows: list = []

    def __call__(self, tick: int) -> list:
        """The row of ``tick`` as a list (a number where the function returns numbers)."""
        block, row = divmod(tick, self._size)
        if block != self._block:
            ticks = np.arange(block * self._size, (block + 1) * self._size)
            self._rows = self._function(ticks / self._rate_hz).tolist()
            self._block = block
        return self._rows[row]
