# SPDX-License-Identifier: BSD-3-Clause
"""Real messages, moved as bytes and read back: only the stamps change."""
import io

import genpy
import genpy.dynamic
import pytest
from roslib.message import get_message_class

from process_visualizer.bagio.message_definition import definition_checksum
from process_visualizer.bagio.message_layout import StampLocator

SHIFT_NS = 400_000_123_456_789
COUNTS = (0, 1, 3)
TYPES = [
    'std_msgs/Header', 'std_msgs/String', 'std_msgs/Empty', 'std_msgs/Time', 'std_msgs/Duration',
    'std_msgs/Float32MultiArray', 'sensor_msgs/Image', 'sensor_msgs/CameraInfo',
    'sensor_msgs/PointCloud2', 'sensor_msgs/JointState', 'sensor_msgs/TimeReference',
    'sensor_msgs/MultiDOFJointState', 'tf2_msgs/TFMessage', 'visualization_msgs/MarkerArray',
    'visualization_msgs/InteractiveMarkerInit', 'geometry_msgs/PoseStamped',
    'geometry_msgs/WrenchStamped', 'geometry_msgs/TransformStamped',
    'geometry_msgs/PolygonStamped', 'diagnostic_msgs/DiagnosticArray',
    'actionlib_msgs/GoalStatusArray', 'tf2_msgs/LookupTransformActionGoal', 'rosgraph_msgs/Log',
    'rosgraph_msgs/Clock', 'dynamic_reconfigure/ConfigDescription']
UNSTAMPED = {'std_msgs/String', 'std_msgs/Empty', 'std_msgs/Time', 'std_msgs/Duration',
             'std_msgs/Float32MultiArray', 'rosgraph_msgs/Clock',
             'dynamic_reconfigure/ConfigDescription'}


def fill(message, count, numbers):
    """Fill a message with different values; arrays get a number of elements."""
    for name, kind in zip(message.__slots__, message._slot_types):
        setattr(message, name, value(kind, getattr(message, name), count, numbers))
    return message


def value(kind, default, count, numbers):
    base, bracket, length = kind.partition('[')
    if bracket:
        size = int(length[:-1]) if length[:-1] else count
        if base in ('uint8', 'char'):
            return bytes(next(numbers) % 256 for _ in range(size))
        return [value(base, None, count, numbers) for _ in range(size)]
    if base == 'time':
        return genpy.Time(1_000_000 + next(numbers), next(numbers))
    if base == 'duration':
        return genpy.Duration(next(numbers), next(numbers))
    if base == 'string':
        return f'text {next(numbers)}'
    if base == 'bool':
        return bool(next(numbers) % 2)
    if '/' in base:
        return fill(get_message_class(base)(), count, numbers)
    return next(numbers) % 100


@pytest.mark.parametrize('name', TYPES)
def test_checksum_of_a_definition(name):
    kind = get_message_class(name)
    assert definition_checksum(name, kind._full_text) == kind._md5sum
    assert definition_checksum(name, f'int8 more\n{kind._full_text}') != kind._md5sum


def numbers():
    number = 0
    while True:
        number += 1
        yield number


def move_stamps(message):
    """Move every single time called stamp, the slow way."""
    moved = 0
    for name, kind in zip(message.__slots__, message._slot_types):
        inside = getattr(message, name)
        if name == 'stamp' and kind == 'time':
            setattr(message, name, genpy.Time(0, inside.to_nsec() + SHIFT_NS))
            moved += 1
        elif '/' in kind:
            moved += sum(map(move_stamps, inside if '[' in kind else [inside]))
    return moved


def as_bytes(message):
    buffer = io.BytesIO()
    message.serialize(buffer)
    return buffer.getvalue()


def check_moving(name, message, count):
    """Compare with deserializing, moving and serializing; return the number of stamps."""
    fill(message, count, numbers())
    data = as_bytes(message)
    locator = StampLocator(name, message._full_text)
    locator.check(data)
    moved = locator.moved(data, lambda stamp_ns: stamp_ns + SHIFT_NS)
    stamps = move_stamps(message)
    assert bytes(moved) == as_bytes(message)
    assert len(locator.offsets(data)) == stamps
    assert locator.has_stamps == (name not in UNSTAMPED)
    return stamps


@pytest.mark.parametrize('count', COUNTS)
@pytest.mark.parametrize('name', TYPES)
def test_as_if_deserialized_and_moved(name, count):
    check_moving(name, get_message_class(name)(), count)


@pytest.mark.parametrize('count', COUNTS)
def test_type_that_is_not_installed(count):
    """nav_msgs/Path, from its definition alone."""
    pose = 'geometry_msgs/PoseStamped'
    text = (f'Header header\n{pose}[] poses\n{"=" * 80}\nMSG: {pose}\n'
            + get_message_class(pose)._full_text)
    message_class = genpy.dynamic.generate_dynamic('nav_msgs/Path', text)['nav_msgs/Path']
    assert check_moving('nav_msgs/Path', message_class(), count) == 1 + count
