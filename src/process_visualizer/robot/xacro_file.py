# SPDX-License-Identifier: BSD-3-Clause
"""Expansion of xacro files, with the xacro of ROS 1 or, if that is missing, xacro 2."""
from __future__ import annotations

import functools
import json
import os
import subprocess
import sys
import threading
import time
from typing import (
    Any,
    Callable,
    Dict,
    FrozenSet,
    Iterable,
    List,
    Mapping,
    Optional,
    Sequence,
    Tuple,
)

from process_visualizer.cell.errors import advice
from process_visualizer.cell.substitution import package_advice
from process_visualizer.robot.model_resources import packages_beside

Make = Callable[[], Tuple[str, Iterable[str]]]
"""Returns the text, and the paths of the files read for it."""
_FileState = Optional[Tuple[int, int]]
_SETTLED_NS = 2_000_000_000
"""Minimum age of a change: two earlier changes may have the same time on some file systems."""


class MadeText:
    """Caches a text; methods may be called in several threads."""

    def __init__(self, make: Make) -> None:
        """``make`` may raise anything; then nothing is cached."""
        self._make = make
        self._lock = threading.Lock()
        self._text: Optional[str] = None
        self._states: Dict[str, _FileState] = {}

    def get(self) -> str:
        """Return the text for the present state of the files."""
        with self._lock:
            if self._text is not None and _states(self._states) == self._states:
                return self._text
            return self._made()

    def _made(self) -> str:
        """Make the text; cache it unless a file has just changed, or changes meanwhile."""
        self._text, begin_ns = None, time.time_ns()
        text, paths = self._make()
        self._states = _states(paths)
        if all(state is None or state[0] < begin_ns - _SETTLED_NS
               for state in self._states.values()):
            self._text = text
        return text


def _states(paths: Iterable[str]) -> Dict[str, _FileState]:
    return {path: _state(path) for path in paths}


def _state(path: str) -> _FileState:
    """Return the time of the last change [ns] and the size [bytes]; None without the file."""
    try:
        found = os.stat(path)
    except OSError:
        return None
    return found.st_mtime_ns, found.st_size


TIMEOUT_S = 60.0
_PACKAGE_PATH = 'ROS_PACKAGE_PATH'


class XacroError(Exception):
    """A xacro file cannot be expanded; the text has file, line and reason."""


def expand_xacro(path: str, arguments: Tuple[Tuple[str, str], ...] = (),
                 confined_to: str = '') -> str:
    """Return the text of an expanded file, given values for its ``<xacro:arg>`` elements.

    The file is expanded again only if it, or a file read by it, has changed. A file ``confined_to``
    a folder is untrusted: it may only read files there and in packages, and calculate.

    Raises:
        XacroError: the file cannot be expanded.
    """
    return _text_of(path, arguments, confined_to, frozenset(os.environ.items())).get()


@functools.lru_cache(maxsize=64)
def _text_of(path: str, arguments: Tuple[Tuple[str, str], ...], confined_to: str,
             _environment: FrozenSet[Tuple[str, str]]) -> MadeText:
    """Return a cached text; the environment, which files can read, locates packages."""
    return MadeText(lambda: _expanded(path, arguments, confined_to))


def _expanded(path: str, arguments: Tuple[Tuple[str, str], ...],
              confined_to: str) -> Tuple[str, List[str]]:
    """Return the text of the expanded file, and the files read for it."""
    result = _run(path, dict(arguments), confined_to)
    if result.get('missing'):
        raise XacroError(f'{path}: xacro is not installed for {sys.executable}; install it '
                         '(requirements/python.txt) or activate its virtual environment')
    if 'text' not in result:
        line = f':{result["line"]}' if result['line'] else ''
        raise XacroError(f'{result["file"]}{line}: xacro: {_reason(result)} ({result["xacro"]})')
    for name, known in result['unused'].items():
        raise XacroError(f'{path}: {_unused(name, known)}')
    return str(result['text']), result['files']


def _reason(result: Mapping[str, Any]) -> str:
    if result['package']:
        return package_advice(result['package'])
    if result['argument']:
        name = result['argument']
        return (f'the argument "{name}" has no value; write <arg name="{name}" value="…" /> '
                'in <model>')
    return str(result['message'])


def _unused(name: str, known: Sequence[str]) -> str:
    return f'it has no argument "{name}"; ' + (advice(name, known) if known else 'leave it out')


def _environment(path: str, confined_to: str) -> Dict[str, str]:
    """Return the environment, with uninstalled packages beside the file unless it is untrusted."""
    beside = {} if confined_to else packages_beside(path)
    folders = [os.environ.get(_PACKAGE_PATH, ''), *beside.values()]
    return {**os.environ, _PACKAGE_PATH: os.pathsep.join(filter(None, folders))}


def _run(path: str, mappings: Mapping[str, str], confined_to: str) -> Dict[str, Any]:
    words = [f'{name}:={value}' for name, value in mappings.items()]
    command = [sys.executable, '-m', 'process_visualizer.robot.xacro_child',
               os.path.abspath(path), confined_to, *words]
    try:
        # Output of an untrusted model could control the terminal, or be endless.
        done = subprocess.run(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                              stderr=subprocess.DEVNULL if confined_to else None,
                              timeout=TIMEOUT_S, check=False, cwd=os.path.dirname(__file__),
                              env=_environment(path, confined_to))
    except subprocess.TimeoutExpired:
        raise XacroError(f'{path}: xacro did not finish within {TIMEOUT_S:g} s') from None
    try:
        result: Dict[str, Any] = json.loads(done.stdout)
    except ValueError:
        why = 'a model in a recording may take 30 s and 2 GB of memory' if confined_to \
            else 'see its output in the terminal'
        raise XacroError(f'{path}: xacro ended with status {done.returncode}; {why}') from None
    return result
