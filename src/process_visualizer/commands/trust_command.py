# SPDX-License-Identifier: BSD-3-Clause
"""The command ``cell trust``: packages whose nodes may run because a recording names them."""
from __future__ import annotations

import argparse
import sys

import rospkg

from process_visualizer.cell.substitution import package_advice
from process_visualizer.cell.trusted_packages import set_trusted, trust_file, trusted_packages
from process_visualizer.shown_text import say


def add_trust_options(command: argparse.ArgumentParser) -> None:
    """Add the options of ``cell trust``."""
    command.add_argument('packages', metavar='PACKAGE', nargs='*',
                         help='an installed package; default: list those that are trusted')
    command.add_argument('--remove', action='store_true', help='trust them no more')


def execute_trust(options: argparse.Namespace) -> int:
    """Change the list, or print it; return the exit code.

    Raises:
        OSError, ValueError: the list cannot be read or written.
    """
    known = rospkg.RosPack().list()
    for name in options.packages:
        if name not in known and not options.remove:
            say(f'cell: {package_advice(name)}', file=sys.stderr)
            return 1
    for name in options.packages:
        set_trusted(name, not options.remove)
    for name in sorted(trusted_packages()):
        say(name)
    if not options.packages and not trusted_packages():
        say(f'no package is trusted ({trust_file()})', file=sys.stderr)
    return 0
