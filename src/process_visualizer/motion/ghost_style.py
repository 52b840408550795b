# SPDX-License-Identifier: BSD-3-Clause
"""The style of the reference beside a run: the same in RViz and on a page."""
from __future__ import annotations

from typing import Tuple

_Color = Tuple[float, float, float, float]

GHOST_COLOR: _Color = (0.35, 0.65, 1.0, 0.35)
GHOST_ARROW_COLOR: _Color = (0.35, 0.65, 1.0, 1.0)
GHOST_ARROW_DIAMETER_M = 0.007
BESIDE_M = 0.022
"""So far beside its foot: in one line with the thicker arrow of this run, it would be hidden."""
DEVIATION_COLOR: _Color = (1.0, 0.35, 0.85, 1.0)
EXAGGERATION = 20.0
"""An arrow is so many times as long as the deviation: a millimetre could not be seen in a cell."""
LEAST_DEVIATION_M = 0.0002
LONGEST_DEVIATION_M = 0.4
DEVIATION_DIAMETER_M = 0.02
