# SPDX-License-Identifier: BSD-3-Clause
"""Arrows and texts of a serialized visualization_msgs/MarkerArray, read directly from its bytes."""
from __future__ import annotations

from enum import IntEnum
from struct import Struct, error
from typing import Iterator, List, NamedTuple

from process_visualizer.bagio.message_layout import (
    Data,
    MessageDamaged,
    checked_end,
    read_length,
    read_text,
)
from process_visualizer.robot.kinematics import Placement
from process_visualizer.robot.rotations import Triple

MARKERS = 'visualization_msgs/MarkerArray'
_STAMPED_BYTES = 12
_KIND = Struct('<iii')  # id, type, action
_SHAPE = Struct('<7d3d4f2i')  # pose, scale, color, lifetime
_POINT_BYTES, _COLOR_BYTES = 24, 16
_MAX_TEXT = 1000
FAR_M = 1e6
"""Maximum of the numbers in a scene: much greater ones do not fit into a frame."""
_NUMBERS = slice(0, 14)  # of a shape, without its lifetime


class MarkerType(IntEnum):
    """The types of visualization_msgs/Marker that a live page draws."""

    ARROW = 0
    TEXT = 9


class MarkerAction(IntEnum):
    """The actions of visualization_msgs/Marker."""

    ADD = 0
    DELETE = 2
    DELETE_ALL = 3


class SeenMarker(NamedTuple):
    """A marker: its pose in a frame, its size [m] and color (red green blue from 0 to 1).

    ``lifetime_s`` is 0 for a marker that does not expire.
    """

    namespace: str
    number: int
    kind: int
    action: int
    frame: str
    place: Placement
    size: Triple
    color: Triple
    lifetime_s: float
    text: str

    @property
    def vector(self) -> Triple:
        """Return the arrow's vector [m] in the frame; it points along the marker's x axis."""
        x, y, z, w = self.place.quaternion
        square = x * x + y * y + z * z + w * w or 1.0
        length_m = self.size[0]
        return (length_m * (w * w + x * x - y * y - z * z) / square,
                length_m * 2.0 * (x * y + w * z) / square,
                length_m * 2.0 * (x * z - w * y) / square)


def markers_in(data: Data) -> List[SeenMarker]:
    """Return the markers up to the first damaged one, without those with NaN or huge numbers."""
    found = []
    try:
        for marker in _markers(data):
            found.append(marker)
    except (MessageDamaged, error):
        return found
    return found


def _markers(data: Data) -> Iterator[SeenMarker]:
    count, position = read_length(data, 0)
    for _ in range(count):
        frame, position = read_text(data, position + _STAMPED_BYTES)
        namespace, position = read_text(data, position)
        number, kind, action = _KIND.unpack_from(data, position)
        shape = _SHAPE.unpack_from(data, position + _KIND.size)
        position += _KIND.size + _SHAPE.size + 1
        for size in (_POINT_BYTES, _COLOR_BYTES):
            length, position = read_length(data, position)
            position = checked_end(data, position, length * size)
        text, position = read_text(data, position)
        _, position = read_text(data, position)
        position += 1
        if not all(abs(it) < FAR_M for it in shape[_NUMBERS]):
            continue
        yield SeenMarker(_words(namespace), number, kind, action, _words(frame).strip('/'),
                         Placement(shape[0:3], shape[3:7]), shape[7:10], shape[10:13],
                         shape[14] + shape[15] / 1e9, _words(text)[:_MAX_TEXT])


def _words(data: bytes) -> str:
    return data.decode('utf-8', 'replace')
