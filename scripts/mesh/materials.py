# SPDX-License-Identifier: BSD-3-Clause
"""The colors of the cell: red, green, blue (0 to 1) and how much the material shines."""

from __future__ import annotations

from typing import Dict, Tuple

Color = Tuple[float, float, float]

#: Name of a material -> (diffuse color, strength of its highlight from 0 to 1).
MATERIALS: Dict[str, Tuple[Color, float]] = {
    "aluminium": ((0.80, 0.81, 0.83), 0.35),
    "blue_cap": ((0.42, 0.62, 0.78), 0.30),
    "seal": ((0.15, 0.16, 0.17), 0.10),
    "steel": ((0.68, 0.70, 0.72), 0.60),
    "chrome": ((0.85, 0.86, 0.88), 0.80),
    "graphite": ((0.30, 0.31, 0.33), 0.50),
    "black": ((0.10, 0.10, 0.11), 0.30),
    "rubber": ((0.20, 0.20, 0.21), 0.05),
    "orange": ((0.90, 0.45, 0.12), 0.15),
    "enamel": ((0.90, 0.93, 0.87), 0.40),
    "green_grey": ((0.38, 0.48, 0.44), 0.25),
    "table": ((0.42, 0.35, 0.30), 0.10),
    "frame_grey": ((0.50, 0.54, 0.58), 0.20),
    "thread_red": ((0.70, 0.16, 0.14), 0.05),
    "thread_cream": ((0.90, 0.84, 0.68), 0.05),
    "screen": ((0.25, 0.55, 0.70), 0.60),
    "lens": ((0.12, 0.16, 0.30), 0.90),
}
