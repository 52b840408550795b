# SPDX-License-Identifier: BSD-3-Clause
"""Boxes around the objects that a sensor sees now; their contents are expected from then on."""
from __future__ import annotations

import math
from typing import List, NamedTuple, Sequence, Tuple

from process_visualizer.cell.model import RegionOfInterest, SoughtObjects
from process_visualizer.health.near_objects import SeenObject

LOOK_S = 3.0
"""Time [s] for which a sensor is observed; a box covers all that is seen of an object in it."""
MARGIN_M = 0.03
"""Margin of the box around the object, on each side.

Nine edges out of ten are accurate to 1 cm + 1 % of the distance (3 cm at 2 m), and objects are not
put back at exactly the same position.
"""
_STILL_M_S, _STILL_M = 0.05, 0.05  # noise of velocities and centers of objects at rest
_PERSON_M, _PERSON_WIDTH_M = (1.3, 2.1), 1.0  # height; width with arms slightly spread
_MAX_WIDTH_M = 1.5  # more than a pallet
_WIDE = 'needs a box that is so wide that it would hide other things; write boxes into the file, ' \
        'each in a frame along which it is narrow'
_MAX_COORDINATE_M = 1000.0  # coordinates beyond this, or NaN, are outside any cell
_MILLIMETERS = 1000.0
_SAME_M = 1e-9

Looks = Sequence[Sequence[SeenObject]]
"""All objects of a sensor, in successive messages."""


class Expectation(NamedTuple):
    """Objects that can be expected, each with its box, and the others, each with the reason."""

    added: Tuple[Tuple[SeenObject, RegionOfInterest], ...]
    left_out: Tuple[Tuple[SeenObject, str], ...]

    @property
    def boxes(self) -> Tuple[RegionOfInterest, ...]:
        """The boxes without the objects."""
        return tuple(box for _seen, box in self.added)

    def added_lines(self) -> List[str]:
        """Return a line for each object that would be expected: size and distance."""
        return [f'object {seen.number}: {seen.size_text()}{_distance(seen)}'
                for seen, _box in self.added]

    def left_out_lines(self) -> List[str]:
        """Return a line for each object that would not be expected, with the reason."""
        return [f'object {seen.number} {reason}: {seen.size_text()}{_distance(seen)}'
                for seen, reason in self.left_out]


def expectation(looks: Looks, sought: SoughtObjects, frame: str) -> Expectation:
    """Return which objects of the last message can be expected; ``frame`` is the global frame.

    The boxes are aligned with that frame, and their sides lie at whole millimeters.
    """
    *_, latest = looks or [()]
    added: List[Tuple[SeenObject, RegionOfInterest]] = []
    left_out: List[Tuple[SeenObject, str]] = []
    for seen in sorted(latest, key=lambda it: it.number):
        sights = [it for look in looks for it in look if it.number == seen.number]
        reason = _hindrance(seen, sights)
        extent = _Extent.around([it for it in sights if it.is_seen] or [seen])
        if reason or extent.is_wide():
            left_out.append((seen, reason or _WIDE))
        elif any(extent.is_in(box) for box in sought.expected if box.frame == frame):
            left_out.append((seen, 'is expected already'))
        else:
            added.append((seen, extent.box(frame, sought)))
    return Expectation(tuple(added), tuple(left_out))


def _hindrance(seen: SeenObject, sights: Sequence[SeenObject]) -> str:
    """Return why an object cannot be expected; '' if it can."""
    numbers = (*seen.center_m, *seen.size_m, seen.yaw_rad, seen.speed_m_s)
    if not all(abs(it) < _MAX_COORDINATE_M for it in numbers) or min(seen.size_m) < 0.0:
        return 'has no valid box'
    if not seen.is_confirmed:
        return 'is new and not confirmed'
    if not seen.is_seen:
        return 'is hidden'
    if max(it.speed_m_s for it in sights) > _STILL_M_S or any(
            math.dist(it.center_m, seen.center_m) > _STILL_M for it in sights):
        return 'moves'
    if _PERSON_M[0] <= seen.size_m[2] <= _PERSON_M[1] and max(seen.size_m[:2]) <= _PERSON_WIDTH_M:
        return 'may be a person; if not, write its box into the file'
    return ''


def _distance(seen: SeenObject) -> str:
    return f', {seen.distance_text()}' if seen.link else ''


class _Extent(NamedTuple):
    """The minimum and maximum coordinates [m] of what was seen of an object."""

    least: Tuple[float, ...]
    greatest: Tuple[float, ...]

    @classmethod
    def around(cls, sights: Sequence[SeenObject]) -> _Extent:
        corners = [_corners(it) for it in sights]
        return cls(tuple(map(min, zip(*(it.least for it in corners)))),
                   tuple(map(max, zip(*(it.greatest for it in corners)))))

    def is_wide(self) -> bool:
        """Return whether it is wide in both directions, such as a wall across the global frame."""
        return all(greatest - least > _MAX_WIDTH_M
                   for least, greatest in zip(self.least[:2], self.greatest[:2]))

    def is_in(self, box: RegionOfInterest) -> bool:
        return all(
            center - size / 2 <= least + _SAME_M and greatest - _SAME_M <= center + size / 2
            for least, greatest, center, size in zip(self.least, self.greatest, box.center,
                                                     box.size))

    def box(self, frame: str, sought: SoughtObjects) -> RegionOfInterest:
        x, y, z = [(_down_mm(least - MARGIN_M), -_down_mm(-greatest - MARGIN_M))
                   for least, greatest in zip(self.least, self.greatest)]
        return RegionOfInterest(frame, (_middle_m(x), _middle_m(y), _middle_m(z)),
                                (_length_m(x), _length_m(y), _length_m(z)), sought.location)


def _corners(seen: SeenObject) -> _Extent:
    """Return the extent of a box that is rotated by a yaw."""
    cos, sin = abs(math.cos(seen.yaw_rad)), abs(math.sin(seen.yaw_rad))
    length, width, height = seen.size_m
    spans = cos * length + sin * width, sin * length + cos * width, height
    return _Extent(tuple(center - span / 2 for center, span in zip(seen.center_m, spans)),
                   tuple(center + span / 2 for center, span in zip(seen.center_m, spans)))


def _down_mm(value_m: float) -> int:
    return math.floor(round(_MILLIMETERS * value_m, 6))  # 369.9999999 is 370


def _middle_m(side_mm: Tuple[int, int]) -> float:
    return sum(side_mm) / 2 / _MILLIMETERS


def _length_m(side_mm: Tuple[int, int]) -> float:
    return (side_mm[1] - side_mm[0]) / _MILLIMETERS
