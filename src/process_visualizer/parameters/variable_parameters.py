# SPDX-License-Identifier: BSD-3-Clause
"""Private parameters of the variable processor, as written by the generated launch file."""
from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Dict, List, Optional, Tuple

import rosgraph.names

from process_visualizer.bagio.number_places import FieldPath
from process_visualizer.health.staleness import STALE_AFTER_S
from process_visualizer.parameters.reading import (
    Parameters,
    changed,
)
from process_visualizer.parameters.variable_colors import VariableColors, variable_default
from process_visualizer.robot.arrows import MAX_LENGTH_M

UnitVector = Tuple[float, float, float]


@dataclass(frozen=True)
class VariableParameters:
    """A number of a topic, and its display."""

    topic: str
    field: FieldPath
    frame: str
    axis: UnitVector  # in the frame
    colors: VariableColors
    unit: str
    scale_m: float  # meters of arrow per unit; 0: text only
    offset: float  # value at which the arrow has length 0
    label: str
    offset_param: str = ''  # parameter that holds the offset; empty: none
    max_m: float = MAX_LENGTH_M  # maximum length of the arrow
    is_shown: bool = True  # drawn; limits are watched even for a hidden variable

    @staticmethod
    def read(parameters: Parameters) -> 'VariableParameters':
        """Return the checked parameters of a variable.

        Raises:
            ParameterError: a value is wrong.
        """
        return VariableParameters(
            topic=_topic(parameters), field=_field(parameters),
            frame=_required(parameters, 'frame').lstrip('/'), axis=_axis(parameters),
            colors=VariableColors.read(parameters), unit=parameters.text('unit', ''),
            scale_m=parameters.number('scale', variable_default('scale')),
            offset=parameters.number('offset', variable_default('offset')),
            label=parameters.text('label', ''), offset_param=_offset_param(parameters),
            max_m=parameters.number('max', MAX_LENGTH_M, above=0.0),
            is_shown=parameters.flag('shown', True))

    def to_parameters(self) -> Dict[str, Any]:
        """Return the parameters that ``read`` reads."""
        return {'topic': self.topic, 'field': str(self.field), 'frame': self.frame,
                'axis': list(self.axis), 'unit': self.unit, 'scale': self.scale_m,
                'offset': self.offset, 'label': self.label, **self.colors.to_parameters(),
                **changed({'offset_param': self.offset_param, 'max': self.max_m,
                           'shown': self.is_shown},
                          {'offset_param': '', 'max': MAX_LENGTH_M, 'shown': True})}


@dataclass(frozen=True)
class VariablesParameters:
    """The private parameters of the variable processor."""

    variables: List[VariableParameters]
    text_frame: str = ''  # empty: each text is beside its own arrow
    text_position: Optional[Tuple[float, float, float]] = None  # [m] in the frame of the text
    text_height_m: float = 0.05
    marker_rate_hz: float = 30.0
    stale_after_s: float = STALE_AFTER_S

    @staticmethod
    def read(parameters: Parameters) -> 'VariablesParameters':
        """Return the checked parameters.

        Raises:
            ParameterError: a value is wrong, or there is no variable.
        """
        variables = [VariableParameters.read(group) for group in parameters.groups('variables')]
        if not variables:
            raise parameters.error('variables', 'a list of at least one variable', variables)
        text = parameters.group('text')
        return VariablesParameters(
            variables, text.frame('frame', ''),
            text.vector('position', (0.0, 0.0, 0.0)) if text.has('position') else None,
            text.number('height', VariablesParameters.text_height_m, above=0.0),
            parameters.number('marker_rate', VariablesParameters.marker_rate_hz, above=0.0),
            parameters.number('stale_after', STALE_AFTER_S, above=0.0))

    def to_parameters(self) -> Dict[str, Any]:
        """Return the variables, and values other than the defaults, as ``read`` reads them."""
        default = VariablesParameters([])
        text = changed({'frame': self.text_frame, 'height': self.text_height_m},
                       {'frame': '', 'height': default.text_height_m})
        if self.text_position is not None:
            text['position'] = list(self.text_position)
        return {'variables': [variable.to_parameters() for variable in self.variables],
                **({'text': text} if text else {}),
                **changed({'marker_rate': self.marker_rate_hz, 'stale_after': self.stale_after_s},
                          {'marker_rate': default.marker_rate_hz,
                           'stale_after': default.stale_after_s})}


def _required(parameters: Parameters, name: str) -> str:
    value = parameters.text(name, '')
    if not value:
        raise parameters.error(name, 'a name', value)
    return value


def _topic(parameters: Parameters) -> str:
    name = _required(parameters, 'topic')
    if not rosgraph.names.is_legal_name(name):
        raise parameters.error('topic', 'the name of a topic', name)
    return name


def _field(parameters: Parameters) -> FieldPath:
    text = parameters.text('field', variable_default('field'))
    try:
        return FieldPath(text)
    except ValueError:
        raise parameters.error('field', 'a field such as data, data[2] or wrench.force.z',
                               text) from None


def _offset_param(parameters: Parameters) -> str:
    name = parameters.text('offset_param', '')
    if name and not rosgraph.names.is_legal_name(name):
        raise parameters.error('offset_param', 'the name of a parameter', name)
    return name


def _axis(parameters: Parameters) -> UnitVector:
    x, y, z = axis = parameters.vector('axis', variable_default('axis'))
    length = math.hypot(*axis)
    if not 0.0 < length < math.inf:
        raise parameters.error('axis', 'a direction of three numbers', list(axis))
    return x / length, y / length, z / length
