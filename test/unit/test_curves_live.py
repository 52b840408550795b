# SPDX-License-Identifier: BSD-3-Clause
"""Live curves of messages equal those of the recording afterward."""
from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Dict, List, Tuple

import numpy as np
import pytest
from cycle_bags import write_bag
from geometry_msgs.msg import WrenchStamped
from hypothesis import given, settings
from hypothesis import strategies as st
from recent_parts import part_of, parts_of
from recorded_rows import Row, stamp
from recorded_rows import write_bag as rows_bag
from sensor_msgs.msg import JointState
from std_msgs.msg import Float32, Float32MultiArray

from process_visualizer.bagio.message_definition import Connection
from process_visualizer.bagio.recorder_topics import MARKS
from process_visualizer.bagio.recording import Recording
from process_visualizer.cell.model import Device
from process_visualizer.cell.xml_parser import XmlParser
from process_visualizer.curves.curve_sources import curve_sources
from process_visualizer.curves.live_curves import (
    COLUMN_S,
    LiveCurve,
    LiveCurves,
    RecentPart,
    RollingColumns,
)
from process_visualizer.curves.samples import found_series, read_samples, sampled

DURATION_S = 24.0
ARM = """<robot name="arm"><link name="base"/><link name="wrist"/><link name="tool"/>
  <link name="jaw"/>
  <joint name="turn" type="continuous"><parent link="base"/><child link="wrist"/>
    <axis xyz="0 0 1"/></joint>
  <joint name="flange" type="fixed"><parent link="wrist"/><child link="tool"/>
    <origin xyz="0.6 0 0"/></joint>
  <joint name="finger" type="prismatic"><parent link="tool"/><child link="jaw"/>
    <limit lower="0" upper="1" effort="1" velocity="1"/></joint>
</robot>"""


@pytest.fixture(scope='module')
def bag(tmp_path_factory: pytest.TempPathFactory) -> Tuple[str, Tuple[Device, ...]]:
    folder = tmp_path_factory.mktemp('live')
    return write_bag(folder), XmlParser().parse(str(folder / 'cell.xml')).devices


def by_label(curves: Tuple[LiveCurve, ...]) -> Dict[str, LiveCurve]:
    return {curve.source.label: curve for curve in curves}


@pytest.mark.parametrize('step_s', [0.02, 0.2, 1.7, 30.0])
def test_live_curves_are_those_of_the_recording(bag: Tuple[str, Tuple[Device, ...]],
                                                step_s: float) -> None:
    path, devices = bag
    live = LiveCurves(devices)
    for part in parts_of(path, step_s):
        live.add(part)
    window = live.window(30.0)
    found = by_label(window.curves)
    assert set(found) == {'v', 'F', 'feed'}
    with Recording([path]) as recording:
        series = found_series(recording, curve_sources(devices), devices)
        expected = {it.source.label: sampled(it) for it in read_samples(recording, series)}
    for label, (times_s, values) in expected.items():
        is_whole = (times_s > 0.3) & (times_s < DURATION_S - 0.3)
        low, high = found[label].low, found[label].high
        known = np.flatnonzero(np.isfinite(low))
        assert np.diff(known).max() * COLUMN_S <= 0.14
        at_s = window.begin_s + (known + 0.5) * COLUMN_S
        shown = np.interp(times_s[is_whole], at_s, 0.5 * (low + high)[known])
        off = np.sort(np.abs(shown - values[is_whole]))
        limit = {'v': 0.005, 'F': 0.1, 'feed': 1e-6}[label]
        assert off[int(0.98 * len(off))] < limit  # of the feed, all but its few jumps
        assert values.min() - limit < np.nanmin(low) and np.nanmax(high) < values.max() + limit


def test_only_what_is_new_is_read(bag: Tuple[str, Tuple[Device, ...]]) -> None:
    path, devices = bag
    live = LiveCurves(devices)
    parts = list(parts_of(path, 6.0))
    live.add(parts[0])
    before = by_label(live.window(5.0).curves)['feed']
    live.add(part_of(parts[0].connections, [], parts[0].now_ns + 1_000_000_000))
    after = by_label(live.window(5.0).curves)['feed']
    count = int(1.0 / COLUMN_S)
    np.testing.assert_array_equal(after.high[:-count], before.high[count:])
    assert np.isnan(after.high[-count:]).all()
    assert after.value == before.value


def test_topics_are_those_of_the_variables(bag: Tuple[str, Tuple[Device, ...]]) -> None:
    _, devices = bag
    assert LiveCurves(devices).topics == ('/feed', '/ft', MARKS, '/tcf', '/tf_static')


def test_a_recorder_that_begins_anew_begins_the_curves_anew(
        bag: Tuple[str, Tuple[Device, ...]]) -> None:
    path, devices = bag
    live = LiveCurves(devices)
    parts = list(parts_of(path, 12.0))
    live.add(parts[0])
    live.add(parts[1]._replace(is_anew=True))
    window = live.window(30.0)
    shown_s = np.ptp(np.flatnonzero(np.isfinite(by_label(window.curves)['feed'].low))) * COLUMN_S
    assert shown_s == pytest.approx(12.0, abs=0.1)


def test_the_value_of_now_is_none_when_nothing_has_come_for_long(
        bag: Tuple[str, Tuple[Device, ...]]) -> None:
    path, devices = bag
    live = LiveCurves(devices)
    *parts, last = parts_of(path, 6.0)
    for part in [*parts, last]:
        live.add(part)
    assert all(np.isfinite(it.value) for it in live.window(30.0).curves)
    live.add(part_of(last.connections, [], last.now_ns + 70 * 10 ** 9))
    assert all(np.isnan(it.value) for it in live.window(120.0).curves)


def test_a_recorder_that_stood_still_is_no_habit_of_the_topics(
        bag: Tuple[str, Tuple[Device, ...]]) -> None:
    path, devices = bag
    live, stood_still_ns = LiveCurves(devices), 8 * 10 ** 9
    parts = list(parts_of(path, 0.5))
    for part in parts[:40]:
        live.add(part)
    last_ns = 0
    for part in parts[40:46]:
        last_ns = part.now_ns + stood_still_ns
        live.add(part._replace(times_ns=part.times_ns + stood_still_ns, now_ns=last_ns))
    assert all(np.isfinite(it.value) for it in live.window(30.0).curves)
    live.add(part_of(parts[-1].connections, [], last_ns + 5 * 10 ** 9))
    assert all(np.isnan(it.value) for it in live.window(30.0).curves)


def held_up(part: RecentPart, begin_ns: int, end_ns: int) -> RecentPart:
    """The same messages in the batches of a recorder that hangs."""
    is_late = (part.times_ns >= begin_ns) & (part.times_ns < end_ns)
    return part._replace(times_ns=np.where(
        is_late, end_ns - 10 ** 7 + 10 ** 3 * np.arange(len(is_late)), part.times_ns))


def test_what_came_together_after_a_silence_is_not_drawn_at_that_moment(
        bag: Tuple[str, Tuple[Device, ...]]) -> None:
    path, devices = bag
    live = LiveCurves(devices)
    (part,) = parts_of(path, 30.0)
    begin_ns = int(part.times_ns[0])
    live.add(held_up(part, begin_ns + 8 * 10 ** 9, begin_ns + 16 * 10 ** 9))
    window = live.window(30.0)
    at_s = window.begin_s + (np.arange(len(window.curves[0].low)) + 0.5) * COLUMN_S
    for curve in window.curves:
        known_s = at_s[np.isfinite(curve.low)]
        assert known_s.min() < 1.0 and known_s.max() > 23.0
        assert not np.any((known_s > 8.2) & (known_s < 15.9))
        held = curve.high - curve.low
        assert np.nanmax(held[(at_s > 15.9) & (at_s < 16.1)], initial=0.0) < 0.1


def test_what_has_stamps_is_where_it_was_though_it_came_late(tmp_path: Path) -> None:
    config = tmp_path / 'cell.xml'
    config.write_text('<visualizer><device type="robot" name="arm"><base frame="base"/>'
                      '<topic name="ft" type="force_sensor"/></device></visualizer>')
    rows = []
    for number in range(1200):
        wrench = WrenchStamped()
        wrench.header.stamp = stamp(20 * number - 5)
        wrench.wrench.force.x = 0.1 * number
        rows.append(Row('/ft', 20 * number, wrench))
    (part,) = parts_of(rows_bag(tmp_path / 'a.bag', rows), 30.0)
    live = LiveCurves(XmlParser().parse(str(config)).devices)
    begin_ns = int(part.times_ns[0])
    live.add(held_up(part, begin_ns + 8 * 10 ** 9, begin_ns + 16 * 10 ** 9))
    window = live.window(30.0)
    curve = by_label(window.curves)['F']
    known = np.flatnonzero(np.isfinite(curve.low))
    at_s = window.begin_s + (known + 0.5) * COLUMN_S
    assert np.diff(at_s).max() < 0.05
    assert np.abs(0.5 * (curve.low + curve.high)[known] - 5.0 * at_s).max() < 0.2


def sent_seldom(path: str) -> 'Tuple[Connection, bytes]':
    """Return the connection of the topic /feed, and a message of it."""
    with Recording([path]) as recording:
        number = [it.topic for it in recording.index.connections].index('/feed')
        row = int(np.flatnonzero(recording.index.connection == number)[0])
        return recording.index.connections[number], bytes(recording.message(row))


def test_the_value_of_a_topic_that_is_sent_seldom_holds(bag: Tuple[str, Tuple[Device, ...]]
                                                         ) -> None:
    path, devices = bag
    live, begin_ns = LiveCurves(devices), 10 ** 12
    feed, data = sent_seldom(path)
    live.add(part_of((feed,), [(0, begin_ns, data), (0, begin_ns + 9 * 10 ** 9, data)],
                     begin_ns + 90 * 10 ** 9))
    assert np.isfinite(by_label(live.window(120.0).curves)['feed'].value)


def test_topics_without_a_variable_have_values_too(bag: Tuple[str, Tuple[Device, ...]]) -> None:
    """Each has its own color."""
    path, devices = bag
    feed, data = sent_seldom(path)
    topic = next(it for it in devices[1].topics if it.name == '/feed')
    live, begin_ns = LiveCurves([replace(devices[1], variables=(), topics=(
        topic, replace(topic, name='/heat')))]), 10 ** 12
    live.add(part_of((feed, feed._replace(topic='/heat')), [
        (number, begin_ns, data) for number in (0, 1)], begin_ns + 10 ** 9))
    curves = live.window(10.0).curves
    assert len({it.source.color for it in curves}) == 2
    assert all(np.isfinite(it.value) for it in curves)


def test_marks_come_with_their_labels_and_time_may_go_back(tmp_path: Path) -> None:
    mark = Connection(MARKS, 'std_msgs/String', '', 'string data', False, '/r')
    text = 'seam tears – ö'.encode()
    live = LiveCurves(())
    live.add(part_of((mark,), [(0, 5_000_000_000, len(text).to_bytes(4, 'little') + text)],
                     6_000_000_000))
    assert [(it.time_s, it.label) for it in live.window(30.0).marks] == [(0.0, 'seam tears – ö')]
    live.add(part_of((mark,), [], 1_000_000_000))  # a simulation that was restarted
    assert live.window(30.0).marks == () and live.window(30.0).curves == ()


def test_connections_that_are_known_before_their_messages_have_curves(
        bag: Tuple[str, Tuple[Device, ...]]) -> None:
    """For example after a clock that was set back."""
    path, devices = bag
    live = LiveCurves(devices)
    (part,) = parts_of(path, 30.0)
    live.add(part_of(part.connections, [], part.now_ns))
    live.add(part)
    assert set(by_label(live.window(30.0).curves)) == {'v', 'F', 'feed'}


def test_a_message_that_cannot_be_read_is_left_out(bag: Tuple[str, Tuple[Device, ...]]) -> None:
    path, devices = bag
    live = LiveCurves(devices)
    connections = next(parts_of(path, 1.0)).connections
    feed = next(number for number, it in enumerate(connections) if it.topic == '/feed')
    good = np.float32(0.5).tobytes()
    live.add(part_of(connections, [(feed, 10 ** 9, b''), (feed, 2 * 10 ** 9, good),
                                   (feed, 3 * 10 ** 9, np.float32(np.nan).tobytes())],
                     4 * 10 ** 9))
    curve = by_label(live.window(30.0).curves)['feed']
    assert curve.value == 0.5
    assert np.isfinite(curve.low).sum() == 1


@settings(max_examples=200, deadline=None)
@given(st.lists(st.lists(st.tuples(st.floats(0.0, 90.0), st.floats(-5.0, 5.0)), max_size=20),
                max_size=10), st.sampled_from([1, 2, 5]))
def test_columns_hold_the_extremes_of_the_last_seconds(
        added: List[List[Tuple[float, float]]], joined: int) -> None:
    columns, kept_s = RollingColumns(30.0), 30.0
    for rows in added:
        columns.add(np.array([it[0] for it in rows]), np.array([it[1] for it in rows]))
    rows = [it for part in added for it in part]
    newest_s = max((time_s for time_s, _ in rows), default=0.0)
    end = joined * (int(newest_s / COLUMN_S) // joined + 1)
    count = int(kept_s / (joined * COLUMN_S)) - 1
    low, high = columns.window(end, count, joined)
    wanted = np.full((2, count), np.nan)
    for time_s, value in rows:
        row = int(np.floor(time_s / COLUMN_S)) // joined - (end // joined - count)
        if row >= 0:
            wanted[:, row] = np.fmin(wanted[0, row], value), np.fmax(wanted[1, row], value)
    np.testing.assert_array_equal(np.stack([low, high]), wanted)


def test_a_topic_of_something_else_is_not_asked_for_again(
        bag: Tuple[str, Tuple[Device, ...]]) -> None:
    _, devices = bag
    topic = replace(devices[1].topics[0], name='/camera/image')
    live = LiveCurves([replace(devices[1], topics=(*devices[1].topics, topic))])
    assert topic.name in live.topics
    image = Connection(topic.name, 'sensor_msgs/Image', '', 'uint8[] data', False, '/camera')
    live.add(part_of((image,), [(0, 10 ** 9, b'\0\0\0\0')], 2 * 10 ** 9))
    assert topic.name not in live.topics and '/feed' in live.topics


def test_a_tool_moves_by_the_joints_of_a_topic_that_comes_later(tmp_path: Path) -> None:
    """The gripper's topic is named first, and arrives first."""
    (tmp_path / 'arm.urdf').write_text(ARM)
    (tmp_path / 'cell.xml').write_text(
        '<visualizer><device type="robot" name="r"><model path="arm.urdf"/>'
        '<base frame="base"/><tool frame="tool"/>'
        + ''.join(f'<topic ns="{ns}" name="joints" type="joint_states" '
                  'msg="sensor_msgs/JointState"/>' for ns in ('gripper', 'arm'))
        + '</device></visualizer>')
    rows = [Row(f'/{ns}/joints', time_ms, JointState(name=[name], position=[time_ms * slope]))
            for ns, name, begin_ms, slope in (('gripper', 'finger', 0, 0.0),
                                              ('arm', 'turn', 1000, 5e-4))
            for time_ms in range(begin_ms, 4000, 10)]
    live = LiveCurves(XmlParser().parse(str(tmp_path / 'cell.xml')).devices)
    for part in parts_of(rows_bag(tmp_path / 'arm.bag', rows), 0.5):
        known = max(part.numbers, default=0) + 1
        live.add(part._replace(connections=part.connections[:known]))
    [speed] = live.window(5.0).curves
    assert speed.value == pytest.approx(0.5 * 0.6, rel=0.01)


def test_a_joint_that_is_sent_only_when_it_moves_is_where_it_was(tmp_path: Path) -> None:
    """It has been known since the beginning, when there was no message of the arm."""
    (tmp_path / 'arm.urdf').write_text(ARM.replace('<link name="base"/>', '<link name="base"/>'
        '<link name="cart"/>').replace('<parent link="base"/>', '<parent link="cart"/>').replace(
        '</robot>', '<joint name="rail" type="prismatic"><parent link="base"/>'
        '<child link="cart"/><limit lower="0" upper="9" effort="1" velocity="1"/></joint></robot>'))
    (tmp_path / 'cell.xml').write_text(
        '<visualizer><device type="robot" name="r"><model path="arm.urdf"/>'
        '<base frame="base"/><tool frame="tool"/><topic name="joints" type="joint_states"/>'
        '</device></visualizer>')
    rows = [Row('/joints', 0, JointState(name=['rail'], position=[2.0]))]
    rows += [Row('/joints', time_ms, JointState(name=['turn'], position=[time_ms * 5e-4]))
             for time_ms in range(100, 8000, 10)]
    live = LiveCurves(XmlParser().parse(str(tmp_path / 'cell.xml')).devices)
    for part in parts_of(rows_bag(tmp_path / 'arm.bag', rows), 0.5):
        live.add(part)
    [speed] = live.window(5.0).curves
    assert speed.value == pytest.approx(0.5 * 0.6, rel=0.01)
    assert np.isfinite(speed.high).mean() > 0.8


def robot_with_tool_poses(folder: Path) -> Tuple[Device, ...]:
    (folder / 'arm.urdf').write_text(ARM)
    (folder / 'cell.xml').write_text(
        '<visualizer><device type="robot" name="r"><model path="arm.urdf"/>'
        '<base frame="base"/><topic name="tcf" type="tool_center_frame"/></device></visualizer>')
    return XmlParser().parse(str(folder / 'cell.xml')).devices


@pytest.mark.parametrize('step_s', [0.02, 0.1, 0.5])
def test_poses_of_which_some_were_lost_while_they_came_late_have_no_speed(tmp_path: Path,
                                                                        step_s: float) -> None:
    """Their measuring times are unknown; the tool moves evenly."""
    rows = []
    for time_ms in range(0, 8000, 8):
        late_ms = next((end for end in (5090, 5130, 5300, 5500) if end >= time_ms > 5000), time_ms)
        if not 5140 < time_ms < 5230:
            rows.append(Row('/tcf', late_ms, Float32MultiArray(data=[
                3e-4 * time_ms, 0.0, 0.0, 0.0, 0.0, 0.0])))
    live = LiveCurves(robot_with_tool_poses(tmp_path))
    for part in parts_of(rows_bag(tmp_path / 'arm.bag', rows), step_s):
        live.add(part)
    [speed] = live.window(8.0).curves
    known = np.isfinite(speed.low)
    assert speed.low[known] == pytest.approx(0.3, rel=0.1)
    assert speed.high[known] == pytest.approx(0.3, rel=0.1)
    assert known.mean() > 0.8


def test_seconds_in_which_many_poses_are_lost_do_not_change_the_period_of_the_driver(
        tmp_path: Path) -> None:
    """By those seconds alone, the driver seemed slower, and the tool faster."""
    rows = []
    for time_ms in range(0, 14_000, 8):
        late_ms = time_ms
        if 8_000 <= time_ms < 12_800:
            end_ms = -(-time_ms // 160) * 160  # all of 160 ms arrive together, but for some
            late_ms = end_ms if end_ms - time_ms < 130 else 0
        if late_ms or not time_ms:
            rows.append(Row('/tcf', late_ms, Float32MultiArray(data=[
                3e-4 * time_ms, 0.0, 0.0, 0.0, 0.0, 0.0])))
    live = LiveCurves(robot_with_tool_poses(tmp_path))
    for part in parts_of(rows_bag(tmp_path / 'arm.bag', rows), 0.2):
        live.add(part)
    [speed] = live.window(14.0).curves
    known = np.isfinite(speed.low)
    assert speed.low[known] == pytest.approx(0.3, rel=0.1)
    assert speed.high[known] == pytest.approx(0.3, rel=0.1)
    assert 0.5 < known.mean() < 0.75
    assert live.window(1.0).curves[0].motion_s[0] == pytest.approx(13.0, abs=0.1)
    assert live.window(14.0).curves[0].motion_s[0] < 0.1, 'a shorter window forgets nothing'


def test_a_topic_that_changes_its_rate_is_where_it_was_recorded(tmp_path: Path) -> None:
    """With its usual period, fast messages would be some seconds too early."""
    (tmp_path / 'cell.xml').write_text(
        '<visualizer><device type="other" name="o"><base frame="o"/>'
        '<variable topic="heat" frame="o"/></device></visualizer>')
    times_ms = [*range(0, 20_000, 50), *range(20_000, 22_000, 10), *range(22_000, 30_000, 50)]
    path = rows_bag(tmp_path / 'a.bag', [Row('/heat', it, Float32(float(it))) for it in times_ms])
    devices = XmlParser().parse(str(tmp_path / 'cell.xml')).devices
    with Recording([path]) as recording:
        [found] = read_samples(recording, found_series(recording, curve_sources(devices), devices),
                               by_stamp=True)
    assert found.times_s == pytest.approx(found.values[:, 0] / 1e3, abs=1e-6)
    assert len(found.times_s) == len(times_ms)
