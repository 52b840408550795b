# SPDX-License-Identifier: BSD-3-Clause
"""Shares of the launcher, RViz and the timeline on a screen."""
from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple, Optional, Tuple

from process_visualizer.rviz.window_geometry import Rectangle

LEAST_LAUNCHER_PX, LEAST_RVIZ_PX = 450, 480
"""Widths in which they can be used."""
LEAST_UPPER_PX, LEAST_TIMELINE_PX = 300, 220
"""Heights of the launcher and RViz, and of the timeline below them."""
_LEAST_PART, _MOST_PART = 0.38, 0.42
"""Of the height of the screen for the timeline: the more the launcher and RViz leave, the more."""
_ENOUGH_UPPER_PX = 620


class Frame(NamedTuple):
    """The window manager's frame around a window [px]."""

    left: int = 0
    top: int = 0
    right: int = 0
    bottom: int = 0


@dataclass(frozen=True)
class Sizes:
    """The operator's sizes for one screen [px]; None: a part of the screen's height."""

    launcher_width: int = 460
    timeline_height: Optional[int] = None
    is_right: bool = False
    """Whether the launcher is at the right of RViz."""


class Places(NamedTuple):
    """The windows' places: x and y of their frames' corners, sizes without frames."""

    launcher: Rectangle
    rviz: Rectangle
    timeline: Rectangle


def places(room: Rectangle, frame: Frame, sizes: Sizes, is_wide: bool) -> Places:
    """Return the places in the usable part of a screen: none overlaps another one.

    The timeline, which has no frame, is below RViz or, if it is wide, below both. On a screen that
    is too small for all, everything is smaller than it should be.
    """
    lower = _timeline_height(room.height, sizes)
    upper = room.height - lower
    sides = frame.left + frame.right
    width = _share(room.width, sizes.launcher_width + sides, LEAST_LAUNCHER_PX + sides,
                   LEAST_RVIZ_PX + sides)
    rest = room.width - width
    x, rviz_x = (rest, 0) if sizes.is_right else (0, width)
    timeline = Rectangle(room.x + (0 if is_wide else rviz_x), room.y + upper,
                         max(room.width if is_wide else rest, 1), max(lower, 1))
    return Places(
        _inside(Rectangle(room.x + x, room.y, width, upper if is_wide else room.height), frame),
        _inside(Rectangle(room.x + rviz_x, room.y, rest, upper), frame), timeline)


def followed(sizes: Sizes, room: Rectangle, launcher: Rectangle, asked: Rectangle) -> Sizes:
    """Return the sizes after the operator has moved or resized the launcher.

    ``launcher`` is its place, ``asked`` the one that it was given.
    """
    width = sizes.launcher_width if launcher.width == asked.width else launcher.width
    is_right = 2 * launcher.x + launcher.width > 2 * room.x + room.width
    return Sizes(width, sizes.timeline_height, is_right)


def _timeline_height(total: int, sizes: Sizes) -> int:
    wanted = sizes.timeline_height
    if wanted is None:
        wanted = round(min(max(_LEAST_PART * total, total - _ENOUGH_UPPER_PX),
                           _MOST_PART * total))
    return _share(total, wanted, LEAST_TIMELINE_PX, LEAST_UPPER_PX)


def _share(total: int, wanted: int, least: int, least_rest: int) -> int:
    """The part of a length that one of two gets; in proportion, if it is too short for both."""
    if total < least + least_rest:
        return max(total, 0) * least // (least + least_rest)
    return min(max(wanted, least), total - least_rest)


def _inside(outer: Rectangle, frame: Frame) -> Rectangle:
    return Rectangle(outer.x, outer.y, max(outer.width - frame.left - frame.right, 1),
                     max(outer.height - frame.top - frame.bottom, 1))


def settings_of(sizes: Sizes) -> Tuple[int, Optional[int], bool]:
    """Return the sizes as plain values, to be stored."""
    return sizes.launcher_width, sizes.timeline_height, sizes.is_right


def sizes_from(values: object) -> Sizes:
    """Return the sizes that were stored; the default ones if another version has stored them."""
    if isinstance(values, (list, tuple)) and len(values) == 3:
        width, height, is_right = values
        if isinstance(width, int) and (height is None or isinstance(height, int)):
            return Sizes(width, height, bool(is_right))
    return Sizes()
