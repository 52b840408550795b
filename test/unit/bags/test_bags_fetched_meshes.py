# SPDX-License-Identifier: BSD-3-Clause
"""A recording does not let RViz connect to anything."""
from __future__ import annotations

from io import BytesIO
from pathlib import Path
from typing import Any

import pytest
import rosbag
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
from process_visualizer.bagio.message_parts import fetched_mesh
from process_visualizer.bagio.recording import Recording
from process_visualizer.playback.message_loader import MessageLoader


def mesh(uri: str, text: str = '') -> Marker:
    return Marker(type=Marker.MESH_RESOURCE, mesh_resource=uri, text=text)


def found(message: Any) -> 'str | None':
    buffer = BytesIO()
    message.serialize(buffer)
    connection = Connection('/m', message._type, message._md5sum, message._full_text, False, '/n')
    return fetched_mesh(connection, memoryview(buffer.getvalue()))


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
        assert found(message) == uri


@pytest.mark.parametrize('message', [
    mesh('package://sewing_cell/meshes/a.dae'), mesh('file:///tmp/a.dae'), Marker(),
    mesh('FILE:///tmp/a.dae'), mesh('/tmp/a.dae'),
    mesh('', 'see http://127.0.0.1/manual for this'), mesh('', 'http://127.0.0.1/a.dae'),
    Marker(points=[Point()] * 3, colors=[ColorRGBA()] * 3),
    InteractiveMarkerUpdate(poses=[InteractiveMarkerPose(name='x/a')], erases=['x/a']),
    String('http://127.0.0.1/a.dae')])
def test_what_is_not(message: Any) -> None:
    assert found(message) is None


def test_a_type_of_another_name_is_read_all_the_same() -> None:
    buffer = BytesIO()
    mesh('http://x/a').serialize(buffer)
    connection = Connection('/m', 'a/B', Marker._md5sum, '', False, '/n')
    assert fetched_mesh(connection, memoryview(buffer.getvalue())) == 'http://x/a'


def test_what_ends_too_early_is_damaged() -> None:
    buffer = BytesIO()
    MarkerArray([mesh('file:///a')]).serialize(buffer)
    data = buffer.getvalue()
    connection = Connection('/m', 'a/B', MarkerArray._md5sum, '', False, '/n')
    for end in range(len(data)):
        with pytest.raises(MessageDamaged):
            fetched_mesh(connection, data[:end])


def test_such_a_message_is_left_out_and_named(tmp_path: Path) -> None:
    path = str(tmp_path / 'a.bag')
    with rosbag.Bag(path, 'w') as bag:
        bag.write('/m', mesh('http://127.0.0.1:1/a.dae'), Time(1))
        bag.write('/m', mesh('package://sewing_cell/a.dae'), Time(2))
    with Recording([path]) as recording:
        loader = MessageLoader(recording)
        assert [loader.load(position) is None for position in range(2)] == [True, False]
        assert loader.left_out == {'/m': 1}
        assert 'the mesh http://127.0.0.1:1/a.dae are left out' in loader.problems[0]
