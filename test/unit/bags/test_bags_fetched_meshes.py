# SPDX-License-Identifier: BSD-3-Clause
"""A recording cannot make RViz connect to anything or read a file that is not a mesh."""
from __future__ import annotations

import os
from io import BytesIO
from pathlib import Path
from typing import Any, Tuple

import pytest
import rosbag
import rospkg
from genpy import Time
from geometry_msgs.msg import Point
from std_msgs.msg import ColorRGBA, String
from visualization_msgs.msg import (
    InteractiveMarker,
    InteractiveMarkerControl,
    InteractiveMarkerInit,
    InteractiveMarkerPose,
    InteractiveMarkerUpdate,
    Marker,
    MarkerArray,
    MenuEntry,
)

from process_visualizer.bagio.message_definition import Connection
from process_visualizer.bagio.message_layout import MessageDamaged
from process_visualizer.bagio.message_parts import named_meshes
from process_visualizer.bagio.recording import Recording
from process_visualizer.playback.message_loader import MessageLoader
from process_visualizer.robot.mesh_files import mesh_problem


def mesh(uri: str, text: str = '') -> Marker:
    return Marker(type=Marker.MESH_RESOURCE, mesh_resource=uri, text=text)


def named(message: Any) -> Tuple[str, ...]:
    buffer = BytesIO()
    message.serialize(buffer)
    connection = Connection('/m', message._type, message._md5sum, message._full_text, False, '/n')
    return named_meshes(connection, memoryview(buffer.getvalue()))


@pytest.mark.parametrize('uri', ['http://127.0.0.1:1/a.dae', 'HTTPS://x/a', 'ftp://x/a',
                                 'sftp://u:p@x/a.stl', 'smb://x/a', '127.0.0.1:1/a.dae',
                                 'x/a.dae', 'http:/127.0.0.1:1/a.dae', 'http:x', '//x/a.dae',
                                 ' http://x/a', './a.dae', 'http:\\\\x/a'])
def test_what_would_be_fetched(uri: str) -> None:
    control = InteractiveMarkerControl(markers=[mesh(uri)])
    for message in (mesh(uri), mesh(uri, 'label'), MarkerArray([Marker(), mesh(uri)]),
                    InteractiveMarkerInit(markers=[InteractiveMarker(controls=[control])]),
                    InteractiveMarkerUpdate(markers=[InteractiveMarker(
                        menu_entries=[MenuEntry(title='m')], controls=[control, control])])):
        assert named(message) == (uri,)
    assert 'RViz would ask another computer' in mesh_problem(uri)


@pytest.mark.parametrize('message', [
    Marker(), mesh('', 'see http://127.0.0.1/manual for this'), mesh('', 'http://127.0.0.1/a.dae'),
    Marker(points=[Point()] * 3, colors=[ColorRGBA()] * 3),
    InteractiveMarkerUpdate(poses=[InteractiveMarkerPose(name='x/a')], erases=['x/a']),
    String('http://127.0.0.1/a.dae')])
def test_what_names_no_mesh(message: Any) -> None:
    assert not named(message)


@pytest.mark.parametrize('uri', [
    'package://sewing_cell/meshes/a.dae', 'package://not_installed/a.dae', 'file:///gone/a.dae',
    'FILE:///gone/a.dae', '/gone/a.dae', 'file:/gone/a.dae', 'file://localhost/gone/a.dae'])
def test_what_rviz_looks_for_here(uri: str) -> None:
    assert not mesh_problem(uri)


@pytest.mark.parametrize('uri', [
    'file:///dev/zero', 'file:/dev/zero', 'file://localhost/dev/zero', '/dev/zero',
    'file:///%64ev/zero', 'package://sewing_cell/../../../../../../../../../dev/zero'])
def test_a_device_is_no_mesh(uri: str) -> None:
    """RViz would read it until the memory is full."""
    assert mesh_problem(uri) == f'the mesh {path_in(uri)} is not a file'


def path_in(uri: str) -> str:
    """The file of such an address, by its name."""
    if uri.startswith('package://'):
        package, _, rest = uri[len('package://'):].partition('/')
        return os.path.join(rospkg.RosPack().get_path(package), rest)
    return '/dev/zero'


@pytest.mark.parametrize('ending', ['?a.dae', '#a.dae', '\n.dae', '\x1b.dae'])
def test_an_address_of_which_a_part_is_left_out(ending: str) -> None:
    assert 'not a plain address' in mesh_problem(f'file:///dev/zero{ending}')
    assert 'not a plain address' in mesh_problem('file:a.dae')
    assert 'not a plain address' in mesh_problem('file://host/a.dae')


def test_a_pipe_is_no_mesh(tmp_path: Path) -> None:
    """RViz would wait until another process writes into it."""
    os.mkfifo(tmp_path / 'a.dae')
    assert 'is not a file' in mesh_problem(f'file://{tmp_path}/a.dae')


@pytest.mark.parametrize(('name', 'content', 'is_shown'), [
    ('a.stl', b'solid a', True), ('a.obj', b'v 1 2 3', True), ('a.dae', b'<COLLADA/>', True),
    ('a.dae', b'<!DOCTYPE a [<!ENTITY b "c">]><COLLADA/>', False),
    ('a.x', b'xof 0302txt 0064', False), ('a', b'Kaydara FBX', False)])
def test_only_files_that_can_be_checked_are_shown(name: str, content: bytes, is_shown: bool,
                                                  tmp_path: Path) -> None:
    """Some assimp readers use up all memory for certain bytes."""
    (tmp_path / name).write_bytes(content)
    assert (not mesh_problem(f'file://{tmp_path}/{name}')) == is_shown


def test_a_hidden_ending_is_no_ending(tmp_path: Path) -> None:
    """assimp chooses the format by the address as written."""
    (tmp_path / 'a.dae').write_bytes(b'<COLLADA/>')
    assert mesh_problem(f'file://{tmp_path}/a.d%61e')


def test_a_type_of_another_name_is_read_all_the_same() -> None:
    buffer = BytesIO()
    mesh('http://x/a').serialize(buffer)
    connection = Connection('/m', 'a/B', Marker._md5sum, '', False, '/n')
    assert named_meshes(connection, memoryview(buffer.getvalue())) == ('http://x/a',)


def test_what_ends_too_early_is_damaged() -> None:
    buffer = BytesIO()
    MarkerArray([mesh('file:///a')]).serialize(buffer)
    data = buffer.getvalue()
    connection = Connection('/m', 'a/B', MarkerArray._md5sum, '', False, '/n')
    for end in range(len(data)):
        with pytest.raises(MessageDamaged):
            named_meshes(connection, data[:end])


def test_such_a_message_is_left_out_and_named(tmp_path: Path) -> None:
    path = str(tmp_path / 'a.bag')
    with rosbag.Bag(path, 'w') as bag:
        bag.write('/m', mesh('http://127.0.0.1:1/a.dae'), Time(1))
        bag.write('/m', mesh('file:///dev/zero'), Time(2))
        bag.write('/m', mesh('package://sewing_cell/a.dae'), Time(3))
    with Recording([path]) as recording:
        loader = MessageLoader(recording)
        assert [loader.load(position) is None for position in range(3)] == [True, True, False]
        assert loader.left_out == {'/m': 2}
        assert 'computer for the mesh http://127.0.0.1:1/a.dae' in loader.problems[0]
        assert '/m: markers are left out: the mesh /dev/zero is not a file' in loader.problems[1]
