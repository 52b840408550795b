# SPDX-License-Identifier: BSD-3-Clause
"""The launch files of the parts: together they equal the single launch file; their changes."""
from __future__ import annotations

from pathlib import Path
from typing import Callable, Dict

import pytest
from golden import BAG, CASES, make_plan
from launch_loading import load_file, node_names, parameters

from process_visualizer.cell.model import Cell, Mode
from process_visualizer.generate.choice import Choice, RvizStart
from process_visualizer.generate.generator import generate_parts
from process_visualizer.generate.plan import (
    BAG_PART,
    FRAMES_PART,
    LAUNCH_FILE,
    RVIZ_PART,
    Plan,
    write_plan,
)
from process_visualizer.robot.description import is_own_description

Parse = Callable[[str], Cell]
ROBOT = ('<device type="robot" name="arm"><model pkg="my_cell" path="urdf/arm.urdf"/>{}'
         '<topic name="q" type="joint_states"/></device>')
URDF = ('<robot name="arm"><link name="arm/base"/><link name="arm/tool"/><joint name="j" '
        'type="continuous"><parent link="arm/base"/><child link="arm/tool"/></joint></robot>')
OTHER = '<device type="other" name="box">{}</device>'


@pytest.fixture
def plan(parse: Parse, package: Path) -> Callable[..., Plan]:
    """The plan with parts of the devices given as text."""
    (package / 'urdf' / 'arm.urdf').write_text(URDF)

    def make(text: str, mode: Mode = Mode.REALTIME, bag: 'str | None' = None,
             rviz: RvizStart = RvizStart.OPTIONAL) -> Plan:
        cell = parse(text)
        return generate_parts(Choice(cell, mode, cell.devices, rviz, bag))
    return make


def changed(before: Plan, after: Plan) -> 'set[str]':
    """The names of parts that are not in both, or differ."""
    return {name for name in {*before.parts, *after.parts}
            if before.parts.get(name) != after.parts.get(name)}


@pytest.mark.parametrize('case', CASES)
def test_parts_together_are_the_cell(case: str, tmp_path: Path) -> None:
    plan = make_plan(case, generate_parts)
    write_plan(plan, str(tmp_path))
    whole = load_file(tmp_path / LAUNCH_FILE)
    found_nodes = []
    found_parameters: Dict[str, object] = {}
    for part in plan.parts.values():
        if part.launch_file is not None:
            config = load_file(tmp_path / part.launch_file)
            assert node_names(config) == sorted(part.nodes)
            found_nodes += node_names(config)
            found_parameters.update(parameters(config))
    assert sorted(found_nodes) == node_names(whole)
    assert found_parameters == parameters(whole)


@pytest.mark.parametrize('case', CASES)
def test_the_one_launch_file_is_the_same(case: str) -> None:
    plan, with_parts = make_plan(case), make_plan(case, generate_parts)
    assert plan.parts == {}
    assert {name: with_parts.files[name] for name in plan.files} == plan.files
    assert {name for name in with_parts.files if name not in plan.files} == {
        part.launch_file for part in with_parts.parts.values() if part.launch_file}


def test_names_of_the_parts(plan: Callable[..., Plan]) -> None:
    text = ROBOT.format('') + OTHER.format('')
    assert list(plan(text).parts) == [FRAMES_PART, 'arm', 'box', BAG_PART, RVIZ_PART]
    assert list(plan(text, rviz=RvizStart.NONE).parts) == [FRAMES_PART, 'arm', 'box', BAG_PART]
    assert list(plan(text, Mode.PLAYBACK).parts) == [FRAMES_PART, 'arm', 'box', RVIZ_PART]
    assert list(plan(text, Mode.PLAYBACK, BAG).parts) == [
        FRAMES_PART, 'arm', 'box', BAG_PART, RVIZ_PART]
    assert list(plan(OTHER.format(''), Mode.PLAYBACK, BAG).parts) == [
        FRAMES_PART, 'box', RVIZ_PART]


def test_devices_may_be_called_like_parts(plan: Callable[..., Plan]) -> None:
    nodes = '<node pkg="a" type="b" name="n"/>'
    made = plan(''.join(f'<device type="other" name="{name}">{nodes}</device>'
                        for name in ('frames', 'bag', 'rviz', 'rviz_')))
    assert {name: list(part.nodes) for name, part in made.parts.items()} == {
        FRAMES_PART: ['/cell_frames', '/scene_watch', '/view_relay'], RVIZ_PART: ['/rviz'],
        'frames': ['/frames/n'],
        'bag': ['/bag/n'], 'rviz': ['/rviz/n'], 'rviz_': ['/rviz_/n']}
    assert len({part.launch_file for part in made.parts.values()}) == len(made.parts)


def test_nodes_by_name_and_type(plan: Callable[..., Plan]) -> None:
    made = plan(OTHER.format(
        '<node pkg="a" type="b.py" name="n"/><node pkg="a" type="c" name="m" ns="/"/>'
        '<node pkg="a" type="c" name="k" ns="other/one"/>'
        '<node pkg="a" type="b" name="far" machine="pc"/>')
        + '<machine name="pc" address="pc"/>')
    assert made.parts['box'].nodes == {'/box/n': 'a/b.py', '/m': 'a/c', '/other/one/k': 'a/c'}


def test_nodes_of_an_included_launch_file(plan: Callable[..., Plan], package: Path) -> None:
    (package / 'launch' / 'driver.launch').write_text(
        '<launch><group ns="camera"><node pkg="rospy" type="driver" name="driver"/></group>'
        '<node pkg="rospy" type="x" name="$(anon x)"/></launch>')
    made = plan(OTHER.format('<launch pkg="my_cell" type="driver.launch"/>'))
    assert made.parts['box'].nodes == {'/camera/driver': 'rospy/driver'}


def test_part_without_anything_to_launch(plan: Callable[..., Plan]) -> None:
    part = plan(OTHER.format('')).parts['box']
    assert (part.launch_file, part.nodes) == (None, {})


def test_rviz_has_the_models_before_it_starts(plan: Callable[..., Plan], tmp_path: Path) -> None:
    made = plan(ROBOT.format(''))
    write_plan(made, str(tmp_path))
    config = load_file(tmp_path / str(made.parts[RVIZ_PART].launch_file))
    [(name, text)] = parameters(config).items()
    assert name == 'arm/robot_description' and str(text).startswith(URDF)
    assert is_own_description(str(text)) and not is_own_description(URDF)


def test_machines_are_known_in_every_part(plan: Callable[..., Plan], tmp_path: Path) -> None:
    made = plan('<machine name="pc" address="pc"/>' + OTHER.format(
        '<node pkg="a" type="b" name="far" machine="pc"/>'))
    write_plan(made, str(tmp_path))
    assert 'pc' in load_file(tmp_path / str(made.parts['box'].launch_file)).machines


def test_nothing_changes_with_the_place_in_the_file(plan: Callable[..., Plan]) -> None:
    text = ROBOT.format('') + OTHER.format('<node pkg="a" type="b" name="n"/>')
    assert changed(plan(text), plan('\n<!-- two lines further down -->\n' + text)) == set()


@pytest.mark.parametrize('inside, expected', [
    ('<base frame="arm/base"/>', {FRAMES_PART, 'arm'}),
    ('<param name="p" value="1"/>', {'arm'}),
    ('<node pkg="a" type="b" name="n"/>', {'arm'}),
    ('<topic name="more"/>', {BAG_PART}),
    ('<topic name="more" record="False"/>', set()),
    ('<rviz type="Axes"/>', {RVIZ_PART})])
def test_only_what_an_element_is_for_changes(inside: str, expected: 'set[str]',
                                             plan: Callable[..., Plan]) -> None:
    other = OTHER.format('<node pkg="a" type="b" name="n"/>')
    assert changed(plan(ROBOT.format('') + other), plan(ROBOT.format(inside) + other)) == expected


def test_a_device_that_is_moved_goes_on(plan: Callable[..., Plan]) -> None:
    before, after = (plan(ROBOT.format(f'<base frame="arm/base" xyz="{x} 0 0"/>')) for x in (0, 1))
    assert changed(before, after) == {FRAMES_PART}


def test_change_of_a_model(plan: Callable[..., Plan], package: Path) -> None:
    before = plan(ROBOT.format(''))
    (package / 'urdf' / 'arm.urdf').write_text(URDF.replace('continuous', 'fixed'))
    assert changed(before, plan(ROBOT.format(''))) == {'arm', RVIZ_PART}


def test_change_in_a_file_that_an_included_one_includes(plan: Callable[..., Plan],
                                                        package: Path) -> None:
    folder = package / 'launch'
    text = OTHER.format('<launch pkg="my_cell" type="outer.launch"/>')
    (folder / 'outer.launch').write_text(
        '<launch><include file="$(dirname)/inner.launch"/></launch>')
    (folder / 'inner.launch').write_text('<launch><param name="a" value="1"/></launch>')
    before = plan(text)
    (folder / 'inner.launch').write_text('<launch><param name="a" value="2"/></launch>')
    assert changed(before, plan(text)) == {'box'}


def test_new_and_gone_devices(plan: Callable[..., Plan]) -> None:
    one, two = plan(ROBOT.format('')), plan(ROBOT.format('') + OTHER.format('<rviz type="Axes"/>'))
    assert changed(one, two) == changed(two, one) == {'box', RVIZ_PART}
