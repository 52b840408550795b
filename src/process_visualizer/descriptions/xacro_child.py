# SPDX-License-Identifier: BSD-3-Clause
"""The program behind expand_xacro: expands one file and prints the result as JSON.

usage: python3 -m process_visualizer.descriptions.xacro_child FILE FOLDER [NAME:=VALUE …]

With a FOLDER the file is data: see xacro_limits.

It is a separate process because xacro keeps its state in its module.
"""
from __future__ import annotations

import json
import os
import re
import sys
from contextlib import redirect_stdout
from pathlib import Path
from types import TracebackType
from typing import Any, Dict, List, Mapping, Optional, Sequence, Set
from xml.dom import minidom
from xml.parsers.expat import ExpatError

import rospkg

from process_visualizer.descriptions.xacro_limits import LimitError, limit_this_process
from process_visualizer.descriptions.xacro_module import import_xacro, xacro_version
from process_visualizer.descriptions.xacro_place import XacroPlace, place_in_files

_ARGUMENT = re.compile(r'''<xacro:arg\s[^>]*?\bname\s*=\s*["']([^"']+)|'''
                       r'''\$\(arg\s+([^)\s]+)|\barg\(\s*["']([^"']+)''')
"""An argument in the place where a file declares or uses it."""


def main(arguments: List[str]) -> int:
    """Print the text of an expanded file, or the reason for the failure."""
    path, folder, given = arguments[0], arguments[1], arguments[2:]
    mappings = dict(argument.split(':=', 1) for argument in given)
    with redirect_stdout(sys.stderr):  # what a file prints is not the result
        result = _result(path, folder, mappings)
    json.dump(result, sys.stdout)
    return 0


def _result(path: str, folder: str, mappings: Dict[str, str]) -> Mapping[str, Any]:
    try:
        xacro = import_xacro()
    except ImportError:
        return {'missing': True}
    result: Dict[str, Any] = {'xacro': xacro_version(xacro)}
    try:
        files = _files_read()
        if folder:
            limit_this_process(folder)
        document = xacro.process_file(path, mappings=dict(mappings))
        result.update(files=sorted(files), text=document.toprettyxml(indent='  '),
                      unused=_unused(mappings, [path, *xacro.all_includes]))
    except Exception as error:  # a xacro file evaluates expressions, which can raise anything
        place = _place(xacro, path, error)
        result.update(message=' '.join((str(error) or repr(error)).split()),
                      package=_missing_package(error), argument=_missing_argument(error),
                      file=place.file, line=place.line)
    return result


def _files_read() -> Set[str]:
    """Return the set of the files that are opened from now on, other than Python's modules.

    They are those that are included, YAML files, and what says where packages are.
    """
    files: Set[str] = set()

    def take(event: str, values: Sequence[Any]) -> None:
        if event == 'open' and isinstance(values[0], str) \
                and not (values[0].endswith('.py') or '__pycache__' in values[0]):
            files.add(os.path.abspath(values[0]))

    sys.addaudithook(take)
    return files


def _unused(mappings: Mapping[str, str], files: List[str]) -> Dict[str, List[str]]:
    """Return arguments that no file mentions, each with those that the files have."""
    texts = [Path(file).read_text(encoding='utf-8', errors='replace') for file in files]
    known = {name for text in texts for names in _ARGUMENT.findall(text) for name in names if name}
    return {name: sorted(known) for name in mappings if name not in known}


def _missing_package(error: Exception) -> str:
    """Return the name of the package that was not found; '' if that is not the problem."""
    cause = getattr(error, 'exc', None)  # xacro's own errors carry the one that they wrap
    return str(cause.args[0]) if isinstance(cause, rospkg.ResourceNotFound) else ''


def _missing_argument(error: Exception) -> str:
    """Return the name of the argument without a value; '' if that is not the problem."""
    cause: Any = getattr(error, 'exc', None)
    return str(cause.args[0]) if type(cause).__name__ == 'ArgException' else ''


def _place(xacro: Any, path: str, error: Exception) -> XacroPlace:
    """Return where xacro stopped: in the innermost macro's file, or the last included file."""
    files = [file for file in (xacro.filestack or [path]) if file is not None] or [path]
    if isinstance(error, ExpatError):
        return XacroPlace(files[-1], error.lineno)
    macros = [macro.history[-1][-1] for macro in (xacro.macrostack or []) if macro.history]
    try:
        return place_in_files(_innermost_element(error.__traceback__),
                              [*reversed(macros), *reversed(files)], files[-1])
    except LimitError:  # the file that may not be read
        return XacroPlace(path, 0)


def _innermost_element(traceback: Optional[TracebackType]) -> Optional[minidom.Element]:
    """Return the element that was being expanded: xacro's functions call it ``node``."""
    found = None
    while traceback is not None:
        node = traceback.tb_frame.f_locals.get('node')
        if isinstance(node, minidom.Element):
            found = node
        traceback = traceback.tb_next
    return found


if __name__ == '__main__':
    sys.exit(main(sys.argv[1:]))
