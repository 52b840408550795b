# SPDX-License-Identifier: BSD-3-Clause
"""The commands ``cell runs`` and ``cell compare`` on bags, by the configuration in them."""
from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Callable

import genpy
import numpy as np
import pytest
import rosbag
from cycle_bags import BEGIN_S, write_bag
from genpy.dynamic import generate_dynamic
from geometry_msgs.msg import WrenchStamped
from sensor_msgs.msg import JointState

from process_visualizer.bagio.bag_file import OP_MESSAGE
from process_visualizer.bagio.marks import Mark, add_mark
from process_visualizer.bagio.recording import Recording
from process_visualizer.cell.xml_parser import XmlParser
from process_visualizer.commands.command_line import main
from process_visualizer.runs.comparison.ghost import reference_tracks
from process_visualizer.runs.recorded.run_reader import read_run
from process_visualizer.runs.run import DAMAGED

Bag = Callable[..., str]


@pytest.fixture
def bag(tmp_path: Path) -> Bag:
    """Writes a bag: see write_bag."""
    return lambda *names, **options: write_bag(tmp_path, *names, **options)


def test_cycles_are_listed(bag: Bag, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(['runs', bag()]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines] == ['a.bag#1', 'a.bag#2']
    assert 'starts at 0:01.02' in lines[0]


def test_cycles_for_programs(bag: Bag, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(['runs', '--json', bag()]) == 0
    second = json.loads(capsys.readouterr().out)[1]
    assert second['begin_s'] == pytest.approx(11.02, abs=0.03)
    assert second['events'][0]['time_s'] == pytest.approx(13.02, abs=0.03)
    assert 'arm tool force' in second['channels']


def test_a_run_of_a_damaged_recording_says_so(
        bag: Bag, capsys: pytest.CaptureFixture[str]) -> None:
    """Its index points at bytes that are not a message."""
    good, path = bag('good.bag'), Path(bag())
    data = path.read_bytes()
    at = data.rindex(b'op=' + bytes([OP_MESSAGE]))
    path.write_bytes(data[:at] + b'op=\x09' + data[at + 4:])
    assert main(['runs', str(path)]) == 0
    assert all(DAMAGED in line for line in capsys.readouterr().out.splitlines())
    main(['compare', f'{path}#2', '--reference', f'{good}#1'])
    assert f'note: {DAMAGED}' in capsys.readouterr().out


def test_a_poor_run_is_found(bag: Bag, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    path = bag(cycles=3, poor=1)
    page = tmp_path / 'page.html'
    code = main(['compare', f'{path}#2', '--reference', f'{path}#1', f'{path}#3', '--report',
                 str(page)])
    assert code == 2
    out = capsys.readouterr().out
    assert 'a.bag#2: out of range first at 0:14.98 (starts + 2.0 s): arm tool force' in out
    assert '+5 N (band' in out
    assert 'arm tool force' in page.read_text(encoding='utf-8')


def test_a_good_run_is_within(bag: Bag, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(['compare', bag(), '--reference', bag()]) == 0
    assert '0 of 2 runs out of range' in capsys.readouterr().out


def test_a_good_run_without_data_in_places_is_not_called_all_good(
        bag: Bag, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    whole, gap = bag(), tmp_path / 'gap.bag'
    with rosbag.Bag(whole) as before, rosbag.Bag(str(gap), 'w') as after:
        for topic, message, time in before.read_messages():
            if topic != '/ft' or not 4.0 < time.to_sec() - BEGIN_S < 5.5:
                after.write(topic, message, time)
    assert main(['compare', f'{gap}#1', '--reference', whole]) == 3
    told = capsys.readouterr().out
    assert 'gap.bag#1: in range, 1.' in told
    assert 'not judged: arm tool force from 0:04' in told


def test_a_recording_in_parts_is_one(bag: Bag, capsys: pytest.CaptureFixture[str]) -> None:
    """The second cycle is in both parts; the third bag is another recording."""
    parts = [bag('a_0.bag', part_of_s=(0.0, 15.0)), bag('a_1.bag', part_of_s=(15.0, 24.0)),
             bag('a_2.bag', part_of_s=(2.0, 10.0))]
    for words in (parts[:1], parts[:2]):
        assert main(['runs', *words]) == 0
        lines = capsys.readouterr().out.splitlines()
        assert [line.split()[0] for line in lines] == ['a_0.bag#1', 'a_0.bag#2']
        assert 'starts at 0:13.02' in lines[1]
    assert main(['compare', f'{parts[0]}#2', '--reference', f'{parts[0]}#1']) == 0
    assert 'a_0.bag#2: in range' in capsys.readouterr().out


def test_a_configuration_may_be_given(bag: Bag, tmp_path: Path,
                                      capsys: pytest.CaptureFixture[str]) -> None:
    path = bag(stored=False)
    assert main(['runs', path]) == 1
    assert 'holds no configuration; name one with --config' in capsys.readouterr().err
    assert main(['runs', path, '--config', str(tmp_path / 'cell.xml')]) == 0


def test_without_a_span_a_recording_is_one_run(bag: Bag,
                                               capsys: pytest.CaptureFixture[str]) -> None:
    assert main(['runs', bag(run='')]) == 0
    assert capsys.readouterr().out.startswith('a.bag  from 0:00.00, 24.0 s: starts at')


ARM = """<robot name="arm"><link name="root"/><link name="upper"/><link name="fore"/>
  <link name="tool0"/>
  <joint name="a" type="continuous"><parent link="root"/><child link="upper"/>
    <axis xyz="0 0 1"/></joint>
  <joint name="b" type="continuous"><parent link="upper"/><child link="fore"/>
    <origin xyz="0.6 0 0"/><axis xyz="0 0 1"/></joint>
  <joint name="c" type="fixed"><parent link="fore"/><child link="tool0"/>
    <origin xyz="0.4 0 0"/></joint></robot>"""


def write_joints_only_cell(folder: Path) -> str:
    """Write a robot whose driver sends joint states and nothing else; return the configuration."""
    (folder / 'arm.urdf').write_text(ARM)
    (folder / 'cell.xml').write_text(
        '<visualizer><device type="robot" name="arm"><model path="arm.urdf"/>'
        '<base frame="root"/><topic name="joints" type="joint_states"/></device></visualizer>')
    return str(folder / 'cell.xml')


def write_turn(path: Path, start_s: float, pace: float, bent_rad: float = 0.0) -> str:
    """Write joint states of a motion; joint b leaves its path for a while."""
    with rosbag.Bag(str(path), 'w') as bag:
        for row in range(1100):
            now_s = row / 100
            part = min(max((now_s - start_s) * pace / 6.0, 0.0), 1.0)
            turn = 10 * part ** 3 - 15 * part ** 4 + 6 * part ** 5
            off = bent_rad * np.sin(np.pi * (part - 0.4) / 0.2) ** 2 * (0.4 < part < 0.6)
            state = JointState(name=['a', 'b'],
                               position=[1.5 * turn, 0.8 * np.sin(4.0 * turn) + off])
            state.header.stamp = genpy.Time(1000 + now_s)
            bag.write('/joints', state, genpy.Time(1000 + now_s + 0.002))
    return str(path)


@pytest.mark.parametrize('start_s, pace, said', [
    (2.5, 1.0, ''), (1.0, 0.9, r'its motion took 0\.\d+ s \(1[01]\.\d %\) longer than in the ref')])
def test_a_driver_of_joints_only_may_begin_later_or_be_slower(
        tmp_path: Path, capsys: pytest.CaptureFixture[str], start_s: float, pace: float,
        said: str) -> None:
    config = write_joints_only_cell(tmp_path)
    assert main(['compare', write_turn(tmp_path / 'other.bag', start_s, pace), '--reference',
                 write_turn(tmp_path / 'good.bag', 1.0, 1.0), '--config', config]) == 0
    out = capsys.readouterr().out
    assert 'other.bag: in range' in out
    assert re.search(said, out) and ('took' in out) == bool(said)


def test_a_tool_beside_its_path_is_told_though_the_driver_sends_joints_only(
        tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """One joint is off by 0.1 rad, which is 40 mm at the tool."""
    config = write_joints_only_cell(tmp_path)
    assert main(['compare', write_turn(tmp_path / 'other.bag', 1.0, 1.0, bent_rad=0.1),
                 '--reference', write_turn(tmp_path / 'good.bag', 1.0, 1.0), '--config',
                 config]) == 2
    said = r'other\.bag: out of range first at 0:03\.\d+: arm tool \d\d\.\d mm to the left of'
    assert re.search(said, capsys.readouterr().out)


def test_joints_that_come_one_by_one_give_tool_and_ghost(tmp_path: Path) -> None:
    """The tool is in the global frame, in which the base is turned."""
    (tmp_path / 'arm.urdf').write_text(ARM)
    (tmp_path / 'cell.xml').write_text(
        '<visualizer><device type="robot" name="arm"><model path="arm.urdf"/>'
        '<base frame="root" xyz="1 2 0" rpy="1.5707963 0 0"/>'
        '<topic name="joints" type="joint_states"/></device></visualizer>')

    def angles(time_s: np.ndarray) -> np.ndarray:
        return np.array([np.sin(time_s), 0.5 * time_s])

    with rosbag.Bag(str(tmp_path / 'a.bag'), 'w') as bag:
        for row in range(400):
            for number, name in enumerate('ab'):
                time_s = row / 100 + 0.004 * number
                state = JointState(name=[name], position=[angles(time_s)[number]])
                state.header.stamp = genpy.Time.from_sec(1000 + time_s)
                bag.write('/joints', state, genpy.Time.from_sec(1000 + time_s))
    cell = XmlParser().parse(str(tmp_path / 'cell.xml'))
    with Recording([str(tmp_path / 'a.bag')]) as recording:
        run = read_run(recording, cell)
    for number, name in enumerate('ab'):
        joint = run.by_key['arm', f'joint {name}']
        np.testing.assert_allclose(joint.values, angles(joint.times_s)[number], atol=1e-6)
    motion, = run.motions
    a, b = angles(motion.times_s)
    along, aside = 0.6 * np.cos(a) + 0.4 * np.cos(a + b), 0.6 * np.sin(a) + 0.4 * np.sin(a + b)
    assert len(motion.times_s) > 390
    np.testing.assert_allclose(motion.positions, np.column_stack(
        (1.0 - aside, 2.0 + along, 0.0 * along)), atol=1e-4)
    track, = reference_tracks(cell, run)
    found = track.there.at(2.222)
    assert found is not None
    np.testing.assert_allclose([found['a'], found['b']], angles(np.array(2.222)), atol=1e-4)


def test_what_has_a_stamp_was_measured_then(tmp_path: Path) -> None:
    """A delay on the way affects messages, but no time of a joint or force."""
    (tmp_path / 'arm.urdf').write_text(ARM)
    (tmp_path / 'cell.xml').write_text(
        '<visualizer><device type="robot" name="arm"><model path="arm.urdf"/>'
        '<base frame="root"/><topic name="joints" type="joint_states"/>'
        '<topic name="wrench" type="force_sensor" msg="geometry_msgs/WrenchStamped"/>'
        '</device></visualizer>')
    with rosbag.Bag(str(tmp_path / 'a.bag'), 'w') as bag:
        for row in range(200):
            stamp = genpy.Time(1000 + row / 100)
            arrival = genpy.Time(1000 + (row if not 50 <= row < 54 else 54) / 100 + 0.002)
            for topic, message in (('/joints', JointState(name=['a', 'b'], position=[row, 0.0])),
                                   ('/wrench', WrenchStamped())):
                message.header.stamp = stamp
                bag.write(topic, message, arrival)
    with Recording([str(tmp_path / 'a.bag')]) as recording:
        run = read_run(recording, XmlParser().parse(str(tmp_path / 'cell.xml')))
    for key in (('arm', 'joint a'), ('arm', 'tool force')):
        times_s = run.by_key[key].times_s
        np.testing.assert_allclose(np.diff(times_s), 0.01, atol=1e-6)


CONTROLLER_STATE = """std_msgs/Header header
string[] joint_names
trajectory_msgs/JointTrajectoryPoint desired
trajectory_msgs/JointTrajectoryPoint actual
trajectory_msgs/JointTrajectoryPoint error
""" + '='*80 + """
MSG: std_msgs/Header
uint32 seq
time stamp
string frame_id
""" + '='*80 + """
MSG: trajectory_msgs/JointTrajectoryPoint
float64[] positions
float64[] velocities
float64[] accelerations
float64[] effort
duration time_from_start
"""


def test_joints_that_lag_and_torques_are_judged_without_being_configured(
        tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The torque is greater from 3 s on, joint b lags from 5 s on; tool and joints move as ever."""
    (tmp_path / 'arm.urdf').write_text(ARM)
    (tmp_path / 'cell.xml').write_text(
        '<visualizer><device type="robot" name="arm"><model path="arm.urdf"/>'
        '<base frame="root"/><topic name="joints" type="joint_states"/>'
        '<topic name="wrench" type="force_sensor"/></device></visualizer>')
    kind = generate_dynamic('control_msgs/JointTrajectoryControllerState', CONTROLLER_STATE)
    state_type = kind['control_msgs/JointTrajectoryControllerState']

    def write(name: str, torque_nm: float, lag_rad: float) -> str:
        random = np.random.default_rng(sum(name.encode()))
        with rosbag.Bag(str(tmp_path / name), 'w') as bag:
            for row in range(800):
                now_s = row / 100
                stamp = genpy.Time(1000 + now_s)
                part = min(max((now_s - 1.0) / 6.0, 0.0), 1.0)
                turn = 10 * part ** 3 - 15 * part ** 4 + 6 * part ** 5
                joints = [1.5 * turn, 0.8 * np.sin(4.0 * turn)]
                message = WrenchStamped()
                message.wrench.force.z = 5.0 + 0.1 * random.standard_normal()
                message.wrench.torque.x = 1.0 + 0.02 * random.standard_normal() + (
                    torque_nm if now_s > 3.0 else 0.0)
                lags = [0.01 * part, 0.02 * part + (lag_rad if now_s > 5.0 else 0.0)]
                controller = state_type(joint_names=['b', 'a'])
                controller.actual.positions = joints[::-1]
                controller.desired.positions = [at + it for at, it in zip(joints, lags)][::-1]
                for topic, it in (('/joints', JointState(name=['a', 'b'], position=joints)),
                                  ('/wrench', message), ('/arm_controller/state', controller)):
                    it.header.stamp = stamp
                    bag.write(topic, it, stamp)
        return str(tmp_path / name)

    good, config = write('good.bag', 0.0, 0.0), ['--config', str(tmp_path / 'cell.xml')]
    assert main(['compare', write('same.bag', 0.0, 0.0), '--reference', good, *config]) == 0
    assert capsys.readouterr().err == ''
    assert main(['compare', write('poor.bag', 0.5, 0.03), '--reference', good, *config]) == 2
    torque, lag = capsys.readouterr().out.splitlines()[2:4]
    assert re.search(r'1  arm tool torque +from 0:0[23].*\+0.5', torque)
    assert re.search(r'2  arm joint b lag +from 0:0[45].*\+0.03 rad', lag)


def test_what_a_sensor_of_forces_does_not_measure_is_no_torque(bag: Bag) -> None:
    with Recording([bag()]) as recording:
        run = read_run(recording, XmlParser().parse(str(Path(recording.paths[0]).parent
                                                        / 'cell.xml')))
    assert ('arm', 'tool force') in run.by_key and ('arm', 'tool torque') not in run.by_key
    assert run.forces and not run.torques


@pytest.mark.parametrize('old, new, said', [
    ('topic="feed" frame', 'topic="fed" frame', 'did you mean "/feed"?'),
    ('topic="feed" frame', 'topic="feed" field="dat" frame',
     'the messages of "/feed" have no number "dat", which is configured for "machine feed"')])
def test_what_is_configured_and_no_recording_has_is_an_error(
        bag: Bag, tmp_path: Path, capsys: pytest.CaptureFixture[str], old: str, new: str,
        said: str) -> None:
    path, config = bag(), tmp_path / 'cell.xml'
    config.write_text(config.read_text(encoding='utf-8').replace(old, new), encoding='utf-8')
    for words in (['runs', path], ['compare', path, '--reference', path]):
        assert main([*words, '--config', str(config)]) == 1
        assert said in capsys.readouterr().err


@pytest.mark.parametrize('words, reason', [
    (['a.bag#7', '--reference', 'a.bag'], 'has the runs 1 to 2, not 7'),
    (['a.bag', '--reference', 'none.bag'], 'none.bag: cannot be opened'),
    (['a.bag', '--reference', 'a.bag', '--band', '0.01'], 'it takes 99'),
    (['a.bag', '--reference', 'a.bag', '--band', '2'], '--band is 2; give a rate between 0 and 1'),
    (['a.bag', '--reference', 'a.bag', '--tolerance', '0'], '--tolerance is 0'),
    (['a.bag', '--reference', 'a.bag', '--report', 'no/page.html'], 'no/page.html')])
def test_wrong_input(bag: Bag, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
                     capsys: pytest.CaptureFixture[str], words: 'list[str]', reason: str) -> None:
    bag()
    monkeypatch.chdir(tmp_path)
    assert main(['compare', *words]) == 1
    error = capsys.readouterr().err
    assert error.startswith('cell: ') and reason in error


def test_a_recording_without_a_whole_run(bag: Bag, capsys: pytest.CaptureFixture[str]) -> None:
    path = bag(run='<run begin="starts" end="a mark"/>')
    assert main(['runs', path]) == 1
    assert 'a.bag contains no complete run: "a mark" does not occur' in capsys.readouterr().err
    add_mark(path, Mark((BEGIN_S + 5) * 10 ** 9, 'a mark'))
    assert main(['runs', path]) == 0
    assert 'a.bag#1  from 0:01.02, 4.0 s' in capsys.readouterr().out


def test_from_each_begin_to_the_next(bag: Bag, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(['runs', bag(cycles=3, run='<run begin="starts" end="starts"/>')]) == 0
    assert len(capsys.readouterr().out.splitlines()) == 2


def test_a_robot_of_another_name(bag: Bag, capsys: pytest.CaptureFixture[str]) -> None:
    code = main(['compare', bag('b.bag', robot='renamed'), '--reference', bag()])
    out = capsys.readouterr().out
    assert code == 3
    assert 'note: only the reference has arm tool speed, arm tool force' in out
    assert 'aligned by their events' in out


def test_an_interrupt_ends_it_without_a_word(bag: Bag, monkeypatch: pytest.MonkeyPatch,
                                             capsys: pytest.CaptureFixture[str]) -> None:
    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt
    monkeypatch.setattr(Recording, 'message', interrupted)
    assert main(['runs', bag()]) == 130
    assert capsys.readouterr().err == ''


def test_two_variables_of_one_label(bag: Bag, tmp_path: Path) -> None:
    path = bag()
    config = tmp_path / 'cell.xml'
    config.write_text(config.read_text(encoding='utf-8').replace('<topic name="feed"/>', (
        '<topic name="feed"/><topic name="ft"/>'
        '<variable topic="ft" field="data[0]" frame="world" label="feed"/>')), encoding='utf-8')
    with Recording([path]) as recording:
        run = read_run(recording, XmlParser().parse(str(config)))
    assert [key for key in run.by_key if key[0] == 'machine'] == [
        ('machine', 'feed'), ('machine', 'feed (/feed)')]
    assert len(run.by_key) == len(run.channels)


def test_tolerances_are_those_of_the_configuration(bag: Bag, tmp_path: Path) -> None:
    path, config = bag(), tmp_path / 'cell.xml'
    config.write_text(config.read_text(encoding='utf-8').replace(
        'tolerance="0.02"', 'tolerance="0.02" max_tolerance="0.03"').replace(
        '<topic name="ft"', '<arrow quantity="force" tolerance="2" max_tolerance="4"/>'
        '<topic name="ft"'), encoding='utf-8')
    with Recording([path]) as recording:
        channels = read_run(recording, XmlParser().parse(str(config))).by_key
    assert [(it.tolerance, it.max_tolerance) for it in (
        channels['machine', 'feed'], channels['arm', 'tool force'])] == [(0.02, 0.03), (2.0, 4.0)]


def test_tool_positions_are_in_the_global_frame(bag: Bag, tmp_path: Path) -> None:
    with Recording([bag()]) as recording:
        run = read_run(recording, XmlParser().parse(str(tmp_path / 'cell.xml')))
    positions = run.motions[0].positions
    np.testing.assert_allclose(positions[0], (1.0, 0.0, 0.0), atol=1e-6)
    np.testing.assert_allclose(positions[:, 1].max(), 0.5, atol=1e-3)  # the base is turned
