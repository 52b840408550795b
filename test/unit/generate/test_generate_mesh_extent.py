# SPDX-License-Identifier: BSD-3-Clause
"""Mesh sizes, in files of the three kinds that RViz reads."""
from __future__ import annotations

import os
import struct
import threading
from pathlib import Path

import numpy as np
import pytest

from process_visualizer.generate.cell_extent import mesh_corners
from process_visualizer.robot.mesh_files import MeshError, check_mesh_file

TRIANGLE = [(0.0, 0.0, 0.0), (1.0, 0.0, -2.0), (0.5, 3.0, 0.0)]
LOW, HIGH = [0.0, 0.0, -2.0], [1.0, 3.0, 0.0]
COLLADA = '''<?xml version="1.0"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
  <asset><unit name="millimeter" meter="0.001"/></asset>
  <library_geometries><geometry id="g"><mesh>
    <source id="p"><float_array id="pa" count="9">0 0 0 1 0 -2 0.5 3 0</float_array></source>
    <source id="n"><float_array id="na" count="3">99 99 99</float_array></source>
    <vertices id="v"><input semantic="POSITION" source="#p"/></vertices>
  </mesh></geometry></library_geometries>
  <library_nodes><node id="part"><instance_geometry url="#g"/></node></library_nodes>
  <library_visual_scenes><visual_scene id="s"><node>
    <translate>10 0 0</translate><rotate>0 0 1 90</rotate><scale>2 2 2</scale>
    <node><matrix>1 0 0 0 0 1 0 0 0 0 1 5 0 0 0 1</matrix>{shown}</node>
  </node></visual_scene></library_visual_scenes>
</COLLADA>'''


def binary_stl() -> bytes:
    face = struct.pack('<12fH', 0, 0, 1, *(value for corner in TRIANGLE for value in corner), 0)
    return b'solid but binary'.ljust(80) + struct.pack('<I', 1) + face


def text_stl() -> bytes:
    corners = '\n'.join(f'   vertex {x} {y} {z}' for x, y, z in TRIANGLE)
    return (f'solid a\n facet normal 0 0 1\n  outer loop\n{corners}\n  endloop\n endfacet\n'
            'endsolid a\n').encode()


def obj() -> bytes:
    corners = '\n'.join(f'v {x} {y} {z} 1.0' for x, y, z in TRIANGLE)
    return f'# a triangle\n{corners}\nvn 9 9 9\nf 1 2 3\n'.encode()


@pytest.mark.parametrize(('name', 'content'), [
    ('a.stl', binary_stl()), ('b.STL', text_stl()), ('c.obj', obj())])
def test_triangle(name: str, content: bytes, tmp_path: Path) -> None:
    (tmp_path / name).write_bytes(content)
    np.testing.assert_allclose(mesh_corners(str(tmp_path / name)), [LOW, HIGH])


@pytest.mark.parametrize('shown', ['<instance_geometry url="#g"/>', '<instance_node url="#part"/>'])
def test_collada_with_its_unit_and_its_nodes(shown: str, tmp_path: Path) -> None:
    path = tmp_path / 'a.dae'
    path.write_text(COLLADA.format(shown=shown))
    np.testing.assert_allclose(mesh_corners(str(path)),
                               [[0.004, 0.0, 0.006], [0.010, 0.002, 0.010]], atol=1e-12)


@pytest.mark.parametrize(('name', 'content'), [
    ('a.dae', b'<COLLADA'),
    ('b.dae', COLLADA.format(shown='<instance_geometry url="#x"/>').encode()),
    ('c.stl', b''), ('d.obj', b'v 1 2 x\n'), ('e.fbx', b'Kaydara'),
    ('f.obj', b'v nan 0 0\n')])
def test_what_cannot_be_read_has_no_size(name: str, content: bytes, tmp_path: Path) -> None:
    (tmp_path / name).write_bytes(content)
    assert mesh_corners(str(tmp_path / name)) is None
    assert mesh_corners(str(tmp_path / 'gone.stl')) is None


def test_changed_file_is_read_again(tmp_path: Path) -> None:
    path = tmp_path / 'a.obj'
    path.write_bytes(obj())
    mesh_corners(str(path))
    path.write_bytes(b'v 7 7 7\n')
    np.testing.assert_allclose(mesh_corners(str(path)), [[7, 7, 7]] * 2)


def test_a_pipe_is_no_mesh(tmp_path: Path) -> None:
    """A reader waits until another process writes into it, and then for the end."""
    path = tmp_path / 'a.obj'
    os.mkfifo(path)
    writer = threading.Thread(target=path.write_bytes, args=(obj(),))
    writer.start()
    try:
        assert mesh_corners(str(path)) is None
        with pytest.raises(MeshError, match='is not a file'):
            check_mesh_file(str(path))
    finally:
        with open(os.open(path, os.O_RDONLY | os.O_NONBLOCK), 'rb'):
            writer.join()


def within_each_other(count: int) -> str:
    """Return nested nodes, each of which shows the next one twice."""
    twice = ''.join(f'<node id="n{number}">' + f'<instance_node url="#n{number + 1}"/>' * 2
                    + '</node>' for number in range(count))
    return f'<library_nodes>{twice}<node id="n{count}"><instance_geometry url="#g"/></node>' \
        '</library_nodes>'


@pytest.mark.parametrize(('nodes', 'shown', 'reason'), [
    (within_each_other(17), '<instance_node url="#n0"/>', 'shows more than'),
    ('<library_nodes><node id="n0"><instance_node url="#n0"/></node></library_nodes>',
     '<instance_node url="#n0"/>', 'shows more than'),
    ('', '<node>' * 300 + '<instance_geometry url="#g"/>' + '</node>' * 300, 'nested more than')])
def test_a_collada_file_of_endless_nodes_is_refused(nodes: str, shown: str, reason: str,
                                                    tmp_path: Path) -> None:
    """Readers would need years, or crash."""
    path = tmp_path / 'a.dae'
    scene = '<library_visual_scenes>'
    path.write_text(COLLADA.format(shown=shown).replace(scene, nodes + scene))
    with pytest.raises(MeshError, match=reason):
        check_mesh_file(str(path))
    assert mesh_corners(str(path)) is None


def test_a_collada_file_with_entities_is_refused(tmp_path: Path) -> None:
    path = tmp_path / 'a.dae'
    text = COLLADA.format(shown='<instance_geometry url="#g"/>').replace('0 0 0 1 0', '&a; 1 0')
    path.write_text(text.replace('<COLLADA', '<!DOCTYPE a [<!ENTITY a "0 0 0">]><COLLADA', 1))
    with pytest.raises(MeshError, match='DOCTYPE'):
        check_mesh_file(str(path))
    assert mesh_corners(str(path)) is None


def test_a_collada_file_may_show_a_node_often(tmp_path: Path) -> None:
    path = tmp_path / 'a.dae'
    path.write_text(COLLADA.format(shown='<instance_node url="#part"/>' * 1000))
    check_mesh_file(str(path))
    assert mesh_corners(str(path)) is not None
