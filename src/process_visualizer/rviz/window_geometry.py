# SPDX-License-Identifier: BSD-3-Clause
"""RViz's window: its place on the screen, and the docks beside the scene."""
from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Dict, NamedTuple, Optional, Tuple

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


# Shares of the launcher, RViz and the timeline on a screen.

MIN_LAUNCHER_PX, MIN_RVIZ_PX = 450, 480
"""Minimum usable widths."""
MIN_UPPER_PX, MIN_TIMELINE_PX = 300, 220
"""Minimum heights of RViz and of the timeline below it."""
_MIN_PART, _MAX_PART = 0.38, 0.42
"""Limits of the timeline's share of the screen's height; within them it gets what is left."""
_ENOUGH_UPPER_PX = 620


class WindowFrame(NamedTuple):
    """The window manager's frame around a window [px]."""

    left: int = 0
    top: int = 0
    right: int = 0
    bottom: int = 0


@dataclass(frozen=True)
class Sizes:
    """The operator's sizes for one screen [px]; None: a share of the screen's height."""

    launcher_width: int = 460
    timeline_height: Optional[int] = None
    is_right: bool = False
    """True if the launcher is to the right of RViz."""


class WindowPlaces(NamedTuple):
    """The windows' places: x and y of the corners of their frames, sizes without frames."""

    launcher: Rectangle
    rviz: Rectangle
    timeline: Rectangle


def places(room: Rectangle, frame: WindowFrame, sizes: Sizes) -> WindowPlaces:
    """Return places in the usable part of a screen that do not overlap.

    The launcher has the full height beside RViz; the timeline, which has no frame, is below RViz.
    On a screen that is too small, all windows are smaller than their minimum.
    """
    lower = _timeline_height(room.height, sizes)
    upper = room.height - lower
    sides = frame.left + frame.right
    width = _share(room.width, sizes.launcher_width + sides, MIN_LAUNCHER_PX + sides,
                   MIN_RVIZ_PX + sides)
    rest = room.width - width
    x, rviz_x = (rest, 0) if sizes.is_right else (0, width)
    return WindowPlaces(
        _inside(Rectangle(room.x + x, room.y, width, room.height), frame),
        _inside(Rectangle(room.x + rviz_x, room.y, rest, upper), frame),
        Rectangle(room.x + rviz_x, room.y + upper, max(rest, 1), max(lower, 1)))


def followed(sizes: Sizes, room: Rectangle, launcher: Rectangle, asked: Rectangle) -> Sizes:
    """Return the sizes after the operator has moved or resized the launcher.

    ``launcher`` is its current place, ``asked`` the place that was requested for it.
    """
    width = sizes.launcher_width if launcher.width == asked.width else launcher.width
    is_right = 2 * launcher.x + launcher.width > 2 * room.x + room.width
    return Sizes(width, sizes.timeline_height, is_right)


def _timeline_height(total: int, sizes: Sizes) -> int:
    wanted = sizes.timeline_height
    if wanted is None:
        wanted = round(min(max(_MIN_PART * total, total - _ENOUGH_UPPER_PX),
                           _MAX_PART * total))
    return _share(total, wanted, MIN_TIMELINE_PX, MIN_UPPER_PX)


def _share(total: int, wanted: int, least: int, least_rest: int) -> int:
    """Return the first of two parts of a length; in proportion if it is too short for both."""
    if total < least + least_rest:
        return max(total, 0) * least // (least + least_rest)
    return min(max(wanted, least), total - least_rest)


def _inside(outer: Rectangle, frame: WindowFrame) -> Rectangle:
    return Rectangle(outer.x, outer.y, max(outer.width - frame.left - frame.right, 1),
                     max(outer.height - frame.top - frame.bottom, 1))


def settings_of(sizes: Sizes) -> Tuple[int, Optional[int], bool]:
    """Return the sizes as plain values, to be stored."""
    return sizes.launcher_width, sizes.timeline_height, sizes.is_right


def sizes_from(values: object) -> Sizes:
    """Return stored sizes; the defaults if another version stored them in another form."""
    if isinstance(values, (list, tuple)) and len(values) == 3:
        width, height, is_right = values
        if isinstance(width, int) and (height is None or isinstance(height, int)):
            return Sizes(width, height, bool(is_right))
    return Sizes()
