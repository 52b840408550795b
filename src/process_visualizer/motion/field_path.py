# SPDX-License-Identifier: BSD-3-Clause
"""Finds one number in a message of any type by a path such as pose.position.x or data[2]."""
from __future__ import annotations

import re
from typing import Any, List, Tuple, Union

from process_visualizer.cell.suggestions import nearest

_PART = re.compile(r'([A-Za-z]\w*)((?:\[\d+\])*)\Z', re.ASCII)
_INDEX = re.compile(r'\[(\d+)\]')


class FieldPath:
    """A path of names and array indices from a message to a number.

    A message is anything that lists its fields in __slots__, as ROS' generated classes do.
    """

    def __init__(self, text: str) -> None:
        """Take the path's text.

        Raises:
            ValueError: it is not a path.
        """
        self._text = text
        self._steps: List[Union[str, int]] = []
        for part in text.split('.'):
            match = _PART.match(part)
            if match is None:
                raise ValueError(f'{text!r} is no field; write a path such as data, data[2] '
                                 'or wrench.force.z')
            self._steps.append(match.group(1))
            self._steps += [int(index) for index in _INDEX.findall(match.group(2))]

    def __str__(self) -> str:
        """Return the path as it was written."""
        return self._text

    @property
    def steps(self) -> Tuple[Union[str, int], ...]:
        """The names of fields and the indices of elements, from the message inwards."""
        return tuple(self._steps)

    def number(self, message: Any) -> Union[int, float]:
        """Return the number that the path leads to; a boolean is 0 or 1.

        Raises:
            ValueError: there is no such field or element, or it is no number; the text says what
                there is instead.
        """
        value, here = message, ''
        for step in self._steps:
            value = _element(value, here, step) if isinstance(step, int) else _field(
                value, here, step)
            here += f'[{step}]' if isinstance(step, int) else f'.{step}' if here else step
        if isinstance(value, (int, float)):  # a bool is an int too
            return value + 0
        raise ValueError(f'{here} is {_describe(value, here)}')


def _field(value: Any, here: str, name: str) -> Any:
    names = _names(value)
    if name in names:
        return getattr(value, name)
    if here and not names:
        raise ValueError(f'{here} is {_describe(value, here)}, and has no field {name}')
    meant = nearest(name, names)
    what = here or getattr(value, '_type', type(value).__name__)
    raise ValueError(f'{what} has no field {name}, it has {", ".join(names) or "none"}'
                     + (f'; did you mean {meant}?' if meant else ''))


def _element(value: Any, here: str, index: int) -> Any:
    if not _is_array(value):
        raise ValueError(f'{here} is {_describe(value, here)}, and no array')
    if index >= len(value):
        raise ValueError(f'{here}[{index}] is not there, {here} has {len(value)} elements')
    return value[index]


def _describe(value: Any, here: str) -> str:
    if isinstance(value, (int, float)):
        return 'a number'
    if isinstance(value, str):
        return 'a text'
    if _is_array(value):
        return f'an array of {len(value)} elements; write {here}[0] for the first'
    fields = ', '.join(f'{here}.{name}' for name in _names(value))
    return f'no number but a group; its fields are {fields}'


def _is_array(value: Any) -> bool:
    return isinstance(value, (list, tuple, bytes))  # rospy gives uint8[] as bytes


def _names(value: Any) -> List[str]:
    return list(getattr(value, '__slots__', ()))
