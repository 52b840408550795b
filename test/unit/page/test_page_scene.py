# SPDX-License-Identifier: BSD-3-Clause
"""Models on a page: their shapes, colors and meshes, and frames on /tf_static."""
from __future__ import annotations

from pathlib import Path

import genpy
import numpy as np
import pytest
import rosbag
from geometry_msgs.msg import TransformStamped
from page_reader import PageReader
from sensor_msgs.msg import JointState
from std_msgs.msg import Float32, Header
from tf2_msgs.msg import TFMessage

from process_visualizer.commands.command_line import main
from process_visualizer.page.link_meshes import LinkMeshes, thinned
from process_visualizer.page.robots import RowsOfJoints, link_places
from process_visualizer.robot.arrows import VARIABLE_DIAMETER_M
from process_visualizer.robot.kinematics import Kinematics, Placement
from process_visualizer.robot.mesh_files import MeshError
from process_visualizer.robot.visuals import (
    LinkVisual,
    ShapeKind,
    link_visuals,
    read_colored_mesh,
)

REPOSITORY = Path(__file__).resolve().parents[3]
MESH = REPOSITORY / 'sewing_cell/meshes/sewing_machine.dae'
SHAPES = '''<robot name="r"><material name="blue"><color rgba="0 0 1 1"/></material>
<link name="a"><visual><origin xyz="0 0 1"/><geometry><box size="0.2 0.4 0.6"/></geometry>
<material name="blue"/></visual></link>
<link name="b"><visual><geometry><cylinder radius="0.5" length="2"/></geometry></visual></link>
<link name="c"><visual><geometry><sphere radius="0.5"/></geometry></visual></link>
<link name="d"><visual><geometry><mesh filename="package://nowhere/a.stl"/></geometry></visual>
</link></robot>'''
CELL = '''<visualizer>
  <device type="other" name="machine">
    <base frame="machine/base" xyz="1 2 3"/>
    <variable topic="feed" frame="needle" axis="0 0 1" unit="m/s" label="feed" scale="2"/>
  </device>
</visualizer>'''


def test_a_mesh_is_read_with_its_colors() -> None:
    mesh = read_colored_mesh(str(MESH))
    assert mesh.has_colors
    assert len(np.unique(mesh.colors, axis=0)) > 3
    assert np.linalg.norm(mesh.normals, axis=1) == pytest.approx(1.0, abs=1e-3)


def test_what_is_no_mesh_is_an_error_with_its_name(tmp_path: Path) -> None:
    path = tmp_path / 'a.stl'
    path.write_text('solid\n', encoding='utf-8')
    with pytest.raises(MeshError, match='a.stl cannot be read'):
        read_colored_mesh(str(path))


def test_shapes_have_their_size_and_the_color_of_the_model() -> None:
    reader = LinkMeshes()
    found = {it.link: it.mesh for it in reader.of(link_visuals(SHAPES))}
    assert [len(it) for it in found] == [1, 1, 1]
    box = found['a']
    assert np.ptp(box.positions, axis=0) == pytest.approx([0.2, 0.4, 0.6])
    assert box.positions.mean(axis=0) == pytest.approx([0.0, 0.0, 1.0])
    assert np.unique(box.colors, axis=0).tolist() == [[0, 0, 255]]
    assert np.ptp(found['b'].positions, axis=0) == pytest.approx([1.0, 1.0, 2.0])
    for mesh in found.values():  # seen from outside
        corners = mesh.positions[mesh.triangles]
        faces = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        large = np.linalg.norm(faces, axis=1) > 1e-9
        assert ((faces * mesh.normals[mesh.triangles[:, 0]]).sum(axis=1)[large] > 0.0).all()
    assert reader.notes == ['not shown: the mesh package://nowhere/a.stl is not found']


def test_a_model_of_endless_shapes_takes_no_endless_memory() -> None:
    """Some kB of a recording can show a million of them; the page is thinned only afterward."""
    box = LinkVisual('tool', Placement(), ShapeKind.BOX, (1.0, 1.0, 1.0))
    reader = LinkMeshes()
    tool, = reader.of([box] * 5_003)
    assert len(tool.mesh.triangles) == 5_000 * 12
    assert reader.notes == ['3 shapes are not shown: a page has at most 5000, of 5000000 triangles']


def test_large_meshes_are_thinned_and_keep_their_extent() -> None:
    mesh = read_colored_mesh(str(MESH))
    small = mesh._replace(triangles=mesh.triangles[:10])
    most = len(mesh.triangles) // 3
    slim, kept = thinned([mesh, small], most)
    assert len(slim.triangles) + len(kept.triangles) <= most
    assert kept is small
    assert np.ptp(slim.positions, axis=0) == pytest.approx(np.ptp(mesh.positions, axis=0),
                                                           rel=0.05, abs=0.02)


def test_an_arrow_in_a_frame_of_the_recording_is_there(tmp_path: Path) -> None:
    config, bag, page = (tmp_path / name for name in ('cell.xml', 'a.bag', 'page.html'))
    config.write_text(CELL, encoding='utf-8')
    needle = TransformStamped(child_frame_id='needle')
    needle.header.frame_id = 'machine/base'
    needle.transform.translation.z, needle.transform.rotation.w = 0.5, 1.0
    with rosbag.Bag(str(bag), 'w') as file:
        file.write('/tf_static', TFMessage([needle]), genpy.Time(100))
        for number in range(100):
            file.write('/feed', Float32(0.1), genpy.Time.from_sec(100.0 + 0.02 * number))
    assert main(['share', str(bag), '--config', str(config), '-o', str(page)]) == 0
    reader = PageReader(page.read_text(encoding='utf-8'))
    arrow, = reader.data['runs'][0]['arrows']
    assert reader.place(0, arrow['frame'], 1.0)[0].tolist() == [1.0, 2.0, 3.5]
    assert reader.data['runs'][0]['notes'] == [
        'the configuration has no model of a robot or machine; the picture has none']
    assert reader.column(arrow['vectors'], 3)[5] == pytest.approx([0.0, 0.0, 0.2])


def test_a_variable_called_force_is_no_force(tmp_path: Path) -> None:
    """It has the color, the width and the number of a variable."""
    config, bag, page = (tmp_path / name for name in ('cell.xml', 'a.bag', 'page.html'))
    config.write_text(CELL.replace('label="feed"', 'label="force" color="cyan"').replace(
        'frame="needle"', 'frame="machine/base"'), encoding='utf-8')
    with rosbag.Bag(str(bag), 'w') as file:
        for number in range(100):
            file.write('/feed', Float32(0.1), genpy.Time.from_sec(100.0 + 0.02 * number))
    assert main(['share', str(bag), '--config', str(config), '-o', str(page)]) == 0
    arrow, = PageReader(page.read_text(encoding='utf-8')).data['runs'][0]['arrows']
    assert arrow['variable'] and arrow['color'] == [0.0, 0.85, 0.95]
    assert arrow['diameter'] == VARIABLE_DIAMETER_M


CART = '<robot name="cart"><link name="cart"/>' + '''<link name="arm"><visual><geometry>
<box size="0.1 0.1 0.1"/></geometry></visual></link><joint name="turn" type="revolute">
<parent link="cart"/><child link="arm"/><axis xyz="0 0 1"/><origin xyz="0.5 0 0"/>
<limit lower="-3" upper="3" effort="1" velocity="1"/></joint></robot>'''
CART_CELL = '''<visualizer>
  <device type="robot" name="cart"><model path="cart.urdf"/>
    <topic ns="/" name="joints" type="joint_states" msg="sensor_msgs/JointState"/></device>
</visualizer>'''


def transform(parent: str, child: str, x_m: float, yaw: float, time_s: float) -> TransformStamped:
    it = TransformStamped(child_frame_id=child)
    it.header.frame_id, it.header.stamp = parent, genpy.Time.from_sec(time_s)
    it.transform.translation.x = x_m
    it.transform.rotation.z, it.transform.rotation.w = np.sin(yaw / 2), np.cos(yaw / 2)
    return it


@pytest.mark.parametrize('has_joints', [True, False])
def test_a_robot_that_tf_moves_is_where_tf_has_it(tmp_path: Path, has_joints: bool) -> None:
    """Odometry in a map that a localization shifts: the latest of each, as in RViz."""
    config, bag, page = (tmp_path / name for name in ('cell.xml', 'a.bag', 'page.html'))
    config.write_text(CART_CELL, encoding='utf-8')
    (tmp_path / 'cart.urdf').write_text(CART, encoding='utf-8')
    with rosbag.Bag(str(bag), 'w') as file:
        file.write('/tf_static', TFMessage([transform('world', 'map', 10.0, 0.0, 0.0)]),
                   genpy.Time(100))
        for number in range(300):
            time_s = 100.0 + 0.01 * number
            stamp = genpy.Time.from_sec(time_s)
            if number % 20 == 0:
                file.write('/tf', TFMessage([transform('map', 'odom', 0.01 * number, 0.0,
                                                       time_s)]), stamp)
            if number % 2 == 0:
                file.write('/tf', TFMessage([transform('odom', 'cart', 0.02 * number,
                                                       0.005 * number, time_s)]), stamp)
            if has_joints:
                file.write('/joints', JointState(name=['turn'], position=[0.3],
                                                 header=Header(stamp=stamp)), stamp)
            else:
                file.write('/feed', Float32(0.1), stamp)
    assert main(['share', str(bag), '--config', str(config), '-o', str(page)]) == 0
    reader = PageReader(page.read_text(encoding='utf-8'))
    (_, link, place), = reader.links(0)
    assert link == 'arm'
    for time_s in (0.411, 1.237, 2.053, 2.611):
        shifted_s, driven_s = time_s - time_s % 0.2, time_s - time_s % 0.02
        yaw = 0.5 * driven_s
        position, turn = reader.place(0, place, time_s)
        assert position == pytest.approx(
            [10.0 + shifted_s + 2.0 * driven_s + 0.5 * np.cos(yaw), 0.5 * np.sin(yaw), 0.0],
            abs=2e-4)
        assert abs(turn[2]) == pytest.approx(np.sin((yaw + 0.3 * has_joints) / 2), abs=1e-3)
    assert not any('does not say where' in it for it in reader.data['runs'][0]['notes'])


def test_a_robot_of_which_nothing_says_where_it_is_is_named(tmp_path: Path) -> None:
    config, bag, page = (tmp_path / name for name in ('cell.xml', 'a.bag', 'page.html'))
    config.write_text(CART_CELL, encoding='utf-8')
    (tmp_path / 'cart.urdf').write_text(CART, encoding='utf-8')
    with rosbag.Bag(str(bag), 'w') as file:
        for number in range(50):
            stamp = genpy.Time.from_sec(100.0 + 0.02 * number)
            file.write('/joints', JointState(name=['turn'], position=[0.3]), stamp)
    assert main(['share', str(bag), '--config', str(config), '-o', str(page)]) == 0
    assert 'cart: the recording does not say where its frame cart is; shown at world' in \
        PageReader(page.read_text(encoding='utf-8')).data['runs'][0]['notes']


def test_a_number_that_was_never_one_is_named(tmp_path: Path) -> None:
    config, bag, page = (tmp_path / name for name in ('cell.xml', 'a.bag', 'page.html'))
    config.write_text(CELL.replace('frame="needle"', 'frame="machine/base"'), encoding='utf-8')
    with rosbag.Bag(str(bag), 'w') as file:
        for number in range(100):
            file.write('/feed', Float32(float('nan')), genpy.Time.from_sec(100.0 + 0.02 * number))
    assert main(['share', str(bag), '--config', str(config), '-o', str(page)]) == 0
    run = PageReader(page.read_text(encoding='utf-8')).data['runs'][0]
    assert run['lanes'] == []
    assert 'machine feed: no number was recorded, at most NaN or infinity' in run['notes']


def test_a_long_chain_of_links_may_be_named_from_its_end() -> None:
    links = [f'l{number}' for number in range(1000)]
    joints = ''.join(f'<joint name="j{it}" type="fixed"><origin xyz="1 0 0"/><parent link="{it}"/>'
                     f'<child link="{child}"/></joint>' for it, child in zip(links, links[1:]))
    model = Kinematics('<robot name="r">' + ''.join(
        f'<link name="{it}"/>' for it in reversed(links)) + joints + '</robot>')
    places = link_places(model, Placement(), RowsOfJoints(np.zeros(0), {}))
    last = places['l999']
    assert isinstance(last, Placement) and last.position == (999.0, 0.0, 0.0)
