# SPDX-License-Identifier: BSD-3-Clause
"""Numbers in messages by a path, and the message if there is none."""
import pytest
from geometry_msgs.msg import Pose, PoseArray, WrenchStamped
from hypothesis import given
from hypothesis import strategies as st
from sensor_msgs.msg import JointState, Temperature
from std_msgs.msg import Bool, Float32, Float32MultiArray, Int64, String, UInt8MultiArray

from process_visualizer.bagio.number_places import FieldPath


def wrench() -> WrenchStamped:
    message = WrenchStamped()
    message.wrench.force.z = -4.5
    message.header.seq = 7
    return message


def poses() -> PoseArray:
    message = PoseArray(poses=[Pose(), Pose()])
    message.poses[1].position.x = 0.25
    return message


@pytest.mark.parametrize('message, path, number', [
    (Float32(data=1.5), 'data', 1.5),
    (Int64(data=-2**63), 'data', -2**63),
    (Bool(data=True), 'data', 1),
    (Bool(data=False), 'data', 0),
    (Float32MultiArray(data=[1.0, 2.0, 3.0]), 'data[2]', 3.0),
    (UInt8MultiArray(data=b'\x05\xff'), 'data[1]', 255),
    (wrench(), 'wrench.force.z', -4.5),
    (wrench(), 'header.seq', 7),
    (wrench(), 'header.stamp.secs', 0),
    (poses(), 'poses[1].position.x', 0.25),
    (JointState(position=(0.1, 0.2)), 'position[0]', 0.1),
])
def test_number(message, path, number):
    found = FieldPath(path).number(message)
    assert found == number
    assert not isinstance(found, bool)


@pytest.mark.parametrize('message, path, problem', [
    (Temperature(), 'temprature', 'sensor_msgs/Temperature has no field temprature, it has header, '
     'temperature, variance; did you mean temperature?'),
    (Temperature(), 'xyz', 'it has header, temperature, variance$'),
    (Temperature(), 'deserialize', 'has no field deserialize'),
    (wrench(), 'wrench.forse.z', 'wrench has no field forse, it has force, torque; '
     'did you mean force?'),
    (wrench(), 'wrench.force', 'is not a number but a submessage; its fields are wrench.force.x, '
     'wrench.force.y, wrench.force.z'),
    (Float32(), 'data.x', 'data is a number, and has no field x'),
    (Float32(), 'data[0]', 'data is not an array but a number'),
    (String(data='12'), 'data', 'data is not a number but a string'),
    (String(data='12'), 'data[0]', 'data is not an array but a string'),
    (Float32MultiArray(data=[1.0, 2.0]), 'data[2]',
     r'data\[2\] is out of range: data has 2 elements'),
    (Float32MultiArray(data=[1.0, 2.0]), 'data', r'an array of 2 elements; write data\[0\]'),
    (UInt8MultiArray(data=b''), 'data[0]', 'data has 0 elements'),
    (poses(), 'poses.position', 'poses is an array of 2 elements'),
    (poses(), 'poses[0].positon.x', r'poses\[0\] has no field positon, .*did you mean position'),
])
def test_what_is_there_instead(message, path, problem):
    with pytest.raises(ValueError, match=problem):
        FieldPath(path).number(message)


@pytest.mark.parametrize('path', ['', '.', 'data.', '[0]', 'data[-1]', 'data[x]', 'data[1', 'a b',
                                  'data[]', '_type', '__class__', 'x.__dict__', 'data\n'])
def test_what_is_no_path(path):
    with pytest.raises(ValueError, match='is not a valid field path; write a path'):
        FieldPath(path)


@given(st.text())
def test_any_text_is_a_path_or_refused(text):
    try:
        path = FieldPath(text)
    except ValueError:
        return
    assert str(path) == text


@given(st.lists(st.integers(0, 255), min_size=1), st.data())
def test_each_element(values, data):
    index = data.draw(st.integers(0, len(values) - 1))
    assert FieldPath(f'data[{index}]').number(UInt8MultiArray(data=bytes(values))) == values[index]
