# SPDX-License-Identifier: BSD-3-Clause
"""The mark by which a robot description that a cell has made is told from a driver's."""
from __future__ import annotations

_MARK = 'made by process_visualizer for its own nodes'


def marked_description(text: str) -> str:
    """Return a URDF that says at its end that a cell has made it."""
    return f'{text.rstrip()}\n<!-- {_MARK} -->\n'


def is_own_description(text: str) -> bool:
    """Whether a cell has made a robot description, for whatever parameter it is found in."""
    return text.rstrip().endswith(f'<!-- {_MARK} -->')
