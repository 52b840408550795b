# SPDX-License-Identifier: BSD-3-Clause
"""The installed xacro, which finds packages of ROS 1; also the command (compatibility/xacro).

Noetic's xacro 1.14 finds packages by rospkg. Elsewhere xacro comes from PyPI, whose 2.x reads the
same files but asks the package index of ROS 2; here it gets an index with those of ROS 1.
"""
from __future__ import annotations

import os
import sys
from importlib import metadata
from typing import Any

_INDEX = os.path.join(os.path.dirname(os.path.abspath(__file__)), 'ros1_packages')


def import_xacro() -> Any:
    """Return the module xacro.

    Raises:
        ImportError: it is not installed.
    """
    sys.path.insert(0, _INDEX)
    import xacro
    return xacro


def xacro_version(xacro: Any) -> str:
    """Return the version of xacro, if known, and its folder."""
    folder = os.path.dirname(xacro.__file__)
    try:
        return f'xacro {metadata.version("xacro")} in {folder}'
    except metadata.PackageNotFoundError:
        return f'xacro in {folder}'


def main() -> None:
    """Run xacro with the command line; if it fails, say which xacro it was."""
    try:
        xacro = import_xacro()
    except ImportError:
        sys.exit(f'xacro: it is not installed for {sys.executable}; install it '
                 '(requirements/python.txt) or activate its virtual environment')
    try:
        xacro.main()
    except SystemExit as end:
        if end.code:
            print(f'({xacro_version(xacro)})', file=sys.stderr)
        raise
