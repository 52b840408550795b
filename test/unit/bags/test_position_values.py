# SPDX-License-Identifier: BSD-3-Clause
"""Values at a position: exact, from the messages around it, independent of the way there."""
from __future__ import annotations

import math
import random
from pathlib import Path
from typing import Any, Iterator, List

import numpy as np
import pytest
import rosbag
from genpy import Time
from geometry_msgs.msg import PoseStamped, WrenchStamped
from std_msgs.msg import Float32MultiArray, Float64, String

from process_visualizer.cell.xml_parser import XmlParser
from process_visualizer.curves.position_values import PositionValues, key_of
from process_visualizer.robot.measuring_time import measuring_times
from process_visualizer.robot.recorded_velocity import RecordedVelocity

BEGIN_S = 1_600_000_000
SPEED, FORCE = key_of('ur', 'v', '/tcf'), key_of('ur', 'F', '/ft')
HEAT = key_of('oven', 'heat', '/heat')
CELL = """<visualizer>
<device type="robot" name="ur">
  <base frame="ur/link0"/>
  <topic name="tcf" type="tool_center_frame"/>
  <topic name="ft" type="force_sensor"/>
</device>
<device type="other" name="oven"><topic name="heat"/></device>
</visualizer>"""


def stamp(time_s: float) -> Time:
    return Time(*divmod(BEGIN_S * 10 ** 9 + round(time_s * 1e9), 10 ** 9))


def speed_at(time_s: float) -> float:
    """Speed of a tool that swings [m/s]."""
    return abs(0.2 * math.cos(2.0 * time_s))


def pose(time_s: float, stamped: bool) -> Any:
    x = 0.1 * math.sin(2.0 * time_s)
    if not stamped:
        return Float32MultiArray(data=[x, 0.0, 0.5, 0.0, 0.0, 0.0])
    message = PoseStamped()
    message.header.stamp = stamp(time_s)
    message.pose.position.x, message.pose.orientation.w = x, 1.0
    return message


def test_in_a_hole_of_the_recording_no_value_holds(tmp_path: Path) -> None:
    path, config = tmp_path / 'a.bag', tmp_path / 'cell.xml'
    config.write_text(CELL)
    with rosbag.Bag(str(path), 'w') as bag:
        bag.write('/heat', Float64(400.0), stamp(0.0))
        for time_s in (it for it in np.arange(0.0, 12.0, 0.02) if not 4.0 < it < 9.0):
            bag.write('/other', String('a'), stamp(time_s))
    found = PositionValues([str(path)], XmlParser({}).parse(str(config)).devices)
    assert [found.at(it)[HEAT] for it in (3.9, 4.5, 4.8, 8.9, 9.1)] == [
        400.0, 400.0, None, None, 400.0]
    found.close()


@pytest.fixture(params=[False, True], ids=['arrays', 'poses with stamps'])
def values(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[PositionValues]:
    """Eight seconds at 125 Hz; the force equals its time, the heat begins at 0.1 s."""
    path, config = tmp_path / 'a.bag', tmp_path / 'cell.xml'
    config.write_text(CELL)
    with rosbag.Bag(str(path), 'w', chunk_threshold=20_000) as bag:
        for number in range(1001):
            time_s = number / 125
            bag.write('/tcf', pose(time_s, request.param), stamp(time_s))
            wrench = WrenchStamped()
            wrench.wrench.force.z = -time_s
            bag.write('/ft', wrench, stamp(time_s))
            if number % 25 == 12:
                bag.write('/heat', Float64(time_s), stamp(time_s))
    found = PositionValues([str(path)], XmlParser({}).parse(str(config)).devices)
    yield found
    found.close()


def test_the_last_message_at_the_position(values: PositionValues) -> None:
    assert values.at(4.0)[FORCE] == 4.0
    assert values.at(4.0 - 1e-9)[FORCE] == pytest.approx(4.0 - 0.008)
    assert values.at(4.0)[HEAT] == pytest.approx((500 - 500 % 25 - 13) / 125)


def test_the_speed_is_that_of_the_middle_of_its_window(values: PositionValues) -> None:
    for time_s in (0.5, 2.345, 4.0, 6.789):
        assert values.at(time_s)[SPEED] == pytest.approx(speed_at(time_s), abs=2e-3)


def test_the_part_around_the_position_says_what_the_whole_says(tmp_path: Path) -> None:
    """Messages of a busy machine: late and in bunches. Near the position all of them count."""
    random.seed(3)
    path, config = tmp_path / 'a.bag', tmp_path / 'cell.xml'
    config.write_text(CELL)
    times_s, positions = [], []
    for number in range(1001):
        late_s = max(number / 125 + 0.02 * random.random() ** 4, times_s[-1] if times_s else 0.0)
        times_s.append(round(late_s, 9))
        positions.append(list(np.float32([0.1 * math.sin(number / 62.5), 0.0, 0.5])))
    with rosbag.Bag(str(path), 'w') as bag:
        for time_s, position in zip(times_s, positions):
            bag.write('/tcf', Float32MultiArray(data=[*position, 0.0, 0.0, 0.0]), stamp(time_s))
    values = PositionValues([str(path)], XmlParser({}).parse(str(config)).devices)
    begin_s = times_s[0]
    arrivals_s = np.array(times_s) - begin_s
    whole = RecordedVelocity(measuring_times(arrivals_s, np.full(len(arrivals_s), np.nan)),
                             np.array(positions, float))
    for time_s in (0.0, 0.3, 1.0, 2.345, 5.0, 7.9):
        expected = np.linalg.norm(whole.velocity(time_s))
        assert values.at(time_s)[SPEED] == pytest.approx(expected, abs=1e-6)
    values.close()


def test_at_the_beginning_the_first_message_of_the_next_moment_holds(
        values: PositionValues) -> None:
    assert values.at(0.0)[HEAT] == pytest.approx(12 / 125)
    assert values.at(0.0)[FORCE] == 0.0


def test_however_one_comes_there(values: PositionValues) -> None:
    """No state is kept that would make a difference."""
    positions = [number / 10 for number in range(80)]
    forwards = {position: values.at(position) for position in positions}
    random.Random(1).shuffle(positions)
    for position in positions:
        assert values.at(position) == forwards[position]


def test_what_has_nothing_there(tmp_path: Path) -> None:
    path, config = tmp_path / 'a.bag', tmp_path / 'cell.xml'
    config.write_text(CELL)
    with rosbag.Bag(str(path), 'w') as bag:
        bag.write('/other', String('x'), stamp(0.0))
        for number in range(100):
            bag.write('/tcf', pose(2.0 + number / 125, False), stamp(2.0 + number / 125))
        for number, heat in enumerate([1.0, math.nan, 2.0]):
            bag.write('/heat', Float64(heat), stamp(3.0 + number))
    values = PositionValues([str(path)], XmlParser({}).parse(str(config)).devices)
    found: List[Any] = [values.at(time_s) for time_s in (1.0, 2.5, 4.5, 5.0)]
    values.close()
    assert found[0] == {SPEED: None, HEAT: None}
    assert found[1][SPEED] == pytest.approx(speed_at(2.5), abs=2e-3)
    assert [it[HEAT] for it in found[2:]] == [1.0, 2.0]
    assert found[2][SPEED] is None
