"""Turns the text of an attribute into a value; each function raises ValueError with advice.

Names follow ROS's rules for graph resource names; vectors are in m or rad as the attribute says.
"""
from __future__ import annotations

import math
import re
from typing import Callable, Dict, Tuple

_BASE_NAME = re.compile(r'[A-Za-z][A-Za-z0-9_]*\Z')
_GRAPH_NAME = re.compile(r'[~/]?[A-Za-z][A-Za-z0-9_/]*\Z')
_FRAME = re.compile(r'[A-Za-z0-9_][A-Za-z0-9_./-]*\Z')
_PACKAGE = re.compile(r'[A-Za-z][A-Za-z0-9_-]*\Z')
_MESSAGE = re.compile(r'[A-Za-z][A-Za-z0-9_]*/[A-Za-z][A-Za-z0-9_]*\Z')
_FIELD = re.compile(r'[A-Za-z]\w*(\[\d+\])?(\.[A-Za-z]\w*(\[\d+\])?)*\Z', re.ASCII)
_HEX_COLOR = re.compile(r'#([0-9a-fA-F]{2})([0-9a-fA-F]{2})([0-9a-fA-F]{2})\Z')

Numbers = Tuple[float, ...]

COLORS: Dict[str, Tuple[float, float, float]] = {
    'red': (0.9, 0.1, 0.1), 'green': (0.1, 0.8, 0.2), 'blue': (0.2, 0.4, 1.0),
    'yellow': (1.0, 0.85, 0.0), 'cyan': (0.0, 0.85, 0.95), 'purple': (0.65, 0.25, 0.9),
    'orange': (1.0, 0.55, 0.1), 'white': (1.0, 1.0, 1.0), 'grey': (0.6, 0.6, 0.6),
}

_AXES: Dict[str, Tuple[float, float, float]] = {
    'x': (1.0, 0.0, 0.0), 'y': (0.0, 1.0, 0.0), 'z': (0.0, 0.0, 1.0),
    '-x': (-1.0, 0.0, 0.0), '-y': (0.0, -1.0, 0.0), '-z': (0.0, 0.0, -1.0),
}


def number(text: str) -> float:
    """A finite number."""
    try:
        value = float(text)
    except ValueError:
        raise ValueError(f'"{text}" is not a number; write one such as 0.5') from None
    if not math.isfinite(value):
        raise ValueError(f'"{text}" is not a finite number; write one such as 0.5')
    return value


def positive(text: str) -> float:
    """A finite number above 0."""
    value = number(text)
    if value <= 0:
        raise ValueError(f'"{text}" must be greater than 0')
    return value


def length(text: str) -> float:
    """A finite number of at least 0."""
    value = number(text)
    if value < 0:
        raise ValueError(f'"{text}" must not be less than 0')
    return value


def vector(text: str) -> Numbers:
    """Three finite numbers, separated by spaces."""
    words = text.split()
    if len(words) != 3:
        raise ValueError(f'"{text}" has {len(words)} values; write three numbers separated by '
                         'spaces, such as "0 0 0.5"')
    return tuple(number(word) for word in words)


def size(text: str) -> Numbers:
    """Three numbers above 0, separated by spaces."""
    values = vector(text)
    if min(values) <= 0:
        raise ValueError(f'"{text}": each edge length must be greater than 0')
    return values


def axis(text: str) -> Numbers:
    """A unit vector: an axis name with an optional minus, or three numbers."""
    if text.strip() in _AXES:
        return _AXES[text.strip()]
    try:
        values = vector(text)
    except ValueError:
        raise ValueError(f'"{text}" is not a direction; write x, y, z, -x, -y, -z or three '
                         'numbers') from None
    norm = math.sqrt(sum(value * value for value in values))
    if norm < 1e-9:
        raise ValueError(f'"{text}" has no direction; write a vector that is not zero')
    return tuple(value / norm for value in values)


def color(text: str) -> Numbers:
    """Red, green, blue from 0 to 1: a colour name, #rrggbb, or three numbers."""
    if text in COLORS:
        return COLORS[text]
    match = _HEX_COLOR.match(text)
    if match:
        return tuple(int(part, 16) / 255 for part in match.groups())
    try:
        values = vector(text)
    except ValueError:
        values = (-1.0,)
    if min(values) < 0 or max(values) > 1:
        raise ValueError(f'"{text}" is not a colour; write #rrggbb, three numbers from 0 to 1, '
                         'or one of ' + ', '.join(COLORS))
    return values


def boolean(text: str) -> bool:
    """True or False in any case, 1 or 0."""
    known = {'true': True, '1': True, 'false': False, '0': False}
    try:
        return known[text.strip().lower()]
    except KeyError:
        raise ValueError(f'"{text}" is neither True nor False') from None


def text_value(text: str) -> str:
    """Any text; runs of white space (a line break in an attribute) become one space."""
    return ' '.join(text.split())


def path(text: str) -> str:
    """A relative path that stays below its folder."""
    if text.startswith('/') or '..' in text.split('/') or not text:
        raise ValueError(f'"{text}" must be a path below the package, such as "urdf/robot.xacro"')
    return text


def name(text: str) -> str:
    """A ROS base name: letters, digits and underscores, beginning with a letter."""
    return _matched(_BASE_NAME, text, 'is not a valid name; use letters, digits and "_" and begin '
                                      'with a letter (no spaces, no "/")')


def namespace(text: str) -> str:
    """A ROS graph name, possibly empty, with any slashes inside."""
    if text == '':
        return text
    _matched(_GRAPH_NAME, text, 'is not a valid ROS name; use letters, digits, "_" and "/" and '
                                'begin with a letter')
    if '//' in text:
        raise ValueError(f'"{text}" has two slashes in a row; write one')
    return text.rstrip('/')


def topic(text: str) -> str:
    """A ROS graph name that is not empty."""
    if not text:
        raise ValueError('the name is empty; write the name of a topic')
    return namespace(text)


def frame(text: str) -> str:
    """A tf2 frame name; a leading slash (tf's old way) is stripped."""
    stripped = text.lstrip('/')
    return _matched(_FRAME, stripped, 'is not a valid frame name; use letters, digits, "_" and '
                                      '"/" without spaces')


def package(text: str) -> str:
    """The name of a ROS package."""
    return _matched(_PACKAGE, text, 'is not a valid package name')


def message(text: str) -> str:
    """A message type such as sensor_msgs/JointState."""
    return _matched(_MESSAGE, text, 'is not a message type; write package/Type, such as '
                                    'sensor_msgs/JointState')


def field(text: str) -> str:
    """The path of a number in a message, such as data[2] or pose.position.x."""
    return _matched(_FIELD, text, 'is not a field; write a path such as data, data[2] or '
                                  'pose.position.x')


def _matched(pattern: 're.Pattern[str]', text: str, message_text: str) -> str:
    if not pattern.match(text):
        raise ValueError(f'"{text}" {message_text}')
    return text


CONVERTERS: Dict[str, Callable[[str], object]] = {
    'number': number, 'positive': positive, 'length': length, 'vector': vector, 'size': size,
    'axis': axis, 'color': color, 'boolean': boolean, 'text': text_value, 'path': path,
    'name': name, 'namespace': namespace, 'topic': topic, 'frame': frame, 'package': package,
    'message': message, 'field': field, 'choice': text_value,
}
"""The converter of each kind of attribute in the table ``language``."""
