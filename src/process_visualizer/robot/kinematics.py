# SPDX-License-Identifier: BSD-3-Clause
"""Kinematics: poses of a robot's links from the positions of its joints."""
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
"""Maximum position of a joint [rad or m]; computations with far greater numbers would overflow."""
MOVABLE = ('revolute', 'continuous', 'prismatic')
"""Types of URDF joints whose position is one number, as in movableJoints in C++."""


class Placement(NamedTuple):
    """Position [m] and rotation (x y z w) of a frame in an outer frame."""

    position: Triple = (0.0, 0.0, 0.0)
    quaternion: Quaternion = NO_ROTATION

    def then(self, inner: 'Placement') -> 'Placement':
        """Return the placement of an inner frame in the outer frame."""
        x, y, z = rotated(self.quaternion, inner.position)
        a, b, c = self.position
        return Placement((a + x, b + y, c + z), product(self.quaternion, inner.quaternion))

    def inverse(self) -> 'Placement':
        """Return the placement of the outer frame in this frame."""
        turn = conjugate(self.quaternion)
        x, y, z = rotated(turn, self.position)
        return Placement((-x, -y, -z), turn)


class Joint(NamedTuple):
    """The pose of a frame in its parent; not every type of URDF joint can be computed."""

    parent: str
    origin: Placement
    kind: str = 'fixed'
    name: str = ''  # of the joint whose position is used, which may be another one (mimic)
    axis: Triple = (1.0, 0.0, 0.0)
    multiplier: float = 1.0
    offset: float = 0.0

    def placement(self, positions: Mapping[str, float]) -> Optional[Placement]:
        """Return the placement of the child in the parent; None if the joint's position is unknown.

        A position beyond MAX_POSITION, or NaN, counts as unknown.
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
        """Return the joint for measured positions to which an offset must be added."""
        return self._replace(offset=self.offset + self.multiplier * offset)


class Kinematics:
    """The tree of a robot's links, with frames fixed to them."""

    def __init__(self, urdf: str = '<robot />') -> None:
        """Read a URDF.

        Raises:
            ValueError: the text is not XML, or has an invalid number.
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
        """The parent of each frame that has a joint."""
        return {child: joint.parent for child, joint in self._joints.items()}

    def fix(self, parent: str, frame: str, placement: Placement) -> None:
        """Add or move a frame fixed to another one; links placed by the model do not change."""
        if frame not in self._placed:
            self._joints[frame] = Joint(parent, placement)

    def placement(self, frame: str, base: str,
                  positions: Mapping[str, float]) -> Optional[Placement]:
        """Return the placement of a frame in another one that carries it.

        Args:
            frame, base: names; the base is the frame itself or one of its carriers.
            positions: joint positions by name [rad or m].

        Returns:
            None if the frames are not connected, or a joint between them has no position.
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
        """Yield parent, child and placement of each link moved by a joint with a known position."""
        for child, joint in self._joints.items():
            place = None if joint.kind == 'fixed' else joint.placement(positions)
            if place is not None:
                yield joint.parent, child, place

    def connection(self, frame: str, other: str,
                   positions: Mapping[str, float]) -> Optional[Placement]:
        """Return the placement of a frame in another one, through their common carrier.

        None as for ``placement``.
        """
        root = self._common(frame, other)
        inner = None if root is None else self.placement(frame, root, positions)
        outer = None if root is None else self.placement(other, root, positions)
        return None if inner is None or outer is None else outer.inverse().then(inner)

    def connects(self, frame: str, other: str) -> bool:
        """Return whether two frames are connected, independently of joint positions."""
        return self._common(frame, other) is not None

    def moves(self, frame: str, other: str) -> bool:
        """Return whether a moving joint is between two connected frames."""
        return bool(self.joints_between(frame, other))

    def joints_between(self, frame: str, other: str) -> List[str]:
        """Return the names of the moving joints between two connected frames."""
        root = self._common(frame, other)
        return [] if root is None else [
            joint.name for end in (frame, other) for joint in self._chain(end, root) or ()
            if joint.kind != 'fixed']

    def _common(self, frame: str, other: str) -> Optional[str]:
        """Return the first frame that carries both frames, which may be one of them."""
        for _ in range(len(self._joints) + 1):
            if self._chain(frame, other) is not None:
                return other
            joint = self._joints.get(other)
            if joint is None:
                return None
            other = joint.parent
        return None

    def joint(self, frame: str) -> Optional[Joint]:
        """Return the joint of a frame; None for a root or an unknown frame."""
        return self._joints.get(frame)

    def carriers(self, frame: str, base: str) -> Optional[List[str]]:
        """Return the frame and its carriers up to the base; None if the base does not carry it."""
        if self._chain(frame, base) is None:
            return None
        found = [frame]
        while found[-1] != base:
            found.append(self._joints[found[-1]].parent)
        return found

    def fixed_to(self, frame: str, base: str) -> str:
        """Return the frame nearest to the base to which a frame is fixed, without moving joints."""
        while frame != base and frame in self._joints and self._joints[frame].kind == 'fixed':
            frame = self._joints[frame].parent
        return frame

    def _chain(self, frame: str, base: str) -> Optional[List[Joint]]:
        """Return the joints from a frame to its carrier ``base``, or None."""
        joints: List[Joint] = []
        while frame != base:
            joint = self._joints.get(frame)
            if joint is None or len(joints) > len(self._joints):  # fixed frames may form a circle
                return None
            joints.append(joint)
            frame = joint.parent
        return joints


_DEEPEST = 100
"""Maximum depth of elements: programs descend recursively, including RViz."""


def urdf_root(text: str) -> ElementTree.Element:
    """Return the root element of a URDF.

    Raises:
        ValueError: the text is not XML, or its elements are nested too deeply.
    """
    try:
        root = ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        raise ValueError(f'not well-formed XML: {error}') from None
    level, depth = [root], 1
    while level:
        if depth > _DEEPEST:
            raise ValueError(f'elements are nested more than {_DEEPEST} deep')
        level, depth = [child for element in level for child in element], depth + 1
    return root


def origin_of(element: ElementTree.Element) -> Placement:
    """Return the pose of a URDF's joint or shape in its link.

    Raises:
        ValueError: the element has an invalid number.
    """
    origin = element.find('origin')
    if origin is None:
        return Placement()
    roll, pitch, yaw = triple(origin.get('rpy', '0 0 0'))
    x, y, z, w = quaternion_from_ypr((yaw, pitch, roll)).tolist()
    return Placement(triple(origin.get('xyz', '0 0 0')), (x, y, z, w))


def triple(text: str) -> Triple:
    """Return the three numbers in an attribute of a URDF.

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
