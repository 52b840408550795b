# SPDX-License-Identifier: BSD-3-Clause
"""The content of a page equals that of the product at the same position."""
from __future__ import annotations

import math
from pathlib import Path
from typing import Dict, List

import genpy
import numpy as np
import pytest
import rosbag
from geometry_msgs.msg import Vector3, Wrench, WrenchStamped
from page_reader import PageReader, between
from sensor_msgs.msg import JointState
from sewing_runs import CELL, write_sewing_run
from std_msgs.msg import Header

from process_visualizer.cell.xml_parser import XmlParser
from process_visualizer.commands.command_line import main
from process_visualizer.curves.position_values import PositionValues, key_of
from process_visualizer.nodes.ghost.ghost_robot import GhostRobot
from process_visualizer.page.robots import (
    Moving,
    RowsOfJoints,
    base_place,
    resampled,
    standing_on,
)
from process_visualizer.robot.description import describe_device
from process_visualizer.robot.joints import JointTrack
from process_visualizer.robot.kinematics import Kinematics
from process_visualizer.robot.placements import Placements
from process_visualizer.robot.rotations import rotation_vector_between
from process_visualizer.runs.comparison.ghost import ghost_tracks, reference_tracks, robot_models
from process_visualizer.runs.comparison.good_runs import GoodRuns
from process_visualizer.runs.recorded.chosen_runs import ChosenRuns

POSITIONS_S = np.random.default_rng(3).uniform(0.6, 18.0, 60).tolist()
QUANTITIES = {'v': 'speed', 'F': 'force'}


class Shared:
    """A page and the recordings from which it was made."""

    def __init__(self, folder: Path) -> None:
        self.good = write_sewing_run(folder, 'good.bag')
        self.poor = write_sewing_run(folder, 'poor.bag', 2, is_poor=True)
        self.path = folder / 'page.html'
        assert main(['share', f'{self.poor}#1', '--reference', self.good, '-o',
                     str(self.path)]) == 0
        self.html = self.path.read_text(encoding='utf-8')
        self.page = PageReader(self.html)


@pytest.fixture(scope='module')
def shared(tmp_path_factory: pytest.TempPathFactory) -> Shared:
    return Shared(tmp_path_factory.mktemp('page'))


def test_numbers_are_those_at_the_position(shared: Shared) -> None:
    devices = XmlParser().parse(str(CELL)).devices
    values = PositionValues([shared.poor], devices)
    try:
        for time_s in POSITIONS_S:
            known = values.at(time_s)
            for entry in shared.page.data['runs'][0]['numbers']:
                label = {'speed': 'v', 'force': 'F'}.get(entry['quantity'], entry['label'])
                expected = known[key_of(entry['device'], label, entry['topic'])]
                assert expected is not None
                assert shared.page.value(entry, time_s) == pytest.approx(expected, rel=2e-6,
                                                                         abs=1e-7)
    finally:
        values.close()


def test_texts_are_in_the_words_of_rviz(shared: Shared) -> None:
    page = shared.page
    force, edge = (page.number(0, 'ur_rt_upper', 'force'),
                   page.number(0, 'sewing_machine', 'number', 'upper edge'))
    for time_s in POSITIONS_S[:10]:
        assert page.text(force, time_s) == f'F {page.value(force, time_s):.1f} N'
        assert page.text(edge, time_s) == f'upper edge {page.value(edge, time_s):.0f}'


def test_links_are_where_the_last_joints_have_them(shared: Shared) -> None:
    cell = XmlParser().parse(str(CELL))
    run, = ChosenRuns(cell).runs([f'{shared.poor}#1'])
    tracks = {it.device: it.there for it in reference_tracks(cell, run)}
    models: Dict[str, Kinematics] = {}
    for device in cell.devices:
        description = describe_device(device)
        if description is not None:
            models[device.name] = Kinematics(description.text)
    links = shared.page.links(0)
    assert {device for device, _, _ in links} == set(models)
    for time_s in POSITIONS_S:
        for device, link, number in links:
            joints = {} if device not in tracks else last_joints(
                tracks[device], time_s - run.begin_s)
            inner = models[device].placement(link, models[device].links[0], joints)
            assert inner is not None
            place = base_place(cell.device(device)).then(inner)
            position, turn = shared.page.place(0, number, time_s)
            assert math.dist(position, place.position) < 2e-4
            angle = math.hypot(*rotation_vector_between(place.quaternion, tuple(turn.tolist())))
            assert math.degrees(angle) < 0.05


def last_joints(track: JointTrack, time_s: float) -> Dict[str, float]:
    """The last joint positions, as in robot_state_publisher."""
    row = int(np.searchsorted(track.times_s, time_s, side='right')) - 1
    return dict(zip(track.joints, track.positions[row].tolist()))


ARM = '<robot name="arm"><link name="foot"/>' + ''.join(
    f'''<link name="{link}"><visual><geometry><box size="0.1 0.1 0.1"/></geometry></visual></link>
<joint name="{joint}" type="prismatic"><parent link="{parent}"/><child link="{link}"/>
<axis xyz="{axis}"/><limit lower="-9" upper="9" effort="1" velocity="1"/></joint>'''
    for joint, parent, link, axis in (('reach', 'foot', 'hand', '1 0 0'),
                                      ('grip', 'hand', 'jaw', '0 1 0'))) + '</robot>'
ARM_CELL = '''<visualizer><device type="robot" name="arm"><model path="arm.urdf"/>
<base frame="foot"/><tool frame="hand"/><topic name="joints" type="joint_states"/>
<topic name="grip" type="joint_states"/>
<topic name="wrench" type="force_sensor" msg="geometry_msgs/WrenchStamped"/></device>
</visualizer>'''
LATE_S = 0.03
"""Delay between stamp and arrival."""


def test_messages_count_from_when_they_came_and_each_joint_has_its_last(tmp_path: Path) -> None:
    config, bag, page = (tmp_path / name for name in ('cell.xml', 'a.bag', 'page.html'))
    config.write_text(ARM_CELL, encoding='utf-8')
    (tmp_path / 'arm.urdf').write_text(ARM, encoding='utf-8')
    with rosbag.Bag(str(bag), 'w') as file:
        for number in range(40):
            came_s, step = 100.0 + 0.1 * number, 0.1 * number
            header = Header(stamp=genpy.Time.from_sec(came_s - LATE_S), frame_id='hand')
            came = genpy.Time(nsecs=round(came_s * 1e9) + 7)
            file.write('/joints', JointState(header, ['reach'], [step], [], []), came)
            file.write('/wrench', WrenchStamped(header, Wrench(force=Vector3(step, 0, 0))), came)
            if number % 5 == 0:
                file.write('/grip', JointState(header, ['grip'], [-step], [], []), came)
    assert main(['share', str(bag), '--config', str(config), '-o', str(page)]) == 0
    reader = PageReader(page.read_text(encoding='utf-8'))
    places = {link: number for _, link, number in reader.links(0)}
    arrow = next(it for it in reader.data['runs'][0]['arrows'] if it['quantity'] == 'force')
    forces_s = reader.column(arrow['times'])
    assert not arrow.get('between')
    for time_s, last in ((1.0, 10), (1.05, 10), (1.075, 10), (1.0999999, 10), (1.1, 11), (3.0, 30)):
        reach, grip = 0.1 * last, -0.5 * (last // 5)
        assert reader.place(0, places['hand'], time_s)[0] == pytest.approx(
            [reach, 0.0, 0.0], abs=1e-4)
        assert reader.place(0, places['jaw'], time_s)[0] == pytest.approx(
            [reach, grip, 0.0], abs=1e-4)
        assert np.searchsorted(forces_s, time_s, side='right') == last + 1


def test_a_ghost_on_a_base_that_tf_moves_does_not_glide_ahead() -> None:
    """The base follows the last message; between its messages the joints change evenly."""
    def at_x(*x_m: float) -> Placements:
        return Placements(np.column_stack((x_m, np.zeros((len(x_m), 2)))),
                          np.tile((0.0, 0.0, 0.0, 1.0), (len(x_m), 1)))

    base = Moving(np.array([0.0, 1.0, 2.0]), at_x(0.0, 1.0, 2.0))
    joints = RowsOfJoints(np.array([0.0, 2.0]), {'reach': np.array([0.0, 0.2])}, True)
    placed, rows = standing_on(base, joints)
    assert isinstance(placed, Moving)
    for time_s, x_m in ((0.5, 0.0), (0.999999, 0.0), (1.0, 1.0), (1.5, 1.0)):
        found = resampled(placed, np.array([time_s])).positions[0, 0]
        assert found == pytest.approx(x_m, abs=1e-6)
        assert np.interp(time_s, rows.times_s, rows.positions['reach']) == pytest.approx(
            0.1 * time_s)


def test_the_ghost_is_as_far_away_as_in_rviz(shared: Shared) -> None:
    cell = XmlParser().parse(str(CELL))
    chosen = ChosenRuns(cell)
    good, (run,) = GoodRuns(*chosen.runs([shared.good])), chosen.runs([f'{shared.poor}#1'])
    models = robot_models(cell)
    tracks = ghost_tracks(cell, good.reference, [good.compare(run)], models)
    entries = {it['device']: it for it in shared.page.data['runs'][0]['ghost']['deviations']}
    assert len(tracks) == len(entries) == 2
    for track in tracks:
        robot = GhostRobot(track.device, models[track.device].text, track.tool, track.there,
                           track.there._replace(positions=track.here))
        entry = entries[track.device]
        times_s, rows = (shared.page.column(entry['times']), shared.page.column(entry['rows'], 6))
        known: List[float] = []
        for time_s in POSITIONS_S:
            deviation, row = robot.deviation(time_s), between(times_s, rows, time_s)
            if deviation is None or row is None:
                continue
            known.append(deviation.length_m)
            assert np.linalg.norm(row[3:]) == pytest.approx(deviation.length_m, abs=1e-5)
        assert len(known) > 50


def test_the_words_are_those_of_the_comparison(shared: Shared,
                                               capsys: pytest.CaptureFixture[str]) -> None:
    main(['compare', f'{shared.poor}#1', '--reference', shared.good])
    said = capsys.readouterr().out
    run = shared.page.data['runs'][0]
    assert f'poor.bag#1: {run["verdict"]}' in said
    assert run['departures'][0]['what'] in said
    assert run['departures'][0]['amount'] in shared.html
    assert run['lanes'][0]['band']['out']['n'] == run['lanes'][0]['low']['n']
    assert [it['label'] for it in run['moments']] == ['needle starts', 'needle stops']
