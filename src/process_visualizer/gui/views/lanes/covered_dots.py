# SPDX-License-Identifier: BSD-3-Clause
"""Areas between two curves as dots of a picture, softened at their edges."""
from __future__ import annotations

import numpy as np

OPACITIES = 128  # steps of opacity, from transparent to opaque
MOST_OPAQUE = OPACITIES - 1


def covered_dots(upper: np.ndarray, lower: np.ndarray, rows: int) -> np.ndarray:
    """Return how much (0 to 1) of each dot (rows, columns) lies between two curves.

    Their ends, (columns,) each, are in dots from above.
    """
    row = np.arange(rows, dtype=np.float32)[:, None]
    covered = _below(lower, row)
    covered -= _below(upper, row)
    return covered


def _below(ends: np.ndarray, row: np.ndarray) -> np.ndarray:
    """Return how much (0 to 1) of each dot lies above an end."""
    covered = ends - row
    np.maximum(covered, np.float32(0.0), out=covered)
    return np.minimum(covered, np.float32(1.0), out=covered)
