# SPDX-License-Identifier: BSD-3-Clause
"""Messages of many types, and all code of this package that reads such messages as bytes."""
from __future__ import annotations

from io import BytesIO
from typing import Any, Callable, Dict, List

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from geometry_msgs.msg import Point, PoseStamped, TransformStamped
from sensor_msgs.msg import Image, JointState, PointCloud2, PointField
from std_msgs.msg import Float32MultiArray, MultiArrayDimension, String
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import Marker, MarkerArray

from process_visualizer.bagio.bag_file import sized_part
from process_visualizer.bagio.message_definition import Connection, parse_definitions
from process_visualizer.bagio.message_layout import StampLocator
from process_visualizer.bagio.message_parts import can_be_emptied, emptied, parts_reader, split
from process_visualizer.bagio.message_values import message_values
from process_visualizer.bagio.number_places import FieldLocator, FloatArrayLocator, transforms_in
from process_visualizer.nodes.robot.message_reader import float32_values, tf_transforms

MESSAGES: List[Any] = [
    Float32MultiArray(data=[1.0, 2.0]), String('text'), PoseStamped(), Image(data=b'1234'),
    JointState(name=['a', 'b'], position=[1.0, 2.0], velocity=[0.0], effort=[]),
    TFMessage([TransformStamped(child_frame_id='a'), TransformStamped(child_frame_id='b')]),
    PointCloud2(fields=[PointField(name='x'), PointField(name='y')], data=b'12345678'),
    MarkerArray([Marker(ns='a', text='b', points=[Point()]), Marker()]), Marker(text='b'),
    DiagnosticArray(status=[DiagnosticStatus(name='a', values=[KeyValue('a', 'b')])])]
MESSAGES[0].layout.dim = [MultiArrayDimension('a', 1, 1)]


def serialized(message: Any) -> bytes:
    """Return a message as bytes."""
    buffer = BytesIO()
    message.serialize(buffer)
    return buffer.getvalue()


def readers(message: Any) -> Dict[str, Callable[[bytes], Any]]:
    """Return the readers for this message's type, by a short name."""
    kind, definition = message._type, message._full_text
    connection = Connection('/a', kind, message._md5sum, definition, False, '/n')
    locator = StampLocator(kind, definition)
    definitions = parse_definitions(kind, definition)
    paths = ['data[2]', 'position[1]', 'transforms[1].transform.translation.x']
    found: Dict[str, Callable[[bytes], Any]] = {
        'genpy': lambda it: type(message)().deserialize(it),
        'stamps': locator.offsets,
        'values': lambda it: message_values(kind, definitions, it),
        'fields': FieldLocator(kind, definition, paths).places,
        'array': FloatArrayLocator(2, (2,)).places,
        'floats': float32_values, 'transforms': lambda it: list(transforms_in(it)),
        'tf': tf_transforms, 'split': lambda it: list(split(it)),
        'text': lambda it: sized_part(memoryview(it), 0)}
    parts = parts_reader(connection)
    if parts is not None:
        found['parts'] = parts
    if can_be_emptied(connection):
        found['emptied'] = lambda it: emptied(connection, it)
    return found
