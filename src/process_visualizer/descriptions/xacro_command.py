# SPDX-License-Identifier: BSD-3-Clause
"""The command xacro for launch files, if ROS has none (see compatibility/xacro)."""
from __future__ import annotations

import sys

from process_visualizer.descriptions.xacro_module import import_xacro, xacro_version


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
