# SPDX-License-Identifier: BSD-3-Clause
"""A tool after links that only the cell's own nodes place: its velocity at a position."""
from __future__ import annotations

import math
import shutil
from pathlib import Path
from typing import Any, Callable, Dict, Iterator, List

import numpy as np
import pytest
from geometry_msgs.msg import PoseStamped
from recorded_rows import BEGIN_S, Row, stamp, write_bag
from robot_stage import MODELS, RobotStage, array, transform
from sensor_msgs.msg import JointState
from simulated_node import SimulatedNode
from simulated_player import SimulatedPlayer
from std_msgs.msg import Header
from tf2_msgs.msg import TFMessage

from process_visualizer.cell.xml_parser import XmlParser
from process_visualizer.curves.curves import read_curves
from process_visualizer.player.bag_player import HEAD_START_NS

LENGTH_MS = 9000
OFFSET_M = 2.0  # of joint_proc; it moves the tool, but does not change its velocity
NEAR_M_PER_S = 0.004  # of 0.45 m/s: joints are recorded at 100 Hz, and the slope is over 0.2 s
MODEL = 'maker_robot.urdf'
CELL = """<visualizer><device type="robot" name="r">
  <model path="{model}" /><base frame="left_base_link" /><tool frame="left_tool" />
  <topic ns="driver" name="array" type="joint_states" />
  <topic name="tf" type="tool_center_frame" msg="tf2_msgs/TFMessage" frame="{frame}" />
</device></visualizer>"""


def robot_parameters(joints: str, tool: Any, prefix: str = 'left_') -> Dict[str, Any]:
    """Return the parameters of a robot with a joint topic, and a frame or topic of the tool."""
    if not isinstance(tool, dict):
        tool = {'name': '/tf', 'msg': 'tf2_msgs/TFMessage', 'frame': tool}
    return {'base_frame': 'left_base_link', 'tool_frame': 'left_tool', 'link_prefix': prefix,
            'topics': {'joint_states': {'name': f'/driver/{joints}'}, 'tool_center_frame': tool}}


ROBOTS = {
    # as with a Panda: the tool on tf, after links for which the recording only has the joints
    'tip': robot_parameters('joints', 'left_tip'),
    'array': robot_parameters('array', 'left_tip', ''),
    # the tool's frame is a link of the model: the driver does not send it
    'link': robot_parameters('joints', 'left_tool'),
    # as with most makers: the driver sends joints, and no tool pose
    'only': robot_parameters('joints', {}),
    # poses in the frame of a link that a joint moves
    'cart': robot_parameters('joints', {'name': '/driver/pose'}),
    # after a link that is named without the prefix
    'bare': robot_parameters('joints', 'bare_tip'),
    # after a link whose name has a prefix that the model does not have
    'odd': robot_parameters('joints', 'odd_tip', '')}
PLACED = ('tip', 'array', 'link', 'cart', 'bare', 'only')


def axis(time_s: float) -> float:
    """Return the position of the linear axis [m]."""
    return 0.3 * math.sin(1.5 * time_s)


def velocity(time_s: float) -> float:
    """Return its velocity [m/s], over a window of 0.2 s."""
    times_s = time_s + np.linspace(-0.1, 0.1, 21)
    return float(np.polyfit(times_s, [axis(it) for it in times_s], 1)[0])


def rows() -> List[Row]:
    """Return a hand driver's messages: the tool after its flange at 30 Hz, joints at 100 Hz."""
    found = []
    for time_ms in range(0, LENGTH_MS + 1, 33):
        for parent, child in (('left_tool', 'left_tip'), ('tool', 'bare_tip'),
                              ('my_left_tool', 'odd_tip')):
            found.append(Row('/tf', time_ms + 2, TFMessage([transform(
                parent, child, BEGIN_S + time_ms / 1000.0, 0.1, 0.0, 0.0)])))
    for time_ms in range(0, LENGTH_MS + 1, 10):
        place, header = axis(time_ms / 1000.0), Header(stamp=stamp(time_ms))
        found += [Row('/driver/joints', time_ms + 3, JointState(
            header=header, name=['left_axis'], position=[place])),
            Row('/driver/array', time_ms + 3, array(place))]
        pose = PoseStamped(header=Header(stamp=header.stamp, frame_id='cart'))
        pose.pose.position.x = pose.pose.orientation.w = 1.0
        found.append(Row('/driver/pose', time_ms + 4, pose))
    return found


@pytest.fixture(scope='module')
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with recordings: of everything, without the joints, and of the joints alone."""
    path: Path = tmp_path_factory.mktemp('hand')
    write_bag(path / 'hand.bag', rows())
    write_bag(path / 'without.bag', [row for row in rows() if row.topic == '/tf'])
    write_bag(path / 'joints.bag', [row for row in rows() if row.topic == '/driver/joints'])
    return path


def play_joint_nodes(node: SimulatedNode, name: str) -> None:
    """Replace joint_proc and robot_state_publisher."""
    node.send('/tf_static', TFMessage([
        transform('left_base_link', 'left_base', 0.0, 0.0, 0.0, 0.5, turn=math.pi),
        transform('left_cart', 'left_tool', 0.0, 1.0, 0.0, 0.0, turn=math.pi / 2)]), latch=True)

    def place(message: Any) -> None:
        value = (message.position if hasattr(message, 'position') else message.data)[0] + OFFSET_M
        node.send(f'/{name}/joint_states', JointState(
            header=Header(stamp=node.now()), name=['axis'], position=[value]))
        node.send('/tf', TFMessage([transform('left_base_link', 'left_cart', node.now_s,
                                              0.0, value, 0.0)]))
    node.subscribe('/driver/joints', JointState, place)


class Hand:
    """Robot next to a player that is paused at the beginning."""

    def __init__(self, name: str, bag: Path) -> None:
        self.robot = RobotStage(ROBOTS[name], name, MODEL)
        play_joint_nodes(self.robot.node, name)
        self.player = SimulatedPlayer(self.robot.node, str(bag))

    def check(self, command: Callable[..., None], *arguments: Any) -> None:
        """Give a command; soon the velocity at the position must be published, and stay."""
        self.robot.forget()
        command(*arguments)
        self.robot.node.advance(0.3)
        wanted = (0.0, velocity(self.player.position_s), 0.0)
        assert self.robot.twists
        np.testing.assert_allclose(self.robot.velocity(), wanted, atol=NEAR_M_PER_S)
        self.robot.forget()
        self.robot.node.advance(0.5)
        for found in self.robot.velocities():
            np.testing.assert_allclose(found, wanted, atol=NEAR_M_PER_S)


@pytest.fixture
def hand(folder: Path) -> Iterator[Callable[..., Hand]]:
    """Return a function that sets up a robot next to a player."""
    hands: List[Hand] = []

    def make(name: str, bag: str = 'hand.bag') -> Hand:
        hands.append(Hand(name, folder / bag))
        return hands[-1]
    yield make
    for it in hands:
        it.player.close()


@pytest.mark.parametrize('frame', ['left_tip', 'left_tool'])
def test_the_curves_of_the_launcher_say_the_same(folder: Path, frame: str) -> None:
    path = folder / 'cell.xml'
    shutil.copy(MODELS / MODEL, folder)
    path.write_text(CELL.format(model=MODEL, frame=frame))
    devices = XmlParser().parse(str(path)).devices
    (curve,) = read_curves([str(folder / 'hand.bag')], devices, columns=LENGTH_MS // 100)
    wanted = np.abs([velocity(time_s) for time_s in curve.times_s])
    # Arrays are recorded 3 ms late.
    assert np.max(np.maximum(curve.low - wanted, wanted - curve.high)[2:-2]) < 2.0 * NEAR_M_PER_S
    assert np.max((curve.high - curve.low)[2:-2]) < 0.1


@pytest.mark.parametrize('name', PLACED)
def test_after_seeks_and_steps(hand: Callable[..., Hand], name: str) -> None:
    stage = hand(name)
    player = stage.player
    for position_s in (4.0, 7.7, 0.5, 4.0):
        stage.check(player.seek, position_s)
    for count in (1, -1, -20, 60):
        stage.check(player.step, count, '/driver/joints')
    stage.check(player.step, 0, '', -0.3)


@pytest.mark.parametrize('rate, begin_s', [(1.0, 1.0), (-1.0, 7.5), (4.0, 0.5), (0.25, 3.0)])
@pytest.mark.parametrize('name', ['tip', 'array', 'link', 'cart', 'only'])
def test_when_it_is_paused_while_it_plays(hand: Callable[..., Hand], name: str, rate: float,
                                          begin_s: float) -> None:
    stage = hand(name)
    stage.check(stage.player.seek, begin_s)
    stage.player.play(rate)
    stage.robot.node.advance(HEAD_START_NS * 1e-9 + 0.4321 / abs(rate))
    stage.check(stage.player.pause)


@pytest.mark.parametrize('rate, begin_s', [(1.0, 1.0), (-1.0, 7.5), (4.0, 0.5)])
def test_while_it_plays_each_velocity_is_the_one_of_its_stamp(
        hand: Callable[..., Hand], rate: float, begin_s: float) -> None:
    stage = hand('tip')
    stage.check(stage.player.seek, begin_s)
    stage.player.play(rate)
    node = stage.robot.node
    node.advance(0.3 / abs(rate))
    stage.robot.forget()
    node.advance(1.0 / abs(rate))
    end_s, now_s = stage.player.position_s, node.now_s
    errors = [abs(it.twist.linear.y - velocity(end_s - rate * (now_s - it.header.stamp.to_sec())))
              for it in stage.robot.twists]
    assert len(errors) > 20
    assert max(errors) < NEAR_M_PER_S


@pytest.mark.parametrize('name', ['link', 'only'])
def test_a_recording_of_joints_alone(hand: Callable[..., Hand], name: str) -> None:
    stage = hand(name, 'joints.bag')
    for position_s in (4.0, 0.5):
        stage.check(stage.player.seek, position_s)


def test_without_the_joints_there_is_none_and_it_is_said_why(hand: Callable[..., Hand]) -> None:
    stage = hand('tip', 'without.bag')
    for position_s in (4.0, 6.0, 4.5):
        stage.player.seek(position_s)
        stage.robot.node.advance(1.0)
    assert stage.robot.reports('does not say where the tool is', 'record /driver/joints')
    stage.player.play()
    stage.robot.node.advance(1.0)
    assert stage.robot.twists == []


def test_a_frame_with_a_prefix_that_the_model_lacks(hand: Callable[..., Hand]) -> None:
    stage = hand('odd')
    stage.robot.node.advance(3.0)
    assert stage.robot.reports('my_left_tool left_tool', 'prefix="my_"')
