"""Expands xacro files with the xacro of ROS 1."""
from __future__ import annotations

import rospkg

from process_visualizer.cell.substitution import package_advice


class XacroError(Exception):
    """A xacro file cannot be expanded; says which file and why."""


def expand_xacro(path: str) -> str:
    """The text of the expanded file; raises XacroError."""
    try:
        import xacro
    except ImportError:  # on Debian it is a Python package of its own, not everybody has it
        raise XacroError(f'{path}: xacro is not installed for this Python; install xacro 1.13 '
                         '(requirements/python.txt) or activate its virtual environment') from None
    try:
        return str(xacro.process_file(path).toprettyxml(indent='  '))
    except Exception as error:  # a xacro file evaluates expressions, which can raise anything
        # The stack of files ends with the included file in which xacro stopped.
        file = xacro.filestack[-1] if xacro.filestack else path
        raise XacroError(f'{file}: xacro: {_message(error)}') from None


def _message(error: Exception) -> str:
    cause = getattr(error, 'exc', None)  # xacro's own errors carry the one that they wrap
    if isinstance(cause, rospkg.ResourceNotFound):
        return package_advice(str(cause.args[0]))
    return ' '.join((str(error) or repr(error)).split())
