# SPDX-License-Identifier: BSD-3-Clause
"""What a page shows of models: their shapes, colors and meshes, and frames on /tf_static."""
from __future__ import annotations

from pathlib import Path

import genpy
import numpy as np
import pytest
import rosbag
from geometry_msgs.msg import TransformStamped
from page_reader import PageReader
from std_msgs.msg import Float32
from tf2_msgs.msg import TFMessage

from process_visualizer.commands.command_line import main
from process_visualizer.page.link_meshes import LinkMeshes, thinned
from process_visualizer.robot.visuals import MeshError, link_visuals, read_colored_mesh

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
    assert reader.column(arrow['vectors'], 3)[5] == pytest.approx([0.0, 0.0, 0.2])
