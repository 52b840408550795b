# SPDX-License-Identifier: BSD-3-Clause
"""A robot's tool that is a frame on tf is found; a mere guess remains a comment."""
from __future__ import annotations

import dataclasses
import tempfile
from pathlib import Path
from typing import Any, Callable, List, Sequence, Tuple

import pytest
import rosbag
from genpy import Time
from geometry_msgs.msg import (
    PoseStamped,
    Quaternion,
    Transform,
    TransformStamped,
    Vector3,
    WrenchStamped,
)
from hypothesis import given, settings
from seen_cells import (
    CLOUD,
    JOINTS,
    POSE,
    TF_MESSAGE,
    cells,
    model,
    sent,
    transform,
    written,
)
from sensor_msgs.msg import JointState
from std_msgs.msg import Header
from tf2_msgs.msg import TFMessage

from process_visualizer.cell.model import Cell, Device, TopicFunction
from process_visualizer.cell.xml_parser import XmlParser
from process_visualizer.commands.command_line import main
from process_visualizer.discovery.make_draft import make_draft
from process_visualizer.discovery.robot_topics import FoundModel
from process_visualizer.discovery.seen import FrameForest, Seen, SeenTopic, SeenTransform
from process_visualizer.generate.frame_rules import frame_problems, frame_warnings
from process_visualizer.robot.description import describe_devices

TF = SeenTopic('/tf', TF_MESSAGE)
UR_JOINTS, PANDA_JOINTS = ['pan', 'lift'], ['panda_joint1', 'panda_joint2']
GUESS = 'a guess: '


def ur(namespace: str = '/ur', prefix: str = '') -> FoundModel:
    """The joints move tool0; ``base`` is fixed, and carries a box with a ``lid``."""
    links = [prefix + it for it in ('base_link', 'arm', 'tool0', 'base', 'lid')]
    found = model(namespace, 'ur', links, UR_JOINTS)
    text = found.description.text.replace(f'<parent link="{prefix}tool0" />',
                                          f'<parent link="{prefix}base_link" />')
    parents = {**found.description.parents, f'{prefix}base': f'{prefix}base_link'}
    return dataclasses.replace(found, description=dataclasses.replace(
        found.description, text=text, parents=parents))


def panda() -> FoundModel:
    return model('/franka', 'panda', ['panda_link0', 'panda_link1', 'panda_link8'], PANDA_JOINTS)


FRANKA_FRAMES = (sent('panda_link8', 'panda_NE'), sent('panda_NE', 'panda_EE'),
                 sent('panda_EE', 'panda_K'))
UR_FRAME = sent('base', 'tool0_controller', True)


def joints(namespace: str, names: Sequence[str]) -> SeenTopic:
    return SeenTopic(f'{namespace}/joint_states', JOINTS, joints=tuple(names))


def ur_cell(tmp_path: Path, *frames: SeenTransform, topics: Sequence[SeenTopic] = ()
            ) -> Tuple[str, Cell]:
    """The configuration for a UR and frames on tf."""
    return written(Seen('x', (TF, joints('/ur', UR_JOINTS), *topics), frames), [ur()], tmp_path)


def tool(device: Device) -> str:
    """The robot's tool frame on tf, '' without one; for another topic, the topic's name."""
    topic = device.topic_for(TopicFunction.TOOL_CENTER_FRAME)
    if topic is None:
        return ''
    return topic.frame or '' if topic.name == '/tf' else topic.name


def tools(cell: Cell) -> List[str]:
    return [tool(it) for it in cell.devices]


def test_the_tools_of_two_makers(tmp_path: Path) -> None:
    topics = TF, joints('/ur', UR_JOINTS), joints('/franka', PANDA_JOINTS)
    text, cell = written(Seen('x', topics, (UR_FRAME, *FRANKA_FRAMES)), [ur(), panda()], tmp_path)
    assert tools(cell) == ['tool0_controller', 'panda_EE']
    assert ('<topic name="tf" type="tool_center_frame" msg="tf2_msgs/TFMessage" '
            'frame="panda_EE" />') in text
    assert 'no velocity' not in text and GUESS not in text and 'did not move' not in text
    descriptions, problems = describe_devices(cell.devices)
    assert (problems, frame_warnings(cell, descriptions, ())) == ([], [])


def test_a_robot_with_a_topic_of_poses_keeps_it(tmp_path: Path) -> None:
    text, cell = ur_cell(tmp_path, UR_FRAME, topics=[SeenTopic('/ur/tcp_pose', POSE)])
    assert tools(cell) == ['/ur/tcp_pose'] and 'tool0_controller' not in text


@pytest.mark.parametrize('topics, frames', [
    ((), (UR_FRAME,)),
    ((SeenTopic('/tf', 'tf/tfMessage'),), (UR_FRAME,)),
    ((TF,), ()),
    ((TF,), (sent('base_link', 'arm', True), sent('arm', 'tool0', True))),
    ((TF,), (sent('table', 'tool0_controller', True),)),
    ((TF,), (sent('base_link', 'tool0_goal', True), sent('tool0', 'camera_tool', True))),
    ((TF,), (sent('base_link', 'arm', True), sent('arm', 'tool0', True), sent('base', 'tool'))),
    ((TF,), (transform('base', 'tool'), transform('tool0', 'bracket'))),
    ((TF,), (sent('tool0', 'camera_link', True), sent('camera_link', 'hand', True))),
    ((TF,), (sent('base', 'part', False), sent('base', 'goal_1', True)))],
    ids=['no tf', 'a type that is not read', 'no frames', 'links', 'not connected', 'other things',
         'a stand', 'fixed', 'seen by a camera', 'nothing that moves'])
def test_what_is_no_tool(tmp_path: Path, topics: Sequence[SeenTopic],
                         frames: Sequence[SeenTransform]) -> None:
    seen = Seen('x', (*topics, joints('/ur', UR_JOINTS)), tuple(frames))
    text, cell = written(seen, [ur()], tmp_path)
    assert tools(cell) == [''] and GUESS not in text
    assert ('no pose of its tool (PoseStamped, or a frame on tf), so its velocity is that of the '
            'model and the joints') in ' '.join(text.split())


@pytest.mark.parametrize('frames, guess', [
    ([transform('tool0', 'torch_tcp')], 'torch_tcp'),
    ([sent('base', 'holder', True), sent('holder', 'needle')], 'needle'),
    ([sent('tool0', 'left_tcp'), sent('tool0', 'right_tcp')], 'left_tcp')],
    ids=['fixed to the tool', 'another name', 'two of them'])
def test_a_guess_is_a_comment(tmp_path: Path, frames: Sequence[SeenTransform], guess: str) -> None:
    text, cell = ur_cell(tmp_path, *frames)
    assert tools(cell) == [''] and GUESS in text and 'no pose of its tool' in text
    assert ('<!-- <topic name="tf" type="tool_center_frame" msg="tf2_msgs/TFMessage" '
            f'frame="{guess}" /> -->') in text


@pytest.mark.parametrize('frames, found', [
    ([UR_FRAME, sent('base', 'needle', True)], 'tool0_controller'),
    ([UR_FRAME, sent('base', 'flange', True)], 'tool0_controller'),
    ([UR_FRAME, sent('base', 'tcp')], 'tool0_controller'),
    ([UR_FRAME, transform('tool0', 'tcp')], 'tool0_controller'),
    ([UR_FRAME, transform('tool0_controller', 'tcp')], 'tcp'),
    ([UR_FRAME, transform('base_link', 'base')], 'tool0_controller')],
    ids=['by its name', 'nearer to the work', 'what moves', 'what is sent', 'fixed to it',
         'tf has the links too'])
def test_the_likeliest_is_taken(tmp_path: Path, frames: Sequence[SeenTransform],
                                found: str) -> None:
    assert tools(ur_cell(tmp_path, *frames)[1]) == [found]


def test_a_robot_that_stands_still(tmp_path: Path) -> None:
    """Another part of its model moves."""
    text, cell = ur_cell(tmp_path, UR_FRAME._replace(changes=False), sent('base_link', 'arm'),
                         sent('base', 'lid', True))
    assert tools(cell) == ['tool0_controller']
    assert '<!-- by its name: it did not move while it was observed -->' in text


def test_a_camera_on_the_tool_is_fixed_to_its_frame(tmp_path: Path) -> None:
    """In playback the recorded tf moves that frame, and nothing else does."""
    cloud = SeenTopic('/cam/depth/points', CLOUD, frames=('eye_frame',))
    text, cell = ur_cell(tmp_path, UR_FRAME, sent('tool0_controller', 'tool'),
                         sent('tool', 'eye_frame'), topics=[cloud])
    assert tools(cell)[0] == 'tool' and 'cam is fixed to tool.' in text
    assert [it.attributes['args'].split()[-2:] for it in cell.device('cam').nodes] == [
        ['tool', 'eye_frame']]
    seen_as_tool = dataclasses.replace(cloud, frames=('tool',))
    assert tools(ur_cell(tmp_path, sent('base', 'tool', True), topics=[seen_as_tool])[1])[0] == ''


def test_two_robots_of_one_model(tmp_path: Path) -> None:
    """With prefixes on tf each has its own frame; without, a frame could be of either robot."""
    models = [ur('/left'), ur('/right')]
    topics = TF, joints('/left', UR_JOINTS), joints('/right', UR_JOINTS)
    frames = tuple(sent(f'{side}/{parent}', f'{side}/{child}', True) for side in ('left', 'right')
                   for parent, child in (('base', 'tool0_controller'), ('base_link', 'arm')))
    _, cell = written(Seen('x', topics, frames), models, tmp_path)
    assert [it.base.frame for it in cell.devices if it.base] == ['left/base_link',
                                                                 'right/base_link']
    assert tools(cell) == ['left/tool0_controller', 'right/tool0_controller']
    text, cell = written(Seen('x', topics, (UR_FRAME,)), models, tmp_path)
    assert tools(cell) == ['', '']
    assert text.count(f'{GUESS}several models have the link base') == 1


def test_two_robots_with_prefixes_in_their_models(tmp_path: Path) -> None:
    models = [ur('/left', 'left_'), ur('/right', 'right_')]
    topics = TF, joints('/left', UR_JOINTS), joints('/right', UR_JOINTS)
    frames = tuple(sent(f'{side}_base', f'{side}_tool0_controller', True)
                   for side in ('right', 'left'))
    _, cell = written(Seen('x', topics, frames), models, tmp_path)
    assert tools(cell) == ['left_tool0_controller', 'right_tool0_controller']


@settings(max_examples=60)
@given(cells)
def test_what_is_taken_is_no_link_and_behind_one(cell: Tuple[Seen, List[FoundModel]]) -> None:
    if not make_draft(*cell).draft.devices:
        return
    with tempfile.TemporaryDirectory() as folder:
        _, read = written(*cell, Path(folder))
        descriptions, _ = describe_devices(read.devices)
    assert frame_problems(read.devices, descriptions) == []
    forest = FrameForest(cell[0].transforms)
    found = [(tool(it), it.name) for it in read.devices if tool(it)[:1] not in ('', '/')]
    assert len({frame for frame, _ in found}) == len(found)
    links = {link for it in descriptions.values() for link in it.links}
    for frame, device in found:
        carriers = [it for it in forest.path(frame) if it in links]
        assert frame not in links and carriers[0] in descriptions[device].links


MAKERS = Path(__file__).parents[2] / 'data' / 'makers'
UR_STYLE = ['shoulder_pan_joint', 'shoulder_lift_joint', 'wrist_1_joint']
PANDA_STYLE = ['panda_joint1', 'panda_joint7', 'panda_leftfinger_joint']


def tf_message(*frames: Tuple[str, str, float]) -> TFMessage:
    return TFMessage([TransformStamped(Header(frame_id=parent), child, Transform(
        Vector3(x, 0, 0), Quaternion(0, 0, 0, 1))) for parent, child, x in frames])


ROWS: List[Tuple[str, Callable[[int], Any]]] = [
    ('/ur/joint_states', lambda _: JointState(name=UR_STYLE, position=3 * [0.0])),
    ('/ur/wrench', lambda _: WrenchStamped(header=Header(frame_id='tool0_controller'))),
    ('/tf', lambda number: tf_message(('/base', '/tool0_controller', 0.01 * number))),
    ('/franka/joint_states', lambda _: JointState(name=PANDA_STYLE, position=3 * [0.0])),
    ('/tf', lambda _: tf_message(('panda_link8', 'panda_NE', 0.1), ('panda_NE', 'panda_EE', 0.0),
                                 ('panda_EE', 'panda_K', 0.0)))]


def new_cell(tmp_path: Path, rows: Sequence[Tuple[str, Callable[[int], Any]]]) -> Cell:
    """The configuration that ``cell new`` writes for a bag, and ``cell check`` accepts."""
    bag, config = str(tmp_path / 'a.bag'), str(tmp_path / 'cell.xml')
    with rosbag.Bag(bag, 'w') as file:
        for number in range(10):
            for topic, message in rows:
                file.write(topic, message(number), Time(1000 + number))
    assert main(['new', bag, '-o', config]) == 0
    assert main(['check', config]) == 0
    return XmlParser().parse(config)


def test_the_tools_in_a_bag(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Any) -> None:
    monkeypatch.setenv('ROS_PACKAGE_PATH', str(MAKERS))
    cell = new_cell(tmp_path, ROWS)
    assert 'warning' not in capsys.readouterr().out
    assert tools(cell) == ['tool0_controller', 'panda_EE']
    assert [it.force for it in cell.devices] == [None, None]
    assert 'did not move' not in (tmp_path / 'cell.xml').read_text(encoding='utf-8')


def test_a_bag_without_tf(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv('ROS_PACKAGE_PATH', str(MAKERS))
    pose = PoseStamped(header=Header(frame_id='base'))
    rows = [it for it in ROWS if it[0] != '/tf']
    assert tools(new_cell(tmp_path, [*rows, ('/ur/pose', lambda _: pose)])) == ['/ur/pose', '']
