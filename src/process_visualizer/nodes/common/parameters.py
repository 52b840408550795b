# SPDX-License-Identifier: BSD-3-Clause
"""Private parameters of the nodes: read once, checked, with defaults and units in the names."""
from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, Dict, List, Mapping, Sequence, Tuple

import rospy

from process_visualizer.motion.arrows import FORCE_COLOR, VELOCITY_COLOR

_FEET = ('reported', 'tool_frame')  # where arrows begin
Color = Tuple[float, float, float, float]  # red green blue alpha, 0 to 1
STALE_AFTER_S = 0.7  # so that it is seen within a second, whatever else takes time


class ParameterError(ValueError):
    """A parameter has a value that cannot be used; the text says which and what is right."""


class Parameters:
    """Typed reading of a (nested) dictionary of parameters; errors name the full parameter."""

    def __init__(self, values: Any, path: str) -> None:
        """Take the parameters of a namespace as a dictionary, and the namespace."""
        if not isinstance(values, Mapping):
            raise ParameterError(f'parameter {path}: a group of parameters is expected, '
                                 f'not {values!r}')
        self._values = values
        self._path = path

    def group(self, name: str) -> 'Parameters':
        """Return the parameters below a name; none of them where the name is not set."""
        return Parameters(self._values.get(name, {}), f'{self._path}/{name}')

    def groups(self, name: str) -> List['Parameters']:
        """Return the groups of parameters in a list; none of them where it is not set."""
        values = self._values.get(name, [])
        if not isinstance(values, list):
            raise self.error(name, 'a list of groups of parameters', values)
        return [Parameters(value, f'{self._path}/{name}[{index}]')
                for index, value in enumerate(values)]

    def texts(self, name: str) -> Dict[str, str]:
        """Return texts by their names; none of them where it is not set."""
        values = self._values.get(name, {})
        if isinstance(values, list):
            values = {value: '' for value in values}
        if not isinstance(values, dict) or not all(
                isinstance(part, str) for pair in values.items() for part in pair):
            raise self.error(name, 'a group of texts', values)
        return values

    def has(self, name: str) -> bool:
        """Tell whether a parameter is set."""
        return name in self._values

    def text(self, name: str, default: str) -> str:
        """Return a string."""
        value = self._values.get(name, default)
        if not isinstance(value, str):
            raise self.error(name, 'a text', value)
        return value

    def choice(self, name: str, choices: Sequence[str]) -> str:
        """Return one of some texts; the first one where it is not set."""
        value = self.text(name, choices[0])
        if value not in choices:
            raise self.error(name, ' or '.join(choices), value)
        return value

    def frame(self, name: str, default: str) -> str:
        """Return a frame's name without leading slash (tf2)."""
        return self.text(name, default).lstrip('/')

    def number(self, name: str, default: float, above: float = -math.inf) -> float:
        """Return a finite number that is greater than a bound."""
        value = self._values.get(name, default)
        if not is_number(value) or value <= above:
            bound = '' if above == -math.inf else f' above {above:g}'
            raise self.error(name, f'a number{bound}', value)
        return float(value)

    def vector(self, name: str, default: Tuple[float, float, float]) -> Tuple[float, float, float]:
        """Return three finite numbers."""
        value = self._values.get(name, list(default))
        if not isinstance(value, list) or len(value) != 3 or not all(map(is_number, value)):
            raise self.error(name, 'a list of three numbers', value)
        return float(value[0]), float(value[1]), float(value[2])

    def color(self, name: str, default: Color) -> Color:
        """Return a colour given as 'r g b', 'r g b a', or such a list, each from 0 to 1."""
        value = self._values.get(name, list(default))
        try:
            numbers = [float(part) for part in (value.split() if isinstance(value, str) else value)]
        except (TypeError, ValueError):
            numbers = []
        if len(numbers) not in (3, 4) or not all(0.0 <= number <= 1.0 for number in numbers):
            raise self.error(name, 'three or four numbers from 0 to 1, as in 0 0.8 0.1', value)
        red, green, blue = numbers[:3]
        return red, green, blue, numbers[3] if len(numbers) == 4 else 1.0

    def error(self, name: str, expected: str, value: Any) -> ParameterError:
        """Return the error that a parameter has a value other than what is expected."""
        return ParameterError(f'parameter {self._path}/{name}: {expected} is expected, '
                              f'not {value!r}')


def is_number(value: Any) -> bool:
    """Tell whether a parameter's value is a finite number."""
    return (isinstance(value, (int, float)) and not isinstance(value, bool)
            and math.isfinite(value))


def private_parameters() -> Parameters:
    """Return all private parameters of this node, in one call to the master."""
    return Parameters(rospy.get_param('~', {}), rospy.get_name())


@dataclass(frozen=True)
class ArrowStyle:
    """How a quantity is shown: an arrow with its value and unit beside it."""

    label: str
    unit: str
    decimals: int
    scale_m: float  # length of the arrow per unit
    min_m: float  # limits of the length
    max_m: float
    threshold: float  # in the quantity's unit; below it there is no arrow
    color: Color
    diameter_m: float = 0.018  # of the shaft; the head has twice as much

    @staticmethod
    def read(parameters: Parameters, default: 'ArrowStyle') -> 'ArrowStyle':
        """Return a style with the parameters scale, min, max, threshold, color and diameter.

        Raises:
            ParameterError: a value is wrong.
        """
        style = ArrowStyle(
            label=default.label, unit=default.unit, decimals=default.decimals,
            scale_m=parameters.number('scale', default.scale_m, above=0.0),
            min_m=parameters.number('min', default.min_m, above=0.0),
            max_m=parameters.number('max', default.max_m, above=0.0),
            threshold=parameters.number('threshold', default.threshold),
            color=parameters.color('color', default.color),
            diameter_m=parameters.number('diameter', default.diameter_m, above=0.0),
        )
        if style.min_m > style.max_m:
            raise ParameterError(f'an arrow for {default.label}: min {style.min_m:g} m '
                                 f'is above max {style.max_m:g} m')
        return style


# The two often point the same way: the force is the thinner and mostly the longer one, so that
# both are seen.
VELOCITY_ARROW = ArrowStyle('v', 'm/s', 3, scale_m=3.5, min_m=0.05, max_m=0.5,
                            threshold=0.002, color=(*VELOCITY_COLOR, 1.0), diameter_m=0.02)
FORCE_ARROW = ArrowStyle('F', 'N', 1, scale_m=0.018, min_m=0.05, max_m=0.6,
                         threshold=0.5, color=(*FORCE_COLOR, 1.0), diameter_m=0.012)


@dataclass(frozen=True)
class TopicParameters:
    """A topic that a node reads; without a name the quantity is not there."""

    name: str = ''
    message_type: str = ''  # package/Type; empty: what the topic turns out to carry
    frame: str = ''  # of a tf topic: which frame
    parent_frame: str = ''  # in which the values are, where the message does not say it

    @staticmethod
    def read(parameters: Parameters) -> 'TopicParameters':
        """Return the topic of a group of parameters."""
        return TopicParameters(parameters.text('name', ''), parameters.text('msg', ''),
                               parameters.frame('frame', ''),
                               parameters.frame('parent_frame', ''))


@dataclass(frozen=True)
class TextParameters:
    """Where a robot's numbers stand (see motion.arrows.label_offset), and how large."""

    height_m: float = 0.05
    outward_m: float = 0.08
    up_m: float = 0.3  # past a wrist


@dataclass(frozen=True)
class RobotParameters:
    """The private parameters of the robot processor."""

    robot_name: str
    base_frame: str
    tool_frame: str
    force_frame: str
    joint_states: TopicParameters = TopicParameters()
    tool_center_frame: TopicParameters = TopicParameters()
    force_sensor: TopicParameters = TopicParameters()
    velocity_arrow: ArrowStyle = VELOCITY_ARROW
    force_arrow: ArrowStyle = FORCE_ARROW
    text: TextParameters = field(default_factory=TextParameters)
    marker_rate_hz: float = 30.0
    velocity_window_s: float = 0.2
    stale_after_s: float = STALE_AFTER_S
    foot_at_tool_frame: bool = False  # else arrows begin where the driver says that the tool is
    tool_limit_m: float = 0.01  # from here a reported tool is not where the model has it
    tool_limit_rad: float = 0.1
    link_prefix: str = ''  # what the configuration has put before the names of the model's links


def read_robot_parameters(parameters: Parameters, robot_name: str) -> RobotParameters:
    """Return the checked parameters of the robot processor.

    Args:
        parameters: the node's private ones.
        robot_name: the device's name, which is the node's namespace.

    Raises:
        ParameterError: a value is wrong.
    """
    topics, arrows, text, limit = (parameters.group(name)
                                   for name in ('topics', 'arrows', 'text', 'tool_limit'))
    tool_frame = parameters.frame('tool_frame', f'{robot_name}/tool')
    return RobotParameters(
        robot_name=robot_name,
        base_frame=parameters.frame('base_frame', f'{robot_name}/link0'),
        tool_frame=tool_frame,
        force_frame=parameters.frame('force_frame', tool_frame),
        joint_states=TopicParameters.read(topics.group('joint_states')),
        tool_center_frame=TopicParameters.read(topics.group('tool_center_frame')),
        force_sensor=TopicParameters.read(topics.group('force_sensor')),
        velocity_arrow=ArrowStyle.read(arrows.group('velocity'), VELOCITY_ARROW),
        force_arrow=ArrowStyle.read(arrows.group('force'), FORCE_ARROW),
        text=TextParameters(text.number('height', TextParameters.height_m, above=0.0),
                            text.number('outward', TextParameters.outward_m),
                            text.number('up', TextParameters.up_m)),
        marker_rate_hz=parameters.number('marker_rate', 30.0, above=0.0),
        velocity_window_s=parameters.number('velocity_window', 0.2, above=0.0),
        stale_after_s=parameters.number('stale_after', STALE_AFTER_S, above=0.0),
        foot_at_tool_frame=parameters.choice('arrow_foot', _FEET) == _FEET[1],
        tool_limit_m=limit.number('position', RobotParameters.tool_limit_m, above=0.0),
        tool_limit_rad=limit.number('angle', RobotParameters.tool_limit_rad, above=0.0),
        link_prefix=parameters.frame('link_prefix', ''),
    )
