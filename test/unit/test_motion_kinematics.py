# SPDX-License-Identifier: BSD-3-Clause
"""Link poses of robots: known poses of the makers' arms, fixed frames, missing joints."""
from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from process_visualizer.robot.kinematics import Kinematics, Placement
from process_visualizer.robot.rotations import matrix_from_quaternion, matrix_from_ypr

DATA = Path(__file__).resolve().parents[1] / 'data'
UR = ('shoulder_pan_joint', 'shoulder_lift_joint', 'elbow_joint', 'wrist_1_joint',
      'wrist_2_joint', 'wrist_3_joint')


def model(name: str) -> Kinematics:
    return Kinematics((DATA / f'{name}.urdf').read_text())


def test_stretched_ur5e() -> None:
    found = model('ur5e').placement('tool0', 'base_link', dict.fromkeys(UR, 0.0))
    assert found is not None
    # The sums of the lengths in the maker's table, seen from base_link (half a turn from base).
    assert np.allclose(found.position, [0.8172, 0.2329, 0.0628], atol=1e-6)
    assert np.allclose(matrix_from_quaternion(found.quaternion)[:, 2], [0, 1, 0], atol=1e-6)


def test_panda_in_its_usual_pose() -> None:
    angles = (0.0, -math.pi / 4, 0.0, -3 * math.pi / 4, 0.0, math.pi / 2, math.pi / 4)
    positions = {f'panda_joint{number}': angle for number, angle in enumerate(angles, 1)}
    found = model('panda_hand').placement('panda_hand', 'panda_link0', positions)
    assert found is not None
    assert np.allclose(found.position, [0.307, 0.0, 0.590], atol=1e-3)
    assert np.allclose(matrix_from_quaternion(found.quaternion), np.diag([1, -1, -1]), atol=1e-6)


@pytest.mark.parametrize('value', [1e308, -1e308, math.inf, math.nan, 2e6])
@pytest.mark.parametrize('joint', ['panda_joint1', 'panda_finger_joint1'])
def test_a_joint_that_is_nowhere(joint: str, value: float) -> None:
    """Its sine ended the thread that draws the robot."""
    link = 'panda_link1' if joint == 'panda_joint1' else 'panda_leftfinger'
    found = model('panda_hand')
    base = 'panda_link0' if joint == 'panda_joint1' else 'panda_hand'
    assert found.placement(link, base, {joint: value}) is None
    assert found.placement(link, base, {joint: 0.01}) is not None


def test_a_finger_that_follows_another_one() -> None:
    found = model('panda_hand').placement('panda_rightfinger', 'panda_hand',
                                          {'panda_finger_joint1': 0.03})
    assert found is not None and np.allclose(found.position, [0.0, -0.03, 0.0584])


def test_frames_that_are_fixed_to_a_link() -> None:
    arm = model('panda')
    arm.fix('panda_link8', 'tip', Placement((0.0, 0.0, 0.1), (0.0, 0.0, 1.0, 0.0)))
    arm.fix('tip', 'end', Placement((0.2, 0.0, 0.0)))
    found = arm.placement('end', 'panda_link7', {})
    assert found is not None and np.allclose(found.position, [-0.2, 0.0, 0.207])
    arm.fix('elsewhere', 'panda_link8', Placement())  # the model's link stays
    assert arm.placement('panda_link8', 'panda_link7', {}) == Placement((0.0, 0.0, 0.107))


def test_what_is_not_known() -> None:
    arm = model('panda')
    assert arm.placement('panda_link8', 'panda_link0', {'panda_joint1': 0.0}) is None
    assert arm.placement('nowhere', 'panda_link0', {}) is None
    assert arm.placement('panda_link0', 'panda_link8', {}) is None
    arm.fix('a', 'b', Placement())
    arm.fix('b', 'a', Placement())
    assert arm.placement('a', 'panda_link0', {}) is None


@pytest.mark.parametrize('text', [
    '<robot', '<robot><joint><child link="a"/><origin xyz="0 0 far"/></joint></robot>',
    '<robot><joint><child link="a"/><origin xyz="0 0"/></joint></robot>'])
def test_what_is_no_model(text: str) -> None:
    with pytest.raises(ValueError):
        Kinematics(text)


def test_placements_follow_each_other() -> None:
    first, second = Placement((1.0, 2.0, 3.0), (0.1, -0.7, 0.3, 0.4)), Placement(
        (0.5, 0.0, -1.0), (0.0, 0.6, 0.0, 0.8))
    both = first.then(second)
    turn = matrix_from_quaternion(first.quaternion)
    assert np.allclose(both.position, turn @ second.position + first.position)
    assert np.allclose(matrix_from_quaternion(both.quaternion),
                       turn @ matrix_from_quaternion(second.quaternion))
    assert np.allclose(matrix_from_quaternion(Placement().then(first).quaternion),
                       matrix_from_quaternion(first.quaternion))
    assert np.allclose(matrix_from_ypr((0, 0, 0)), np.eye(3))


def test_frames_that_the_model_connects_with_the_base() -> None:
    """The frame ``base`` of a UR is turned by half a turn; either carries the other or neither."""
    arm = model('ur5e')
    found = arm.connection('base', 'base_link', {})
    assert found is not None
    assert np.allclose(matrix_from_quaternion(found.quaternion), np.diag([-1, -1, 1]), atol=1e-6)
    for frame, other in (('base_link', 'base'), ('base', 'base_link_inertia'),
                         ('tool0', 'wrist_3_link'), ('wrist_3_link', 'tool0')):
        there, back = arm.connection(frame, other, {}), arm.connection(other, frame, {})
        assert there is not None and back is not None
        assert np.allclose(there.then(back).position, 0.0, atol=1e-9)
        assert not arm.moves(frame, other) and arm.connects(frame, other)


@given(st.lists(st.floats(-3, 3), min_size=6, max_size=6),
       st.sampled_from(['forearm_link', 'base', 'tool0']), st.sampled_from(['tool0', 'base']))
def test_connection_agrees_with_what_carries_both(angles: 'list[float]', frame: str,
                                                  other: str) -> None:
    arm, positions = model('ur5e'), dict(zip(UR, angles))
    found = arm.connection(frame, other, positions)
    outer, inner = (arm.placement(it, 'base_link', positions) for it in (other, frame))
    assert found is not None and outer is not None and inner is not None
    assert np.allclose(outer.then(found).position, inner.position, atol=1e-9)
    assert np.allclose(matrix_from_quaternion(outer.then(found).quaternion),
                       matrix_from_quaternion(inner.quaternion), atol=1e-9)


def test_a_joint_between_two_frames() -> None:
    arm = model('ur5e')
    assert arm.moves('tool0', 'base') and arm.connects('tool0', 'base')
    assert arm.connection('tool0', 'base', {}) is None  # the joint positions are unknown
    assert arm.connection('nowhere', 'base', {}) is None
    assert not arm.connects('nowhere', 'base') and not arm.moves('nowhere', 'base')
    arm.fix('world', 'base_link', Placement((0.0, 0.0, 0.8)))  # below the root, which the cell has
    found = arm.connection('world', 'base_link', {})
    assert found is not None and np.allclose(found.position, [0.0, 0.0, -0.8])
    arm.fix('a', 'b', Placement())
    arm.fix('b', 'a', Placement())  # a cycle is not a connection
    assert not arm.connects('a', 'base')


def test_links_that_joints_move() -> None:
    arm = model('panda_hand')
    assert arm.joint_names == [*(f'panda_joint{number}' for number in range(1, 8)),
                               'panda_finger_joint1']
    found = {child: (parent, place) for parent, child, place
             in arm.moved({'panda_joint1': 0.0, 'panda_finger_joint1': 0.03})}
    assert found.keys() == {'panda_link1', 'panda_leftfinger', 'panda_rightfinger'}
    assert found['panda_link1'] == ('panda_link0', Placement((0.0, 0.0, 0.333)))
