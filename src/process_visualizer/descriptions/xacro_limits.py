# SPDX-License-Identifier: BSD-3-Clause
"""Limits of a model that is data: what it may read while xacro expands it.

xacro evaluates expressions as Python. Its own limits leave ways out (``vars``, a generator's
frame), and it includes and loads any file. So the process that expands such a model refuses, by
an audit hook, which nothing can take away again, whatever is not needed: other files, processes,
connections, and expressions that reach into Python.
"""
from __future__ import annotations

import ast
import importlib
import os
import re
import resource
import sys
from contextlib import suppress
from typing import Any, FrozenSet, Sequence

import rospkg

from process_visualizer.cell.errors import shortened

_MEMORY_BYTES, _TIME_S = 2_000_000_000, 30
_REFUSED = frozenset((
    'code', 'ctypes', 'fcntl', 'ftplib', 'function', 'gc', 'http', 'imaplib', 'mmap', 'nntplib',
    'os', 'pickle', 'poplib', 'pty', 'resource', 'setopencodehook', 'shutil', 'signal', 'smtplib',
    'socket', 'sqlite3', 'subprocess', 'syslog', 'telnetlib', 'tempfile', 'urllib',
    'webbrowser'))
"""First words of audit events."""
_HARMLESS = frozenset(('os.listdir', 'os.scandir', 'os.walk'))
_WRITING = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND
_EXPRESSIONS = ('<expression>', b'<expression>', '<string>', b'<string>')
"""What xacro calls ${…} and Python the text of $(eval …)."""
_REACHING = re.compile(r'_|(gi|cr|ag|tb|co|f|func)_')
"""Attributes of Python's own objects: of generators, frames, code, functions."""
_REACHING_NAMES = frozenset(('vars', 'mro', 'format', 'format_map', 'getattr', 'eval', 'exec'))
"""Without these nothing leads from a value to what Python knows of it, such as all classes."""
_NEEDED_LATER = ('yaml', 'xacro.substitution_args', 'roslaunch.substitution_args')
"""Modules that xacro, as its version may be, imports only when a file needs them."""
_VARIABLES = ('ROS_PACKAGE_PATH', 'ROS_ROOT')


class LimitError(Exception):
    """A model does what one of a recording may not; says what."""


def limit_this_process(folder: str) -> None:
    """From now on, let this process only read a folder and packages, and calculate.

    Environment variables that ROS does not need are gone.
    """
    for name in _NEEDED_LATER:
        with suppress(ImportError):
            importlib.import_module(name)
    packages = rospkg.RosPack()
    readable = frozenset(os.path.realpath(it) for it in (
        folder, *(packages.get_path(name) for name in packages.list())))
    for name in list(os.environ):
        if name not in _VARIABLES:
            del os.environ[name]
    resource.setrlimit(resource.RLIMIT_AS, (_MEMORY_BYTES, _MEMORY_BYTES))
    resource.setrlimit(resource.RLIMIT_CPU, (_TIME_S, _TIME_S))
    sys.addaudithook(lambda event, values: _check(event, values, readable))


def _check(event: str, values: Sequence[Any], readable: FrozenSet[str]) -> None:
    """Raise LimitError if an audit event may not happen."""
    if event == 'open':
        _check_open(values[0], int(values[2] or 0), readable)
    elif event == 'compile' and values[1] in _EXPRESSIONS:
        _check_expression(values[0])
    elif event.partition('.')[0] in _REFUSED and event not in _HARMLESS:
        raise LimitError(f'a model in a recording may not use {event}')


def _check_open(path: Any, flags: int, readable: FrozenSet[str]) -> None:
    if isinstance(path, int):
        return
    name = os.path.realpath(os.fsdecode(path))
    if flags & _WRITING:
        raise LimitError(f'a model in a recording may not write "{name}"')
    if os.path.basename(name) in ('package.xml', 'manifest.xml') or name.endswith(('.py', '.pyc')):
        return
    above = name
    while above not in readable:
        if os.path.dirname(above) == above:
            raise LimitError(f'a model in a recording may not read "{name}", which is in no '
                             'package')
        above = os.path.dirname(above)


def _check_expression(source: Any) -> None:
    """Raise LimitError for an expression that is more than a calculation."""
    if not isinstance(source, (str, bytes)):
        return
    try:
        tree = ast.parse(source.strip(), mode='eval')
    except SyntaxError:
        return  # xacro says so
    for node in ast.walk(tree):
        name = node.attr if isinstance(node, ast.Attribute) else \
            node.id if isinstance(node, ast.Name) else ''
        if name in _REACHING_NAMES or name.startswith('_') \
                or isinstance(node, ast.Attribute) and _REACHING.match(name) \
                or isinstance(node, (ast.GeneratorExp, ast.Lambda, ast.JoinedStr)):
            raise LimitError('a model in a recording may only calculate, which '
                             f'${{{shortened(_text(source))}}} is not')


def _text(source: 'str | bytes') -> str:
    return source if isinstance(source, str) else source.decode('utf-8', 'replace')
