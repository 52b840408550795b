# SPDX-License-Identifier: BSD-3-Clause
"""Markers for RViz: arrows and numbers that are locked to the frame they act in.

RViz draws a frame_locked marker with the newest transform of its frame, like the robot itself. So
the marker never lags behind the robot (thesis figure 6.11). Its zero stamp means "the latest
transform".
"""
from __future__ import annotations

import math
from dataclasses import dataclass
from typing import List, NamedTuple, Optional, Sequence

import genpy
from geometry_msgs.msg import Point, Quaternion
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker

from process_visualizer.parameters.reading import Color
from process_visualizer.robot.arrows import ArrowStyle, format_age, format_value, line_of_block
from process_visualizer.robot.rotations import Vector, quaternion_turning_x_onto

STALE_COLOR: Color = (0.55, 0.55, 0.55, 1.0)
ARROW_ID, TEXT_ID = 0, 1
TEXT_PERIOD_S = 0.1  # numbers that change faster cannot be read
LIFETIME_S = 0.8
"""Time [s] after which RViz removes a marker that is not redrawn, so that none outlives its
process. Processes redraw at least ten times a second, even if nothing changes or the data is
stale."""


@dataclass(frozen=True)
class VectorSample:
    """The last value of a quantity, its time of arrival, and where it acts."""

    vector: Vector  # (3,) in the frame, in the quantity's unit
    frame: str
    time_s: float
    foot: Vector = (0.0, 0.0, 0.0)  # (3,) [m] in the frame: where the arrow begins

    def age_s(self, now_s: float) -> float:
        """Return the time [s] since the value arrived."""
        return max(0.0, now_s - self.time_s)


class RefreshRate:
    """Limits how often something happens: once per period."""

    def __init__(self, period_s: float) -> None:
        """``period_s`` is the length of the period [s]."""
        self._period_s = period_s
        self._next_s = -math.inf

    def hurry(self) -> None:
        """Allow the event at the next check, however recent the last one was."""
        self._next_s = -math.inf

    def wait(self, now_s: float) -> None:
        """Let a whole period pass from now on."""
        self._next_s = now_s + self._period_s

    def is_due(self, now_s: float, early_s: float = 0.0) -> bool:
        """Return whether the event may happen now; if so, it is not due again for a period.

        It may come early by ``early_s``, so that events with about this period are not skipped.
        """
        # After a clock was set back, start again.
        if self._next_s - self._period_s <= now_s < self._next_s - early_s:
            return False
        late_s = now_s - self._next_s
        # A small delay is compensated, so that the rate does not depend on how often it is checked.
        self._next_s = now_s + self._period_s - (late_s if 0.0 <= late_s < self._period_s else 0.0)
        return True


def value_text(style: ArrowStyle, value: float, age_s: float, stale_after_s: float) -> str:
    """Return the value with its unit; if it is stale, its age instead."""
    if age_s > stale_after_s:
        return format_age(style.label, age_s)
    return format_value(style.label, value, style.unit, style.decimals)


def vector_arrow(namespace: str, style: ArrowStyle, sample: VectorSample, stale: bool) -> Marker:
    """Return the arrow of a vector, gray if stale; below the threshold, return its deletion."""
    return _arrow(namespace, sample, style.length_m(sample.vector), style.diameter_m,
                  STALE_COLOR if stale else style.color)


def _arrow(namespace: str, sample: VectorSample, length_m: float, diameter_m: float,
           color: Color) -> Marker:
    """Return an arrow along a vector, or its deletion if the length is 0."""
    marker = _mortal_marker(namespace, ARROW_ID, sample.frame)
    if length_m > 0.0:
        shape_as_arrow(marker, sample.foot, sample.vector, length_m, diameter_m)
        marker.color = ColorRGBA(*color)
    else:
        marker.action = Marker.DELETE
    return marker


def shape_as_arrow(marker: Marker, foot: Vector, direction: Vector, length_m: float,
                   diameter_m: float) -> None:
    """Give a marker the shape of an arrow that begins at a foot (3,) [m]; see ArrowStyle."""
    marker.type = Marker.ARROW
    marker.scale.x, marker.scale.y, marker.scale.z = length_m, diameter_m, diameter_m
    marker.pose.position = Point(*foot)
    marker.pose.orientation = Quaternion(*quaternion_turning_x_onto(direction))


def text_marker(namespace: str, frame: str, position: Vector, text: str, height_m: float,
                color: Color) -> Marker:
    """Return a text that faces the viewer, centered at a position (3,) [m] in a frame."""
    marker = _mortal_marker(namespace, TEXT_ID, frame)
    marker.type = Marker.TEXT_VIEW_FACING
    marker.text = text
    marker.scale.z = height_m
    marker.pose.position = Point(*position)
    marker.color = ColorRGBA(*color)
    return marker


def frame_marker(namespace: str, number: int, frame: str, color: Color) -> Marker:
    """Return a shapeless marker in a frame; it disappears unless it is redrawn."""
    marker = _mortal_marker(namespace, number, frame)
    marker.color = ColorRGBA(*color)
    return marker


def deletion(namespace: str, number: int, frame: str) -> Marker:
    """Return the deletion of a marker."""
    marker = _marker(namespace, number, frame)
    marker.action = Marker.DELETE
    return marker


def invisible_marker(namespace: str, frame: str) -> Marker:
    """Return an invisible marker: RViz warns about a display that has received no marker."""
    marker = _mortal_marker(namespace, 0, frame)
    marker.type = Marker.SPHERE
    marker.scale.x = marker.scale.y = marker.scale.z = 1e-4
    marker.color.a = 1e-3
    return marker


def mesh_marker(namespace: str, frame: str, resource: str) -> Marker:
    """Return a mesh with its own materials at a frame's origin; resource is its URL."""
    marker = _marker(namespace, 0, frame)
    marker.type = Marker.MESH_RESOURCE
    marker.mesh_resource = resource
    marker.mesh_use_embedded_materials = True
    marker.scale.x = marker.scale.y = marker.scale.z = 1.0
    return marker


def text_color(color: Optional[Color]) -> Color:
    """Return a light variant of an arrow's color, readable on a dark background."""
    red, green, blue, _ = STALE_COLOR if color is None else color
    light = [0.65 + 0.35 * part for part in (red, green, blue)]
    return light[0], light[1], light[2], 1.0


def _mortal_marker(namespace: str, number: int, frame: str) -> Marker:
    marker = _marker(namespace, number, frame)
    marker.lifetime = genpy.Duration.from_sec(LIFETIME_S)
    return marker


def _marker(namespace: str, number: int, frame: str) -> Marker:
    marker = Marker()
    marker.header.frame_id = frame
    marker.ns = namespace
    marker.id = number
    marker.frame_locked = True
    marker.pose.orientation.w = 1.0
    return marker


# Arrows with their values: shared by the displays of variables.

class ValuePlace(NamedTuple):
    """The position of a text: one line of a block that several values share."""

    frame: str
    position: Vector  # (3,) [m] in the frame: the middle of the block
    line: int = 0
    line_count: int = 1


class ShownValue(NamedTuple):
    """A value as an arrow and a text, gray if it is stale.

    ``namespace`` is that of its markers.
    """

    namespace: str
    sample: VectorSample
    length_m: float  # of the arrow; 0: no arrow
    diameter_m: float
    color: Color
    text: str
    place: ValuePlace
    is_stale: bool


class ValueBoard:
    """Makes the markers of values: arrows every time, texts only as often as they can be read."""

    def __init__(self, text_height_m: float) -> None:
        """``text_height_m`` is the height of the texts [m]."""
        self._text_height_m = text_height_m
        self._texts = RefreshRate(TEXT_PERIOD_S)

    def markers(self, values: Sequence[ShownValue], wall_s: float) -> List[Marker]:
        """Return the arrows, and the texts if they are due.

        Args:
            values: the values to show.
            wall_s: the present time [s] of a clock that is never paused.
        """
        markers = [_arrow(it.namespace, it.sample, it.length_m, it.diameter_m,
                          STALE_COLOR if it.is_stale else it.color) for it in values]
        if self._texts.is_due(wall_s):
            markers += [self._text(value) for value in values]
        return markers

    def _text(self, value: ShownValue) -> Marker:
        place = value.place
        return text_marker(value.namespace, place.frame, place.position,
                           line_of_block(value.text, place.line, place.line_count),
                           self._text_height_m,
                           text_color(None if value.is_stale else value.color))
