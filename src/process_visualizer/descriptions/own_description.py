# SPDX-License-Identifier: BSD-3-Clause
"""A mark that distinguishes a cell's own robot descriptions from those of drivers."""
from __future__ import annotations

_MARK = 'made by process_visualizer for its own nodes'


def marked_description(text: str) -> str:
    """Return a URDF with a mark at its end, which says that a cell made it."""
    return f'{text.rstrip()}\n<!-- {_MARK} -->\n'


def is_own_description(text: str) -> bool:
    """Return whether a cell made a robot description, in whatever parameter it is found."""
    return text.rstrip().endswith(f'<!-- {_MARK} -->')
