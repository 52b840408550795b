# SPDX-License-Identifier: BSD-3-Clause
"""Positions of numbers in messages, compared with the values that genpy deserializes."""
from __future__ import annotations

import io
import struct
from typing import Any, Collection, Dict, List, Sequence

import genpy
import numpy as np
import pytest
from geometry_msgs.msg import PoseStamped, TransformStamped, WrenchStamped
from sensor_msgs.msg import Image, JointState, PointCloud2, PointField
from std_msgs.msg import (
    Bool,
    Float32MultiArray,
    Header,
    Int8,
    MultiArrayDimension,
    String,
    UInt8MultiArray,
    UInt16,
)
from tf2_msgs.msg import TFMessage

from process_visualizer.bagio.number_places import (
    FieldLocator,
    FloatArrayLocator,
    JointLocator,
    Locator,
    NumberPlaces,
    TransformLocator,
)
from process_visualizer.ros_names import DYNAMIC_JOINT_STATE, JOINT_STATE


def serialized(message: genpy.Message) -> bytes:
    buffer = io.BytesIO()
    message.serialize(buffer)
    return buffer.getvalue()


def located(message: Any, *paths: str) -> NumberPlaces:
    return FieldLocator(message._type, message._full_text, paths).places(serialized(message))


def values(message: Any, *paths: str) -> List[float]:
    data = serialized(message)
    return [np.frombuffer(data, place.kind, 1, place.offset)[0]
            for place in located(message, *paths).numbers]


def cloud() -> PointCloud2:
    fields = [PointField('x', 0, 7, 1), PointField('yy', 4, 7, 3)]
    message = PointCloud2(width=7, height=2, fields=fields, data=b'abcdef', is_dense=True)
    message.header.frame_id = 'camera'
    return message


@pytest.mark.parametrize('message, path, expected', [
    (UInt16(513), 'data', 513), (Int8(-3), 'data', -3), (Bool(True), 'data', True),
    (UInt8MultiArray(data=b'\x05\x07'), 'data[1]', 7),
    (Float32MultiArray(data=[1.0, 2.5, 3.0]), 'data[1]', 2.5),
    (JointState(name=['a', 'bcd'], position=[1.0, 2.0], effort=[4.0]), 'effort[0]', 4.0),
    (cloud(), 'fields[1].count', 3), (cloud(), 'is_dense', True), (cloud(), 'data[2]', ord('c')),
    (cloud(), 'width', 7)])
def test_a_field_is_found(message: Any, path: str, expected: float) -> None:
    assert values(message, path) == [expected]


@pytest.mark.parametrize('message, path', [
    (UInt16(1), 'value'), (UInt16(1), 'data[0]'), (String('a'), 'data'),
    (Float32MultiArray(data=[1.0]), 'data[1]'), (Float32MultiArray(data=[1.0]), 'data'),
    (JointState(), 'header'), (JointState(), 'header.stamp'), (JointState(), 'position.x')])
def test_what_is_no_number_is_not_found(message: Any, path: str) -> None:
    assert located(message, path).numbers == ()


def test_a_message_that_is_cut_off_has_no_numbers() -> None:
    data = serialized(cloud())
    locator = FieldLocator(PointCloud2._type, PointCloud2._full_text, ['is_dense'])
    assert locator.places(data).numbers
    for length in range(len(data)):
        assert not locator.places(data[:length]).numbers


def test_nested_arrays_of_nothing_are_not_walked_over() -> None:
    line = '\n' + '=' * 80 + '\nMSG: a/'
    definition = (f'E[300] e\nuint8 behind{line}E\nF[300] f{line}F\nG[300] g{line}G\n')
    assert FieldLocator('a/T', definition, ['behind']).places(b'\0').numbers == ()


def test_a_stamp_in_front_is_found() -> None:
    pose = PoseStamped()
    assert located(pose, 'pose.position.x').stamp == 4
    assert located(UInt16(), 'data').stamp is None


def array(data: Sequence[float], padding: int = 0, label: str = '') -> bytes:
    message = Float32MultiArray(data=[9.0] * padding + list(data))
    message.layout.data_offset = padding
    if label:
        message.layout.dim = [MultiArrayDimension(label, 3, 3)]
    return serialized(message)


@pytest.mark.parametrize('data, count', [
    (array([1, 2, 3]), 3), (array([1, 2, 3], 2), 3), (array([1, 2, 3, 4, 5, 6], 1, 'force'), 3),
    (array([1, 2]), 0), (array([1, 2, 3, 4]), 0), (array([1, 2, 3])[:-1], 0), (b'', 0)])
def test_float_arrays(data: bytes, count: int) -> None:
    places = FloatArrayLocator(3, (3, 6)).places(data)
    assert [struct.unpack_from('<f', data, it.offset)[0] for it in places.numbers] == [
        1.0, 2.0, 3.0][:count]


def transforms(*frames: str) -> bytes:
    message = TFMessage()
    for number, frame in enumerate(frames):
        parent, child = frame.split('>')
        transform = TransformStamped(child_frame_id=child)
        transform.header.frame_id = parent
        transform.header.stamp = genpy.Time(100 + number, 5)
        transform.transform.translation.y = number
        message.transforms.append(transform)
    return serialized(message)


def test_a_transform_is_found_by_its_frames() -> None:
    data = transforms('world>base', 'base>elbow', '/base>/tool')
    places = TransformLocator('base', 'tool').places(data)
    assert [struct.unpack_from('<d', data, it.offset)[0] for it in places.numbers] == [
        0, 2, 0, 0, 0, 0, 0]
    assert places.stamp is not None
    assert struct.unpack_from('<II', data, places.stamp) == (102, 5)
    for other in (transforms('base>elbow'), transforms('world>tool'), transforms(), b'', data[:90]):
        assert not TransformLocator('base', 'tool').places(other).numbers


@pytest.mark.parametrize('names, positions, expected', [
    (['a', 'b'], [1.0, 2.0], [2.0]), (['left_b'], [3.0], [3.0]), (['a'], [1.0], []),
    (['a', 'b'], [1.0], []), ([], [], [])])
def test_a_joint_is_found_by_its_names(names: List[str], positions: List[float],
                                       expected: List[float]) -> None:
    data = serialized(JointState(name=names, position=positions, velocity=[9.0]))
    places = JointLocator(JOINT_STATE, ['b', 'left_b']).places(data)
    assert [struct.unpack_from('<d', data, it.offset)[0] for it in places.numbers] == expected
    for length in range(0, len(data) - 8 * len(positions) - 8 * 2):
        assert not JointLocator(JOINT_STATE, ['b', 'left_b']).places(data[:length]).numbers


def dynamic_joints(**interfaces: Dict[str, float]) -> bytes:
    """A control_msgs/DynamicJointState, which need not be installed on this machine."""
    data = io.BytesIO()
    Header(stamp=genpy.Time(5, 6)).serialize(data)
    data.write(text_array(interfaces) + struct.pack('<I', len(interfaces)))
    for values in interfaces.values():
        data.write(text_array(values))
        data.write(struct.pack(f'<I{len(values)}d', len(values), *values.values()))
    return data.getvalue()


def text_array(texts: Collection[str]) -> bytes:
    parts = (struct.pack('<I', len(text)) + text.encode() for text in texts)
    return struct.pack('<I', len(texts)) + b''.join(parts)


@pytest.mark.parametrize('data, expected', [
    (dynamic_joints(a={'position': 1.0}, b={'velocity': 9.0, 'position': 2.0}), [2.0]),
    (dynamic_joints(b={'velocity': 9.0}), []), (dynamic_joints(a={'position': 1.0}), []),
    (dynamic_joints(), [])])
def test_a_joint_with_interfaces_is_found(data: bytes, expected: List[float]) -> None:
    locator = JointLocator(DYNAMIC_JOINT_STATE, ['b'])
    places = locator.places(data)
    assert [struct.unpack_from('<d', data, it.offset)[0] for it in places.numbers] == expected
    assert struct.unpack_from('<II', data, places.stamp or 0) == (5, 6)
    for length in range(len(data) if expected else 0):
        assert not locator.places(data[:length]).numbers


@pytest.mark.parametrize('locator, one, other', [
    (FloatArrayLocator(3, (3, 4)), array([1, 2, 3], 1), array([1, 2, 3, 4])),
    (TransformLocator('a', 'b'), transforms('x>y', 'a>b'), transforms('a>b', 'x>y')),
    (JointLocator(JOINT_STATE, ['b']), serialized(JointState(name=['a', 'b'], position=[1.0, 2.0])),
     serialized(JointState(name=['b', 'a'], position=[1.0, 2.0]))),
    (JointLocator(DYNAMIC_JOINT_STATE, ['b']), dynamic_joints(a={'position': 1.0}, b={
        'position': 2.0, 'effort': 3.0}), dynamic_joints(a={'position': 1.0}, b={
            'effort': 3.0, 'position': 2.0})),
    (FieldLocator(WrenchStamped._type, WrenchStamped._full_text, ['wrench.force.x']),
     serialized(WrenchStamped()), b'\0' * 12 + b'\1\0\0\0'),
    (FieldLocator(Image._type, Image._full_text, ['step']),
     serialized(Image(encoding='a')), serialized(Image(encoding='ab')))])
def test_what_the_places_depend_on_is_told(locator: Locator, one: bytes, other: bytes) -> None:
    places = locator.places(one)
    assert places.numbers
    assert any(one[begin:end] != other[begin:end] for begin, end in places.fixed)
