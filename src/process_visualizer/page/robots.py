# SPDX-License-Identifier: BSD-3-Clause
"""Poses of models' links from the recorded joints, in a run and in its reference run."""
from __future__ import annotations

import math
from typing import Any, Collection, Dict, List, Mapping, NamedTuple, Optional, Tuple, Union

import numpy as np

from process_visualizer.cell.model import Device
from process_visualizer.page.packed import Packed
from process_visualizer.robot.joints import JointTrack
from process_visualizer.robot.kinematics import MOVABLE, Joint, Kinematics, Placement
from process_visualizer.robot.placements import Placements, constant, interpolated, of_joint
from process_visualizer.robot.rotations import matrix_from_quaternion, quaternion_from_ypr
from process_visualizer.runs.comparison.ghost import GhostTrack

# Poses of frames in the cell's frame, over the time of a recording.

_TURN_STEPS = 32_767


class PageSpan(NamedTuple):
    """A part of a recording [s from its start]."""

    begin_s: float
    end_s: float

    def rows(self, times_s: np.ndarray) -> slice:
        """Return the rows of increasing times in the span, with one more on either side."""
        first, behind = np.searchsorted(times_s, (self.begin_s, np.nextafter(self.end_s, np.inf)))
        return slice(max(int(first) - 1, 0), int(behind) + 1)


class Moving(NamedTuple):
    """A moving pose at increasing ``times_s`` (n,); each pose holds until the next one.

    If ``is_between``, poses are interpolated linearly instead.
    """

    times_s: np.ndarray
    places: Placements
    is_between: bool = False


Place = Union[Placement, Moving]


class FramePlaces:
    """Frames by name; only frames that are referred to are written to the page."""

    def __init__(self, packed: Packed, span: PageSpan) -> None:
        """Initialize with the destination of the columns, and the shown part of the recording."""
        self._packed, self._span = packed, span
        self._frames: Dict[str, Place] = {}
        self._numbers: Dict[str, int] = {}
        self.entries: List[Dict[str, Any]] = []

    def add(self, frame: str, place: Place) -> None:
        """Add a frame; if it is known already, its first pose is kept."""
        self._frames.setdefault(frame, place)

    @property
    def count(self) -> int:
        """Return the number of known frames."""
        return len(self._frames)

    @property
    def names(self) -> Tuple[str, ...]:
        """Return the known frames."""
        return tuple(self._frames)

    def find(self, frame: str) -> Optional[Place]:
        """Return the pose of a frame; None if it is unknown."""
        return self._frames.get(frame)

    def number(self, frame: str) -> Optional[int]:
        """Return the number of a frame in ``entries``; None if its pose is unknown."""
        place = self._frames.get(frame)
        if place is None:
            return None
        if frame not in self._numbers:
            self._numbers[frame] = len(self.entries)
            self.entries.append(self.entry(place))
        return self._numbers[frame]

    def entry(self, place: Place) -> Dict[str, Any]:
        """Return a pose as an entry of the page."""
        if isinstance(place, Placement):
            return {'at': [*place.position, *place.quaternion]}
        rows = self._span.rows(place.times_s)
        positions, turns = (column[rows] for column in _whole(place))
        return {'times': self._packed.times(place.times_s[rows]),
                **({'between': True} if place.is_between else {}),
                'positions': self._packed.scaled(positions),
                'turns': self._packed.plain(np.rint(
                    _TURN_STEPS * _continuous(turns)).astype(np.int16))}


def _whole(place: Moving) -> Tuple[np.ndarray, np.ndarray]:
    """Return positions and quaternions with a row for each time, even if all rows are equal."""
    count = len(place.times_s)
    return (np.broadcast_to(place.places.positions, (count, 3)),
            np.broadcast_to(place.places.quaternions, (count, 4)))


def _continuous(turns: np.ndarray) -> np.ndarray:
    """Return unit quaternions, each with the sign nearest to its predecessor."""
    units: np.ndarray = turns / np.maximum(np.linalg.norm(turns, axis=1, keepdims=True), 1e-12)
    flips = np.cumprod(np.where((units[1:] * units[:-1]).sum(axis=1) < 0.0, -1.0, 1.0))
    units[1:] *= flips[:, np.newaxis]
    return units


_TICK_S = 1e-9
"""Time [s] between the two rows of a page around a jump."""
_MAX_STEP, _FINE_STEP = 0.02, 0.005
"""Maximum step of a joint between rows [rad or m]: lines are then accurate to 0.1 or 0.01 mm."""
_MAX_BETWEEN = 200


class RowsOfJoints(NamedTuple):
    """Positions [rad or m] by joint (n,) at ``times_s`` (n,); each row holds until the next one.

    If ``is_between``, positions are interpolated linearly instead.
    """

    times_s: np.ndarray
    positions: Dict[str, np.ndarray]
    is_between: bool = False


_MAX_ROWS = 60_000
"""Maximum rows of a robot: 8 min at 125 Hz; of more rows, every second, third, ... is kept."""


def held_rows(joints: Mapping[str, Tuple[np.ndarray, np.ndarray]], span: PageSpan) -> RowsOfJoints:
    """Return rows with the last position of each joint, as the robot in RViz has it.

    Args:
        joints: the increasing times of receipt [s] (n,) and the positions (n,) of each joint.
        span: the relevant part of the recording.
    """
    known = {name: (times_s[rows], values[rows]) for name, (times_s, values) in joints.items()
             for rows in [span.rows(times_s)] if len(times_s)}
    if not known:
        return RowsOfJoints(np.empty(0), {})
    times_s = np.unique(np.concatenate([it for it, _ in known.values()]))
    step = math.ceil(len(times_s) / _MAX_ROWS)
    times_s = times_s if step == 1 else np.append(times_s[:-1:step], times_s[-1])
    return RowsOfJoints(times_s, {
        name: values[rows_held(own_s, times_s)] for name, (own_s, values) in known.items()})


def rows_held(known_s: np.ndarray, times_s: np.ndarray) -> np.ndarray:
    """Return the row that holds at each time (m,): the last one up to it, or else the first."""
    return np.maximum(np.searchsorted(known_s, times_s, side='right') - 1, 0)


def fine_rows(track: JointTrack, max_step: float = _MAX_STEP) -> RowsOfJoints:
    """Return the rows of a track, with further rows where a joint moves far between two rows.

    Rows without positions are left out.
    """
    known = np.isfinite(track.positions).all(axis=1)
    times_s, positions = track.times_s[known], track.positions[known]
    if len(times_s) > 1:
        step = np.abs(np.diff(positions, axis=0)).max(axis=1)
        parts = np.clip(np.ceil(step / max_step), 1, _MAX_BETWEEN).astype(int)
        first = np.repeat(np.arange(len(parts)), parts)
        number = np.arange(len(first)) - np.repeat(np.cumsum(parts) - parts, parts)
        share = np.append(number / parts[first], 0.0)
        first = np.append(first, len(times_s) - 1)
        behind = np.minimum(first + 1, len(times_s) - 1)
        times_s = (1.0 - share) * times_s[first] + share * times_s[behind]
        share = share[:, np.newaxis]
        positions = (1.0 - share) * positions[first] + share * positions[behind]
    return RowsOfJoints(times_s, dict(zip(track.joints, positions.T)), True)


def link_places(kinematics: Kinematics, base: Place, rows: RowsOfJoints) -> Dict[str, Place]:
    """Return the poses of a model's links, and of the frames that are fixed to the model.

    A joint without positions is at 0.
    """
    found: Dict[str, Place] = {}
    for link in kinematics.links:
        chain: List[str] = []  # a model may name a child before its parent
        above: Optional[str] = link
        while above is not None and above not in found:
            chain.append(above)
            joint = kinematics.joint(above)
            above = None if joint is None else joint.parent
        for it in reversed(chain):
            joint = kinematics.joint(it)
            found[it] = base if joint is None else _moved_by(joint, found[joint.parent], rows)
    return found


def _moved_by(joint: Joint, parent: Place, rows: RowsOfJoints) -> Place:
    """Return the pose of a joint's child link."""
    if joint.kind not in MOVABLE:
        return carried(parent, joint.origin)
    if joint.name in rows.positions:
        moved = of_joint(joint, rows.positions[joint.name])
        outer = constant(parent) if isinstance(parent, Placement) else parent.places
        return Moving(rows.times_s, outer.then(moved), rows.is_between)
    return carried(parent, joint.placement({joint.name: 0.0}) or Placement())


def resampled(place: Moving, times_s: np.ndarray) -> Placements:
    """Return poses at other times (n,); outside the known times, the first or last pose holds."""
    positions, turns = _whole(place)
    if not place.is_between:
        held = rows_held(place.times_s, times_s)
        return Placements(positions[held], turns[held])
    rows = np.hstack((positions, turns))
    inside_s = np.clip(times_s, place.times_s[0], place.times_s[-1])
    found = interpolated(inside_s, place.times_s, rows, np.inf, slice(3, 7))
    return Placements(found[:, :3], found[:, 3:])


def moved_along(parent: Place, inner: Moving) -> Moving:
    """Return the pose of something that moves in a frame, which may also move."""
    if isinstance(parent, Placement):
        return inner._replace(places=constant(parent).then(inner.places))
    times_s = np.union1d(parent.times_s, inner.times_s)
    return Moving(times_s, resampled(parent, times_s).then(resampled(inner, times_s)),
                  parent.is_between or inner.is_between)


def standing_on(base: Place, rows: RowsOfJoints) -> Tuple[Place, RowsOfJoints]:
    """Return a robot's base and joints at common times, whichever of them moves."""
    if isinstance(base, Placement):
        return base, rows
    if not len(rows.times_s):
        return base, RowsOfJoints(base.times_s, {})
    times_s = np.union1d(base.times_s, rows.times_s)
    if not rows.is_between:
        held = rows_held(rows.times_s, times_s)
        return base._replace(times_s=times_s, places=resampled(base, times_s)), RowsOfJoints(
            times_s, {name: values[held] for name, values in rows.positions.items()})
    if not base.is_between:  # the base jumps to its next pose
        times_s = np.union1d(times_s, base.times_s - _TICK_S)
    times_s = times_s[(times_s >= rows.times_s[0]) & (times_s <= rows.times_s[-1])]
    return Moving(times_s, resampled(base, times_s), True), RowsOfJoints(times_s, {
        name: np.interp(times_s, rows.times_s, values)
        for name, values in rows.positions.items()}, True)


def carried(parent: Place, inner: Placement) -> Place:
    """Return the pose of something fixed to a frame."""
    if isinstance(parent, Placement):
        return parent.then(inner)
    return parent._replace(places=parent.places.then(constant(inner)))


def base_place(device: Device) -> Placement:
    """Return the pose of a device's model root in the cell."""
    if device.base is None:
        return Placement()
    x, y, z, w = (float(it) for it in quaternion_from_ypr(device.base.pose.ypr))
    return Placement(device.base.pose.xyz, (x, y, z, w))


def joints_without_data(kinematics: Kinematics, known: Collection[str]) -> List[str]:
    """Return the joints of a model for which nothing was recorded."""
    return [name for name in kinematics.joint_names if name not in known]


def shown_spans(track: JointTrack) -> List[Tuple[float, float]]:
    """Return start and end [s] of each part of a track with positions."""
    known = np.concatenate(([False], np.isfinite(track.positions).all(axis=1), [False]))
    edges = np.flatnonzero(np.diff(known.astype(np.int8))).reshape(-1, 2)
    return [(float(track.times_s[begin]), float(track.times_s[end - 1])) for begin, end in edges]


def deviation_entry(track: GhostTrack, kinematics: Kinematics, base: Placement, packed: Packed,
                    span: PageSpan) -> Optional[Dict[str, Any]]:
    """Return the deviation of a tool from the reference run, as an entry of the page.

    Rows are the tool's position in the reference run and the vector from there to its position in
    the run [m], in the cell's frame.
    """
    if not track.tool:
        return None
    there = JointTrack(track.there.joints, track.there.times_s, track.there.positions)
    both = fine_rows(JointTrack(
        tuple(f'{name}/{where}' for where in 'ab' for name in there.joints), there.times_s,
        np.hstack((there.positions, track.here))), _FINE_STEP)
    if not len(both.times_s):
        return None
    tools = [_tool(kinematics, track.tool, base, both, where) for where in 'ab']
    if None in tools:
        return None
    first, second = (np.broadcast_to(it.positions, (len(both.times_s), 3))
                     for it in tools if it is not None)
    rows = span.rows(both.times_s)
    return {'times': packed.times(both.times_s[rows]), 'shown': shown_spans(track.there),
            'rows': packed.plain(np.hstack((first, second - first))[rows].astype(np.float32))}


def _tool(kinematics: Kinematics, tool: str, base: Placement, both: RowsOfJoints,
          where: str) -> Optional[Placements]:
    rows = RowsOfJoints(both.times_s, {
        name[:-2]: values for name, values in both.positions.items() if name.endswith(f'/{where}')})
    place = link_places(kinematics, base, rows).get(tool)
    if place is None:
        return None
    return constant(place) if isinstance(place, Placement) else place.places


def upwards(base: Placement) -> List[float]:
    """Return the direction from a robot's tool to its numbers: the z axis of its base.

    So the numbers of a hanging robot do not overlap those of a standing one.
    """
    found: List[float] = matrix_from_quaternion(base.quaternion)[:, 2].tolist()
    return found
