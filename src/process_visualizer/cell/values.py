# SPDX-License-Identifier: BSD-3-Clause
"""Converts the text of an attribute to a value; each function raises ValueError with advice.

Names follow ROS's rules for graph resource names; vectors are in m or rad, as the attribute says.
"""
from __future__ import annotations

import ast
import math
import operator
import re
from typing import Any, Callable, Dict, List, Tuple, Union

import yaml
from yaml.composer import Composer
from yaml.constructor import SafeConstructor
from yaml.parser import Parser
from yaml.reader import Reader
from yaml.resolver import Resolver
from yaml.scanner import Scanner

from process_visualizer.cell.errors import quoted

_GRAPH_NAME = r'[A-Za-z][A-Za-z0-9_]*(/[A-Za-z0-9_]+)*/?'
_NAME = r'[A-Za-z][A-Za-z0-9_]*'
_FIELD_PART = r'[A-Za-z][A-Za-z0-9_]*(\[[0-9]+\])?'

PATTERNS: Dict[str, str] = {
    'number': r'[+-]?([0-9]+(\.[0-9]*)?|\.[0-9]+)([eE][+-]?[0-9]+)?',
    'integer': r'[0-9]{1,9}',
    'boolean': r'[Tt][Rr][Uu][Ee]|[Ff][Aa][Ll][Ss][Ee]|1|0',
    'hex_color': r'#[0-9A-Fa-f]{6}',
    'name': _NAME,
    'names': rf'[ \t\r\n]*{_NAME}([ \t\r\n]+{_NAME})*[ \t\r\n]*',
    'topic': f'/?{_GRAPH_NAME}',
    'namespace': f'/?|/?{_GRAPH_NAME}',
    'resource': f'[~/]?{_GRAPH_NAME}',
    'frame': r'/*[A-Za-z0-9_][A-Za-z0-9_./-]*',
    'package': r'[A-Za-z][A-Za-z0-9_-]*',
    'executable': r'[^/ \t\r\n]+',
    'environment': r'[A-Za-z_][A-Za-z0-9_]*',
    'message': r'[A-Za-z][A-Za-z0-9_]*/[A-Za-z][A-Za-z0-9_]*',
    'field': rf'{_FIELD_PART}(\.{_FIELD_PART})*',
}
"""Regular expressions for whole values, valid in XML Schema, too."""

_COMPILED = {kind: re.compile(f'(?:{pattern})\\Z') for kind, pattern in PATTERNS.items()}
_BLANKS = ' \t\r\n'

Numbers = Tuple[float, ...]

COLORS: Dict[str, Tuple[float, float, float]] = {
    'red': (0.9, 0.1, 0.1), 'green': (0.1, 0.8, 0.2), 'blue': (0.2, 0.4, 1.0),
    'yellow': (1.0, 0.85, 0.0), 'cyan': (0.0, 0.85, 0.95), 'purple': (0.65, 0.25, 0.9),
    'orange': (1.0, 0.55, 0.1), 'white': (1.0, 1.0, 1.0), 'grey': (0.6, 0.6, 0.6),
}

AXES: Dict[str, Tuple[float, float, float]] = {
    'x': (1.0, 0.0, 0.0), 'y': (0.0, 1.0, 0.0), 'z': (0.0, 0.0, 1.0),
    '-x': (-1.0, 0.0, 0.0), '-y': (0.0, -1.0, 0.0), '-z': (0.0, 0.0, -1.0),
}


def number(text: str) -> float:
    """Return a finite number."""
    stripped = text.strip(_BLANKS)
    if stripped.lstrip('+-').lower() in ('nan', 'inf', 'infinity'):
        raise ValueError(f'{quoted(text)} is not a finite number; write one such as 0.5')
    value = float(_matched('number', stripped, 'is not a number; write one such as 0.5'))
    if not math.isfinite(value):
        raise ValueError(f'{quoted(text)} is too large; write a number such as 0.5')
    return value


def positive(text: str) -> float:
    """Return a finite number above 0."""
    value = number(text)
    if value <= 0:
        raise ValueError(f'{quoted(text)} must be greater than 0')
    return value


def length(text: str) -> float:
    """Return a finite number of at least 0."""
    value = number(text)
    if value < 0:
        raise ValueError(f'{quoted(text)} must not be less than 0')
    return value


SENSOR_NOISES = {'kinect': 0.0013, 'realsense': 0.0042, 'tof': 0.0017}
"""Standard deviations of depths at 1 m [m], by kind of sensor."""


def noise(text: str) -> float:
    """Return the standard deviation of depths at 1 m [m], from a kind of sensor or a number."""
    if text in SENSOR_NOISES:
        return SENSOR_NOISES[text]
    try:
        return positive(text)
    except ValueError:
        raise ValueError(f'{quoted(text)} is not the noise of a sensor; write '
                         f'{", ".join(SENSOR_NOISES)} or a number greater than 0, such as 0.002'
                         ) from None


def integer(text: str) -> int:
    """Return a whole number of at least 0."""
    return int(_matched('integer', text, 'is not a whole number; write one such as 22'))


def vector(text: str) -> Numbers:
    """Return three finite numbers, separated by spaces."""
    words = _words(text)
    if len(words) != 3:
        values = 'value' if len(words) == 1 else 'values'
        raise ValueError(f'{quoted(text)} has {len(words)} {values}; write three numbers '
                         'separated by spaces, such as "0 0 0.5"')
    return tuple(number(word) for word in words)


def size(text: str) -> Numbers:
    """Return three numbers above 0, separated by spaces."""
    values = vector(text)
    if min(values) <= 0:
        raise ValueError(f'{quoted(text)}: each edge length must be greater than 0')
    return values


def axis(text: str) -> Numbers:
    """Return a unit vector, from an axis name with an optional minus or three numbers."""
    if text in AXES:
        return AXES[text]
    try:
        values = vector(text)
    except ValueError:
        raise ValueError(f'{quoted(text)} is not a direction; write x, y, z, -x, -y, -z or three '
                         'numbers') from None
    largest = max(abs(value) for value in values)
    if largest < 1e-9:
        raise ValueError(f'{quoted(text)} has no direction; write a vector that is not zero')
    scaled = [value / largest for value in values]  # so that no square overflows
    norm = math.sqrt(sum(value * value for value in scaled))
    return tuple(value / norm for value in scaled)


def color(text: str) -> Numbers:
    """Return red, green, blue from 0 to 1, from a color name, #rrggbb, or three numbers."""
    if text in COLORS:
        return COLORS[text]
    if _COMPILED['hex_color'].match(text):
        return tuple(int(text[start:start + 2], 16) / 255 for start in (1, 3, 5))
    try:
        values = vector(text)
    except ValueError:
        values = (-1.0,)
    if min(values) < 0 or max(values) > 1:
        raise ValueError(f'{quoted(text)} is not a color; write #rrggbb, three numbers from 0 to '
                         '1, or one of ' + ', '.join(COLORS))
    return values


def boolean(text: str) -> bool:
    """Return the boolean of true or false (in upper or lower case), 1 or 0."""
    matched = _matched('boolean', text, 'is neither True nor False; write one of them')
    return matched.lower() in ('true', '1')


def text_value(text: str) -> str:
    """Return any text unchanged."""
    return text


def command_line(text: str) -> str:
    """Return a command line; if it has no quotation marks, white space becomes single spaces."""
    return text if '"' in text or "'" in text else ' '.join(_words(text))


def path_below(text: str) -> str:
    """Return a relative path that stays below its folder."""
    if text.startswith('/') or '..' in text.split('/') or not text.strip():
        raise ValueError(f'{quoted(text)} must be a path below the package, such as '
                         '"urdf/robot.xacro"')
    return text


def name(text: str) -> str:
    """Return a ROS base name: letters, digits and underscores, beginning with a letter."""
    return _matched('name', text, 'is not a valid name; use letters, digits and "_" and begin '
                                  'with a letter (no spaces, no "/")')


def names(text: str) -> Tuple[str, ...]:
    """Return names separated by spaces, without repetitions."""
    words = _words(_matched('names', text, 'is not a list of names; write them with spaces between '
                                           'them, such as "left right"'))
    if len(set(words)) < len(words):
        raise ValueError(f'{quoted(text)} has a name twice; write each one once')
    return tuple(words)


def topic(text: str) -> str:
    """Return a ROS graph name, which may contain slashes."""
    return _graph_name('topic', text)


def namespace(text: str) -> str:
    """Return a ROS graph name, or nothing (or "/") for the root."""
    return _graph_name('namespace', text)


def resource(text: str) -> str:
    """Return a ROS graph name that may be private (begin with "~")."""
    return _graph_name('resource', text)


def frame(text: str) -> str:
    """Return a tf2 frame name; a leading slash (as in the old tf) is stripped."""
    return _matched('frame', text, 'is not a valid frame name; use letters, digits, "_" and '
                                   '"/" without spaces').lstrip('/')


def package(text: str) -> str:
    """Return the name of a ROS package."""
    return _matched('package', text, 'is not a valid package name; use letters, digits, "_" and '
                                     '"-" and begin with a letter')


def executable(text: str) -> str:
    """Return the file name of an executable."""
    return _matched('executable', text, 'is not an executable; write its file name without a '
                                        'folder')


def environment(text: str) -> str:
    """Return the name of an environment variable."""
    return _matched('environment', text, 'is not a valid name; use letters, digits and "_"')


def message(text: str) -> str:
    """Return a message type such as sensor_msgs/JointState."""
    return _matched('message', text, 'is not a message type; write package/Type, such as '
                                     'sensor_msgs/JointState')


def field(text: str) -> str:
    """Return the path of a field that is a number, such as data[2] or pose.position.x."""
    return _matched('field', text, 'is not a field; write a path such as data, data[2] or '
                                   'pose.position.x')


def _words(text: str) -> List[str]:
    """Return the words between XML's white space (Python would also split at exotic spaces)."""
    return [word for word in re.split(f'[{_BLANKS}]+', text) if word]


def _graph_name(kind: str, text: str) -> str:
    if '//' in text:
        raise ValueError(f'{quoted(text)} has two slashes in a row; write one')
    return _matched(kind, text, 'is not a valid ROS name; use letters, digits, "_" and "/" and '
                                'begin with a letter').rstrip('/')


def _matched(kind: str, text: str, advice: str) -> str:
    if not _COMPILED[kind].match(text):
        raise ValueError(f'{quoted(text)} {advice}')
    return text


CONVERTERS: Dict[str, Callable[[str], object]] = {
    'number': number, 'positive': positive, 'length': length, 'noise': noise, 'integer': integer,
    'vector': vector, 'size': size, 'axis': axis, 'color': color, 'boolean': boolean,
    'text': text_value, 'command_line': command_line, 'path': path_below, 'name': name,
    'names': names, 'namespace': namespace, 'topic': topic, 'resource': resource, 'frame': frame,
    'package': package, 'executable': executable, 'environment': environment,
    'message': message, 'field': field, 'choice': text_value,
}
"""The converter of each kind of attribute in the table ``elements``."""


# Reads YAML as data, with angles as in rosparam, such as deg(90) and rad(pi/2).
#
# In every program that imports roslaunch, rosparam makes PyYAML's SafeLoader evaluate angles as
# Python code. The loader here uses only parts that rosparam does not change, and calculates angles
# itself.

_MAX_ANGLE = 200
_OPERATIONS: Dict[type, Callable[[float, float], float]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul,
    ast.Div: operator.truediv}


class _Loader(Reader, Scanner, Parser, Composer, SafeConstructor, Resolver):
    """PyYAML's SafeLoader as it is before rosparam changes it, with support for angles."""

    def __init__(self, text: str) -> None:
        Reader.__init__(self, text)
        Scanner.__init__(self)
        Parser.__init__(self)
        Composer.__init__(self)
        SafeConstructor.__init__(self)
        Resolver.__init__(self)


_loader: Any = _Loader  # PyYAML's classes have no types


def plain_yaml(text: str) -> Any:
    """Return the value of a YAML text.

    Raises:
        yaml.YAMLError, ValueError, RecursionError: the text is not usable YAML.
    """
    return yaml.load(text, Loader=_loader)


def _radians(loader: Any, node: Any) -> float:
    return _angle(loader, node, 'rad(', 1.0)


def _degrees(loader: Any, node: Any) -> float:
    return _angle(loader, node, 'deg(', math.pi / 180.0)


def _angle(loader: Any, node: Any, opening: str, unit: float) -> float:
    text = str(loader.construct_scalar(node)).strip()
    inner = text[len(opening):-1] if text.startswith(opening) else text
    try:
        if len(inner) > _MAX_ANGLE:
            raise ValueError
        return unit * _number(ast.parse(inner.strip(), mode='eval').body)
    except (ValueError, SyntaxError, ArithmeticError):
        raise ValueError(f'"{inner[:_MAX_ANGLE]}" is not an angle; write one such as deg(90) or '
                         'rad(pi/2)') from None


def _number(node: Union[ast.expr, ast.AST]) -> float:
    """Evaluate an expression of numbers and pi; ValueError for anything else."""
    if isinstance(node, ast.Constant) and type(node.value) in (int, float):
        return float(node.value)
    if isinstance(node, ast.Name) and node.id == 'pi':
        return math.pi
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, (ast.UAdd, ast.USub)):
        value = _number(node.operand)
        return -value if isinstance(node.op, ast.USub) else value
    if isinstance(node, ast.BinOp) and type(node.op) in _OPERATIONS:
        return _OPERATIONS[type(node.op)](_number(node.left), _number(node.right))
    raise ValueError


for _tag, _word, _construct in (('!radians', 'rad', _radians), ('!degrees', 'deg', _degrees)):
    _loader.add_constructor(_tag, _construct)
    _loader.add_implicit_resolver(_tag, re.compile(rf'^{_word}\([^\)]*\)$'), [_word[0]])
