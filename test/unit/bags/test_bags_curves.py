# SPDX-License-Identifier: BSD-3-Clause
"""Curves of process variables: from the messages of a bag to the columns of a timeline."""
from __future__ import annotations

import math
import warnings
from pathlib import Path
from typing import Any, Callable, List, NamedTuple, Sequence

import numpy as np
import pytest
import rosbag
from genpy import Time
from geometry_msgs.msg import PoseStamped, TransformStamped, WrenchStamped
from hypothesis import given
from hypothesis import strategies as st
from sensor_msgs.msg import Image
from std_msgs.msg import Float32, Float32MultiArray, Float64, String, UInt16
from tf2_msgs.msg import TFMessage

from process_visualizer.bagio.bag_errors import BagError
from process_visualizer.cell.model import Device
from process_visualizer.cell.xml_parser import XmlParser
from process_visualizer.curves import curves as curves_module
from process_visualizer.curves.curves import Curve, column_limits, columns_for, read_curves
from process_visualizer.curves.position_values import PositionValues
from process_visualizer.curves.samples import ReadingCanceled

BEGIN_S = 1_600_000_000


class Row(NamedTuple):
    """Message to be recorded: topic, time [s from the beginning], content."""

    topic: str
    time_s: float
    message: Any


def stamp(time_s: float) -> Time:
    return Time(*divmod(BEGIN_S * 10 ** 9 + round(time_s * 1e9), 10 ** 9))


def write(path: Path, rows: Sequence[Row], compression: str = 'none') -> str:
    with rosbag.Bag(str(path), 'w', compression=compression, chunk_threshold=50_000) as bag:
        for row in sorted(rows, key=lambda it: it.time_s):
            bag.write(row.topic, row.message, stamp(row.time_s))
    return str(path)


@pytest.fixture
def devices(tmp_path: Path) -> Callable[[str], Sequence[Device]]:
    """Parses the devices of a configuration."""
    def parse(text: str) -> Sequence[Device]:
        path = tmp_path / 'cell.xml'
        path.write_text(f'<visualizer>{text}</visualizer>')
        return XmlParser().parse(str(path)).devices
    return parse


ROBOT = """
<device type="robot" name="ur">
  <base frame="ur/link0"/>
  <topic name="tcf" type="tool_center_frame"/>
  <topic name="ft" type="force_sensor"/>
  <arrow quantity="force" color="0.1 0.2 0.3"/>
</device>
"""


def robot_rows(length_s: float = 4.0) -> List[Row]:
    """A tool that circles at 0.2 m/s, a force of 5 N with a short peak, and images in between."""
    rows = []
    for number in range(int(length_s * 125)):
        time_s = number / 125
        turn = time_s * 2.0
        rows.append(Row('/tcf', time_s, Float32MultiArray(data=[
            0.1 * math.cos(turn), 0.1 * math.sin(turn), 0.5, 0, 0, 0])))
        force = 50.0 if number == 200 else 5.0
        rows.append(Row('/ft', time_s + 0.001, Float32MultiArray(data=[0, 0.6 * force,
                                                                       0.8 * force])))
    rows += [Row('/image', number / 30, Image(data=bytes(60_000)))
             for number in range(int(length_s * 30))]
    return rows


@pytest.mark.parametrize('compression', ['none', 'bz2', 'lz4'])
def test_speed_and_force_of_a_robot(tmp_path: Path, devices: Any, compression: str) -> None:
    path = write(tmp_path / 'a.bag', robot_rows(), compression)
    speed, force = read_curves([path], devices(ROBOT), columns=100)
    assert (speed.device, speed.label, speed.unit, speed.topic) == ('ur', 'v', 'm/s', '/tcf')
    assert (force.device, force.label, force.unit, force.color) == ('ur', 'F', 'N',
                                                                    (0.1, 0.2, 0.3))
    assert speed.color == (0.0, 0.8, 0.1)
    assert len(speed.times_s) == len(speed.low) == len(speed.high) == 100
    # no speed half a window before the first and after the last one
    assert np.abs(speed.high[4:-4] - 0.2).max() < 0.002
    assert np.abs(speed.low[4:-4] - 0.2).max() < 0.002
    peak = int(np.argmax(force.high))
    assert force.high[peak] == pytest.approx(50.0)
    assert abs(force.times_s[peak] - 200 / 125) < 0.04
    assert np.delete(force.high, peak) == pytest.approx(5.0)
    assert force.low == pytest.approx(5.0)


def test_numbers_that_come_late_are_drawn_when_they_were_measured(tmp_path: Path,
                                                                  devices: Any) -> None:
    path = write(tmp_path / 'a.bag', robot_rows())
    late = ROBOT.replace('type="tool_center_frame"/>', 'type="tool_center_frame" latency="0.2"/>')
    late = late.replace('type="force_sensor"/>', 'type="force_sensor" latency="0.4"/>')
    speed, force = read_curves([path], devices(late), columns=100)
    assert abs(force.times_s[int(np.nanargmax(force.high))] - (200 / 125 - 0.4)) < 0.04
    plain, _ = read_curves([path], devices(ROBOT), columns=100)
    begins_s = [it.times_s[np.flatnonzero(np.isfinite(it.high))[-1]] for it in (plain, speed)]
    assert begins_s[0] - begins_s[1] == pytest.approx(0.2, abs=0.05)


def test_standard_messages(tmp_path: Path, devices: Any) -> None:
    rows = []
    for number in range(200):
        time_s = number / 100
        pose, wrench = PoseStamped(), WrenchStamped()
        pose.header.stamp = stamp(time_s)
        pose.header.frame_id = 'ur/link0' if number % 2 else 'longer name'
        pose.pose.position.z = 0.3 * time_s
        wrench.wrench.force.x, wrench.wrench.force.y = 3.0, -4.0
        late_s = time_s + (0.0 if number % 10 else 0.009)  # only the stamps are right
        rows += [Row('/tcf', late_s, pose), Row('/ft', time_s, wrench)]
    speed, force = read_curves([write(tmp_path / 'a.bag', rows)], devices(ROBOT), columns=10)
    assert speed.high == pytest.approx(0.3, rel=1e-4)
    assert force.high == pytest.approx(5.0)


def test_a_tool_from_tf(tmp_path: Path, devices: Any) -> None:
    rows = []
    for number in range(300):
        transform = TransformStamped(child_frame_id='ur/tcp')
        transform.header.frame_id = 'ur/link0'
        transform.header.stamp = stamp(number / 100)
        transform.transform.translation.x = 0.1 * number / 100
        other = TransformStamped(child_frame_id=f'other{number % 12}')
        rows += [Row('/tf', number / 100, TFMessage([other, transform])),
                 Row('/tf', number / 100 + 0.001, TFMessage([other]))]
    cell = devices('<device type="robot" name="ur"><base frame="ur/link0"/><topic name="tf" '
                   'type="tool_center_frame" msg="tf2_msgs/TFMessage" frame="ur/tcp"/></device>')
    (speed,) = read_curves([write(tmp_path / 'a.bag', rows)], cell, columns=10)
    assert speed.high[:5] == pytest.approx(0.1, rel=1e-3)


def tf_rows(child: str) -> List[Row]:
    """A tool that moves at 0.1 m/s, from tf."""
    rows = []
    for number in range(200):
        transform = TransformStamped(child_frame_id=child)
        transform.header.frame_id = f'{child.split("/")[0]}/link0'
        transform.header.stamp = stamp(number / 100)
        transform.transform.translation.x = 0.1 * number / 100
        rows.append(Row('/tf', number / 100, TFMessage([transform])))
    return rows


def test_a_publisher_without_usable_numbers_does_no_harm(tmp_path: Path, devices: Any) -> None:
    """Each publisher of a topic has its own connection; one of them uses another frame."""
    cell = devices(ROBOT + '<device type="robot" name="r2"><base frame="r2/link0"/><topic '
                   'name="tf" type="tool_center_frame" msg="tf2_msgs/TFMessage"/></device>')
    path = write(tmp_path / 'a.bag', robot_rows(2.0) + tf_rows('r2/tool'))
    with rosbag.Bag(path, 'a') as bag:
        for publisher, row in (('/other', tf_rows('wheel')[0]), ('/silent', Row(
                '/ft', 0.0, Float32MultiArray(data=[1.0])))):
            bag.write(row.topic, row.message, stamp(1.0), connection_header={
                'callerid': publisher, 'topic': row.topic, 'type': row.message._type,
                'md5sum': row.message._md5sum, 'message_definition': row.message._full_text})
    found = read_curves([path], cell, columns=10)
    assert [(it.device, it.label) for it in found] == [('ur', 'v'), ('ur', 'F'), ('r2', 'v')]
    assert found[2].high[:5] == pytest.approx(0.1, rel=1e-3)


@pytest.mark.parametrize('link', ['ur/flange', 'ur/tool'])
def test_a_tool_from_tf_is_the_link_that_robot_proc_has(
        tmp_path: Path, devices: Any, monkeypatch: pytest.MonkeyPatch, link: str) -> None:
    package = tmp_path / 'robot_model'
    package.mkdir()
    (package / 'package.xml').write_text('<package><name>robot_model</name></package>')
    (package / 'r.urdf').write_text(
        f'<robot name="r"><link name="ur/link0"/><link name="{link}"/><joint name="j" '
        f'type="fixed"><parent link="ur/link0"/><child link="{link}"/></joint></robot>')
    monkeypatch.setenv('ROS_PACKAGE_PATH', str(package))
    cell = devices('<device type="robot" name="ur"><model pkg="robot_model" path="r.urdf"/>'
                   '<base frame="ur/link0"/><topic name="tf" type="tool_center_frame" '
                   'msg="tf2_msgs/TFMessage"/></device>')
    path = write(tmp_path / 'a.bag', tf_rows(link))
    (speed,) = read_curves([path], cell, columns=10)
    assert speed.high[:5] == pytest.approx(0.1, rel=1e-3)
    values = PositionValues([path], cell)
    assert list(values.at(1.0).values()) == [pytest.approx(0.1, rel=1e-3)]
    values.close()


def test_numbers_that_are_no_measurements_are_left_out(tmp_path: Path, devices: Any) -> None:
    rows = []
    for number in range(200):
        pose, wrench = PoseStamped(), WrenchStamped()
        pose.pose.position.x = 1e300 * number if number > 100 else 0.1 * number / 100
        wrench.wrench.force.x = 1e300 if number > 100 else 2.0
        rows += [Row('/tcf', number / 100, pose), Row('/ft', number / 100, wrench)]
    with warnings.catch_warnings():
        warnings.simplefilter('error')
        speed, force = read_curves([write(tmp_path / 'a.bag', rows)], devices(ROBOT), columns=4)
    assert force.high[:2] == pytest.approx(2.0)
    assert speed.high[0] == pytest.approx(0.1, rel=1e-3)
    assert not np.isinf([speed.high, force.high]).any()


def test_a_model_that_cannot_be_used_takes_no_curve_away(tmp_path: Path, devices: Any) -> None:
    cell = devices('<device type="robot" name="ur"><model pkg="no_such_package" path="r.urdf"/>'
                   '<base frame="ur/link0"/><topic name="tf" type="tool_center_frame" '
                   'msg="tf2_msgs/TFMessage"/><topic name="ft" type="force_sensor"/></device>')
    path = write(tmp_path / 'a.bag', tf_rows('ur/tool') + robot_rows(2.0))
    assert [it.label for it in read_curves([path], cell, columns=10)] == ['v', 'F']


def test_variables_and_topics_of_plain_numbers(tmp_path: Path, devices: Any) -> None:
    cell = devices("""
      <device type="other" name="machine"><base frame="machine/base"/>
        <topic name="edge_upper"/><topic name="text"/><topic name="edge_lower"/>
        <topic name="feed"/><topic name="quiet" record="False"/>
        <variable topic="feed" label="feed rate" unit="m/s" color="0.5 0 0.5"
                  frame="machine/base" axis="x"/>
        <variable topic="array" field="data[2]" frame="machine/base" axis="x" high="40"/>
      </device>""")
    rows = [row for number in range(50) for row in (
        Row('/edge_upper', number / 10, UInt16(number)), Row('/text', number / 10, String('a')),
        Row('/edge_lower', number / 10, UInt16(100 - number)),
        Row('/quiet', number / 10, UInt16(5)), Row('/feed', number / 10, Float32(0.25)),
        Row('/array', number / 10, Float32MultiArray(data=[0.0, 1.0, number])))]
    found = read_curves([write(tmp_path / 'a.bag', rows)], cell, columns=5)
    assert [(it.label, it.unit) for it in found] == [
        ('feed rate', 'm/s'), ('array', ''), ('edge_upper', ''), ('edge_lower', '')]
    assert found[0].color == (0.5, 0.0, 0.5)
    assert len({it.color for it in found}) == 4
    assert [it.limits and (it.limits.low, it.limits.high) for it in found] == [
        None, (None, 40.0), None, None]
    feed, array, upper, lower = found
    assert feed.high.tolist() == [0.25] * 5
    assert array.high.tolist() == [9, 19, 29, 39, 49]
    assert array.low.tolist() == [0, 10, 20, 30, 40]
    assert (upper.low[0], upper.high[4], lower.high[0], lower.low[4]) == (0, 49, 100, 51)


def test_columns_without_data_are_empty_and_times_are_their_middles(tmp_path: Path,
                                                                    devices: Any) -> None:
    rows = [Row('/ft', time_s, Float32MultiArray(data=[1, 0, 0])) for time_s in (0.0, 0.1, 9.9)]
    rows.append(Row('/end', 10.0, String('a')))
    (force,) = read_curves([write(tmp_path / 'a.bag', rows)], devices(ROBOT), columns=10)
    assert force.times_s == pytest.approx(np.arange(10) + 0.5)
    assert np.isnan(force.high).tolist() == [False] + [True] * 8 + [False]
    assert np.isnan(force.low).tolist() == np.isnan(force.high).tolist()


FEED = """<device type="other" name="machine"><topic name="feed"/>
    <variable topic="feed" label="feed rate" frame="world"/></device>"""


@pytest.mark.parametrize(('sent_s', 'known_until_s'), [
    ([0.0, 1.0, 2.0, 3.0], 6.0),  # once a second: valid until three are missing, as in the scene
    ([0.0, 0.3, 4.0], 10.0),  # on change
    (np.arange(0.05, 5.0, 0.1), 5.2),  # at a fixed rate
])
def test_between_messages_the_value_of_a_variable_holds(
        tmp_path: Path, devices: Any, sent_s: Sequence[float], known_until_s: float) -> None:
    rows = [Row('/feed', time_s, Float64(time_s)) for time_s in sent_s]
    rows.append(Row('/end', 10.0, String('a')))
    (feed,) = read_curves([write(tmp_path / 'a.bag', rows)], devices(FEED), columns=100)
    is_known = feed.times_s < known_until_s
    expected = [max(it for it in sent_s if it < at + 0.049) for at in feed.times_s]
    assert feed.high[is_known] == pytest.approx(np.array(expected)[is_known])
    assert np.isnan(feed.high[~is_known]).all() and np.isnan(feed.low[~is_known]).all()


@pytest.mark.parametrize('end_s', [9.0, 16.0])
def test_in_a_hole_of_the_recording_no_value_holds(tmp_path: Path, devices: Any,
                                                   end_s: float) -> None:
    """This holds for any length of the gap and any value, including one that is sent on change."""
    all_s = [it for it in np.arange(0.05, 20.0, 0.1) if not 4.2 < it < end_s]
    for name, sent_s in (('rate', all_s), ('change', [0.05])):
        path = write(tmp_path / f'{name}.bag', [
            *(Row('/feed', it, Float64(1.0)) for it in sent_s),
            *(Row('/other', it, String('a')) for it in all_s)])
        (feed,) = read_curves([path], devices(FEED), columns=200)
        missing_s = feed.times_s[np.isnan(feed.high)]
        assert 4.1 < missing_s[0] < 4.5 and end_s - 0.3 < missing_s[-1] < end_s, name
        assert (np.diff(missing_s) < 0.11).all()


def test_where_a_value_that_is_sent_at_a_rate_is_no_number_it_is_missing(tmp_path: Path,
                                                                         devices: Any) -> None:
    rows = [Row('/feed', time_s, Float64(math.nan if 4.0 < time_s < 5.0 else 1.0))
            for time_s in np.arange(0.05, 10.0, 0.1)]
    (feed,) = read_curves([write(tmp_path / 'a.bag', rows)], devices(FEED), columns=100)
    missing_s = feed.times_s[np.isnan(feed.high)]
    assert 4.1 < missing_s[0] < 4.4 and missing_s[-1] == pytest.approx(4.95, abs=0.06)


def test_messages_that_do_not_fit_are_left_out(tmp_path: Path, devices: Any) -> None:
    good = [Row('/ft', number / 10, Float32MultiArray(data=[0, 0, 2])) for number in range(20)]
    bad = [Row('/ft', 0.55, Float32MultiArray(data=[9.0] * 4)),
           Row('/ft', 0.65, Float32MultiArray(data=[math.nan, 9.0, 9.0])),
           Row('/tcf', 0.5, Float32MultiArray(data=[1.0]))]
    (force,) = read_curves([write(tmp_path / 'a.bag', good + bad)], devices(ROBOT), columns=4)
    assert force.high.tolist() == [2.0] * 4
    path = write(tmp_path / 'b.bag', [Row('/ft', 0.0, String('no force'))])
    assert read_curves([path], devices(ROBOT)) == ()


def test_a_damaged_chunk_is_left_out(tmp_path: Path, devices: Any) -> None:
    path = Path(write(tmp_path / 'a.bag', robot_rows(), 'bz2'))
    data = bytearray(path.read_bytes())
    at = data.index(b'BZh', len(data) // 2)
    data[at:at + 3] = b'xxx'
    path.write_bytes(data)
    speed, _ = read_curves([str(path)], devices(ROBOT), columns=100)
    assert 0 < np.isfinite(speed.high).sum() < 100


def test_several_files_are_one_recording(tmp_path: Path, devices: Any) -> None:
    rows = robot_rows()
    whole = read_curves([write(tmp_path / 'a.bag', rows)], devices(ROBOT), columns=50)
    parts = [write(tmp_path / 'b.bag', [it for it in rows if it.time_s < 1.7]),
             write(tmp_path / 'c.bag', [it for it in rows if it.time_s >= 1.7])]
    for one, other in zip(whole, read_curves(parts, devices(ROBOT), columns=50)):
        np.testing.assert_allclose(one.high, other.high, rtol=1e-9)


@pytest.mark.parametrize('duration_s, columns', [
    (0.0, 1500), (30.0, 1500), (600.0, 12_000), (3600.0, 72_000), (36_000.0, 72_000)])
def test_long_recordings_have_more_columns(duration_s: float, columns: int) -> None:
    """Twenty columns for each second of an hour, for zooming in."""
    assert columns_for(duration_s) == columns


def test_of_very_many_messages_some_are_read_evenly(
        tmp_path: Path, devices: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write(tmp_path / 'a.bag', robot_rows(8.0))
    monkeypatch.setattr(curves_module, 'MAX_PER_COLUMN', 10)
    speed, force = read_curves([path], devices(ROBOT), columns=20)
    assert np.abs(speed.high[1:-1] - 0.2).max() < 0.005
    assert force.low == pytest.approx(5.0)
    assert np.isfinite(force.low).all()


def test_progress_and_cancel(tmp_path: Path, devices: Any) -> None:
    path = write(tmp_path / 'a.bag', robot_rows())
    seen: List[float] = []
    read_curves([path], devices(ROBOT), on_progress=seen.append)
    assert seen == sorted(seen)
    assert seen[-1] == 1.0
    with pytest.raises(ReadingCanceled):
        read_curves([path], devices(ROBOT), is_canceled=lambda: True)


def test_what_is_no_bag(tmp_path: Path, devices: Any) -> None:
    (tmp_path / 'a.bag').write_text('no bag')
    with pytest.raises(BagError, match='a.bag'):
        read_curves([str(tmp_path / 'a.bag')], devices(ROBOT))


def test_a_recording_of_one_moment(tmp_path: Path, devices: Any) -> None:
    path = write(tmp_path / 'a.bag', [Row('/ft', 0.0, Float32MultiArray(data=[0, 3, 4])),
                                      Row('/feed', 0.0, Float64(6.0))])
    force, feed = read_curves([path], devices(ROBOT + FEED), columns=3)
    assert (force.high[0], feed.high[0]) == (5.0, 6.0)
    assert np.isnan([force.high[1:], feed.high[1:]]).all()
    assert force.times_s.tolist() == [0.0, 0.0, 0.0]


@given(st.lists(st.tuples(st.floats(-1, 11), st.floats(-5, 5)), max_size=60), st.integers(1, 30))
def test_columns_hold_the_least_and_the_greatest(samples: List[Any], columns: int) -> None:
    times_s = np.array([time_s for time_s, _ in samples])
    values = np.array([value for _, value in samples])
    low, high = column_limits(times_s, values, 10.0, columns)
    parts: List[List[float]] = [[] for _ in range(columns)]
    for time_s, value in samples:
        parts[min(max(int(time_s * (columns / 10.0)), 0), columns - 1)].append(value)
    for part, least, greatest in zip(parts, low, high):
        if part:
            assert (least, greatest) == (min(part), max(part))
        else:
            assert math.isnan(least)
            assert math.isnan(greatest)


def test_a_curve_is_made_of_equal_columns(tmp_path: Path, devices: Any) -> None:
    found = read_curves([write(tmp_path / 'a.bag', robot_rows(1.0))], devices(ROBOT))
    assert all(isinstance(it, Curve) and it.times_s.shape == (1500,) for it in found)
