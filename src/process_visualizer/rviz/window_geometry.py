# SPDX-License-Identifier: BSD-3-Clause
"""RViz's window: its place on the screen, and what it shows beside the scene."""
from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Dict, Optional

_WIDTH_FOR_DISPLAYS_PX = 1300
"""From this width on there is room for the list of displays beside the scene."""
_ASIDE_PX = 60
_DISPLAYS_PX, _DOCK_EDGES_PX, _BARS_PX = 345, 30, 90
"""Size of the list of displays, the docks' edges, and menu, tool and status bar in a window."""
_STATE_WITHOUT_DISPLAYS = (
    '000000ff00000000fd00000001000000000000012c00000360fc0200000001fb0000001000440069007300700'
    '06c0061007900730000000024000003600000005e00ffffff00000474000003600000000400000004000000080'
    '0000008fc0000000100000002000000010000000a0054006f006f006c00730100000000ffffffff00000000000'
    '00000')
"""State that Qt writes (QMainWindow.saveState) for a window with RViz's tool bar and hidden
displays at the left, 300 pixels wide. RViz hides docks when it reads "Hide Left Dock", but only if
they can be seen, which is impossible before its window opens: so the state has to hide them."""
_DOCK_KEYS = ('Displays', 'Selection', 'Time', 'Tool Properties', 'Views')


@dataclass(frozen=True)
class Rectangle:
    """A part of a screen in (logical) pixels; x and y of its upper left corner."""

    x: int
    y: int
    width: int
    height: int


def scene_aspect(width: int, height: int) -> float:
    """The width of the scene by its height in a generated window of RViz of that size."""
    displays = 0 if width < _WIDTH_FOR_DISPLAYS_PX else _DISPLAYS_PX
    return max(width - displays - _DOCK_EDGES_PX, 1) / max(height - _BARS_PX, 1)


def moved_aside(geometry: Any) -> Dict[str, Any]:
    """The same section for a second window, which leaves the first one to be seen, and its bars."""
    found = dict(geometry) if isinstance(geometry, dict) else {}
    for key, change in (('X', _ASIDE_PX), ('Y', _ASIDE_PX), ('Width', -_ASIDE_PX),
                        ('Height', -_ASIDE_PX)):
        if isinstance(found.get(key), int):
            found[key] = max(found[key] + change, _ASIDE_PX)
    return found


def window_geometry(rectangle: Rectangle, docks: Optional[Any] = None) -> Dict[str, Any]:
    """The section ``Window Geometry`` of an RViz file.

    ``docks`` is that section of a file that the operator has saved, which says which docks are
    shown. Otherwise docks that an operator does not need are hidden: all but the list of displays,
    and that one too if the scene would be too small.
    """
    is_small = rectangle.width < _WIDTH_FOR_DISPLAYS_PX
    hidden = {key: {'collapsed': key != 'Displays' or is_small} for key in _DOCK_KEYS}
    state = {'QMainWindow State': _STATE_WITHOUT_DISPLAYS} if is_small else {}
    return {**hidden, **state, 'Hide Left Dock': is_small, 'Hide Right Dock': True,
            **(docks if isinstance(docks, dict) else {}),
            'X': rectangle.x, 'Y': rectangle.y, 'Width': rectangle.width,
            'Height': rectangle.height}
