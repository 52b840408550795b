# SPDX-License-Identifier: BSD-3-Clause
"""The section 'Window Geometry' of an .rviz file: window size, and the docks that are shown."""
from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Dict, Optional

_WIDTH_FOR_DISPLAYS_PX = 1300
"""Minimum width with room for the list of displays beside the scene."""
_ASIDE_PX = 60
_DISPLAYS_PX, _DOCK_EDGES_PX, _BARS_PX = 345, 30, 90
"""Sizes in a window: list of displays, edges of the docks, and menu, tool and status bars."""
_STATE_WITHOUT_DISPLAYS = (
    '000000ff00000000fd00000001000000000000012c00000360fc0200000001fb0000001000440069007300700'
    '06c0061007900730000000024000003600000005e00ffffff00000474000003600000000400000004000000080'
    '0000008fc0000000100000002000000010000000a0054006f006f006c00730100000000ffffffff00000000000'
    '00000')
"""State as written by Qt (QMainWindow.saveState) for a window with RViz's tool bar and hidden
displays at the left, 300 pixels wide. RViz hides docks when it reads "Hide Left Dock", but only
visible ones, and none are visible before its window opens: so the state has to hide them."""
_DOCK_KEYS = ('Displays', 'Selection', 'Time', 'Tool Properties', 'Views')


@dataclass(frozen=True)
class Rectangle:
    """A part of a screen in (logical) pixels; x and y are those of its upper left corner."""

    x: int
    y: int
    width: int
    height: int


def scene_aspect(width: float, height: float) -> float:
    """Return width over height of the scene in a generated RViz window of a given size."""
    displays = 0 if width < _WIDTH_FOR_DISPLAYS_PX else _DISPLAYS_PX
    return max(width - displays - _DOCK_EDGES_PX, 1) / max(height - _BARS_PX, 1)


def moved_aside(geometry: Any, room: Rectangle) -> Dict[str, Any]:
    """Return the geometry of a second window that leaves the first one and its bars visible.

    ``room`` is the screen of the second window, which may be smaller than that of the first one. X
    and Y are below 0 on a screen to the left of the first one, or above it.
    """
    found = dict(geometry) if isinstance(geometry, dict) else {}
    for key in ('X', 'Y'):
        if isinstance(found.get(key), int):
            found[key] += _ASIDE_PX
    for key in ('Width', 'Height'):
        if isinstance(found.get(key), int):
            found[key] = max(found[key] - _ASIDE_PX, _ASIDE_PX)
    for size, place, first, length in (('Width', 'X', room.x, room.width),
                                       ('Height', 'Y', room.y, room.height)):
        if isinstance(found.get(size), int) and isinstance(found.get(place), int):
            found[size] = min(found[size], length)
            found[place] = min(max(found[place], first), first + length - found[size])
    return found


def window_geometry(rectangle: Rectangle, docks: Optional[Any] = None) -> Dict[str, Any]:
    """Return the section ``Window Geometry`` of an RViz file.

    ``docks`` is the same section of a file saved by the operator; it says which docks are shown.
    Without it, docks that an operator does not need are hidden: all but the list of displays, and
    the list too if the scene would be too small.
    """
    is_small = rectangle.width < _WIDTH_FOR_DISPLAYS_PX
    hidden = {key: {'collapsed': key != 'Displays' or is_small} for key in _DOCK_KEYS}
    state = {'QMainWindow State': _STATE_WITHOUT_DISPLAYS} if is_small else {}
    return {**hidden, **state, 'Hide Left Dock': is_small, 'Hide Right Dock': True,
            **(docks if isinstance(docks, dict) else {}),
            'X': rectangle.x, 'Y': rectangle.y, 'Width': rectangle.width,
            'Height': rectangle.height}
