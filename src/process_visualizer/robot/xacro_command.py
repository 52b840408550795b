# SPDX-License-Identifier: BSD-3-Clause
"""The installed xacro with packages of ROS 1; also the command itself (compatibility/xacro).

Noetic's xacro 1.14 finds packages by rospkg. Elsewhere xacro comes from PyPI; its version 2 reads
the same files, but asks the package index of ROS 2, which is replaced here by one of ROS 1.
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
        ImportError: xacro is not installed.
    """
    sys.path.insert(0, _INDEX)
    import xacro
    return xacro


def xacro_version(xacro: Any) -> str:
    """Return version, if known, and folder of xacro."""
    folder = os.path.dirname(xacro.__file__)
    try:
        return f'xacro {metadata.version("xacro")} in {folder}'
    except metadata.PackageNotFoundError:
        return f'xacro in {folder}'


def main() -> None:
    """Run xacro with the command line; on failure, print its version and folder."""
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
