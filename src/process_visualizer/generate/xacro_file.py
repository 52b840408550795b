"""Expands xacro files, with the xacro of ROS 1 or, where there is none, xacro 2."""
from __future__ import annotations

import json
import subprocess
import sys
from typing import Any, Dict, Mapping, Tuple

from process_visualizer.cell.substitution import package_advice

TIMEOUT_S = 60.0


class XacroError(Exception):
    """A xacro file cannot be expanded; says which file, where, and why."""


def expand_xacro(path: str, arguments: Tuple[Tuple[str, str], ...] = ()) -> str:
    """Return the text of the expanded file, given values for its ``<xacro:arg>`` elements.

    Raises:
        XacroError: it cannot be expanded.
    """
    result = _run(path, dict(arguments))
    if 'text' in result:
        return str(result['text'])
    if result.get('missing'):
        raise XacroError(f'{path}: xacro is not installed for {sys.executable}; install it '
                         '(requirements/python.txt) or activate its virtual environment')
    line = f':{result["line"]}' if result['line'] else ''
    message = package_advice(result['package']) if result['package'] else result['message']
    raise XacroError(f'{result["file"]}{line}: xacro: {message} (xacro {result["xacro"]})')


def _run(path: str, mappings: Mapping[str, str]) -> Dict[str, Any]:
    words = [f'{name}:={value}' for name, value in mappings.items()]
    command = [sys.executable, '-m', 'process_visualizer.generate.xacro_child', path, *words]
    try:
        done = subprocess.run(command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                              timeout=TIMEOUT_S, check=False)
    except subprocess.TimeoutExpired:
        raise XacroError(f'{path}: xacro did not finish within {TIMEOUT_S:g} s') from None
    try:
        result: Dict[str, Any] = json.loads(done.stdout)
    except ValueError:
        raise XacroError(f'{path}: xacro ended with status {done.returncode}; what it said '
                         'stands in the terminal') from None
    return result
