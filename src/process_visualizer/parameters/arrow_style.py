# SPDX-License-Identifier: BSD-3-Clause
"""The style of a quantity's arrow."""
from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, Dict

from process_visualizer.cell.model import Arrow, Device
from process_visualizer.parameters.reading import (
    Color,
    ParameterError,
    Parameters,
    changed,
    opaque,
    written_color,
)
from process_visualizer.robot.arrows import FORCE_COLOR, VELOCITY_COLOR, arrow_length
from process_visualizer.robot.rotations import Vector


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
