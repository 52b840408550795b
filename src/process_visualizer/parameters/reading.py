# SPDX-License-Identifier: BSD-3-Clause
"""Reading of parameters: typed, checked, with errors that name the parameter."""
from __future__ import annotations

import math
from typing import Any, Dict, List, Mapping, Sequence, Tuple

Color = Tuple[float, float, float, float]  # red green blue alpha, 0 to 1
_SHOWN_CHARACTERS = 200


class ParameterError(ValueError):
    """A parameter has an invalid value; the text names the parameter and the expected value."""


class Parameters:
    """Typed reading of a (nested) dictionary of parameters; errors name the full parameter."""

    def __init__(self, values: Any, path: str) -> None:
        """Initialize with the parameters of a namespace as a dictionary, and the namespace."""
        if not isinstance(values, Mapping):
            raise ParameterError(f'parameter {path}: a group of parameters is expected, '
                                 f'not {shown(values)}')
        self._values = values
        self._path = path

    def group(self, name: str) -> 'Parameters':
        """Return the parameters below a name; an empty group if the name is not set."""
        return Parameters(self._values.get(name, {}), f'{self._path}/{name}')

    def groups(self, name: str) -> List['Parameters']:
        """Return the groups of parameters in a list; no groups if the list is not set."""
        values = self._values.get(name, [])
        if not isinstance(values, list):
            raise self.error(name, 'a list of groups of parameters', values)
        return [Parameters(value, f'{self._path}/{name}[{index}]')
                for index, value in enumerate(values)]

    def texts(self, name: str) -> Dict[str, str]:
        """Return texts by their names; no texts if the group is not set."""
        values = self._values.get(name, {})
        if isinstance(values, list) and all(isinstance(it, str) for it in values):
            values = dict.fromkeys(values, '')
        if not isinstance(values, dict) or not all(
                isinstance(part, str) for pair in values.items() for part in pair):
            raise self.error(name, 'a dictionary of strings', values)
        return values

    def has(self, name: str) -> bool:
        """Return whether a parameter is set."""
        return name in self._values

    def text(self, name: str, default: str) -> str:
        """Return a string."""
        value = self._values.get(name, default)
        if not isinstance(value, str):
            raise self.error(name, 'a string', value)
        return value

    def flag(self, name: str, default: bool) -> bool:
        """Return true or false."""
        value = self._values.get(name, default)
        if not isinstance(value, bool):
            raise self.error(name, 'true or false', value)
        return value

    def choice(self, name: str, choices: Sequence[str]) -> str:
        """Return one of some texts; the first one if the parameter is not set."""
        value = self.text(name, choices[0])
        if value not in choices:
            raise self.error(name, ' or '.join(choices), value)
        return value

    def frame(self, name: str, default: str) -> str:
        """Return a frame's name without leading slash (tf2)."""
        return self.text(name, default).lstrip('/')

    def number(self, name: str, default: float, above: float = -math.inf,
               least: float = -math.inf) -> float:
        """Return a finite number greater than ``above`` and not less than ``least``."""
        value = self._values.get(name, default)
        if not is_number(value) or value <= above or value < least:
            bound = '' if above == -math.inf else f' above {above:g}'
            bound += '' if least == -math.inf else f' of {least:g} or more'
            raise self.error(name, f'a number{bound}', value)
        return float(value)

    def vector(self, name: str, default: Tuple[float, float, float]) -> Tuple[float, float, float]:
        """Return three finite numbers."""
        value = self._values.get(name, list(default))
        if not isinstance(value, list) or len(value) != 3 or not all(map(is_number, value)):
            raise self.error(name, 'a list of three numbers', value)
        return float(value[0]), float(value[1]), float(value[2])

    def color(self, name: str, default: Color) -> Color:
        """Return a color given as 'r g b' or 'r g b a', or as such a list; values from 0 to 1."""
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
        """Return the error for a parameter with a value other than the expected one."""
        return ParameterError(f'parameter {self._path}/{name}: {expected} is expected, '
                              f'not {shown(value)}')


def shown(value: Any) -> str:
    """Return a value as text for a message; a long one is cut."""
    text = repr(value)
    return text if len(text) <= _SHOWN_CHARACTERS else f'{text[:_SHOWN_CHARACTERS]}…'


def is_number(value: Any) -> bool:
    """Return whether a parameter's value is a finite number."""
    return (isinstance(value, (int, float)) and not isinstance(value, bool)
            and math.isfinite(value))


def written_color(color: Color) -> List[float]:
    """Return a color as a parameter: without alpha if it is opaque."""
    return list(color[:3] if color[3] == 1.0 else color)


def opaque(color: Sequence[float]) -> Color:
    """Return an opaque color from red, green and blue (3,)."""
    red, green, blue = color
    return red, green, blue, 1.0


def changed(values: Mapping[str, Any], defaults: Mapping[str, Any]) -> Dict[str, Any]:
    """Return the values that differ from the defaults of their names."""
    return {name: value for name, value in values.items()
            if name not in defaults or value != defaults[name]}
