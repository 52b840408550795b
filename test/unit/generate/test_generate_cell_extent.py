# SPDX-License-Identifier: BSD-3-Clause
"""The space that cells take up, for the initial view."""
from __future__ import annotations

from pathlib import Path
from typing import Callable, Dict, List

import numpy as np
import pytest

from process_visualizer.cell.model import Cell
from process_visualizer.cell.xml_parser import XmlParser
from process_visualizer.generate.cell_extent import ModelExtent, cell_extent
from process_visualizer.robot.description import describe_devices

REPOSITORY = Path(__file__).resolve().parents[3]
UR, PANDA = (REPOSITORY / 'test' / 'data' / name for name in ('ur5e.urdf', 'panda.urdf'))
BOX = ('<robot name="b"><link name="{0}"><visual><origin xyz="0 0 {2}"/><geometry>'
       '<box size="{1}"/></geometry></visual></link></robot>')
Parse = Callable[[str], Cell]


def extent(cell: Cell) -> Dict[str, List[List[float]]]:
    """The lowest and the highest visible corner of each device."""
    descriptions, problems = describe_devices(cell.devices)
    assert not problems
    return {name: [points.min(axis=0).round(3).tolist(), points.max(axis=0).round(3).tolist()]
            for name, points in cell_extent(cell, cell.devices, descriptions).items()
            if len(points)}


def machine(package: Path, name: str, size: str, place: str, content: str = '',
            middle: float = 0.0) -> str:
    (package / 'urdf' / f'{name}.urdf').write_text(BOX.format(name, size, middle))
    return (f'<device type="other" name="{name}"><base frame="{name}" {place}/>'
            f'<model pkg="my_cell" path="urdf/{name}.urdf"/>{content}</device>')


def arm(package: Path, model: Path, base: str, place: str) -> str:
    (package / 'urdf' / model.name).write_text(model.read_text())
    return (f'<device type="robot" name="arm"><base frame="{base}" {place}/>'
            f'<model pkg="my_cell" path="urdf/{model.name}"/>'
            '<topic name="q" type="joint_states"/></device>')


def test_machine_at_its_base(package: Path, parse: Parse) -> None:
    cell = parse(machine(package, 'press', '2 1 3', 'xyz="5 0 0.5" ypr="1.5707963 0 0"',
                         '<topic name="t"/>', middle=1.5))
    assert extent(cell) == {'press': [[4.5, -1.0, 0.5], [5.5, 1.0, 3.5]]}


@pytest.mark.parametrize(('model', 'base'), [(UR, 'base_link'), (PANDA, 'panda_link0')])
def test_arm_with_its_reach(model: Path, base: str, package: Path, parse: Parse) -> None:
    """On its table, 5 m from the origin, it is in view in its whole reach, except in the table."""
    low, high = np.array(extent(parse(arm(package, model, base, 'xyz="5 0 0.8"')))['arm'])
    place = np.array([5.0, 0.0, 0.8])
    assert (high - place > [0.5, 0.5, 0.8]).all()
    assert (place - low > [0.5, 0.5, 0.0]).all()
    assert place[2] - low[2] < 0.2
    assert (high - low < 2.6).all()


def test_table_is_in_the_picture_and_a_mast_is_cut_off(package: Path, parse: Parse) -> None:
    found = extent(parse(arm(package, UR, 'base_link', 'xyz="0 0 0.8"')
                         + machine(package, 'table', '2 1 0.8', '', middle=0.4)
                         + machine(package, 'mast', '0.1 0.1 9', '', middle=4.5)))
    assert found['table'] == [[-1.0, -0.5, 0.0], [1.0, 0.5, 0.8]]
    assert found['mast'][1][2] == pytest.approx(found['arm'][1][2])


def test_scenery_alone_is_seen_whole(package: Path, parse: Parse) -> None:
    assert extent(parse(machine(package, 'mast', '0.1 0.1 9', '', middle=4.5))) == {
        'mast': [[-0.05, -0.05, 0.0], [0.05, 0.05, 9.0]]}


def test_region_and_variable_in_their_frames(package: Path, parse: Parse) -> None:
    found = extent(parse(
        machine(package, 'oven', '1 1 1', 'xyz="2 0 0"',
                '<variable topic="t" frame="oven" axis="z"/>')
        + '<device type="depth_sensor" name="eye"><base frame="eye" xyz="0 0 50"/>'
          '<topic name="raw" type="pointcloud" record="False"/>'
          '<roi frame="oven" xyz="0 2 0" size="1 1 4"/></device>'))
    assert found == {'oven': [[1.5, -0.5, -0.5], [2.5, 0.5, 0.5]],
                     'eye': [[1.5, 1.5, -2.0], [2.5, 2.5, 2.0]]}


def test_cell_of_cameras_only(parse: Parse) -> None:
    device = ('<device type="depth_sensor" name="{0}"><base frame="{1}" xyz="1 2 3"/>'
              '<topic name="{0}" type="pointcloud" record="False"/></device>')
    found = extent(parse(device.format('eye', 'camera_link')
                         + device.format('other', 'other_optical_frame')))
    assert found['eye'] == [[1.0, 1.25, 2.25], [2.5, 2.75, 3.75]]  # x forward
    assert found['other'] == [[0.25, 1.25, 3.0], [1.75, 2.75, 4.5]]  # z forward


def test_what_is_placed_nowhere_is_not_seen(parse: Parse) -> None:
    assert extent(parse('<device type="robot" name="arm"/>'
                        '<device type="other" name="a">'
                        '<variable topic="t" frame="gone"/></device>')) == {}


def test_without_a_model_there_is_room_around_the_base(parse: Parse) -> None:
    assert extent(parse('<device type="other" name="a"><base frame="a" xyz="3 0 0"/></device>')) \
        == {'a': [[2.5, -0.5, -0.5], [3.5, 0.5, 0.5]]}


@pytest.mark.parametrize(('low', 'high', 'default'), [
    (-1.0, 2.0, 0.0), (0.5, 1.5, 1.0), (-3.0, -0.1, -1.55)])
def test_default_positions_obey_the_limits(low: float, high: float, default: float) -> None:
    """As with joint_state_publisher: zero, or the middle if zero is not allowed."""
    urdf = ('<robot name="r"><link name="a"/><link name="b"/><joint name="j" type="prismatic">'
            f'<parent link="a"/><child link="b"/><limit lower="{low}" upper="{high}"/>'
            '</joint></robot>')
    model = ModelExtent(urdf)
    assert model.positions == {'j': pytest.approx(default)}
    reached = model.reach('b')[:, 0]
    assert low <= reached.min() < reached.max() <= high
    assert np.ptp(reached) > 0.9 * (high - low)


def test_the_unknown_travel_of_a_slide_is_no_angle() -> None:
    model = ModelExtent('<robot name="r"><link name="a"/><link name="b"/><joint name="j" '
                        'type="prismatic"><parent link="a"/><child link="b"/></joint></robot>')
    assert not model.reach('b').any()


def test_meshes_of_the_sewing_cell_are_read() -> None:
    cell = XmlParser().parse(str(REPOSITORY / 'sewing_cell' / 'devices' / 'variables.xml'))
    found = extent(cell)
    low, high = np.array(found['sewing_machine'])
    assert (high - low > 0.5).all()
    assert (high - low < 1.8).all()
