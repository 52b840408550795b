"""Which joints a robot has, and which measured angle belongs to which."""
from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from typing import List, Sequence, Tuple

MOVABLE_TYPES = ('revolute', 'continuous', 'prismatic')


def movable_joints(urdf: str) -> List[str]:
    """Return the names of the joints of a URDF that have a measurement, in the file's order.

    Joints that mimic another one are left out: robot_state_publisher computes them.

    Raises:
        ValueError: the text is not XML.
    """
    try:
        robot = ElementTree.fromstring(urdf)
    except ElementTree.ParseError as error:
        raise ValueError(f'the URDF is not XML: {error}') from None
    return [
        joint.get('name', '') for joint in robot.findall('joint')
        if joint.get('type') in MOVABLE_TYPES and joint.find('mimic') is None
    ]


def match_joints(robot_name: str, joint_names: Sequence[str], names: Sequence[str],
                 positions: Sequence[float]) -> Tuple[List[str], List[float]]:
    """Return names and positions [rad or m] of the robot's joints that a message has.

    Args:
        robot_name: a driver's name 'elbow' also stands for the joint 'robot_name/elbow'.
        joint_names: the robot's joints, in the order of a message without names.
        names: the message's names, or none at all.
        positions: the message's positions.

    Raises:
        ValueError: the numbers do not fit the joints, or no name is one of the robot's.
    """
    if not names:
        if len(positions) != len(joint_names):
            raise ValueError(f'{len(joint_names)} values are expected, one for each joint of '
                             f'{list(joint_names)}, not {len(positions)}')
        return list(joint_names), list(positions)
    if len(names) != len(positions):
        raise ValueError(f'{len(names)} joint names come with {len(positions)} positions')
    known = {name: name for name in joint_names}
    known.update((name[len(robot_name) + 1:], name) for name in joint_names
                 if name.startswith(robot_name + '/'))
    pairs = [(known[name], position) for name, position in zip(names, positions) if name in known]
    if not pairs:
        raise ValueError(f'none of the names {list(names)} is a joint of the robot; '
                         f'its joints are {list(joint_names)}')
    return [name for name, _ in pairs], [position for _, position in pairs]
