# SPDX-License-Identifier: BSD-3-Clause
"""The devices in a bag, the models that match it, and the files that are written."""
from __future__ import annotations

from pathlib import Path
from typing import Any, List, Optional, Tuple

import pytest
import rosbag
from genpy import Time
from geometry_msgs.msg import PoseStamped, Quaternion, Transform, TransformStamped, Vector3
from seen_cells import urdf, written
from sensor_msgs.msg import Image, JointState, Temperature
from std_msgs.msg import Header, String
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import Marker, MarkerArray

from process_visualizer.bagio.recording import Recording
from process_visualizer.cell.model import TopicFunction
from process_visualizer.cell.xml_parser import XmlParser
from process_visualizer.commands.command_line import main
from process_visualizer.discovery.bag_look import look_into
from process_visualizer.discovery.model_search import ModelSearch
from process_visualizer.discovery.new_configuration import NewConfiguration, from_bags, write_new
from process_visualizer.discovery.seen import Seen, SeenDescription, SeenTopic
from process_visualizer.robot.description import load_robot_description, marked_description

MAKERS = Path(__file__).parents[2] / 'data' / 'makers'
JOINTS = ('left_pan', 'left_lift')
XACRO = '''<robot name="little" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:arg name="prefix" default="left_" />
  <xacro:property name="p" value="$(arg prefix)" />
  <link name="${p}base" /><link name="${p}arm" /><link name="${p}hand" />
  <joint name="${p}pan" type="continuous"><parent link="${p}base" /><child link="${p}arm" /></joint>
  <joint name="${p}lift" type="continuous"><parent link="${p}arm" /><child link="${p}hand" />
    <origin xyz="0 0 0.5" /></joint>
</robot>'''


@pytest.fixture
def package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A package with the model of a robot, found through ROS_PACKAGE_PATH."""
    folder = tmp_path / 'packages' / 'little_description'
    (folder / 'urdf').mkdir(parents=True)
    (folder / 'package.xml').write_text('<package><name>little_description</name></package>')
    (folder / 'urdf' / 'little.urdf.xacro').write_text(XACRO)
    monkeypatch.setenv('ROS_PACKAGE_PATH', str(folder.parent))
    return folder


def joint_states(number: int) -> JointState:
    return JointState(name=list(JOINTS), position=[0.1 * number, 0.0])


def frames(parent: str, child: str, x: float) -> TFMessage:
    return TFMessage([TransformStamped(Header(frame_id=parent), child, Transform(
        Vector3(x, 0, 0), Quaternion(0, 0, 0, 1)))])


def write_bag(path: Path, rows: List[Tuple[str, Any]], count: int = 30,
              compression: str = 'none') -> str:
    with rosbag.Bag(str(path), 'w', compression=compression) as bag:
        for number in range(count):
            for topic, message in rows:
                bag.write(topic, message(number), Time(1000 + number))
    return str(path)


ROWS = [('/little/joint_states', joint_states),
        ('/little/pose', lambda _: PoseStamped(Header(frame_id='/left_base'), PoseStamped().pose)),
        ('/tf_static', lambda _: frames('/world', '/left_base', 2.0)),
        ('/oven', lambda number: Temperature(Header(frame_id='oven'), 20.0 + number, 0.0)),
        ('/camera/image_raw', lambda _: Image(header=Header(frame_id='eye'), data=bytes(200_000)))]


@pytest.mark.parametrize('compression', ['none', 'lz4'])
def test_what_a_bag_shows(tmp_path: Path, compression: str) -> None:
    bag = write_bag(tmp_path / 'a.bag', ROWS, compression=compression)
    with Recording([bag]) as recording:
        seen = look_into(recording)
    topics = {it.name: it for it in seen.topics}
    assert topics['/little/joint_states'].joints == JOINTS
    assert topics['/little/pose'].frames == ('left_base',)
    assert [(it.parent, it.child, it.placement.position) for it in seen.transforms] == [
        ('world', 'left_base', (2.0, 0.0, 0.0))]
    temperature, variance = topics['/oven'].numbers
    assert (temperature.path, temperature.low, variance.changes) == ('temperature', 20.0, False)
    assert temperature.high > 45.0


@pytest.mark.parametrize('cycles', [30, 135, 240])
def test_of_groups_of_joints_that_take_turns_all_are_seen(tmp_path: Path, cycles: int) -> None:
    """This holds for any number of messages, of which only some are read."""
    groups = ('left', 'right', 'torso')
    bag = write_bag(tmp_path / 'a.bag', [('/joints', lambda _, name=name: JointState(
        name=[name], position=[0.0])) for name in groups], cycles)
    with Recording([bag]) as recording:
        [topic] = look_into(recording).topics
    assert set(topic.joints) == set(groups)


def test_frames_of_markers(tmp_path: Path) -> None:
    markers = MarkerArray([Marker(header=Header(frame_id=it)) for it in ('/a', 'b', '')])
    with Recording([write_bag(tmp_path / 'a.bag', [('/m', lambda _: markers)])]) as recording:
        [topic] = look_into(recording).topics
    assert topic.frames == ('a', 'b')


def test_only_a_few_messages_are_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    bag = write_bag(tmp_path / 'a.bag', ROWS, 1000)
    read: List[int] = []
    message = Recording.message
    monkeypatch.setattr(Recording, 'message',
                        lambda self, position: read.append(position) or message(self, position))
    with Recording([bag]) as recording:
        look_into(recording)
    assert len(read) < 700  # 500 of them on /tf_static, which has 5000


def test_a_configuration_of_a_bag(tmp_path: Path, package: Path, capsys: Any) -> None:
    bag = write_bag(tmp_path / 'a.bag', ROWS)
    config = str(tmp_path / 'cell.xml')
    assert main(['new', bag, '-o', config]) == 0
    assert main(['check', config]) == 0
    robot = XmlParser().parse(config).device('little_robot')
    assert robot.model is not None and robot.base is not None
    assert (robot.model.package, robot.model.path) == ('little_description',
                                                       'urdf/little.urdf.xacro')
    assert (robot.base.frame, robot.base.pose.xyz) == ('left_base', (2.0, 0.0, 0.0))
    capsys.readouterr()
    assert main(['new', bag, '-o', config]) == 1
    assert capsys.readouterr().err == (
        f'cell: "{config}" already exists; --force overwrites it\n')
    assert main(['new', bag, '-o', config, '--force']) == 0


def test_descriptions_in_a_bag(tmp_path: Path, package: Path) -> None:
    """One that a package has is named; another one is written next to the configuration."""
    text = XACRO[XACRO.index('<link'):].replace('${p}', 'left_')
    same = '<robot name="little">' + text
    other = same.replace('0 0 0.5', '0 0 0.6')
    in_package = 'pkg="little_description" path="urdf/little.urdf.xacro"'
    for description, attributes in ((same, in_package), (other, 'path="little_robot.urdf"')):
        rows = [*ROWS[:3], ('/little/robot_description', lambda _, it=description: String(it))]
        new = from_bags([write_bag(tmp_path / 'a.bag', rows, 3)])
        assert f'<model {attributes} />' in new.text
        assert list(new.models.values()) == ([other] if description is other else [])


def test_what_a_cell_has_made_is_no_drivers_description(tmp_path: Path, package: Path) -> None:
    text = '<robot name="mine"><link name="mine/base" /></robot>'
    for it, count in ((text, 2), (marked_description(text), 1)):
        rows = [*ROWS[:3], ('/mine/robot_description', lambda _, it=it: String(it))]
        assert from_bags([write_bag(tmp_path / 'a.bag', rows, 3)]).text.count('<model ') == count


def test_a_description_that_cannot_be_used_is_told(package: Path) -> None:
    search = ModelSearch()
    bad = '<robot name="x"><link name="a" /><link name="b" /></robot>'
    assert search.find(Seen('x', (), (), (SeenDescription('/arm', bad),))) == []
    [remark] = search.remarks
    assert remark.startswith('The description /arm/robot_description cannot be used: ')


def test_joints_that_no_package_has(package: Path) -> None:
    topic = SeenTopic('/arm/joint_states', 'sensor_msgs/JointState', joints=('left_pan', 'right_x'))
    assert ModelSearch().find(Seen('x', (topic,))) == []


def test_the_model_with_the_most_joints_is_taken(package: Path) -> None:
    """A file with the hand alone has some of the joints, too."""
    (package / 'urdf' / 'a_hand.xacro').write_text(
        '<robot name="hand"><link name="a" /><link name="b" /><joint name="left_lift" '
        'type="continuous"><parent link="a" /><child link="b" /></joint></robot>')
    topic = SeenTopic('/arm/joint_states', 'sensor_msgs/JointState', joints=JOINTS)
    assert [it.path for it in ModelSearch().find(Seen('x', (topic,)))] == ['urdf/little.urdf.xacro']


@pytest.mark.parametrize('on_topic, told', [
    ((*JOINTS, 'gripper_joint'), '/arm/joint_states has joints that the model lacks, and that '
                                 'are not drawn: gripper_joint.'),
    ((*JOINTS, 'rail', 'gripper_joint'), None),  # half of them belong to something else
    (('left_pan', 'gripper_joint'), None),
    (('left_pan', 'left_lift', 'left_turn', 'left_tilt', 'gripper_joint', 'rail'),
     '/arm/joint_states has joints that the model lacks, and that are not drawn: gripper_joint, '
     'rail.'),
    (('left_pan', 'left_lift', 'left_turn', 'finger'),
     'The model of arm_robot has joints that are not on /arm/joint_states, and stay where they '
     'are: left_tilt.')])
def test_a_model_may_lack_some_joints(tmp_path: Path, package: Path, on_topic: Tuple[str, ...],
                                      told: Optional[str]) -> None:
    """Those of a gripper or of a track; or the topic lacks some."""
    names = JOINTS if len(on_topic) < 4 or told is None else (*JOINTS, 'left_turn', 'left_tilt')
    (package / 'urdf' / 'little.urdf.xacro').write_text(urdf(
        ['left_base', *(f'left_{i}' for i in range(len(names)))], names))
    bag = write_bag(tmp_path / 'a.bag', [('/arm/joint_states', lambda number: JointState(
        name=list(on_topic), position=[0.1 * number] * len(on_topic)))])
    text = ' '.join(from_bags([bag]).text.split())
    assert ('pkg="little_description"' in text, 'no model was found' in text) == (
        (False, True) if told is None else (True, False))
    assert told is None or told in text


def test_a_model_without_surplus_is_preferred(package: Path) -> None:
    """The same arm, alone and with a gripper whose joints nobody publishes."""
    names = (*JOINTS, 'left_turn', 'left_tilt')
    for stem, more in (('a_with_gripper', ('finger',)), ('little', ())):
        joints = (*names, *more)
        (package / 'urdf' / f'{stem}.urdf').write_text(urdf(
            ['left_base', *(f'left_{i}' for i in range(len(joints)))], joints))
    topic = SeenTopic('/arm/joint_states', 'sensor_msgs/JointState', joints=(*names, 'rail'))
    assert [it.path for it in ModelSearch().find(Seen('x', (topic,)))] == ['urdf/little.urdf']


def test_two_robots_of_one_model_on_one_topic(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each has a prefix, and there is another device next to them."""
    monkeypatch.setenv('ROS_PACKAGE_PATH', str(MAKERS))
    file = 'ur_style_description/urdf/arm.xacro'
    joints = tuple(prefix + name for prefix in ('left_', 'right_')
                   for name in load_robot_description(str(MAKERS / file)).joints)
    topic = SeenTopic('/joint_states', 'sensor_msgs/JointState', joints=(*joints, 'table_lift'))
    models = ModelSearch().find(Seen('x', (topic,)))
    assert [(f'{it.package}/{it.path}', it.arguments) for it in models] == [
        (file, (('tf_prefix', 'left_'),)), (file, (('tf_prefix', 'right_'),))]


@pytest.mark.parametrize('names, rest, prefix', [
    (('pan', 'lift', 'turn'), ('left_pan', 'left_lift', 'left_turn', 'finger'), 'left_'),
    (('joint_1', 'joint_2', 'joint_3'), ('r2/joint_1', 'r2/joint_2', 'r2/joint_3'), 'r2/'),
    (('joint_1', 'joint_2', 'joint_3'), tuple(f'big_joint_{i}' for i in range(1, 5)), None)])
def test_a_driver_may_put_a_prefix_before_the_joints(
        tmp_path: Path, package: Path, names: Tuple[str, ...], rest: Tuple[str, ...],
        prefix: Optional[str]) -> None:
    """The model does not have the prefix; one with more joints of that kind is another robot."""
    (package / 'urdf' / 'little.urdf.xacro').write_text(urdf(['base', 'a', 'b', 'c'], names))
    bag = write_bag(tmp_path / 'a.bag', [
        ('/joint_states', lambda number: JointState(
            name=list(rest), position=[0.1 * number] * len(rest))),
        ('/tf_static', lambda _: frames('world', f'{prefix}base', 2.0))])
    new = from_bags([bag])
    write_new(new, str(tmp_path / 'cell.xml'))
    device, = XmlParser().parse(str(tmp_path / 'cell.xml')).devices
    assert (None if device.model is None else device.model.prefix) == prefix
    if prefix is not None:
        assert device.base is not None
        assert (device.base.frame, device.base.pose.xyz) == (f'{prefix}base', (2.0, 0.0, 0.0))
        assert main(['check', str(tmp_path / 'cell.xml')]) == 0
        assert ('finger' in new.text) == ('finger' in rest)


def test_a_description_with_a_hand_is_that_of_its_package(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv('ROS_PACKAGE_PATH', str(MAKERS))
    file, arguments = 'panda_style_description/robots/arm.urdf.xacro', (('hand', 'true'),)
    text = load_robot_description(str(MAKERS / file), arguments).text
    [model] = ModelSearch().find(Seen('x', (), (), (SeenDescription('/arm', text),)))
    assert (f'{model.package}/{model.path}', model.arguments) == (file, arguments)


def test_a_bag_without_devices(tmp_path: Path, capsys: Any) -> None:
    bag = write_bag(tmp_path / 'a.bag', [('/tf', lambda _: frames('a', 'b', 0.0))])
    assert main(['new', bag, '-o', str(tmp_path / 'cell.xml')]) == 1
    message = capsys.readouterr().err
    assert message.startswith('cell: a.bag: no device was seen')
    assert 'start the drivers' not in message  # useless advice for a recording
    assert not (tmp_path / 'cell.xml').exists()


def test_no_file_is_overwritten_and_none_written_by_half(tmp_path: Path) -> None:
    (tmp_path / 'arm.urdf').write_text('mine')
    new = NewConfiguration('<visualizer />', {'arm.urdf': '<robot />'}, '')
    with pytest.raises(FileExistsError, match='arm.urdf" already exists'):
        write_new(new, str(tmp_path / 'cell.xml'), [str(tmp_path / 'cell.xml')])
    assert [it.name for it in tmp_path.iterdir()] == ['arm.urdf']
    with pytest.raises(OSError):
        write_new(new, str(tmp_path / 'no' / 'cell.xml'))


def test_a_model_that_is_the_same_is_no_hindrance(tmp_path: Path) -> None:
    new = NewConfiguration('<visualizer />', {'arm.urdf': '<robot />'}, '')
    for name in ('cell.xml', 'other.xml'):
        write_new(new, str(tmp_path / name))
    assert (tmp_path / 'other.xml').read_text() == '<visualizer />'
    with pytest.raises(FileExistsError, match='other.xml" already exists'):
        write_new(new, str(tmp_path / 'other.xml'))


def test_no_master(capsys: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv('ROS_MASTER_URI', 'http://localhost:1')
    assert main(['new']) == 1
    assert capsys.readouterr().err == (
        'cell: there is no ROS master at http://localhost:1; start the drivers, or name a bag\n')


@pytest.mark.parametrize('file, arguments', [
    ('ur_style_description/urdf/arm.xacro', (('tf_prefix', 'left_'),)),
    ('ur_style_description/urdf/arm.xacro', ()),
    ('panda_style_description/robots/arm.urdf.xacro', (('hand', 'true'),)),
    ('panda_style_description/robots/arm.urdf.xacro', ())])
def test_makers_models_are_found_by_joints(monkeypatch: pytest.MonkeyPatch, file: str,
                                           arguments: Tuple[Tuple[str, str], ...]) -> None:
    """With the prefix of the joint names, and with the hand that has more joints."""
    monkeypatch.setenv('ROS_PACKAGE_PATH', str(MAKERS))
    joints = load_robot_description(str(MAKERS / file), arguments).joints
    topic = SeenTopic('/driver/joint_states', 'sensor_msgs/JointState', joints=tuple(joints))
    [model] = ModelSearch().find(Seen('x', (topic,)))
    assert (f'{model.package}/{model.path}', model.arguments) == (file, arguments)
    assert model.joints == set(joints)


def test_an_arm_and_its_gripper_on_two_topics_are_one_robot(monkeypatch: pytest.MonkeyPatch,
                                                            tmp_path: Path) -> None:
    monkeypatch.setenv('ROS_PACKAGE_PATH', str(MAKERS))
    file = MAKERS / 'panda_style_description/robots/arm.urdf.xacro'
    arm = tuple(load_robot_description(str(file), ()).joints)
    hand = tuple(set(load_robot_description(str(file), (('hand', 'true'),)).joints) - set(arm))
    seen = Seen('x', (SeenTopic('/franka/gripper/joint_states', 'sensor_msgs/JointState',
                                joints=hand),
                      SeenTopic('/franka/joint_states', 'sensor_msgs/JointState', joints=arm)))
    [found] = ModelSearch().find(seen)
    assert found.arguments == (('hand', 'true'),)
    _, cell = written(seen, [found], tmp_path)
    [robot] = cell.devices
    assert [it.name for it in robot.topics_for(TopicFunction.JOINT_STATES)] == [
        '/franka/joint_states', '/franka/gripper/joint_states']
