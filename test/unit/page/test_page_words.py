# SPDX-License-Identifier: BSD-3-Clause
"""The texts of a page about a run match its verdict."""
from __future__ import annotations

import math
from pathlib import Path

import genpy
import pytest
import rosbag
from cycle_bags import write_bag
from geometry_msgs.msg import WrenchStamped
from page_reader import PageReader
from sensor_msgs.msg import JointState
from std_msgs.msg import Bool, Float32, Float64

from process_visualizer.commands.command_line import main
from process_visualizer.page.robots import PageSpan
from process_visualizer.page.run_page import run_words
from process_visualizer.runs.comparison.comparison import Unjudged
from process_visualizer.runs.comparison.good_runs import GoodRuns
from process_visualizer.runs.recorded.chosen_runs import ChosenRuns


def test_a_run_that_is_not_judged_is_neither_good_nor_poor(tmp_path: Path) -> None:
    reference, run = ChosenRuns().runs([write_bag(tmp_path)])
    judged = GoodRuns(reference, []).compare(run)
    not_judged = judged._replace(why_not='there is no good run of variant 2')
    words = [run_words(run, it, (), PageSpan(0.0, 10.0)) for it in (judged, not_judged)]
    assert [it['state'] for it in words] == ['good', 'plain']
    assert words[1]['verdict'] == 'is not judged: there is no good run of variant 2'


def test_where_a_run_has_no_data_the_page_says_so(tmp_path: Path) -> None:
    reference, run = ChosenRuns().runs([write_bag(tmp_path)])
    found = GoodRuns(reference, []).compare(run)
    force = next(it for it in found.band.signals if it.label == 'tool force')
    with_gap = found._replace(unjudged=(Unjudged(force, 4.0, 5.5),))
    assert run_words(run, with_gap, (), PageSpan(0.0, 10.0))['notes'][-1] == (
        'not judged: arm tool force from 0:04.00 to 0:05.50 (data missing or late)')
    in_range = with_gap._replace(departures=())
    assert run_words(run, in_range, (), PageSpan(0.0, 10.0))['verdict'] == (
        'in range, 1.5 s not judged (data missing or late)')
    overlapping = in_range._replace(unjudged=(Unjudged(force, 4.0, 5.5), Unjudged(force, 5.0, 6.0),
                                              Unjudged(force, 8.0, 8.2)))
    assert overlapping.unjudged_s == pytest.approx(2.2)
    half = in_range._replace(unjudged=(Unjudged(force, 1.0, 6.0),))
    assert run_words(run, half, (), PageSpan(0.0, 10.0))['verdict'] == (
        f'5.0 of {run.duration_s:.1f} s not judged (data missing or late); the rest is in range')


@pytest.mark.parametrize(('period_s', 'holds_s'), [(0.02, 0.7), (0.5, 0.7), (2.0, 6.0)])
def test_a_value_is_out_of_date_as_in_rviz(tmp_path: Path, period_s: float,
                                           holds_s: float) -> None:
    config, bag, page = (tmp_path / name for name in ('cell.xml', 'a.bag', 'page.html'))
    config.write_text('<visualizer><device type="other" name="oven"><base frame="oven"/>'
                      '<variable topic="/heat" frame="oven" label="heat"/></device></visualizer>',
                      encoding='utf-8')
    with rosbag.Bag(str(bag), 'w') as file:
        for number in range(20):
            file.write('/heat', Float32(20.0), genpy.Time.from_sec(100.0 + period_s * number))
        file.write('/end', Float32(0.0), genpy.Time.from_sec(200.0))
    assert main(['share', str(bag), '--config', str(config), '-o', str(page)]) == 0
    entry, = PageReader(page.read_text(encoding='utf-8')).data['runs'][0]['numbers']
    assert (entry['holds'], entry['short']) == (pytest.approx(holds_s), 'heat')


def test_a_value_that_is_sent_on_change_holds(tmp_path: Path) -> None:
    config, bag, page = (tmp_path / name for name in ('cell.xml', 'a.bag', 'page.html'))
    config.write_text('<visualizer><device type="other" name="oven"><base frame="oven"/>'
                      '<variable topic="/door" frame="oven" label="door"/></device></visualizer>',
                      encoding='utf-8')
    with rosbag.Bag(str(bag), 'w') as file:
        for number, time_s in enumerate((0.0, 0.1, 7.0, 30.0, 31.0, 60.0)):
            file.write('/door', Bool(bool(number % 2)), genpy.Time.from_sec(100.0 + time_s))
    assert main(['share', str(bag), '--config', str(config), '-o', str(page)]) == 0
    entry, = PageReader(page.read_text(encoding='utf-8')).data['runs'][0]['numbers']
    assert entry['holds'] is None


ARM = '''<robot name="arm"><link name="base"/><link name="hand"/><joint name="j" type="revolute">
<parent link="base"/><child link="hand"/><origin rpy="0.3 0 0"/><axis xyz="0 1 0"/>
<limit lower="-3" upper="3" effort="1" velocity="1"/></joint></robot>'''
ODD_CELL = '''<visualizer><device type="robot" name="arm"><model path="arm.urdf"/>
<base frame="base" xyz="0 0 0"/><tool frame="hand"/>
<topic name="q" type="joint_states" msg="sensor_msgs/JointState"/>
<topic name="f" type="force_sensor" msg="geometry_msgs/WrenchStamped"/>
<variable topic="v" field="data" frame="base"/></device></visualizer>'''


@pytest.mark.filterwarnings('error')
def test_numbers_that_no_sensor_measures_lead_to_a_page_without_warnings(tmp_path: Path) -> None:
    (tmp_path / 'arm.urdf').write_text(ARM)
    (tmp_path / 'cell.xml').write_text(ODD_CELL)
    with rosbag.Bag(str(tmp_path / 'a.bag'), 'w') as bag:
        for row, value in enumerate([1.0, math.nan, math.inf, 1e300, -1e308, 2.0] * 10):
            stamp = genpy.Time(1_700_000_000, row * 10_000_000)
            force = WrenchStamped()
            force.header.stamp, force.header.frame_id = stamp, 'hand'
            force.wrench.force.x = value
            joint = JointState(name=['j'], position=[value])
            joint.header.stamp = stamp
            for topic, message in (('/f', force), ('/v', Float64(value)), ('/q', joint)):
                bag.write(topic, message, stamp)
    page = tmp_path / 'page.html'
    assert main(['share', str(tmp_path / 'a.bag'), '--config', str(tmp_path / 'cell.xml'), '-o',
                 str(page)]) == 0
    reader = PageReader(page.read_text(encoding='utf-8'))
    number = reader.number(0, 'arm', 'number')
    assert reader.text(number, 0.0) == 'v 1.000'
