# SPDX-License-Identifier: BSD-3-Clause
"""Decides the positions and sizes of the launcher, RViz and the timeline on a screen."""
from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, Optional, Tuple

from process_visualizer.rviz.window_geometry import Rectangle

MIN_LAUNCHER_PX, MIN_RVIZ_PX = 450, 480
"""Minimum usable widths."""
MIN_UPPER_PX, MIN_TIMELINE_PX = 300, 220
"""Minimum heights of RViz and of the timeline below it."""
_MIN_PART, _MAX_PART = 0.38, 0.42
"""Limits of the timeline's share of the screen's height; within them it gets what RViz leaves."""
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
