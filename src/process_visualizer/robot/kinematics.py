# SPDX-License-Identifier: BSD-3-Clause
"""Kinematics: poses of a robot's links, given the positions of its joints."""
from __future__ import annotations

import math
from typing import Dict, Iterator, List, Mapping, NamedTuple, Optional, Tuple
from xml.etree import ElementTree

from process_visualizer.robot.rotations import (
    NO_ROTATION,
    Quaternion,
    Triple,
    conjugate,
    product,
    quaternion_from_rotation_vector,
    quaternion_from_ypr,
    rotated,
)

MAX_POSITION = 1e6
"""Of a joint [rad or m]; numbers far beyond overflow where they are used."""
MOVABLE = ('revolute', 'continuous', 'prismatic')
"""URDF's kinds of joints whose position is one number; as movableJoints has it, in C++."""


class Placement(NamedTuple):
    """Position [m] and rotation (x y z w) of a frame in another one."""

    position: Triple = (0.0, 0.0, 0.0)
    quaternion: Quaternion = NO_ROTATION

    def then(self, inner: 'Placement') -> 'Placement':
        """Return the place, seen from outside, of what is placed in this frame."""
        x, y, z = rotated(self.quaternion, inner.position)
        a, b, c = self.position
        return Placement((a + x, b + y, c + z), product(self.quaternion, inner.quaternion))

    def inverse(self) -> 'Placement':
        """Return the place of the outside in this frame."""
        turn = conjugate(self.quaternion)
        x, y, z = rotated(turn, self.position)
        return Placement((-x, -y, -z), turn)


class Joint(NamedTuple):
    """The pose of a frame in its parent; not every kind of URDF's joints can be computed."""

    parent: str
    origin: Placement
    kind: str = 'fixed'
    name: str = ''  # of the joint whose position counts, which may be another one (mimic)
    axis: Triple = (1.0, 0.0, 0.0)
    multiplier: float = 1.0
    offset: float = 0.0

    def placement(self, positions: Mapping[str, float]) -> Optional[Placement]:
        """Return where the child is in the parent; None if the joint's position is not known.

        One beyond MAX_POSITION, or NaN, says nothing.
        """
        if self.kind == 'fixed':
            return self.origin
        value = positions.get(self.name)
        if value is None or self.kind not in MOVABLE or not abs(value) <= MAX_POSITION:
            return None
        value = self.multiplier * value + self.offset
        x, y, z = self.axis
        along = value * x, value * y, value * z
        if self.kind == 'prismatic':
            return self.origin.then(Placement(along))
        return self.origin.then(Placement(quaternion=quaternion_from_rotation_vector(along)))

    def measured_with(self, offset: float) -> 'Joint':
        """Return the joint for measured positions to which an offset has to be added."""
        return self._replace(offset=self.offset + self.multiplier * offset)


class Kinematics:
    """The tree of a robot's links, with frames that are fixed to them."""

    def __init__(self, urdf: str = '<robot />') -> None:
        """Read a URDF.

        Raises:
            ValueError: it is not XML, or has an invalid number.
        """
        root = urdf_root(urdf)
        self.links = [link.get('name', '') for link in root.findall('link')]
        self.collision_only = {link.get('name', '') for link in root.findall('link')
                               if link.find('visual') is None
                               and link.find('collision') is not None}
        self.joint_names = [element.get('name', '') for element in root.findall('joint')
                            if element.get('type') in MOVABLE and element.find('mimic') is None]
        self._joints: Dict[str, Joint] = {}
        for element in root.findall('joint'):
            child = element.find('child')
            if child is not None:
                self._joints[child.get('link', '')] = _joint(element)
        self._placed = frozenset(self._joints)

    @property
    def parents(self) -> Dict[str, str]:
        """The parent of each frame that a joint places."""
        return {child: joint.parent for child, joint in self._joints.items()}

    def fix(self, parent: str, frame: str, placement: Placement) -> None:
        """Add or move a frame that is fixed to another one; links that the model places stay."""
        if frame not in self._placed:
            self._joints[frame] = Joint(parent, placement)

    def placement(self, frame: str, base: str,
                  positions: Mapping[str, float]) -> Optional[Placement]:
        """Return where a frame is in another one that carries it.

        Args:
            frame, base: names; the base is the frame itself or one of those that carry it.
            positions: of joints by name, in rad or m.

        Returns:
            None where nothing connects them, or a joint between them has no position.
        """
        chain = self._chain(frame, base)
        if chain is None:
            return None
        found = Placement()
        for joint in chain:
            inner = joint.placement(positions)
            if inner is None:
                return None
            found = inner.then(found)
        return found

    def moved(self, positions: Mapping[str, float]) -> Iterator[Tuple[str, str, Placement]]:
        """Yield parent, child and place of each link that a joint with a known position moves."""
        for child, joint in self._joints.items():
            place = None if joint.kind == 'fixed' else joint.placement(positions)
            if place is not None:
                yield joint.parent, child, place

    def connection(self, frame: str, other: str,
                   positions: Mapping[str, float]) -> Optional[Placement]:
        """Return where a frame is in another one, whichever carries the other, or what both.

        None as of ``placement``.
        """
        root = self._common(frame, other)
        inner = None if root is None else self.placement(frame, root, positions)
        outer = None if root is None else self.placement(other, root, positions)
        return None if inner is None or outer is None else outer.inverse().then(inner)

    def connects(self, frame: str, other: str) -> bool:
        """Return whether two frames are connected, whatever the joints' positions."""
        return self._common(frame, other) is not None

    def moves(self, frame: str, other: str) -> bool:
        """Return whether a joint lies between two frames that are connected."""
        return bool(self.joints_between(frame, other))

    def joints_between(self, frame: str, other: str) -> List[str]:
        """Return the names of the joints that move one frame in another that is connected."""
        root = self._common(frame, other)
        return [] if root is None else [
            joint.name for end in (frame, other) for joint in self._chain(end, root) or ()
            if joint.kind != 'fixed']

    def _common(self, frame: str, other: str) -> Optional[str]:
        """Return the first frame that carries both, which may be one of them."""
        for _ in range(len(self._joints) + 1):
            if self._chain(frame, other) is not None:
                return other
            joint = self._joints.get(other)
            if joint is None:
                return None
            other = joint.parent
        return None

    def joint(self, frame: str) -> Optional[Joint]:
        """Return what places a frame; None for a root and for what is not known."""
        return self._joints.get(frame)

    def carriers(self, frame: str, base: str) -> Optional[List[str]]:
        """Return the frame and all that carry it up to the base; None if the base does not."""
        if self._chain(frame, base) is None:
            return None
        found = [frame]
        while found[-1] != base:
            found.append(self._joints[found[-1]].parent)
        return found

    def fixed_to(self, frame: str, base: str) -> str:
        """Return the frame nearest to the base that no moving joint parts from a frame."""
        while frame != base and frame in self._joints and self._joints[frame].kind == 'fixed':
            frame = self._joints[frame].parent
        return frame

    def _chain(self, frame: str, base: str) -> Optional[List[Joint]]:
        """Return the joints from a frame down to the base."""
        joints: List[Joint] = []
        while frame != base:
            joint = self._joints.get(frame)
            if joint is None or len(joints) > len(self._joints):  # static transforms may be a ring
                return None
            joints.append(joint)
            frame = joint.parent
        return joints


_DEEPEST = 100
"""Programs go down the elements of a model by calling themselves, RViz too."""


def urdf_root(text: str) -> ElementTree.Element:
    """Return the root element of a URDF.

    Raises:
        ValueError: it is not XML, or its elements are nested too deeply.
    """
    try:
        root = ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        raise ValueError(f'not well-formed XML: {error}') from None
    level, depth = [root], 1
    while level:
        if depth > _DEEPEST:
            raise ValueError(f'elements are nested more than {_DEEPEST} deep')
        level, depth = [child for it in level for child in it], depth + 1
    return root


def origin_of(element: ElementTree.Element) -> Placement:
    """Return the pose of a joint or a shape of a URDF in its link.

    Raises:
        ValueError: it has an invalid number.
    """
    origin = element.find('origin')
    if origin is None:
        return Placement()
    roll, pitch, yaw = triple(origin.get('rpy', '0 0 0'))
    x, y, z, w = quaternion_from_ypr((yaw, pitch, roll)).tolist()
    return Placement(triple(origin.get('xyz', '0 0 0')), (x, y, z, w))


def triple(text: str) -> Triple:
    """Return the three numbers of an attribute of a URDF.

    Raises:
        ValueError: there are not three numbers.
    """
    x, y, z = map(float, text.split())
    return x, y, z


def _joint(element: ElementTree.Element) -> Joint:
    axis, mimic = element.find('axis'), element.find('mimic')
    parent = element.find('parent')
    return Joint(
        parent='' if parent is None else parent.get('link', ''),
        origin=origin_of(element),
        kind=element.get('type', ''),
        name=element.get('name', '') if mimic is None else mimic.get('joint', ''),
        axis=(1.0, 0.0, 0.0) if axis is None else _unit(triple(axis.get('xyz', '1 0 0'))),
        multiplier=1.0 if mimic is None else float(mimic.get('multiplier', '1')),
        offset=0.0 if mimic is None else float(mimic.get('offset', '0')))


def _unit(axis: Triple) -> Triple:
    length = math.hypot(*axis) or 1.0
    return axis[0] / length, axis[1] / length, axis[2] / length
