# SPDX-License-Identifier: BSD-3-Clause
"""The tool frame in a model, if the configuration does not name it."""
from __future__ import annotations

from pathlib import Path
from typing import Callable, Dict, List

import pytest

from process_visualizer.cell.model import Cell
from process_visualizer.robot.description import RobotDescription, load_robot_description
from process_visualizer.robot.tool_frame import tool_frame

Parse = Callable[[str], Cell]
DATA = Path(__file__).resolve().parents[2] / 'data'


def model(parents: Dict[str, str], drawn: str = '', collision_only: str = '') -> RobotDescription:
    links = tuple(dict.fromkeys(['base', *parents.values(), *parents]))
    return RobotDescription('', links, {}, parents, frozenset(drawn.split()),
                            frozenset(collision_only.split()))


def chain(*names: str) -> Dict[str, str]:
    return dict(zip(names, ('base', *names)))


def chosen(parse: Parse, description: 'RobotDescription | None', elements: str = '') -> str:
    device = parse(f'<device type="robot" name="r">{elements}</device>').devices[0]
    return tool_frame(device, description).frame


@pytest.mark.parametrize('file, frame', [
    ('ur5e', 'tool0'), ('panda', 'panda_link8'), ('panda_hand', 'panda_hand')])
def test_robots_in_the_style_of_their_makers(file: str, frame: str, parse: Parse) -> None:
    assert chosen(parse, load_robot_description(str(DATA / f'{file}.urdf'))) == frame


@pytest.mark.parametrize('names, frame', [
    ([], 'base'), (['a', 'tool', 'tip'], 'tool'), (['r/tool', 'tip'], 'r/tool'),
    (['flange', 'tool0'], 'tool0'), (['left_tool0', 'camera'], 'left_tool0'),
    (['flange', 'tcp_link', 'sensor'], 'tcp_link'), (['Flange', 'cable'], 'Flange'),
    (['wrist', 'hand', 'finger'], 'hand'), (['toolchanger', 'tools'], 'tools'),
    (['stool', 'shorthand'], 'shorthand')])
def test_names_of_tools(names: List[str], frame: str, parse: Parse) -> None:
    assert chosen(parse, model(chain(*names))) == frame


def test_the_deepest_of_equal_names(parse: Parse) -> None:
    assert chosen(parse, model({**chain('x_tool0'), **chain('a', 'y_tool0')})) == 'y_tool0'


def test_a_link_for_collisions_only_is_never_the_tool(parse: Parse) -> None:
    parents = {'a': 'base', 'b': 'a', 'b_sc': 'b', 'tool': 'b_sc'}
    assert chosen(parse, model(parents, 'base a b', 'b_sc tool')) == 'b'


def test_the_longest_chain_of_links_that_are_drawn(parse: Parse) -> None:
    parents = {**chain('a', 'b'), **chain('c', 'd', 'e')}
    assert chosen(parse, model(parents)) == 'e'
    assert chosen(parse, model(parents, 'base a b')) == 'b'


def test_one_bare_frame_behind_the_last_link_is_the_flange_and_several_are_not(
        parse: Parse) -> None:
    parents = {**chain('a', 'b', 'end'), 'b_sc': 'b'}
    assert chosen(parse, model(parents, 'a b', 'b_sc')) == 'end'
    assert chosen(parse, model({**parents, 'sensor': 'b'}, 'a b', 'b_sc')) == 'b'


def test_long_chain(parse: Parse) -> None:
    assert chosen(parse, model(chain(*(f'l{i}' for i in range(1200))))) == 'l1199'


def test_what_is_configured_counts(parse: Parse) -> None:
    arm = model(chain('a', 'tool'))
    assert chosen(parse, arm, '<tool frame="a"/>') == 'a'
    assert chosen(parse, arm, '<tool frame="elsewhere"/>') == 'elsewhere'
    device = parse('<device type="robot" name="r"><tool frame="a" xyz="0 0 1"/>'
                   '</device>').devices[0]
    found = tool_frame(device, arm)
    assert (found.frame, found.parent, found.pose.xyz) == ('r/tool_center_frame', 'a', (0, 0, 1))
    assert found.reason == 'as configured'


def test_the_frame_of_a_tf_topic_counts_where_the_model_has_it_or_there_is_none(
        parse: Parse) -> None:
    topic = ('<topic name="tf" type="tool_center_frame" msg="tf2_msgs/TFMessage" '
             'frame="{}"/>').format
    assert chosen(parse, model(chain('a', 'tool')), topic('a')) == 'a'
    assert chosen(parse, model(chain('a', 'tool')), topic('controller')) == 'tool'
    assert chosen(parse, None, topic('controller')) == 'controller'
