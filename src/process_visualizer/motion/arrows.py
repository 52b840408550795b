# SPDX-License-Identifier: BSD-3-Clause
"""Geometry of arrows: their length, and the place and wording of their number."""
from __future__ import annotations

import math

from process_visualizer.motion.rotations import Triple, Vector

VELOCITY_COLOR: Triple = (0.0, 0.8, 0.1)
FORCE_COLOR: Triple = (0.9, 0.05, 0.05)
"""The thesis' colours, red green blue from 0 to 1, where a configuration has no others."""


_MOST_READ = 1e9


def arrow_length(magnitude: float, scale: float, min_m: float, max_m: float) -> float:
    """Return the length [m] of an arrow: linear, within two limits (thesis section 5.3.2).

    Args:
        magnitude: what the arrow shows, at least 0, in its own unit (m/s, N).
        scale: metres of arrow per unit.
        min_m, max_m: the limits of the length [m].
    """
    return min(max(magnitude * scale, min_m), max_m)


def format_value(label: str, value: float, unit: str, decimals: int) -> str:
    """Return, for instance, 'v 0.052 m/s'; a value that rounds to zero has no minus sign.

    Of one with more digits than anybody reads only the first ones are written.
    """
    number = round(value, decimals) + 0.0  # -0.0 + 0.0 is 0.0
    text = f'{number:.{decimals}f}' if abs(number) < _MOST_READ else f'{number:.3g}'
    return ' '.join(part for part in (label, text, unit) if part)


def format_age(label: str, age_s: float) -> str:
    """Return, for instance, 'v no data for 3.2 s'."""
    return f'{label} no data for {age_s:.1f} s'.lstrip()


def line_of_block(text: str, line: int, line_count: int) -> str:
    """Return a block of line_count lines that is blank but for the text in one of them.

    RViz turns a text to the viewer and centres it on its position. Blocks of as many lines at
    one position show one under the other from every side, each with its own colour.
    """
    lines = [' '] * line_count
    lines[line] = text
    return '\n'.join(lines)


def label_offset(tool_position: Vector, outward_m: float, up_m: float) -> Triple:
    """Return where a robot's numbers stand, (3,) [m] from the tool along the base frame's axes.

    They stand beyond the tool as seen from the robot's foot, and along the foot's z axis: a
    hanging robot has them below its tool, where they do not meet those of a standing one.

    Args:
        tool_position: of the tool in the base frame, (3,) [m].
        outward_m, up_m: distances from the tool along the two directions.
    """
    x, y = tool_position[0], tool_position[1]
    distance = math.hypot(x, y)
    outward = (x / distance, y / distance) if distance > 1e-6 else (1.0, 0.0)
    return outward_m * outward[0], outward_m * outward[1], up_m
