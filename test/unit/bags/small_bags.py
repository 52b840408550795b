# SPDX-License-Identifier: BSD-3-Clause
"""Small bags of every kind: compressed or not, in one chunk or many, with or without an index."""
from __future__ import annotations

import json
from pathlib import Path
from typing import Any, Dict, Iterator, Tuple

import rosbag
from genpy import Time
from geometry_msgs.msg import PoseStamped, TransformStamped, WrenchStamped
from sensor_msgs.msg import JointState
from std_msgs.msg import Float32MultiArray, String, UInt16
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import Marker, MarkerArray

from process_visualizer.bagio.recorder_topics import ACCOUNT, CONFIGURATION, MARKS
from process_visualizer.cell.model import Device
from process_visualizer.cell.xml_parser import XmlParser

BEGIN_S = 1_600_000_000
CELL = """<visualizer>
  <device type="robot" name="ur"><base frame="ur/link0"/>
    <topic name="tcf" type="tool_center_frame"/><topic name="ft" type="force_sensor"/></device>
  <device type="robot" name="r2"><base frame="r2/link0"/>
    <topic name="tf" type="tool_center_frame" msg="tf2_msgs/TFMessage"/>
    <topic name="wrench" type="force_sensor"/></device>
  <device type="other" name="machine"><base frame="machine/base"/><topic name="edge"/>
    <variable topic="joints" field="position[1]" frame="machine/base" axis="x"/></device>
</visualizer>"""
_SMALL_CHUNK_BYTES = 1500


def devices(folder: Path) -> Tuple[Device, ...]:
    """The devices whose curves are read."""
    path = folder / 'cell.xml'
    path.write_text(CELL)
    return tuple(XmlParser().parse(str(path)).devices)


def whole_bags(folder: Path) -> Dict[str, bytes]:
    """Undamaged bags by their kind."""
    bags = {}
    for compression in ('none', 'bz2', 'lz4'):
        for chunk_bytes in (_SMALL_CHUNK_BYTES, 1 << 20):
            path = folder / 'whole.bag'
            with rosbag.Bag(str(path), 'w', compression=compression,
                            chunk_threshold=chunk_bytes) as bag:
                for topic, message, time_s, header in _messages():
                    header.update(type=message._type, md5sum=message._md5sum, topic=topic,
                                  message_definition=message._full_text)
                    bag.write(topic, message, _time(time_s), connection_header=header)
            data = bags[f'{compression} {chunk_bytes}'] = path.read_bytes()
            bags[f'{compression} {chunk_bytes} without index'] = without_index(data)
    return bags


def without_index(data: bytes) -> bytes:
    """A bag as a killed recorder leaves it."""
    at = data.index(b'index_pos=') + len(b'index_pos=')
    end = int.from_bytes(data[at:at + 8], 'little')
    return data[:at] + bytes(8) + data[at + 8:end]


def _time(time_s: float) -> Time:
    return Time(*divmod(BEGIN_S * 10 ** 9 + round(time_s * 1e9), 10 ** 9))


def _messages() -> Iterator[Tuple[str, Any, float, Dict[str, str]]]:
    """Topic, message, time and additional connection header fields of the publisher."""
    configuration = {'file': '/c/cell.xml', 'files': {'/c/cell.xml': CELL}, 'arguments': {'a': '1'}}
    latched = {'latching': '1', 'callerid': '/node'}
    yield CONFIGURATION, String(json.dumps(configuration)), 0.0, dict(latched)
    yield '/tf_static', TFMessage([_transform('world', 'ur/link0', 0.0)]), 0.0, dict(latched)
    yield '/tf_static', TFMessage([_transform('world', 'r2/link0', 0.0)]), 0.0, {
        'latching': '1', 'callerid': '/other'}
    yield '/markers', MarkerArray([Marker(ns='a', id=3)]), 0.1, dict(latched)
    for number in range(30):
        yield from _cycle(number, 0.1 * number)
    yield MARKS, String('the seam tears'), 1.5, dict(latched)
    account = {'topics': {'/ft': {'received': 30, 'dropped': 0}},
               'clock_jumps': [{'time': BEGIN_S + 1.0, 'seconds': -0.5}]}
    yield ACCOUNT, String(json.dumps(account)), 3.1, dict(latched)


def _cycle(number: int, time_s: float) -> Iterator[Tuple[str, Any, float, Dict[str, str]]]:
    pose, wrench, joints = PoseStamped(), WrenchStamped(), JointState()
    for message in (pose, wrench, joints):
        message.header.seq, message.header.stamp = number, _time(time_s)
        message.header.frame_id = 'ur/link0'
    pose.pose.position.x = wrench.wrench.force.y = 0.1 * time_s
    joints.name, joints.position = ['a', 'b'], [0.1, time_s]
    odd_publisher = {'callerid': f'/publisher{number % 2}'}
    yield '/tcf', pose, time_s, {}
    yield '/wrench', wrench, time_s, {}
    yield '/joints', joints, time_s, {}
    yield '/ft', Float32MultiArray(data=[0.0, time_s, 1.0]), time_s, odd_publisher
    yield '/edge', UInt16(number), time_s, {}
    yield '/tf', TFMessage([_transform('a', 'b', time_s), _transform('r2/link0', 'r2/tool',
                                                                     time_s)]), time_s, {}


def _transform(parent: str, child: str, time_s: float) -> TransformStamped:
    transform = TransformStamped(child_frame_id=child)
    transform.header.frame_id, transform.header.stamp = parent, _time(time_s)
    transform.transform.translation.x = 0.1 * time_s
    transform.transform.rotation.w = 1.0
    return transform
