# SPDX-License-Identifier: BSD-3-Clause
"""Unmodeled objects on a page: labeled boxes, each with a line to the robot."""
from __future__ import annotations

import math
from typing import Any, Dict, List, Optional, Sequence, Tuple

import numpy as np

from process_visualizer.bagio.recording import Recording
from process_visualizer.cell.model import Device, DeviceType
from process_visualizer.msg import DetectedObject, DetectedObjects
from process_visualizer.page.clouds import SentMessages
from process_visualizer.page.packed import Packed
from process_visualizer.page.robots import FramePlaces, PageSpan
from process_visualizer.robot.kinematics import Placement
from process_visualizer.ros_names import OBJECTS

HOLD_S = 0.8
"""Time for which an object is shown after its message, as in RViz (object_messages.cpp)."""
OBJECTS_HZ = 10.0
"""Maximum rate of the objects of a recorded run."""
MAX_OBJECTS = 50
"""Maximum number of objects per sensor; the nearest ones are kept."""
_COLORS = {DetectedObject.STOP: (1.0, 0.15, 0.1), DetectedObject.WARN: (1.0, 0.85, 0.0)}
_CLEAR_COLOR = 0.85, 0.9, 0.95
_FAR_M = 1e3

Entry = Dict[str, Any]
"""An object in JSON: sensor, number, ``at`` (position [m] and quaternion x y z w), size [m], text,
color, whether it is visible now, and ``line`` between object and robot [m], if there is a robot."""


class ShownObjects:
    """Keeps the last objects of each sensor; times [s] must not decrease."""

    def __init__(self) -> None:
        """Begin without objects."""
        self._seen: Dict[str, Tuple[float, List[Entry]]] = {}

    def take(self, sensor: str, message: DetectedObjects, place: Placement, time_s: float) -> None:
        """Store the objects of a sensor; ``place`` is the pose of their frame."""
        nearest = sorted(message.objects, key=lambda it: it.distance if it.link else math.inf)
        entries = (_entry(sensor, it, place) for it in nearest[:MAX_OBJECTS])
        self._seen[sensor] = time_s, [it for it in entries if it is not None]

    def at(self, time_s: float) -> List[Entry]:
        """Return the objects that are shown at a time."""
        return [it for seen_s, entries in self._seen.values() if time_s < seen_s + HOLD_S
                for it in entries]


def _entry(sensor: str, it: DetectedObject, place: Placement) -> Optional[Entry]:
    """Return an object as an entry of the page; None if its pose or size is invalid."""
    center, turn = it.pose.position, it.pose.orientation
    own = Placement((center.x, center.y, center.z), (turn.x, turn.y, turn.z, turn.w))
    size = it.size.x, it.size.y, it.size.z
    ends = [(end.x, end.y, end.z) for end in (it.on_object, it.on_robot)]
    numbers = [*own.position, *own.quaternion, *size, it.distance, *ends[0], *ends[1]]
    if not all(math.isfinite(number) and abs(number) < _FAR_M for number in numbers) \
            or not any(own.quaternion):
        return None
    moved = place.then(own)
    found = {'sensor': sensor, 'number': it.number,
             'at': _rounded([*moved.position, *moved.quaternion]), 'size': _rounded(size),
             'text': _text(it), 'color': _COLORS.get(it.level, _CLEAR_COLOR), 'seen': it.is_seen}
    if it.link:
        found['line'] = _rounded([number for end in ends
                                  for number in place.then(Placement(end)).position])
    return found


def _text(it: DetectedObject) -> str:
    """Return the label of the object, as in RViz."""
    size = ' x '.join(f'{100.0 * edge:.0f}' for edge in (it.size.x, it.size.y, it.size.z))
    distance = f'\n{it.distance:.2f} m to {it.link}' if it.link else ''
    return f'object {it.number}: {size} cm{distance}'


def _rounded(numbers: Sequence[float]) -> List[float]:
    return [round(it, 4) for it in numbers]


def object_track(devices: Sequence[Device], recording: Recording, places: FramePlaces,
                 packed: Packed, span: PageSpan) -> Dict[str, Any]:
    """Return the recorded objects as rows; each row holds until the next one.

    A recording has objects if the topic ``SENSOR/objects`` was recorded.
    """
    sensors = {it.name: SentMessages(recording, f'/{it.name}/{OBJECTS}', DetectedObjects)
               for it in devices if it.type is DeviceType.DEPTH_SENSOR}
    if not any(len(it.times_s) for it in sensors.values()):
        return {'times': packed.times(np.array([])), 'rows': []}
    shown, rows = ShownObjects(), {name: -1 for name in sensors}
    times_s: List[float] = []
    found: List[List[Entry]] = []
    for time_s in np.arange(span.begin_s, span.end_s, 1.0 / OBJECTS_HZ).tolist():
        for name, sent in sensors.items():
            row = sent.row(time_s)
            if row < 0 or row == rows[name]:
                continue
            rows[name], message = row, sent.message(row)
            place = None if message is None else places.find(message.header.frame_id.strip('/'))
            if isinstance(place, Placement):  # object_finder publishes in the global frame
                shown.take(name, message, place, float(sent.times_s[row]))
        entries = shown.at(time_s)
        if entries != (found[-1] if found else []):
            times_s.append(time_s)
            found.append(entries)
    return {'times': packed.times(np.array(times_s)), 'rows': found}
