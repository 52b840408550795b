# SPDX-License-Identifier: BSD-3-Clause
"""Reads YAML as data, with the angles of rosparam such as deg(90) and rad(pi/2).

rosparam teaches PyYAML's SafeLoader to evaluate angles as Python, in every program that imports
roslaunch. This loader is made of the parts that rosparam does not change, and calculates itself.
"""
from __future__ import annotations

import ast
import math
import operator
import re
from typing import Any, Callable, Dict, Union

import yaml
from yaml.composer import Composer
from yaml.constructor import SafeConstructor
from yaml.parser import Parser
from yaml.reader import Reader
from yaml.resolver import Resolver
from yaml.scanner import Scanner

_LONGEST_ANGLE = 200
_OPERATIONS: Dict[type, Callable[[float, float], float]] = {
    ast.Add: operator.add, ast.Sub: operator.sub, ast.Mult: operator.mul,
    ast.Div: operator.truediv}


class _Loader(Reader, Scanner, Parser, Composer, SafeConstructor, Resolver):
    """PyYAML's SafeLoader as it is before rosparam is imported, with angles."""

    def __init__(self, text: str) -> None:
        Reader.__init__(self, text)
        Scanner.__init__(self)
        Parser.__init__(self)
        Composer.__init__(self)
        SafeConstructor.__init__(self)
        Resolver.__init__(self)


_loader: Any = _Loader  # PyYAML's have no types


def plain_yaml(text: str) -> Any:
    """Return what a text says in YAML.

    Raises:
        yaml.YAMLError, ValueError, RecursionError: it is no YAML that can be used.
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
        if len(inner) > _LONGEST_ANGLE:
            raise ValueError
        return unit * _number(ast.parse(inner.strip(), mode='eval').body)
    except (ValueError, SyntaxError, ArithmeticError):
        raise ValueError(f'"{inner[:_LONGEST_ANGLE]}" is no angle; write one such as deg(90) or '
                         'rad(pi/2)') from None


def _number(node: Union[ast.expr, ast.AST]) -> float:
    """Calculate with numbers and pi; ValueError for anything else."""
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
