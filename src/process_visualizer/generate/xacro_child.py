"""The program behind expand_xacro: expands one file and prints the result as JSON.

usage: python3 -m process_visualizer.generate.xacro_child FILE [NAME:=VALUE …]

It is a process of its own because xacro keeps its state in its module. Noetic's xacro 1.14 finds
packages by rospkg. Elsewhere xacro comes from PyPI, whose 2.x reads the same files but asks the
package index of ROS 2; here it gets an index that holds the packages of ROS 1.
"""
from __future__ import annotations

import json
import os
import sys
from contextlib import redirect_stdout
from importlib import metadata
from types import TracebackType
from typing import Any, Dict, List, Mapping, Optional
from xml.dom import minidom
from xml.parsers.expat import ExpatError

import rospkg

from process_visualizer.generate.xacro_place import XacroPlace, place_in_files

_INDEX = os.path.join(os.path.dirname(os.path.abspath(__file__)), 'ros1_packages')


def main(arguments: List[str]) -> int:
    """Print the text of an expanded file, or the reason why there is none."""
    path, given = arguments[0], arguments[1:]
    mappings = dict(argument.split(':=', 1) for argument in given)
    with redirect_stdout(sys.stderr):  # what a file prints is not the result
        result = _result(path, mappings)
    json.dump(result, sys.stdout)
    return 0


def _result(path: str, mappings: Dict[str, str]) -> Mapping[str, Any]:
    sys.path.insert(0, _INDEX)
    try:
        import xacro
    except ImportError:
        return {'missing': True}
    result: Dict[str, Any] = {'xacro': _version(xacro)}
    try:
        document = xacro.process_file(path, mappings=mappings)
        result['text'] = document.toprettyxml(indent='  ')
    except Exception as error:  # a xacro file evaluates expressions, which can raise anything
        place = _place(xacro, path, error)
        result.update(message=' '.join((str(error) or repr(error)).split()),
                      package=_missing_package(error), file=place.file, line=place.line)
    return result


def _version(xacro: Any) -> str:
    """Return what tells which xacro it is: its version, and where that is not known its place."""
    try:
        return metadata.version('xacro')
    except metadata.PackageNotFoundError:
        return str(os.path.dirname(xacro.__file__))


def _missing_package(error: Exception) -> str:
    """Return the name of the package that was not found, if that is what is wrong, else ''."""
    cause = getattr(error, 'exc', None)  # xacro's own errors carry the one that they wrap
    return str(cause.args[0]) if isinstance(cause, rospkg.ResourceNotFound) else ''


def _place(xacro: Any, path: str, error: Exception) -> XacroPlace:
    """Return where xacro stopped: in the innermost macro's file, else the file included last."""
    files = [file for file in (xacro.filestack or [path]) if file is not None] or [path]
    if isinstance(error, ExpatError):
        return XacroPlace(files[-1], error.lineno)
    macros = [macro.history[-1][-1] for macro in (xacro.macrostack or []) if macro.history]
    return place_in_files(_innermost_element(error.__traceback__),
                          [*reversed(macros), *reversed(files)], files[-1])


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
