# SPDX-License-Identifier: BSD-3-Clause
"""The MCAP file of ``cell export``: the recording's own messages, and the content of the page."""
from __future__ import annotations

from collections import defaultdict
from pathlib import Path
from typing import Any, DefaultDict, Dict, List, NamedTuple

import genpy
import numpy as np
import pytest
import rosbag
import roslib.message
from cycle_bags import write_bag
from geometry_msgs.msg import Quaternion, Transform, TransformStamped, Vector3
from mcap.reader import make_reader
from page_reader import PageReader
from sensor_msgs.msg import JointState
from sewing_runs import write_sewing_run
from std_msgs.msg import Header
from tf2_msgs.msg import TFMessage

from process_visualizer.bagio.recorder_topics import CALIBRATION, STATIC_FRAMES
from process_visualizer.commands.command_line import main


class Exported(NamedTuple):
    """Content found by an MCAP reader: messages with their times [ns], by topic."""

    bag: str
    page: PageReader
    messages: Dict[str, List[Any]]


def read(path: Path) -> Dict[str, List[Any]]:
    found: DefaultDict[str, List[Any]] = defaultdict(list)
    with path.open('rb') as file:
        for schema, channel, message in make_reader(file, validate_crcs=True).iter_messages():
            assert schema is not None
            assert (schema.encoding, channel.message_encoding) == ('ros1msg', 'ros1')
            message_class: Any = roslib.message.get_message_class(schema.name)
            found[channel.topic].append(
                (message.log_time, message_class().deserialize(message.data)))
    return dict(found)


@pytest.fixture(scope='module')
def exported(tmp_path_factory: pytest.TempPathFactory) -> Exported:
    folder = tmp_path_factory.mktemp('mcap')
    good, poor = write_sewing_run(folder, 'good.bag'), write_sewing_run(
        folder, 'poor.bag', 2, is_poor=True)
    words = [poor, '--reference', good, '-o']
    assert main(['share', *words, str(folder / 'page.html')]) == 0
    assert main(['export', *words, str(folder / 'run.mcap')]) == 0
    html = (folder / 'page.html').read_text(encoding='utf-8')
    return Exported(poor, PageReader(html), read(folder / 'run.mcap'))


def begin_ns(bag: str) -> int:
    with rosbag.Bag(bag) as recorded:
        return min(time.to_nsec() for _, _, time in recorded.read_messages())


def test_the_messages_of_the_recording_are_there(exported: Exported) -> None:
    with rosbag.Bag(exported.bag) as recorded:
        run = exported.page.data['runs'][0]
        first = begin_ns(exported.bag)
        sent = [(time.to_nsec(), message) for _, message, time
                in recorded.read_messages('/ur_rt_upper/q_act')
                if run['begin'] <= (time.to_nsec() - first) / 1e9 <= run['end']]
    assert len(sent) > 100
    assert [(time, it.data) for time, it in exported.messages['/ur_rt_upper/q_act']] == [
        (time, it.data) for time, it in sent]


def test_links_are_where_the_page_has_them(exported: Exported) -> None:
    first, compared = begin_ns(exported.bag), 0
    run = exported.page.data['runs'][0]
    places = {link: number for _, link, number in exported.page.links(0) if number is not None}
    places.update({f'ghost/{it["link"]}': it['place'] for it in run['ghost']['parts']})
    sent = exported.messages['/tf'][::7] + exported.messages['/tf_static']
    for time_ns, message in sent:
        for it in message.transforms:
            assert it.header.frame_id == 'world' and it.header.stamp.to_nsec() == time_ns
            if it.child_frame_id not in places:
                continue  # it has no mesh
            position, turn = exported.page.place(
                0, places[it.child_frame_id], (time_ns - first) / 1e9 + 1e-9)
            where, how = it.transform.translation, it.transform.rotation
            assert [where.x, where.y, where.z] == pytest.approx(position.tolist(), abs=2e-4)
            assert abs(np.dot([how.x, how.y, how.z, how.w], turn)) == pytest.approx(1.0, abs=1e-6)
            compared += 1
    assert compared > 200
    assert {it.child_frame_id for _, message in sent for it in message.transforms} >= set(places)


def test_numbers_and_texts_are_those_of_the_page(exported: Exported) -> None:
    page, first = exported.page, begin_ns(exported.bag)
    edge = page.number(0, 'sewing_machine', 'number', 'upper edge')
    sent = exported.messages['/process_visualizer/sewing_machine/upper_edge']
    assert len(sent) > 20
    for time_ns, message in sent:
        assert message.data == page.value(edge, (time_ns - first) / 1e9 + 2e-6)
    force = page.number(0, 'ur_rt_upper', 'force')
    for time_ns, message in exported.messages['/process_visualizer/arrows'][::25]:
        texts = [it.text for it in message.markers if it.ns == 'numbers']
        assert page.text(force, (time_ns - first) / 1e9 + 2e-6) in texts


def test_models_are_markers_in_the_frames_of_their_links(exported: Exported) -> None:
    (_, message), = exported.messages['/process_visualizer/models']
    frames = {it.header.frame_id for it in message.markers}
    assert {'ur_rt_upper/link3', 'ghost/ur_rt_upper/link3'} <= frames
    assert all(len(it.points) % 3 == 0 and it.points and it.frame_locked for it in message.markers)


CELL = '''<visualizer>
  <device type="robot" name="arm"><model path="arm.urdf"/>
    <base frame="base" xyz="1 0 0"/><tool frame="flange"/>
    <topic name="joints" type="joint_states" msg="sensor_msgs/JointState"/></device>
  <device type="other" name="pallet"><base frame="pallet" xyz="0 2 0"/></device>
</visualizer>'''
ARM = '''<robot name="arm"><link name="base"/><link name="flange"/><link name="upper"><visual>
<geometry><box size="0.1 0.1 0.1"/></geometry></visual></link><joint name="turn" type="revolute">
<parent link="base"/><child link="upper"/><axis xyz="0 0 1"/>
<limit lower="-3" upper="3" effort="1" velocity="1"/></joint><joint name="end" type="fixed">
<parent link="upper"/><child link="flange"/><origin xyz="0.5 0 0"/></joint></robot>'''


def test_frames_without_a_mesh_are_in_the_tree(tmp_path: Path) -> None:
    """Otherwise the frame of a wrench, and the recording's own frames, would be unknown."""
    config, bag, path = (tmp_path / name for name in ('cell.xml', 'a.bag', 'a.mcap'))
    config.write_text(CELL, encoding='utf-8')
    (tmp_path / 'arm.urdf').write_text(ARM, encoding='utf-8')
    upper = TransformStamped(Header(frame_id='base'), 'upper', Transform(
        Vector3(), Quaternion(0.0, 0.0, 0.0, 1.0)))
    with rosbag.Bag(str(bag), 'w') as file:
        for number in range(50):
            time = genpy.Time.from_sec(100.0 + 0.02 * number)
            file.write('/joints', JointState(name=['turn'], position=[0.0]), time)
            file.write('/tf', TFMessage([upper]), time)
    assert main(['export', str(bag), '--config', str(config), '-o', str(path)]) == 0
    found = read(path)
    parents = {it.child_frame_id: (topic, it.header.frame_id) for topic in ('/tf', '/tf_static')
               for _, message in found[topic] for it in message.transforms}
    assert parents == {'base': ('/tf_static', 'world'), 'pallet': ('/tf_static', 'world'),
                       'upper': ('/tf', 'base'), 'flange': ('/tf', 'world')}


def test_fixed_frames_that_the_recorder_copied_are_written_once(tmp_path: Path) -> None:
    """Viewers that read only /tf and /tf_static get them at their current poses."""
    config, bag, path = (tmp_path / name for name in ('cell.xml', 'a.bag', 'a.mcap'))
    config.write_text(CELL, encoding='utf-8')
    (tmp_path / 'arm.urdf').write_text(ARM, encoding='utf-8')

    def fixed(parent: str, child: str, x: float) -> TFMessage:
        return TFMessage([TransformStamped(Header(frame_id=parent), child, Transform(
            Vector3(x, 0.0, 0.0), Quaternion(0.0, 0.0, 0.0, 1.0)))])

    with rosbag.Bag(str(bag), 'w') as file:
        begin = genpy.Time(100)
        file.write(CALIBRATION, fixed('world', 'base', 5.0), begin)
        file.write(STATIC_FRAMES, fixed('pallet', 'lens', 0.5), begin)
        file.write('/tf_static', fixed('pallet', 'corner', 0.1), begin)
        file.write('/tf_static', fixed('pallet', 'label', 0.2), begin)
        for number in range(50):
            file.write('/joints', JointState(name=['turn'], position=[0.0]),
                       genpy.Time.from_sec(100.0 + 0.02 * number))
    assert main(['export', str(bag), '--config', str(config), '--from', '0.2', '-o',
                 str(path)]) == 0
    found = read(path)
    assert not {CALIBRATION, STATIC_FRAMES} & set(found)
    places = [(it.child_frame_id, it.header.frame_id, it.transform.translation.x)
              for _, message in found['/tf_static'] for it in message.transforms]
    assert sorted(places) == [('base', 'world', 1.0), ('corner', 'pallet', 0.1),
                              ('label', 'pallet', 0.2), ('lens', 'world', 0.5),
                              ('pallet', 'world', 0.0)]


def write_rare(folder: Path, rare: str) -> 'tuple[Path, Path]':
    """Write CELL without the robot's base, and a bag; one of 1000 messages places a frame."""
    config, bag = folder / 'cell.xml', folder / 'a.bag'
    config.write_text(CELL.replace('<base frame="base" xyz="1 0 0"/>', ''), encoding='utf-8')
    (folder / 'arm.urdf').write_text(ARM, encoding='utf-8')
    still = Transform(Vector3(), Quaternion(0.0, 0.0, 0.0, 1.0))
    with rosbag.Bag(str(bag), 'w') as file:
        for number in range(1000):
            time = genpy.Time.from_sec(100.0 + 0.002 * number)
            child = rare if number == 701 else 'crane'
            file.write('/joints', JointState(name=['turn'], position=[0.0]), time)
            file.write('/tf', TFMessage([TransformStamped(
                Header(frame_id='world'), child, still)]), time)
    return config, bag


def test_a_frame_that_is_sent_once_among_many_is_not_added_again(tmp_path: Path) -> None:
    """Otherwise it would have two poses."""
    config, bag = write_rare(tmp_path, 'pallet')
    path = tmp_path / 'a.mcap'
    assert main(['export', str(bag), '--config', str(config), '-o', str(path)]) == 0
    found = read(path)
    assert 'pallet' not in {it.child_frame_id for _, message in found['/tf_static']
                            for it in message.transforms}


def test_a_frame_that_is_sent_once_among_many_places_its_robot(tmp_path: Path) -> None:
    config, bag = write_rare(tmp_path, 'base')
    path = tmp_path / 'a.html'
    assert main(['share', str(bag), '--config', str(config), '-o', str(path)]) == 0
    assert 'does not say where its frame base is' not in path.read_text(encoding='utf-8')


@pytest.mark.parametrize('words', [['share'], ['export']])
def test_a_recording_of_one_moment_is_refused(tmp_path: Path, words: List[str],
                                              capsys: pytest.CaptureFixture[str]) -> None:
    config, bag, path = (tmp_path / name for name in ('cell.xml', 'a.bag', 'a.html'))
    config.write_text(CELL, encoding='utf-8')
    (tmp_path / 'arm.urdf').write_text(ARM, encoding='utf-8')
    path = path.with_suffix('.html' if words == ['share'] else '.mcap')
    with rosbag.Bag(str(bag), 'w') as file:
        file.write('/joints', JointState(name=['turn'], position=[0.0]), genpy.Time(100))
    assert main([*words, str(bag), '--config', str(config), '-o', str(path)]) == 1
    assert capsys.readouterr().err == 'cell: a.bag has only one moment; nothing in it can move\n'


def test_only_one_run_fits(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / 'a.mcap'
    assert main(['export', write_bag(tmp_path, cycles=2), '-o', str(path)]) == 1
    assert 'an .mcap holds one run; name it with BAG#NUMBER' in capsys.readouterr().err
    assert not path.exists()
