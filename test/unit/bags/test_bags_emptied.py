# SPDX-License-Identifier: BSD-3-Clause
"""Messages that leave nothing visible, as the real types read them."""
from __future__ import annotations

from io import BytesIO
from typing import Any

import genpy
import pytest
from geometry_msgs.msg import Point, Point32, Pose, PoseArray, PoseStamped
from nav_msgs.msg import GridCells, Path
from sensor_msgs.msg import ChannelFloat32, LaserScan, PointCloud, PointCloud2, PointField
from std_msgs.msg import Float64, Header
from visualization_msgs.msg import Marker, MarkerArray

from process_visualizer.bagio.message_definition import Connection
from process_visualizer.bagio.message_layout import MessageDamaged
from process_visualizer.bagio.message_parts import can_be_emptied, emptied

HEADER = Header(seq=7, stamp=genpy.Time(5), frame_id='kamera_ä')
FIELDS = [PointField(name=name, offset=4 * number, datatype=7, count=1)
          for number, name in enumerate(('x', 'y', 'z'))]
CLOUD = PointCloud2(header=HEADER, height=2, width=3, fields=FIELDS, point_step=12, row_step=36,
                    data=bytes(72))
SCAN = LaserScan(header=HEADER, angle_min=-1.0, range_max=9.0, ranges=[1.0, 2.0], intensities=[3.0])
GRID = GridCells(header=HEADER, cell_width=0.5, cell_height=0.25, cells=[Point()])
EXAMPLES = [
    (CLOUD, {'height', 'width', 'row_step', 'data', 'is_dense'}),
    (PointCloud(HEADER, [Point32()], [ChannelFloat32('i', [1.0])]), {'points', 'channels'}),
    (SCAN, {'ranges', 'intensities'}),
    (GRID, {'cells'}),
    (Path(HEADER, [PoseStamped()]), {'poses'}),
    (PoseArray(HEADER, [Pose()]), {'poses'}),
]


def connection_of(message: Any) -> Connection:
    """A connection with such messages."""
    return Connection('/x', message._type, message._md5sum, message._full_text, False, '/n')


def serialized(message: Any) -> bytes:
    """The bytes of a message."""
    buffer = BytesIO()
    message.serialize(buffer)
    return buffer.getvalue()


@pytest.mark.parametrize('example, emptied_fields', EXAMPLES)
def test_nothing_is_left_but_the_frame_and_the_format(example: Any, emptied_fields: set) -> None:
    connection = connection_of(example)
    assert can_be_emptied(connection)
    result = type(example)().deserialize(emptied(connection, serialized(example)))
    nothing = type(example)()
    for field in type(example).__slots__:
        if field == 'header':
            assert result.header == Header(frame_id=HEADER.frame_id)
        elif field == 'is_dense':
            assert result.is_dense
        elif field in emptied_fields:
            assert len(getattr(result, field)) == 0 if isinstance(
                getattr(nothing, field), (list, bytes)) else getattr(result, field) == 0
        else:
            assert getattr(result, field) == getattr(example, field)


@pytest.mark.parametrize('example, _', EXAMPLES)
def test_damaged_examples_are_reported(example: Any, _: set) -> None:
    with pytest.raises(MessageDamaged):
        emptied(connection_of(example), serialized(example)[:13])


def test_markers_are_removed() -> None:
    for message, read in ((Marker(header=HEADER), lambda it: it),
                          (MarkerArray([Marker(header=HEADER)]), lambda it: it.markers[0])):
        connection = connection_of(message)
        assert can_be_emptied(connection)
        result = type(message)().deserialize(emptied(connection, serialized(message)))
        assert read(result).action == Marker.DELETEALL


def test_a_number_or_another_version_of_a_type_cannot_say_nothing() -> None:
    assert not can_be_emptied(connection_of(Float64()))
    assert not can_be_emptied(connection_of(CLOUD)._replace(md5sum='0' * 32))
