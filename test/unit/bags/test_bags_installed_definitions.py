# SPDX-License-Identifier: BSD-3-Clause
"""Bags whose publishers, such as rosjava, did not send their message definitions."""
from __future__ import annotations

from pathlib import Path
from typing import Any, Dict, List

import numpy as np
import pytest
import rosbag
from genpy import Time
from geometry_msgs.msg import TransformStamped, WrenchStamped
from sensor_msgs.msg import JointState
from std_msgs.msg import Empty, Float64, Header
from tf2_msgs.msg import TFMessage

from process_visualizer.bagio.catalog import read_catalog
from process_visualizer.bagio.message_definition import (
    Connection,
    definition_problem,
    with_definition,
)
from process_visualizer.bagio.recording import Recording
from process_visualizer.bagio.report import as_text, make_report
from process_visualizer.cell.model import Device
from process_visualizer.cell.xml_parser import XmlParser
from process_visualizer.curves.curves import read_curves
from process_visualizer.discovery.bag_look import look_into
from process_visualizer.playback.message_loader import MessageLoader

BEGIN_S = 1_600_000_000
TYPES = (JointState, TFMessage, WrenchStamped, Empty, Float64)


def connection(kind: Any, definition: str, **more: str) -> Connection:
    return Connection('/t', more.get('type', kind._type), more.get('md5sum', kind._md5sum),
                      definition, False, '')


def write(path: Path, definitions: Dict[Any, str], **more: str) -> str:
    """A bag with the given definitions."""
    with rosbag.Bag(str(path), 'w') as bag:
        for number in range(50):
            at = Time(BEGIN_S + number // 10, number % 10 * 100_000_000)
            for topic, message in (('/arm/joint_states', joints(number, at)), ('/tf', frame(at)),
                                   ('/arm/wrench', wrench(number, at))):
                bag.write(topic, message, at, connection_header={
                    'topic': topic, 'type': message._type, 'md5sum': message._md5sum,
                    'message_definition': definitions.get(type(message), ''), **more})
    return str(path)


def joints(number: int, at: Time) -> JointState:
    return JointState(Header(number, at, ''), ['a', 'b'], [0.1 * number, 1.0], [], [])


def wrench(number: int, at: Time) -> WrenchStamped:
    found = WrenchStamped(header=Header(number, at, 'tool'))
    found.wrench.force.x = float(number)
    return found


def frame(at: Time) -> TFMessage:
    found = TransformStamped(Header(0, at, 'world'), 'base', TransformStamped().transform)
    found.transform.rotation.w = 1.0
    return TFMessage([found])


def a_robot(folder: Path) -> List[Device]:
    path = folder / 'cell.xml'
    path.write_text('<visualizer><device type="robot" name="arm"><base frame="base" /><topic '
                    'ns="arm" name="wrench" type="force_sensor" /></device></visualizer>')
    return list(XmlParser().parse(str(path)).devices)


@pytest.mark.parametrize('kind', TYPES)
@pytest.mark.parametrize('part', ['nothing', 'main', 'cut off', 'no field'])
def test_the_installed_definition_stands_in(kind: Any, part: str) -> None:
    whole = kind._full_text
    sent = {'nothing': '', 'main': whole.partition('=' * 80)[0], 'cut off': whole[:len(whole) // 2],
            'no field': 'what is this?'}[part]
    found = with_definition(connection(kind, sent))
    assert definition_problem(found) == ''
    assert found.message_definition in (kind._full_text, sent)
    assert with_definition(connection(kind, whole)).message_definition == whole


def test_everything_understands_the_messages(tmp_path: Path) -> None:
    bag = write(tmp_path / 'a.bag', {})
    with Recording([bag]) as recording:
        assert recording.remarks == ()
        seen = look_into(recording)
        loader = MessageLoader(recording)
        assert all(it.stamp_offsets for it in loader.load_all(list(range(150))))
        assert loader.problems == ()
        report = make_report(recording)
    assert {it.name: it.joints for it in seen.topics}['/arm/joint_states'] == ('a', 'b')
    assert [(it.parent, it.child) for it in seen.transforms] == [('world', 'base')]
    assert {it.topic: it.message_count for it in report.topics}['/arm/joint_states'] == 50
    curve, = read_curves([bag], a_robot(tmp_path))
    assert np.nanmax(curve.high) == 49.0


@pytest.mark.parametrize('type_name, md5sum, reason', [
    ('their_msgs/State', 'f' * 32, 'no definition of their_msgs/State, and the type is not '
                                   'installed here either; install the package their_msgs'),
    ('sensor_msgs/JointState', 'f' * 32,
     f'no definition of sensor_msgs/JointState, and the one that is installed has the MD5 sum '
     f'{JointState._md5sum} instead of {"f" * 32}; install the version of sensor_msgs that was '
     'used then'),
    ('sensor_msgs/JointState', Empty._md5sum, 'no definition of sensor_msgs/JointState, and the'),
    ('sensor_msgs/JointState', '*', 'no definition of sensor_msgs/JointState, and the one'),
    ('../os/system', 'f' * 32, 'the type is not installed here either'),
    ('os/path', 'f' * 32, 'the type is not installed here either'),
])
def test_what_cannot_be_understood_is_named(tmp_path: Path, type_name: str, md5sum: str,
                                            reason: str) -> None:
    lacking = connection(JointState, '', type=type_name, md5sum=md5sum)
    assert with_definition(lacking) == lacking
    assert reason in definition_problem(lacking)
    bag = write(tmp_path / 'a.bag', {}, type=type_name, md5sum=md5sum)
    with Recording([bag]) as recording:
        first, *_ = recording.remarks
        assert first.startswith('/arm/joint_states: its messages cannot be understood: they came '
                                'with no definition')
        assert first in as_text(make_report(recording)).splitlines()
    assert first in read_catalog([bag]).remarks


def test_a_definition_that_is_whole_needs_no_package() -> None:
    own = connection(JointState, JointState._full_text, type='their_msgs/State')
    assert with_definition(own) == own
    assert definition_problem(own) == ''
