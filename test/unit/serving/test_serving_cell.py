# SPDX-License-Identifier: BSD-3-Clause
"""A live page on a running cell: alarms and their times, recording, verdict, problems."""
from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any, Dict, List

import numpy as np
import pytest
from geometry_msgs.msg import TransformStamped
from live_stand import packed
from small_clouds import KIND, cloud, read
from std_msgs.msg import ColorRGBA
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import Marker, MarkerArray

from process_visualizer.cell.xml_parser import XmlParser
from process_visualizer.curves.curve_sources import curve_sources
from process_visualizer.curves.live_curves import LiveCurve, LiveMark, LiveWindow
from process_visualizer.health.node_pulse import ENDED, SILENT
from process_visualizer.health.node_warnings import Severity
from process_visualizer.msg import DetectedObject, DetectedObjects
from process_visualizer.nodes.common.markers import text_marker
from process_visualizer.page.live_feed import Slot
from process_visualizer.page.packed import Packed
from process_visualizer.page.run_page import PageCell
from process_visualizer.ros_names import CONFLICT_KEY, LIMIT_KEY
from process_visualizer.runs.comparison.live_comparison import LiveBands
from process_visualizer.runs.comparison.timeline_bands import TimelineBand
from process_visualizer.serving.cell_alarms import RecorderTopic, SeenRecorder
from process_visualizer.serving.live_cell import LiveCell, SeenPlayer, verdict_entry

CELL = '''<visualizer>
  <device type="other" name="oven">
    <base frame="oven/base" xyz="1 2 3"/>
    <variable topic="heat" frame="oven/base" unit="K" label="&lt;script&gt;heat"
      high="400"/>
    <topic name="heat" msg="std_msgs/Float32"/>
  </device>
</visualizer>'''
BEGIN_S = 1.7e9
VERDICT = {'text': 'Run in range (reference at 0:02.00)', 'state': 'good', 'reference': 'good.bag',
           'departed': [['oven', 'heat', '3 K above range', BEGIN_S + 1.0]]}


class Stage:
    """Cell without nodes, and a clock."""

    def __init__(self, folder: Path, text: str = CELL) -> None:
        path = folder / 'cell.xml'
        path.write_text(text)
        self.cell = XmlParser().parse(str(path))
        self.live = LiveCell(self.cell, PageCell(self.cell, Packed()), 'server')
        self.now_s = 0.0

    def pass_time(self, seconds: float) -> None:
        for _ in range(round(seconds / 0.04)):
            self.now_s += 0.04
            self.live.tick(BEGIN_S + self.now_s, self.now_s)

    def see(self, objects: DetectedObjects) -> None:
        """Send a sensor message, and let 0.2 s pass."""
        self.live.take_objects('kinect', objects, BEGIN_S + self.now_s, self.now_s)
        self.pass_time(0.2)

    @property
    def state(self) -> Dict[str, Any]:
        self.pass_time(1.0)
        found: Dict[str, Any] = json.loads(self.live.feed.newest(Slot.STATE)[1])
        return found

    def warn(self, text: str, key: str = LIMIT_KEY, value: str = 'up to 402 K') -> None:
        self.live.alarms.warnings.take_state('/oven/variable_proc', 'heat', Severity.ERROR, text,
                                             self.now_s, {key: value})


@pytest.fixture
def stage(tmp_path: Path) -> Stage:
    return Stage(tmp_path)


def test_nothing_is_wrong_and_nothing_is_recorded_at_first(stage: Stage) -> None:
    state = stage.state
    assert state['alarms'] == []
    assert state['events'] == []
    assert (state['recording'], state['is_recording']) == ('no recorder', False)
    assert (state['verdict'], state['problem'], state['playback']) == (None, None, '')


def test_a_value_beyond_its_limits_is_an_alarm_with_begin_and_end(stage: Stage) -> None:
    stage.pass_time(5.0)
    stage.warn('heat above 400 K')
    alarm, = stage.state['alarms']
    assert alarm['text'] == 'oven: heat above 400 K, up to 402 K'
    assert alarm['begin'] == pytest.approx(BEGIN_S + 5.0, abs=0.6)
    assert alarm['end'] is None
    stage.pass_time(10.0)  # a node repeats what lasts
    state = stage.state
    assert state['alarms'][0]['end'] == pytest.approx(BEGIN_S + 10.0, abs=1.6)
    assert [it['text'] for it in state['events']] == [
        'oven: heat above 400 K, up to 402 K: no data after 5.1 s',
        'oven: heat above 400 K, up to 402 K']


def test_nodes_that_contradict_each_other_are_an_alarm(stage: Stage) -> None:
    stage.warn('a long text', CONFLICT_KEY, '/oven/joints: 2 nodes')
    assert [it['text'] for it in stage.state['alarms']] == ['oven: /oven/joints: 2 nodes']


def test_what_is_marked_in_the_scene_is_an_alarm_once(stage: Stage) -> None:
    transform = TransformStamped()
    transform.header.frame_id, transform.child_frame_id = 'world', 'oven/base'
    transform.transform.rotation.w = 1.0
    stage.live.take_transforms(packed(TFMessage([transform])), True)
    for age_s in (1.0, 1.1, 1.2):
        stage.live.take_markers('/scene_watch/marker_array', packed(MarkerArray([text_marker(
            'oven', 'oven/base', (0, 0, 1), f'oven: variable_proc {ENDED}; no arrows\n'
            f'oven: points {age_s} s old\noven: joint_proc {SILENT}; no joints', 0.1,
            (1.0, 0.7, 0.1, 1.0))])), stage.now_s)
        stage.pass_time(0.6)
    state = stage.state
    assert state['alarms'] == []
    assert sorted(it['text'] for it in state['events'] if 'over after' not in it['text']) == [
        'oven: points 1.0 s old', f'oven: variable_proc {ENDED}; no arrows']


def test_a_topic_that_falls_silent_is_an_alarm(stage: Stage) -> None:
    def recorder(rate_hz: float, silence_s: float, count: int) -> SeenRecorder:
        return SeenRecorder(True, 'seam.bag', 65.2, 3, 2, (
            RecorderTopic('/heat', rate_hz, silence_s, count, False),
            RecorderTopic('heat', rate_hz, silence_s, count, False)))

    for count in range(40):
        stage.live.take_recorder(recorder(20.0, 0.02, 20 * count))
    assert [it['text'] for it in stage.state['alarms']] == [
        'recording: messages are missing: 3 dropped, 2 lost']
    stage.live.take_recorder(recorder(0.0, 4.0, 800))
    state = stage.state
    assert state['is_recording']
    assert state['recording'] == 'recording for 1:05, 5 messages missing'
    assert any(it['text'].startswith('oven: No data from ') for it in state['alarms'])


def test_a_page_opened_after_a_driver_has_died_says_so(stage: Stage) -> None:
    topics = (RecorderTopic('/heat', 0.0, 40.0, 800, False, 0.1),
              RecorderTopic('heat', 0.0, 40.0, 800, False, 0.1))
    stage.live.take_recorder(SeenRecorder(False, '', 0.0, 0, 0, topics))
    assert any(it['text'].startswith('oven: No data from ') for it in stage.state['alarms'])


def test_the_verdict_of_the_launcher_is_shown_while_it_is_new(stage: Stage) -> None:
    stage.live.take_verdict(json.dumps(VERDICT), stage.now_s)
    state = stage.state
    assert state['verdict']['text'] == VERDICT['text']
    assert state['verdict']['state'] == 'good'
    assert state['departures'] == [{'device': 'oven', 'label': 'heat', 'began_s': BEGIN_S + 1.0}]
    assert [it['text'] for it in state['alarms']] == ['oven: heat 3 K above range']
    stage.pass_time(3.0)
    state = stage.state
    assert (state['verdict'], state['departures'], state['alarms']) == (None, [], [])
    assert ': no data after ' in state['events'][0]['text']


@pytest.mark.parametrize('lost, expected', [([], 'over'), ([['oven', 'heat']], 'no data')])
def test_how_a_departure_has_ended(stage: Stage, lost: List[List[str]], expected: str) -> None:
    stage.live.take_verdict(json.dumps(VERDICT), stage.now_s)
    assert stage.state['alarms']
    stage.live.take_verdict(json.dumps({**VERDICT, 'departed': [], 'lost': lost}), stage.now_s)
    state = stage.state
    assert not state['alarms'] and 'lost' not in state['verdict']
    assert f': {expected} after ' in state['events'][0]['text']


def test_the_band_of_good_runs_comes_with_the_curves(stage: Stage) -> None:
    source, = curve_sources(stage.cell.devices)
    values = np.arange(30.0)
    stage.live.take_curves(LiveWindow(
        0.0, 3.0, (LiveCurve(source, values, values, 29.0),), (), BEGIN_S + 7.0))
    told = LiveBands(BEGIN_S + 2.0, 0.1, {(source.device, source.channel_label): TimelineBand(
        np.full(10, 3.0), np.full(10, 4.0), np.ones(10, bool))})
    stage.live.take_bands('nonsense')
    stage.live.take_bands(told.text(), ahead_s=5.0)
    stage.pass_time(0.4)
    lanes = stage.live.feed.newest(Slot.LANES)[1]
    assert isinstance(lanes, bytes)
    head = 20 + 1
    count = int(np.frombuffer(lanes, '<u4', 1, 8)[0])
    assert lanes[20] == 1
    low = np.frombuffer(lanes, '<f4', count, head + 8 * count)
    assert low[:10].tolist() == [3.0] * 10 and np.isnan(low[10:]).all()


@pytest.mark.parametrize('text', [
    '', 'x', '[]', '{}', '[' * 100_000, '{"text": ""}', json.dumps({**VERDICT, 'departed': [1]}),
    json.dumps({**VERDICT, 'departed': [['a', 'b', 'c', 'd']]}), json.dumps({'text': 'x' * 30_000}),
    '{"text": "a", "state": "good", "reference": "b", "departed": [["a", "b", "c", NaN]]}',
    '{"text": "a", "state": "good", "reference": "b", "departed": [["a", "b", "c", 1%s]]}' % (
        '0' * 400)])
def test_what_is_no_verdict_is_none(text: str) -> None:
    assert verdict_entry(text) == {}


def test_an_unknown_state_of_a_verdict_is_shown_plain() -> None:
    assert verdict_entry(json.dumps({**VERDICT, 'state': 'x" onload="'}))['state'] == 'plain'


def test_a_cell_that_does_not_answer_is_said_with_since_when(stage: Stage) -> None:
    stage.pass_time(2.0)
    stage.live.take_problem('The cell does not run', BEGIN_S + 2.0)
    stage.live.take_problem('The cell does not run', BEGIN_S + 4.0)
    assert stage.state['problem'] == {'text': 'The cell does not run', 'since': BEGIN_S + 2.0}
    stage.live.take_problem('', BEGIN_S + 9.0)
    state = stage.state
    assert state['problem'] is None
    assert [it['text'] for it in state['events']] == ['The cell answers again',
                                                      'The cell does not run']


def test_a_recording_that_is_played_is_said(stage: Stage) -> None:
    stage.live.take_player(SeenPlayer('seam.bag', 12.5, True), stage.now_s)
    assert stage.state['playback'] == 'seam.bag is paused at 0:12.50'
    stage.pass_time(3.0)
    assert stage.state['playback'] == ''


def test_curves_come_with_their_marks_and_labels_as_they_are(stage: Stage) -> None:
    source = next(it for it in curve_sources(stage.cell.devices))
    values = np.arange(20.0)
    stage.live.take_curves(LiveWindow(0.0, 2.0, (LiveCurve(source, values, values, 19.0),),
                                      (LiveMark(1.5, '</script>seam'),), BEGIN_S))
    state = stage.state
    assert state['marks'] == [{'label': '</script>seam', 'at': BEGIN_S + 1.5}]
    assert [it['label'] for it in state['lanes']] == ['<script>heat']
    number, data = stage.live.feed.newest(Slot.LANES)
    assert number == 1
    assert isinstance(data, bytes)
    stage.pass_time(2.0)
    assert stage.live.feed.newest(Slot.LANES)[0] == 1  # nothing new has arrived


def test_frames_rise_and_have_the_layout_that_was_sent_before(stage: Stage) -> None:
    stage.pass_time(1.0)
    layout = json.loads(stage.live.feed.newest(Slot.LAYOUT)[1])
    assert (layout['kind'], layout['server'], layout['number']) == ('layout', 'server', 1)
    assert stage.live.feed.newest(Slot.LAYOUT)[0] == 1
    assert stage.live.feed.newest(Slot.FRAME)[0] == 25
    assert len(stage.live.recent(0.0, 2.0 * BEGIN_S)) > 25 * 16


def test_clouds_are_sent_a_few_times_a_second_where_their_frame_is(stage: Stage) -> None:
    points = np.zeros(3, KIND)
    points['x'] = 1.0
    transform = TransformStamped()
    transform.header.frame_id, transform.child_frame_id = 'world', 'camera'
    transform.transform.translation.z = transform.transform.rotation.w = 1.0
    stage.live.take_transforms(packed(TFMessage([transform])), True)
    for _ in range(25):
        stage.live.take_cloud('kinect', cloud(points))
        stage.pass_time(0.04)
    number, data = stage.live.feed.newest(Slot.CLOUD)
    assert number == 3
    assert isinstance(data, bytes)
    assert read(data)[1] == pytest.approx(np.array([[1.0, 0.0, 1.0]] * 3))


def detected(distance_m: float, level: int, frame: str = 'world') -> DetectedObjects:
    found = DetectedObject(number=3, link='arm/hand', distance=distance_m, level=level,
                           is_seen=True)
    found.pose.position.x, found.pose.orientation.w = 0.5, 1.0
    found.size.x, found.size.y, found.size.z = 0.3, 0.2, 0.1
    found.on_object.x, found.on_robot.x = 0.4, 0.2
    message = DetectedObjects(objects=[found])
    message.header.frame_id = frame
    return message


@pytest.fixture
def sensing(tmp_path: Path) -> Stage:
    """A cell whose sensor looks for unmodeled objects."""
    return Stage(tmp_path, '''<visualizer><device type="depth_sensor" name="kinect">
      <base frame="camera" xyz="0 0 2"/><objects warn="0.4" stop="0.15"/>
      <topic ns="/" name="points" type="pointcloud"/></device></visualizer>''')


def test_unmodeled_objects_are_sent_when_they_change(sensing: Stage) -> None:
    def sent() -> Dict[str, Any]:
        found: Dict[str, Any] = json.loads(sensing.live.feed.newest(Slot.OBJECTS)[1])
        return found

    for _ in range(5):
        sensing.see(detected(0.2, DetectedObject.WARN))
    assert sensing.live.feed.newest(Slot.OBJECTS)[0] == 1  # no change
    entry, = sent()['objects']
    assert (entry['at'], entry['size']) == ([0.5, 0, 0, 0, 0, 0, 1], [0.3, 0.2, 0.1])
    assert (entry['text'], entry['line']) == (
        'object 3: 30 x 20 x 10 cm\n0.20 m to arm/hand', [0.4, 0, 0, 0.2, 0, 0])
    sensing.see(detected(0.1, DetectedObject.STOP))
    assert sent()['objects'][0]['color'] == [1.0, 0.15, 0.1]
    sensing.see(DetectedObjects(objects=[]))
    sensing.see(detected(0.1, DetectedObject.STOP, frame='nowhere'))
    sensing.pass_time(1.0)  # the sensor is silent from now on
    assert sent()['objects'] == []


def test_an_object_near_a_robot_is_an_alarm(sensing: Stage) -> None:
    sensing.see(detected(0.1, DetectedObject.STOP))
    assert [it['text'] for it in sensing.state['alarms']] == [
        "kinect: object 3 is 0.10 m from arm's hand: 30 × 20 × 10 cm"]
    for _ in range(10):
        sensing.see(detected(0.9, DetectedObject.CLEAR))
    assert sensing.state['alarms'] == []


@pytest.mark.parametrize('is_played', [False, True])
def test_a_sensor_that_does_not_see_is_an_alarm(sensing: Stage, is_played: bool) -> None:
    sensing.pass_time(14.0)
    assert sensing.state['alarms'] == []
    for _ in range(10):
        if is_played:  # a recording may be paused
            sensing.live.take_player(SeenPlayer('a.bag', 3.0, True), sensing.now_s)
        sensing.pass_time(0.5)
    said = ['kinect: no objects can be found: none of its clouds is evaluated']
    assert [it['text'] for it in sensing.state['alarms']] == ([] if is_played else said)


def no_number(name: str) -> None:
    """Refuse constants that a browser does not accept as JSON."""
    pytest.fail(f'{name} is no JSON')


@pytest.mark.parametrize('number', [math.nan, math.inf, -1e308, 1e200, 1e39])
def test_a_number_that_no_page_can_show_does_not_stop_the_page(stage: Stage, number: float) -> None:
    """A node that sends one, by mistake or not, must not hide the rest of the cell."""
    def transform(parent: str, child: str) -> TransformStamped:
        it = TransformStamped()
        it.header.frame_id, it.child_frame_id = parent, child
        it.transform.translation.x = it.transform.rotation.x = number
        it.transform.rotation.w = 1.0
        return it

    frames = [transform('world', 'far'), transform('far', 'oven/base')]
    marker = text_marker('oven', 'world', (0, 0, number), 'oven: old', 0.1, (1.0, 1.0, 1.0, 1.0))
    arrow = Marker(type=Marker.ARROW, ns='x', color=ColorRGBA(1.0, 1.0, 1.0, 1.0))
    arrow.header.frame_id, arrow.scale.x, arrow.scale.y = 'world', number, 1.0
    for is_static in (False, True):
        stage.live.take_transforms(packed(TFMessage(frames)), is_static)
        stage.live.take_markers('/oven/marker_array', packed(MarkerArray([marker, arrow])),
                                stage.now_s)
        stage.live.take_player(SeenPlayer('a.bag', number, False), stage.now_s)
        stage.live.take_recorder(SeenRecorder(True, 'a.bag', number, 0, 0, (
            RecorderTopic('/heat', 0.0, abs(number), 3, False),)))
        stage.pass_time(1.0)
    for slot in (Slot.LAYOUT, Slot.STATE):
        json.loads(stage.live.feed.newest(slot)[1], parse_constant=no_number)
    assert stage.state['recording'] == 'no recorder'
