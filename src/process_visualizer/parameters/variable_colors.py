# SPDX-License-Identifier: BSD-3-Clause
"""The color of a variable by its value: plain, on a scale, or the warning color of a limit."""
from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Dict, Optional, Tuple

from process_visualizer.cell.elements import TAGS
from process_visualizer.cell.model import Variable
from process_visualizer.cell.values import CONVERTERS
from process_visualizer.parameters.reading import (
    Color,
    Parameters,
    changed,
    opaque,
    written_color,
)
from process_visualizer.robot.limit_alarms import Limits


def variable_default(attribute: str) -> Any:
    """Return the default value of an attribute of <variable>."""
    given = TAGS['variable'].attributes[attribute]
    return CONVERTERS[given.kind](given.default or '')


COLOR, WARNING_COLOR = opaque(variable_default('color')), opaque(variable_default('warning_color'))


@dataclass(frozen=True)
class VariableColors:
    """The color of a variable by its value; warning limits take precedence over the scale."""

    color: Color
    scale: Optional[Tuple[float, float, Color]] = None  # begin, end, color at the end
    low: float = -math.inf
    high: float = math.inf
    warning_color: Color = WARNING_COLOR

    @property
    def limits(self) -> Limits:
        """The lowest and the highest good value."""
        return Limits(self.low, self.high)

    def of(self, value: float) -> Color:
        """Return the color of a value."""
        if not self.low <= value <= self.high:
            return self.warning_color
        if self.scale is None:
            return self.color
        begin, end, end_color = self.scale
        share = min(max((value - begin) / (end - begin), 0.0), 1.0)
        red, green, blue, alpha = (first + share * (second - first)
                                   for first, second in zip(self.color, end_color))
        return red, green, blue, alpha

    @staticmethod
    def read(parameters: Parameters) -> 'VariableColors':
        """Return the checked colors of a variable.

        Raises:
            ParameterError: a value is wrong.
        """
        limits, scale = parameters.group('limits'), parameters.group('color_scale')
        return VariableColors(
            parameters.color('color', COLOR), _color_scale(scale),
            limits.number('low', -math.inf) if limits.has('low') else -math.inf,
            limits.number('high', math.inf) if limits.has('high') else math.inf,
            limits.color('color', WARNING_COLOR))

    def to_parameters(self) -> Dict[str, Any]:
        """Return the parameters that ``read`` reads."""
        values: Dict[str, Any] = {'color': written_color(self.color)}
        limits = changed({'low': self.low, 'high': self.high},
                         {'low': -math.inf, 'high': math.inf})
        if limits:
            values['limits'] = {'color': written_color(self.warning_color), **limits}
        if self.scale is not None:
            begin, end, color = self.scale
            values['color_scale'] = {'begin': begin, 'end': end, 'color': written_color(color)}
        return values


def limits_of(variable: Variable) -> Limits:
    """Return the limits of a variable; without any, every value is good."""
    given = variable.limits
    if given is None:
        return Limits()
    return Limits(-math.inf if given.low is None else given.low,
                  math.inf if given.high is None else given.high)


def colors_of(variable: Variable) -> VariableColors:
    """Return the rule that colors a variable by its value."""
    limits, scale = limits_of(variable), variable.color_scale
    return VariableColors(
        opaque(variable.color),
        None if scale is None else (scale.begin, scale.end, opaque(scale.end_color)),
        limits.low, limits.high,
        WARNING_COLOR if variable.limits is None else opaque(variable.limits.color))


def _color_scale(parameters: Parameters) -> Optional[Tuple[float, float, Color]]:
    if not parameters.has('begin') and not parameters.has('end'):
        return None
    begin, end = parameters.number('begin', 0.0), parameters.number('end', 1.0)
    if begin == end:
        raise parameters.error('end', 'another value than begin', end)
    return begin, end, parameters.color('color', WARNING_COLOR)
