# SPDX-License-Identifier: BSD-3-Clause
"""The reference frame of a robot's poses: found if the motions determine it, never a wrong one."""
from __future__ import annotations

import math
from pathlib import Path
from typing import Dict, List, Optional, Sequence, Tuple

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from process_visualizer.robot.kinematics import Kinematics, Placement
from process_visualizer.robot.rotations import (
    conjugate,
    quaternion_from_rotation_vector,
    quaternion_from_ypr,
    rotated,
)
from process_visualizer.robot.tool_learning import Body, Finding, ToolLearner

DATA = Path(__file__).resolve().parents[1] / 'data'
PANDA = [f'panda_joint{number}' for number in range(1, 8)]
NOISE_M = 0.001
HERE = Placement()
Joints = Dict[str, float]


class Robot:
    """A model, and the frame learned from the reported poses."""

    def __init__(self, urdf: str, base: str, chosen: str) -> None:
        self.model, self.base, self.chosen = Kinematics(urdf), base, chosen
        bodies = {link: Body(self.model.fixed_to(link, base),
                             self.model.carriers(self.model.fixed_to(link, base), base) or ())
                  for link in self.model.links}
        self.learner = ToolLearner(chosen, bodies)

    def frames(self, joints: Joints) -> Dict[str, Placement]:
        found = {link: self.model.placement(link, self.base, joints) for link in self.model.links}
        return {link: place for link, place in found.items() if place is not None}

    def tool(self, joints: Joints, frame: str, tool: Placement, base: Placement = HERE
             ) -> Placement:
        """The pose of a tool that is fixed to a frame, relative to the driver's base."""
        return base.then(self.frames(joints)[frame]).then(tool)

    def report(self, joints: Joints, place: Placement, random: np.random.Generator,
               has_rotation: bool = True) -> None:
        x, y, z = (np.array(place.position) + random.normal(0.0, NOISE_M, 3)).tolist()
        self.learner.add(joints, self.frames(joints), (x, y, z),
                         place.quaternion if has_rotation else None)


def panda() -> Robot:
    return Robot((DATA / 'panda_hand.urdf').read_text(), 'panda_link0', 'panda_hand')


def motions(names: Sequence[str], random: np.random.Generator, count: int = 20,
            range_rad: float = 1.0) -> List[Joints]:
    return [{**dict(zip(names, random.uniform(-range_rad, range_rad, len(names)).tolist())),
             'panda_finger_joint1': 0.02} for _ in range(count)]


def learn(robot: Robot, joints: Sequence[Joints], frame: str, tool: Placement = HERE,
          base: Placement = HERE, has_rotation: bool = True) -> Optional[Finding]:
    random = np.random.default_rng(1)
    for it in joints:
        robot.report(it, robot.tool(it, frame, tool, base), random, has_rotation)
    return robot.learner.finding()


@pytest.mark.parametrize('has_rotation', [True, False])
def test_poses_of_another_frame(has_rotation: bool) -> None:
    robot = panda()
    found = learn(robot, motions(PANDA, np.random.default_rng(2)), 'panda_link8',
                  has_rotation=has_rotation)
    assert found is None  # the flange of a Panda is where its hand begins
    robot = panda()
    found = learn(robot, motions(PANDA, np.random.default_rng(2)), 'panda_link7',
                  has_rotation=has_rotation)
    assert found is not None and found.is_frame
    assert (found.frame, found.distance_m) == ('panda_link7', pytest.approx(0.107, abs=0.002))


@pytest.mark.parametrize('has_rotation', [True, False])
def test_poses_of_a_tool_that_the_model_does_not_have(has_rotation: bool) -> None:
    turn = quaternion_from_ypr((0.5, 0.0, 0.0)).tolist()
    found = learn(panda(), motions(PANDA, np.random.default_rng(2)), 'panda_hand',
                  Placement((0.0, 0.02, 0.1034), (turn[0], turn[1], turn[2], turn[3])),
                  has_rotation=has_rotation)
    assert found is not None and found.frame == 'panda_hand'
    assert np.allclose(found.xyz, [0.0, 0.02, 0.1034], atol=0.002)
    assert np.allclose(found.ypr, [0.5 if has_rotation else 0.0, 0.0, 0.0], atol=0.01)


def test_poses_of_the_chosen_frame_need_no_word() -> None:
    assert learn(panda(), motions(PANDA, np.random.default_rng(2)), 'panda_hand') is None


@pytest.mark.parametrize('joints', [
    motions(PANDA, np.random.default_rng(2), count=7),
    motions(PANDA, np.random.default_rng(2), range_rad=0.05),
    motions(PANDA[:1], np.random.default_rng(2)),
    [{}] * 20,
], ids=['few', 'similar', 'about one axis', 'none'])
def test_motions_that_do_not_tell(joints: List[Joints]) -> None:
    joints = [{**dict.fromkeys(PANDA, 0.3), 'panda_finger_joint1': 0.02, **it} for it in joints]
    tool = Placement((0.0, 0.02, 0.1034))
    assert learn(panda(), joints, 'panda_hand', tool, has_rotation=False) is None


def test_a_tool_that_keeps_its_direction_may_be_another_base() -> None:
    """Up, down and sideways with the hand upright, as a robot that only picks and places."""
    random, robot = np.random.default_rng(3), panda()
    frames = robot.frames({**dict.fromkeys(PANDA, 0.3), 'panda_finger_joint1': 0.0})
    hand = frames['panda_hand']
    for number in range(20):
        shift = random.uniform(-0.3, 0.3, 3).tolist()
        moved = {name: Placement(tuple(np.add(it.position, shift)), it.quaternion)
                 if name != 'panda_link0' else it for name, it in frames.items()}
        at = np.add(hand.position, shift) + rotated(hand.quaternion, (0.0, 0.0, 0.1))
        robot.learner.add({'a': float(number)}, moved, at, hand.quaternion)
    assert robot.learner.finding() is None


@pytest.mark.parametrize('has_rotation', [True, False])
def test_a_last_joint_that_has_not_moved(has_rotation: bool) -> None:
    """The tool may be fixed to the link before it."""
    joints = [{**it, 'panda_joint7': 0.4} for it in motions(PANDA, np.random.default_rng(2))]
    assert learn(panda(), joints, 'panda_link6', Placement((0.1, 0.05, 0.2)),
                 has_rotation=has_rotation) is None


def test_a_tool_along_the_only_axis_may_be_another_base() -> None:
    """A SCARA turns about the vertical only: a longer tool is like a lower base."""
    kinds = ['revolute', 'prismatic', 'revolute', 'revolute']
    urdf = ''.join(f'<link name="l{number}"/>' for number in range(5)) + ''.join(
        f'<joint name="j{number}" type="{kind}"><parent link="l{number}"/>'
        f'<child link="l{number + 1}"/><origin xyz="0.3 0 0"/><axis xyz="0 0 1"/></joint>'
        for number, kind in enumerate(kinds))
    joints = motions([f'j{number}' for number in range(4)], np.random.default_rng(2))
    robot = Robot(f'<robot name="scara">{urdf}</robot>', 'l0', 'l4')
    assert learn(robot, joints, 'l4', Placement((0.0, 0.0, 0.1))) is None
    robot = Robot(f'<robot name="scara">{urdf}</robot>', 'l0', 'l4')
    found = learn(robot, joints, 'l4', Placement((0.1, 0.0, 0.0)))
    assert found is not None and np.allclose(found.xyz, [0.1, 0.0, 0.0], atol=0.002)


@pytest.mark.parametrize('has_rotation', [True, False])
def test_poses_in_another_base(has_rotation: bool) -> None:
    base = Placement((0.3, 0.0, 0.8), (0.0, 0.0, 1.0, 0.0))
    assert learn(panda(), motions(PANDA, np.random.default_rng(2)), 'panda_hand', base=base,
                 has_rotation=has_rotation) is None


def test_the_tool_is_changed() -> None:
    """New poses at the same joint positions replace the old ones."""
    robot, joints = panda(), motions(PANDA, np.random.default_rng(2))
    learn(robot, joints, 'panda_link7')
    found = learn(robot, joints, 'panda_hand', Placement((0.0, 0.0, 0.2)))
    assert found is not None and np.allclose(found.xyz, [0.0, 0.0, 0.2], atol=0.002)


@st.composite
def chains(draw: st.DrawFn) -> Tuple[str, List[str]]:
    """A chain of links with joints that turn or slide, and fixed frames at its end."""
    random = np.random.default_rng(draw(st.integers(0, 2 ** 32)))
    kinds = draw(st.lists(st.sampled_from(['revolute'] * 4 + ['prismatic', 'fixed']), min_size=3,
                          max_size=7)) + ['fixed', 'fixed']
    links = ''.join(f'<link name="l{number}"/>' for number in range(len(kinds) + 1))
    joints = ''
    for number, kind in enumerate(kinds):
        xyz, rpy = random.uniform(-0.3, 0.3, 3), random.uniform(-3.0, 3.0, 3)
        axis = random.normal(size=3)
        joints += (f'<joint name="j{number}" type="{kind}"><parent link="l{number}"/>'
                   f'<child link="l{number + 1}"/><origin xyz="{_words(xyz)}" '
                   f'rpy="{_words(rpy)}"/><axis xyz="{_words(axis)}"/></joint>')
    return (f'<robot name="r">{links}{joints}</robot>',
            [f'j{number}' for number, kind in enumerate(kinds) if kind != 'fixed'])


def _words(values: np.ndarray) -> str:
    return ' '.join(f'{value:.4f}' for value in values)


def places() -> 'st.SearchStrategy[Placement]':
    numbers = st.tuples(*[st.floats(-1.0, 1.0)] * 3)
    return st.builds(lambda xyz, turn: Placement(
        (0.3 * xyz[0], 0.3 * xyz[1], 0.3 * xyz[2]),
        quaternion_from_rotation_vector([2.0 * it for it in turn])), numbers, numbers)


@given(chains(), st.data())
@settings(max_examples=150)
def test_what_is_said_holds_wherever_the_robot_goes(chain: Tuple[str, List[str]],
                                                    data: st.DataObject) -> None:
    """For any tool frame and driver base, and for any small motion."""
    urdf, names = chain
    links = urdf.count('<link')
    robot = Robot(urdf, 'l0', f'l{links - 1}')
    frame = f'l{data.draw(st.integers(0, links - 1))}'
    tool = data.draw(st.one_of(st.just(Placement()), places()))
    base = data.draw(st.one_of(st.just(Placement()), places()))
    random = np.random.default_rng(data.draw(st.integers(0, 2 ** 32)))
    moving = data.draw(st.sets(st.sampled_from(names or ['none'])))
    ranges = {name: data.draw(st.sampled_from([0.1, 0.5, 1.5])) * (name in moving)
              for name in names}
    resting = {name: random.uniform(-1.0, 1.0) for name in names}
    has_rotation = data.draw(st.booleans())
    for _ in range(data.draw(st.sampled_from([5, 10, 30]))):
        joints = {name: resting[name] + ranges[name] * random.uniform(-1.0, 1.0) for name in names}
        robot.report(joints, robot.tool(joints, frame, tool, base), random, has_rotation)
    found = robot.learner.finding()
    for _ in range(20 if found is not None else 0):
        assert found is not None
        joints = {name: random.uniform(-1.5, 1.5) for name in names}
        said = robot.tool(joints, found.frame, Placement(found.xyz)).position
        assert math.dist(said, robot.tool(joints, frame, tool, base).position) < 0.05


@given(chains(), st.data())
@settings(max_examples=60)
def test_motions_of_all_joints_tell(chain: Tuple[str, List[str]], data: st.DataObject) -> None:
    urdf, names = chain
    links = urdf.count('<link')
    robot = Robot(urdf, 'l0', f'l{links - 1}')
    turning = [name for name in names if f'name="{name}" type="revolute"' in urdf]
    tool = data.draw(places().filter(lambda it: math.hypot(*it.position) > 0.05))
    random = np.random.default_rng(data.draw(st.integers(0, 2 ** 32)))
    for _ in range(30):
        joints = {name: random.uniform(-1.5, 1.5) for name in names}
        robot.report(joints, robot.tool(joints, robot.chosen, tool), random)
    found = robot.learner.finding()
    if len(turning) >= 3:
        assert found is not None
        place = robot.tool({name: 0.0 for name in names}, found.frame, Placement(found.xyz))
        expected = robot.tool({name: 0.0 for name in names}, robot.chosen, tool)
        away = rotated(conjugate(place.quaternion), np.subtract(place.position, expected.position))
        assert math.hypot(*away) < 0.01
