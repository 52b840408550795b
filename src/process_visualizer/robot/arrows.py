# SPDX-License-Identifier: BSD-3-Clause
"""Geometry and wording of arrows: lengths, numbers, process variables, and the ghost's style."""
from __future__ import annotations

import math
from typing import List, Sequence, Tuple, Union

import numpy as np

from process_visualizer.robot.rotations import Triple, Vector

VELOCITY_COLOR: Triple = (0.0, 0.8, 0.1)
FORCE_COLOR: Triple = (0.9, 0.05, 0.05)
"""Default colors, from the thesis: red green blue from 0 to 1."""


_MAX_READ = 1e9


def arrow_length(magnitude: float, scale: float, min_m: float, max_m: float) -> float:
    """Return the length [m] of an arrow: linear within two limits (thesis section 5.3.2).

    Args:
        magnitude: the shown value, at least 0, in its own unit (m/s, N).
        scale: meters of arrow per unit.
        min_m, max_m: the limits of the length [m].
    """
    return min(max(magnitude * scale, min_m), max_m)


def format_value(label: str, value: float, unit: str, decimals: int) -> str:
    """Return, for instance, 'v 0.052 m/s'; a value that rounds to zero has no minus sign.

    Very large numbers are written with three digits and an exponent.
    """
    number = round(value, decimals) + 0.0  # -0.0 + 0.0 is 0.0
    text = f'{number:.{decimals}f}' if abs(number) < _MAX_READ else f'{number:.3g}'
    return ' '.join(part for part in (label, text, unit) if part)


def format_age(label: str, age_s: float) -> str:
    """Return, for instance, 'v no data for 3.2 s'; 'v no data' for an infinite age."""
    return f'{label} no data{f" for {age_s:.1f} s" if math.isfinite(age_s) else ""}'.lstrip()


def line_of_block(text: str, line: int, line_count: int) -> str:
    """Return a block of ``line_count`` lines that is blank except for the text in one line.

    RViz turns a text toward the viewer and centers it on its position. So the texts of several
    blocks at one position appear one below the other from every side, each in its own color.
    """
    lines = [' '] * line_count
    lines[line] = text
    return '\n'.join(lines)


def label_offset(tool_position: Vector, outward_m: float, up_m: float) -> Triple:
    """Return the place of a robot's numbers, (3,) [m] from the tool along the base frame's axes.

    The numbers are beyond the tool as seen from the robot's foot, and along the foot's z axis:
    those of a hanging robot are below its tool, away from those of a standing one.

    Args:
        tool_position: (3,) [m] in the base frame.
        outward_m, up_m: distances from the tool along the two directions.
    """
    x, y = tool_position[0], tool_position[1]
    distance = math.hypot(x, y)
    outward = (x / distance, y / distance) if distance > 1e-6 else (1.0, 0.0)
    return outward_m * outward[0], outward_m * outward[1], up_m


# Display of a process variable: the text, the length of the arrow, the place of the text.

Number = Union[int, float]

MIN_ARROW_M = 0.005  # a shorter arrow would look like a disc
VARIABLE_DIAMETER_M = 0.016
FOOT_DISTANCE_M = 0.045  # between parallel arrows: their heads are twice as thick as shafts
MAX_LENGTH_M = 100.0  # wild values must not exceed RViz's single precision
_MAX_WRITTEN_OUT = 1e12
_MAX_DECIMALS = 6
_TEXT_GAP_M = 0.04  # between arrows and texts
_MAX_TEXT_M = 1.0


def variable_vector(value: Number, offset: float, scale_m: float, axis: Vector,
                    max_m: float = MAX_LENGTH_M) -> np.ndarray:
    """Return the arrow (3,) [m]: scale (value - offset) along the axis, at most max_m long.

    Args:
        value: value of the variable; finite.
        offset: value at which the arrow has length 0.
        scale_m: meters of arrow per unit of the value.
        axis: unit vector (3,).
        max_m: maximum length, at most MAX_LENGTH_M.
    """
    limit_m = min(max_m, MAX_LENGTH_M)
    length_m = (float(value) - offset) * scale_m if scale_m else 0.0
    return np.asarray(axis, dtype=float) * min(max(length_m, -limit_m), limit_m)


def variable_text(label: str, value: Number, unit: str, offset: float, scale_m: float) -> str:
    """Return, for instance, 'upper edge 263, 8 above 255' or 'oven 351.2 K, 1.2 above 350'.

    The difference is omitted if the offset is 0.
    """
    parts = [label, _written(value, _decimals(value, scale_m)), unit]
    text = ' '.join(part for part in parts if part)
    if not offset:
        return text
    difference = value - int(offset) if offset.is_integer() else value - offset
    decimals = _decimals(difference if isinstance(value, int) else value, scale_m)
    return f'{text}, {offset_words(difference, offset, decimals)}'


def offset_words(difference: Number, offset: float, decimals: int) -> str:
    """Return the difference from an offset in words: '8 above 255', '6 below 255', 'at 255'."""
    distance = _written(abs(difference), decimals)
    if float(distance) == 0.0:
        return f'at {offset:.10g}'
    return f'{distance} {"above" if difference > 0 else "below"} {offset:.10g}'


def arrow_feet(arrows: Sequence[Tuple[str, Vector]], distance_m: float) -> List[Triple]:
    """Return the feet of arrows, (3,) [m] each in its frame, such that no arrow hides another.

    Arrows along the same line in the same frame are side by side, around the frame's origin; other
    arrows begin at the origin.

    Args:
        arrows: frame, and axis as a unit vector (3,), of each arrow.
        distance_m: distance between neighbors.
    """
    lines = [(frame, _line(axis)) for frame, axis in arrows]
    feet: List[Triple] = []
    for index, line in enumerate(lines):
        members = [other for other, same in enumerate(lines) if same == line]
        shift = (members.index(index) - 0.5 * (len(members) - 1)) * distance_m
        x, y, z = sideways(line[1])
        feet.append((shift * x, shift * y, shift * z))
    return feet


def _line(axis: Vector) -> Triple:
    """Return an axis without its sign, rounded."""
    x, y, z = (round(float(part), 3) for part in axis)
    first = next(part for part in (x, y, z) if part)
    return (x, y, z) if first > 0.0 else (-x + 0.0, -y + 0.0, -z + 0.0)


def sideways(axis: Vector) -> Triple:
    """Return a horizontal unit vector (3,) across an axis (3,); y for a vertical axis."""
    length = math.hypot(axis[0], axis[1])
    if length < 1e-3:
        return 0.0, 1.0, 0.0
    return -axis[1] / length, axis[0] / length, 0.0


def text_position(vectors: Sequence[Vector], block_height_m: float) -> Tuple[float, float, float]:
    """Return the middle of a block of texts, (3,) [m] in the arrows' common frame.

    The block is on the frame's z axis, above the arrows' feet and tips, where no arrow crosses it;
    its height is limited, so that a long arrow does not move it out of sight.

    Args:
        vectors: the arrows, (3,) [m] each, from the frame's origin.
        block_height_m: height of all lines.
    """
    highest_tip_m = max(float(vector[2]) for vector in vectors)
    foot_m = min(max(highest_tip_m, 0.0), _MAX_TEXT_M)
    return 0.0, 0.0, foot_m + _TEXT_GAP_M + 0.5 * block_height_m


def _decimals(value: Number, scale_m: float) -> int:
    """Return the decimals that show a millimeter of the arrow, or three digits without an arrow.

    So the number is as steady as its arrow. It has at least two digits, which matters for small
    values with a small scale.
    """
    if isinstance(value, int):
        return 0
    # Near zero the number of decimals is constant, or noise would change it at random.
    to_first_digit = -math.floor(math.log10(max(abs(value), 0.1)))
    if not scale_m:
        return max(to_first_digit + 2, 0)
    finest = math.floor(math.log10(abs(scale_m) / 1e-3) + 1e-9)
    return min(max(to_first_digit + 1, finest, 0), _MAX_DECIMALS)


def _written(value: Number, decimals: int) -> str:
    if isinstance(value, int):
        return f'{value:d}'
    if abs(value) >= _MAX_WRITTEN_OUT:
        return f'{value:.4g}'
    return f'{round(value, decimals) + 0.0:.{decimals}f}'  # -0.0 + 0.0 is 0.0


# Style of the reference run beside a run, the same in RViz and on a page.

_Color = Tuple[float, float, float, float]

GHOST_COLOR: _Color = (0.35, 0.65, 1.0, 0.35)
GHOST_ARROW_COLOR: _Color = (0.35, 0.65, 1.0, 1.0)
GHOST_ARROW_DIAMETER_M = 0.007
BESIDE_M = 0.022
"""Distance of a ghost arrow from the foot of this run's thicker arrow, which would hide it."""
DEVIATION_COLOR: _Color = (1.0, 0.35, 0.85, 1.0)
EXAGGERATION = 20.0
"""Length of an arrow per deviation: a millimeter would be invisible in a cell."""
MIN_DEVIATION_M = 0.0002
"""Minimum deviation with an arrow; the number is always shown."""
MAX_DEVIATION_M = 0.4
DEVIATION_DIAMETER_M = 0.02
