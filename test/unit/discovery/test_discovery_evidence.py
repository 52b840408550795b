# SPDX-License-Identifier: BSD-3-Clause
"""Models with the same joints are distinguished by the content of a recording."""
from __future__ import annotations

import math
from pathlib import Path
from typing import Any, Callable, Dict, List, Optional, Sequence, Tuple

import pytest
import rosbag
from genpy import Duration, Time
from geometry_msgs.msg import (
    Point,
    Pose,
    PoseStamped,
    Quaternion,
    Transform,
    TransformStamped,
    Vector3,
)
from sensor_msgs.msg import JointState
from std_msgs.msg import Header
from tf2_msgs.msg import TFMessage

from process_visualizer.discovery.new_configuration import from_bags
from process_visualizer.robot.kinematics import Kinematics, Placement
from process_visualizer.robot.rotations import quaternion_from_ypr

NAMES, LENGTHS_M = ('arm3', 'arm5', 'arm7'), (0.3, 0.5, 0.7)
JOINTS = ('pan', 'lift', 'bend')
Move = Callable[[Placement], Placement]


def urdf(name: str, length_m: float) -> str:
    """A pan joint followed by two joints, ``length_m`` apart; ``base`` is turned by 180°."""
    chain = [('base_link', 'turret', 'pan', '0 0 0.1', '0 0 1'),
             ('turret', 'upper', 'lift', '0 0.1 0', '0 1 0'),
             ('upper', 'lower', 'bend', f'0 0 {length_m}', '0 1 0')]
    joints = ''.join(
        f'<joint name="{joint}" type="continuous"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{xyz}"/><axis xyz="{axis}"/></joint>'
        for parent, child, joint, xyz, axis in chain)
    fixed = ''.join(
        f'<joint name="{child}_fixed" type="fixed"><parent link="{parent}"/>'
        f'<child link="{child}"/><origin xyz="{xyz}" rpy="{rpy}"/></joint>'
        for parent, child, xyz, rpy in (('lower', 'tool0', f'0 0 {length_m}', '0 0 0'),
                                        ('base_link', 'base', '0 0 0', f'0 0 {math.pi}')))
    links = ''.join(f'<link name="{it}"/>' for it in (
        'base_link', 'base', 'turret', 'upper', 'lower', 'tool0'))
    return f'<robot name="{name}">{links}{joints}{fixed}</robot>'


MODELS: Dict[str, str] = {name: urdf(name, it) for name, it in zip(NAMES, LENGTHS_M)}


@pytest.fixture(autouse=True)
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = tmp_path / 'packages' / 'arms'
    folder.mkdir(parents=True)
    (folder / 'package.xml').write_text('<package><name>arms</name></package>')
    for name, text in MODELS.items():
        (folder / f'{name}.urdf').write_text(text)
    monkeypatch.setenv('ROS_PACKAGE_PATH', str(folder.parent))


def positions(number: int) -> Dict[str, float]:
    time_s = 0.02 * number
    return {'pan': math.sin(time_s), 'lift': 0.5 + 0.4 * math.sin(1.7 * time_s),
            'bend': 0.8 * math.cos(1.3 * time_s)}


def place(model: str, frame: str, base: str, number: int) -> Placement:
    found = Kinematics(MODELS[model]).connection(frame, base, positions(number))
    assert found is not None
    return found


def pose_message(frame: str, it: Placement, stamp: Time) -> PoseStamped:
    return PoseStamped(Header(frame_id=frame, stamp=stamp),
                       Pose(Point(*it.position), Quaternion(*it.quaternion)))


def tf_message(rows: List[Tuple[str, str, Placement]], stamp: Time) -> TFMessage:
    return TFMessage([TransformStamped(Header(frame_id=parent, stamp=stamp), child, Transform(
        Vector3(*it.position), Quaternion(*it.quaternion))) for parent, child, it in rows])


def model_line(tmp_path: Path, messages: Callable[[int, Time], List[Tuple[str, Any]]],
               late_s: float = 0.0, namespace: str = 'robot',
               groups: Sequence[Sequence[str]] = (JOINTS,)) -> Tuple[str, str]:
    """The file's comment on the model of a bag's robot, and the name of the model."""
    path = str(tmp_path / 'a.bag')
    with rosbag.Bag(path, 'w') as bag:
        for number in range(300):
            stamp = Time.from_sec(1000.0 + 0.02 * number)
            values = positions(number)
            for names in groups:
                state = JointState(Header(stamp=stamp), names, [values[it] for it in names], [], [])
                bag.write(f'/{namespace}/joint_states', state, stamp + Duration.from_sec(late_s))
            for topic, message in messages(number, stamp):
                bag.write(topic, message, stamp)
    text = from_bags([path]).text
    [line] = [it for it in text.splitlines() if '<model ' in it]
    before = text[:text.index(line)]
    comment = before[before.rindex('<!--') + 4:before.rindex('-->')]
    return ' '.join(comment.split()), line.split('path="')[1].split('.urdf')[0]


@pytest.mark.parametrize('name', NAMES)
def test_by_the_tool_on_tf(tmp_path: Path, name: str) -> None:
    """A message that arrives 30 ms late counts at the time of its stamp."""
    comment, found = model_line(tmp_path, lambda number, stamp: [('/tf', tf_message(
        [('base', 'tool0_controller', place(name, 'tool0', 'base', number))], stamp))], 0.03)
    assert found == name
    assert comment.startswith('chosen of those with the same joints, as its joints bring it to '
                              'tool0_controller in /tf: 0.0 mm off; the others: arm')


def test_by_the_tool_if_joints_come_one_by_one(tmp_path: Path) -> None:
    comment, found = model_line(tmp_path, lambda number, stamp: [('/tf', tf_message(
        [('base', 'tool0_controller', place('arm5', 'tool0', 'base', number))], stamp))],
        groups=[[it] for it in JOINTS])
    assert found == 'arm5' and 'tool0_controller in /tf: 0.0 mm off' in comment


MOVED: Dict[str, Tuple[str, Optional[Placement], Optional[Placement]]] = {
    'as it is': ('base_link', None, None),
    'base elsewhere': ('table', Placement((1.0, 2.0, 0.5), tuple(
        quaternion_from_ypr((1.0, 0.3, 0.0)).tolist())), None),
    'gripper': ('base_link', None, Placement((0.03, 0.0, 0.12)))}


@pytest.mark.parametrize('name', NAMES)
@pytest.mark.parametrize('moved', MOVED)
def test_by_poses(tmp_path: Path, name: str, moved: str) -> None:
    """Also if the base is elsewhere or the tool has an offset."""
    frame, outer, inner = MOVED[moved]

    def message(number: int, stamp: Time) -> List[Tuple[str, Any]]:
        found = place(name, 'tool0', 'base_link', number).then(inner or Placement())
        return [('/robot/pose', pose_message(frame, (outer or Placement()).then(found), stamp))]

    comment, found = model_line(tmp_path, message)
    assert found == name and '/robot/pose' in comment
    assert ('up to a constant offset' in comment) == (moved != 'as it is')


@pytest.mark.parametrize('name', NAMES)
def test_by_links_on_tf(tmp_path: Path, name: str) -> None:
    links = (('base_link', 'turret'), ('turret', 'upper'), ('upper', 'lower'))
    comment, found = model_line(tmp_path, lambda number, stamp: [('/tf', tf_message(
        [(parent, child, place(name, child, parent, number)) for parent, child in links], stamp))])
    assert found == name and 'its links are as far apart as on tf: 0.0 mm off' in comment


def test_by_a_name(tmp_path: Path) -> None:
    comment, found = model_line(tmp_path, lambda *_: [], namespace='left/arm5')
    assert (found, comment) == ('arm5', '"arm5" is in the names that were seen; arm3.urdf and '
                                        'arm7.urdf have the same joints: is this the right model?')


def test_what_nothing_tells_apart_is_told(tmp_path: Path) -> None:
    """A frame that stays fixed while the joints move does not help either."""
    comment, found = model_line(tmp_path, lambda number, stamp: [
        ('/robot/pose', pose_message('base_link', Placement((0.1, 0.0, 0.2)), stamp))])
    assert comment == ('nothing observed distinguishes it from arm5.urdf and arm7.urdf, which have '
                       'the same joints: is this the right model?')
