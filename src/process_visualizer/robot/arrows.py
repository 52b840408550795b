# SPDX-License-Identifier: BSD-3-Clause
"""Arrows: their style, length and position, the numbers beside them, the style of ghost arrows."""
from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, Dict, List, Sequence, Tuple, Union

import numpy as np

from process_visualizer.cell.model import Arrow, Device
from process_visualizer.parameters.reading import (
    Color,
    ParameterError,
    Parameters,
    changed,
    opaque,
    written_color,
)
from process_visualizer.robot.rotations import Triple, Vector

VELOCITY_COLOR: Triple = (0.0, 0.8, 0.1)
FORCE_COLOR: Triple = (0.9, 0.05, 0.05)
"""Default colors, from the thesis: red green blue from 0 to 1."""


def arrow_length(magnitude: float, scale: float, min_m: float, max_m: float) -> float:
    """Return the length [m] of an arrow: linear within two limits (thesis section 5.3.2).

    Args:
        magnitude: the shown value, at least 0, in its own unit (m/s, N).
        scale: meters of arrow per unit.
        min_m, max_m: the limits of the length [m].
    """
    return min(max(magnitude * scale, min_m), max_m)


@dataclass(frozen=True)
class ArrowStyle:
    """The style of a quantity: an arrow, with value and unit beside it."""

    label: str
    unit: str
    decimals: int
    scale_m: float  # length of the arrow per unit
    min_m: float  # limits of the length
    max_m: float
    threshold: float  # in the quantity's unit; no arrow below it
    color: Color
    diameter_m: float = 0.018  # of the shaft; the head has twice this diameter

    def length_m(self, vector: Vector) -> float:
        """Return the arrow length [m] for a vector in the quantity's unit; 0 means no arrow."""
        magnitude = math.hypot(*vector)
        return (arrow_length(magnitude, self.scale_m, self.min_m, self.max_m)
                if magnitude > max(self.threshold, 0.0) else 0.0)

    @staticmethod
    def read(parameters: Parameters, default: 'ArrowStyle') -> 'ArrowStyle':
        """Return a style with the parameters scale, min, max, threshold, color and diameter.

        Raises:
            ParameterError: a value is invalid.
        """
        style = ArrowStyle(
            label=default.label, unit=default.unit, decimals=default.decimals,
            scale_m=parameters.number('scale', default.scale_m, above=0.0),
            min_m=parameters.number('min', default.min_m, least=0.0),
            max_m=parameters.number('max', default.max_m, above=0.0),
            threshold=parameters.number('threshold', default.threshold),
            color=parameters.color('color', default.color),
            diameter_m=parameters.number('diameter', default.diameter_m, above=0.0),
        )
        if style.min_m > style.max_m:
            raise ParameterError(f'an arrow for {default.label}: min {style.min_m:g} m '
                                 f'is above max {style.max_m:g} m')
        return style

    def to_parameters(self, default: 'ArrowStyle') -> Dict[str, Any]:
        """Return the values that differ from a default, as ``read`` reads them."""
        return changed(self._written(), default._written())

    def _written(self) -> Dict[str, Any]:
        return {'scale': self.scale_m, 'min': self.min_m, 'max': self.max_m,
                'threshold': self.threshold, 'color': written_color(self.color),
                'diameter': self.diameter_m}


# The two arrows often point the same way: the force arrow is thinner and mostly longer, so that
# both are visible.
VELOCITY_ARROW = ArrowStyle('v', 'm/s', 3, scale_m=3.5, min_m=0.05, max_m=0.5,
                            threshold=0.002, color=(*VELOCITY_COLOR, 1.0), diameter_m=0.02)
FORCE_ARROW = ArrowStyle('F', 'N', 1, scale_m=0.018, min_m=0.05, max_m=0.6,
                         threshold=0.5, color=(*FORCE_COLOR, 1.0), diameter_m=0.012)


_DEFAULTS = {'velocity': VELOCITY_ARROW, 'force': FORCE_ARROW}


def configured_arrow(device: Device, quantity: str) -> ArrowStyle:
    """Return the style of a robot's arrow for a quantity, 'velocity' or 'force'."""
    default = _DEFAULTS[quantity]
    return next((_changed(default, arrow) for arrow in device.arrows
                 if arrow.quantity == quantity), default)


def _changed(style: ArrowStyle, arrow: Arrow) -> ArrowStyle:
    given: Dict[str, Any] = {
        'scale_m': arrow.scale, 'min_m': arrow.minimum_m, 'max_m': arrow.maximum_m,
        'color': None if arrow.color is None else opaque(arrow.color)}
    return replace(style, **{name: value for name, value in given.items() if value is not None})


# Numbers beside arrows.

_MAX_READ = 1e9


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
    """Return the position of a robot's numbers, (3,) [m] from the tool in the base frame's axes.

    The numbers are beyond the tool as seen from the robot's base, and offset along the base frame's
    z axis: below the tool of a robot that hangs, above the tool of one that stands.

    Args:
        tool_position: (3,) [m] in the base frame.
        outward_m, up_m: distances from the tool along the two directions.
    """
    x, y = tool_position[0], tool_position[1]
    distance = math.hypot(x, y)
    outward = (x / distance, y / distance) if distance > 1e-6 else (1.0, 0.0)
    return outward_m * outward[0], outward_m * outward[1], up_m


# Display of a process variable: the text, the length of the arrow, the position of the text.

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
    its height is limited, so that a long arrow does not move it out of view.

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

GHOST_COLOR: Color = (0.35, 0.65, 1.0, 0.35)
GHOST_ARROW_COLOR: Color = (0.35, 0.65, 1.0, 1.0)
GHOST_ARROW_DIAMETER_M = 0.007
BESIDE_M = 0.022
"""Distance of a ghost arrow from the foot of this run's thicker arrow, which would hide it."""
DEVIATION_COLOR: Color = (1.0, 0.35, 0.85, 1.0)
EXAGGERATION = 20.0
"""Length of an arrow per deviation: a millimeter would be invisible in a cell."""
MIN_DEVIATION_M = 0.0002
"""Minimum deviation with an arrow; the number is always shown."""
MAX_DEVIATION_M = 0.4
DEVIATION_DIAMETER_M = 0.02
