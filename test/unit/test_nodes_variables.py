# SPDX-License-Identifier: BSD-3-Clause
"""The variable processor on a simulated clock: numbers of many types, stale and wrong data."""
from __future__ import annotations

from typing import Any, Dict, List, Tuple

import genpy
import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import Vector3, Wrench, WrenchStamped
from sensor_msgs.msg import Temperature
from simulated_node import SimulatedNode
from std_msgs.msg import Bool, Float32, Float64, String, UInt8MultiArray
from visualization_msgs.msg import Marker

from process_visualizer.msg import PlayerState
from process_visualizer.nodes.common.newest_message import NewestMessage, RawMessage, decode
from process_visualizer.nodes.common.node_handle import PlaybackFollower
from process_visualizer.nodes.common.node_parameters import LiveNumber
from process_visualizer.nodes.variable_processor import (
    VariableProcessor,
    marker_namespaces,
    text_places,
)
from process_visualizer.parameters.reading import ParameterError, Parameters
from process_visualizer.parameters.variable_parameters import VariablesParameters

SPEED = {'topic': '/speed', 'frame': '/tool', 'scale': 0.5, 'label': 'v', 'unit': 'm/s'}
TEXT_S = 0.15
"""Maximum time until a text is drawn."""


def read(*variables, **others):
    values = {'variables': [{**SPEED, **variable} for variable in variables], **others}
    return VariablesParameters.read(Parameters(values, '/d/variable_proc'))


class Odd(genpy.Message):
    """Message of a package that is not in the workspace."""

    _type, _md5sum, _has_header = 'odd_msgs/Odd', '0123456789abcdef0123456789abcdef', False
    _full_text = 'float32 data'
    __slots__ = ['data']
    _slot_types = ['float32']

    def serialize(self, buffer: Any) -> None:
        buffer.write(b'\x00\x00\x80\x3f')


class Display:
    """The node of a device d, and its markers in RViz."""

    def __init__(self, *variables: Dict[str, Any], **others: Any) -> None:
        self.node = SimulatedNode('/d/variable_proc')
        VariableProcessor(self.node, 'd', read(*variables, **others))
        self._markers: Dict[Tuple[str, int], Marker] = {}

    def send(self, message: Any, topic: str = '/speed') -> None:
        self.node.send(topic, message)

    def wait(self, duration_s: float = TEXT_S) -> None:
        """Let time pass, and draw the received markers."""
        self.node.advance(duration_s)
        arrived = self.node.sent('marker_array')
        self._markers.update({(it.ns, it.id): it for array in arrived for it in array.markers})
        arrived.clear()

    def arrow(self, label: str = 'v') -> Marker:
        return self._markers[f'variable/{label}', 0]

    def text_marker(self, label: str = 'v') -> Marker:
        return self._markers[f'variable/{label}', 1]

    def text(self, label: str = 'v') -> str:
        """The text of a variable without the blank lines of its block."""
        return self.text_marker(label).text.strip()

    def shown(self, message: Any, label: str = 'v', topic: str = '/speed') -> str:
        """Send a message, and return the resulting text."""
        self.send(message, topic)
        self.wait()
        return self.text(label)

    def reports(self) -> List[DiagnosticStatus]:
        """The messages on /diagnostics since the last call."""
        arrays: List[DiagnosticArray] = self.node.sent('/diagnostics')
        found = [status for array in arrays for status in array.status]
        arrays.clear()
        return found


def test_no_longer_than_it_may_be() -> None:
    display = Display({'scale': 0.1, 'max': 0.6})
    for value, length_m in ((2.0, 0.2), (90.0, 0.6)):
        display.shown(Float32(value))
        assert display.arrow().type == Marker.ARROW
        assert display.arrow().scale.x == pytest.approx(length_m)


def test_parameters():
    parameters = read({'axis': [0, 0, -2], 'color': [0.0, 0.0, 1.0], 'field': 'a.b[2]'}, {})
    first, second = parameters.variables
    assert (first.topic, str(first.field), first.frame) == ('/speed', 'a.b[2]', 'tool')
    assert (first.axis, first.colors.color) == ((0.0, 0.0, -1.0), (0.0, 0.0, 1.0, 1.0))
    assert (str(second.field), second.axis, second.offset) == ('data', (1.0, 0.0, 0.0), 0.0)
    assert (parameters.marker_rate_hz, parameters.stale_after_s) == (30.0, 0.7)


@pytest.mark.parametrize('values, problem', [
    ({'topic': ''}, r'/d/variable_proc/variables\[0\]/topic: a name'),
    ({'topic': 'a b'}, r'variables\[0\]/topic: the name of a topic'),
    ({'topic': '/a//b'}, r'variables\[0\]/topic: the name of a topic'),
    ({'frame': ''}, r'variables\[0\]/frame: a name'),
    ({'frame': 3}, r'variables\[0\]/frame: a string'),
    ({'field': 'data['}, r'variables\[0\]/field: a field such as data'),
    ({'axis': [0, 0, 0]}, r'variables\[0\]/axis: a direction'),
    ({'axis': 'x'}, r'variables\[0\]/axis: a list of three numbers'),
    ({'scale': 'long'}, r'variables\[0\]/scale: a number'),
    ({'max': 0}, r'variables\[0\]/max: a number above 0'),
    ({'offset': float('nan')}, r'variables\[0\]/offset: a number'),
    ({'color': 'red'}, r'variables\[0\]/color: three or four numbers'),
    ({'limits': {'low': 'x'}}, r'variables\[0\]/limits/low: a number'),
    ({'color_scale': {'begin': 1, 'end': 1}}, r'color_scale/end: another value than begin'),
    ({'offset_param': 'a b'}, r'variables\[0\]/offset_param: the name of a parameter'),
])
def test_wrong_parameters_are_named(values, problem):
    with pytest.raises(ParameterError, match=problem):
        read(values)


@pytest.mark.parametrize('values, problem', [
    ({}, 'variables: a list of at least one variable'),
    ({'variables': []}, 'variables: a list of at least one variable'),
    ({'variables': SPEED}, 'variables: a list of groups'),
    ({'variables': [3]}, r'variables\[0\]: a group of parameters'),
    ({'variables': [SPEED], 'marker_rate': 0}, 'marker_rate: a number above 0'),
    ({'variables': [SPEED], 'text': {'position': 1}}, 'text/position: a list of three'),
])
def test_wrong_lists_are_named(values, problem):
    with pytest.raises(ParameterError, match=problem):
        VariablesParameters.read(Parameters(values, '/d/variable_proc'))


def test_namespaces_of_markers_differ():
    variables = read({'label': 'v'}, {'label': 'T'}, {'label': 'v'}, {'label': ''}).variables
    assert marker_namespaces(variables) == ['variable/v 1', 'variable/T', 'variable/v 3',
                                            'variable/speed']


def test_texts_in_one_frame_are_lines_of_one_block():
    places = text_places(read({}, {'frame': 'other'}, {}),
                         [(1.0, 0.0, 0.0), (0.0, 0.0, 0.2), (0.0, 0.1, 0.0)])
    assert [(place.frame, place.line, place.line_count) for place in places] == [
        ('tool', 0, 2), ('other', 0, 1), ('tool', 1, 2)]
    assert places[0].position == pytest.approx((0.0, 0.0, 0.09))
    assert places[2].position == places[0].position
    assert places[1].position == pytest.approx((0.0, 0.0, 0.265))


def test_texts_at_a_place_of_their_own():
    places = text_places(read({}, {'frame': 'other'},
                              text={'frame': '/board', 'position': [0, 1, 2]}),
                         [(0.0, 0.0, 0.5)] * 2)
    assert [(place.frame, tuple(place.position), place.line) for place in places] == [
        ('board', (0, 1, 2), 0), ('board', (0, 1, 2), 1)]


def test_arrow_and_text() -> None:
    display = Display({'offset': 1.0, 'axis': [0, 1, 0], 'color': [1.0, 0.0, 0.0]})
    assert display.shown(Float32(1.5)) == 'v 1.50 m/s, 0.50 above 1'
    arrow = display.arrow()
    assert (arrow.type, arrow.header.frame_id, arrow.frame_locked) == (Marker.ARROW, 'tool', True)
    assert arrow.header.stamp.to_sec() == 0.0
    assert arrow.scale.x == pytest.approx(0.25)
    assert (arrow.color.r, arrow.color.g, arrow.color.b) == (1.0, 0.0, 0.0)
    turn = arrow.pose.orientation
    assert (turn.x, turn.y, turn.z, turn.w) == pytest.approx((0, 0, 0.5 ** 0.5, 0.5 ** 0.5))


def test_two_variables_of_two_types_in_one_frame() -> None:
    display = Display(
        {'topic': '/temperature', 'field': 'temperature', 'axis': [0, 0, 1], 'unit': '°C',
         'scale': 0.01, 'offset': 20, 'label': 'oven'},
        {'topic': '/levels', 'field': 'data[2]', 'unit': '', 'scale': 0.001, 'label': 'level'})
    display.send(Temperature(temperature=45.5), '/temperature')
    assert display.shown(UInt8MultiArray(data=b'\x01\x02\xfa'), 'level', '/levels') == 'level 250'
    assert display.text('oven') == 'oven 45.5 °C, 25.5 above 20'
    assert display.arrow('oven').scale.x == pytest.approx(0.255)
    assert display.arrow('level').scale.x == pytest.approx(0.25)
    texts = [display.text_marker(label) for label in ('oven', 'level')]
    assert texts[0].pose == texts[1].pose
    assert [text.text.split('\n').index(' ') for text in texts] == [1, 0]


def test_below_the_offset_it_points_the_other_way_and_at_it_there_is_none() -> None:
    display = Display({'axis': [0, 0, 1], 'offset': 20, 'scale': 0.01, 'unit': '°C'})
    assert display.shown(Float32(-5.0)) == 'v -5.0 °C, 25.0 below 20'
    turn = display.arrow().pose.orientation  # x onto -z: a quarter turn about y
    assert (turn.x, turn.y, turn.z, turn.w) == pytest.approx((0, 0.5 ** 0.5, 0, 0.5 ** 0.5))
    assert display.arrow().scale.x == pytest.approx(0.25)
    assert display.shown(Float32(20.0)) == 'v 20.0 °C, at 20'
    assert display.arrow().action == Marker.DELETE


def test_a_field_of_a_group_against_its_axis() -> None:
    display = Display({'field': 'wrench.force.z', 'axis': [0, -1, 0], 'scale': 0.01, 'unit': 'N'})
    assert display.shown(WrenchStamped(wrench=Wrench(force=Vector3(z=-45.0)))) == 'v -45.0 N'
    assert display.arrow().pose.orientation.z == pytest.approx(0.5 ** 0.5)  # x onto y


def test_text_only() -> None:
    display = Display({'scale': 0, 'unit': '', 'label': 'door open'})
    assert display.shown(Bool(True), 'door open') == 'door open 1'
    assert display.shown(Bool(False), 'door open') == 'door open 0'
    assert display.arrow('door open').action == Marker.DELETE


def test_short_arrow_is_removed() -> None:
    display = Display({})
    display.shown(Float32(0.009))
    assert (display.arrow().action, display.text_marker().action) == (Marker.DELETE, Marker.ADD)


def is_grey(marker: Marker) -> bool:
    return bool(marker.color.r == marker.color.g == marker.color.b < 1.0)


def test_never_any_data() -> None:
    display = Display({'color': [1.0, 0.0, 0.0]})
    display.wait()
    assert (display.arrow().action, display.text()) == (Marker.DELETE, 'v no data')
    assert is_grey(display.text_marker())


def send_regularly(display: Display, period_s: float, count: int = 6) -> None:
    for _ in range(count):
        display.send(Float64(0.5))
        display.wait(period_s)


def test_stopped_data_are_grey_until_they_come_again() -> None:
    display = Display({'color': [1.0, 0.0, 0.0]})
    send_regularly(display, 0.1)
    assert display.shown(Float64(0.5)) == 'v 0.50 m/s'
    display.wait(0.45)  # 0.6 s: younger than 0.7 s
    assert display.text() == 'v 0.50 m/s'
    display.wait(0.2)
    assert display.text() in ('v no data for 0.7 s', 'v no data for 0.8 s')
    display.wait(2.4)
    assert display.text() in ('v no data for 3.1 s', 'v no data for 3.2 s')
    assert display.arrow().scale.x == pytest.approx(0.25)
    assert is_grey(display.arrow()) and is_grey(display.text_marker())
    assert display.shown(Float64(0.25)) == 'v 0.25 m/s'
    assert display.arrow().color.r == 1.0 > display.arrow().color.g


def test_a_driver_that_was_held_up_for_a_moment_has_a_rate_nevertheless() -> None:
    display = Display({})
    send_regularly(display, 0.1, 60)
    display.wait(1.0)
    send_regularly(display, 0.1, 60)
    display.wait(0.9)
    assert display.text().startswith('v no data for ')


def test_a_value_that_is_sent_on_change_holds_until_nobody_publishes_it() -> None:
    display = Display({'unit': '', 'label': 'state'}, stale_after=0.7)
    assert display.shown(Float64(3), 'state') == 'state 3.00'
    for pause_s, value in ((20.0, 4), (0.2, 5), (0.1, 6), (40.0, 7), (90.0, 8)):
        display.wait(pause_s)
        assert display.text('state') == f'state {value - 1}.00'
        assert not is_grey(display.text_marker('state'))
        display.shown(Float64(value), 'state')
    display.node.end_publishers('/speed')
    display.wait(3.0)
    assert display.text('state').startswith('state no data for 3')
    assert is_grey(display.text_marker('state'))


def test_a_slow_topic_has_stopped_when_it_is_silent_for_three_times_as_long_as_usual() -> None:
    display = Display({})
    send_regularly(display, 2.0)
    display.wait(3.9)  # 5.9 s after the last one
    assert display.text() == 'v 0.50 m/s'
    display.wait(0.2)
    assert display.text().startswith('v no data for 6')


def test_a_driver_that_sends_in_bursts_has_stopped_after_three_pauses() -> None:
    display = Display({})
    for _ in range(6):
        send_regularly(display, 0.02, 10)
        display.wait(0.8)
    assert display.text() == 'v 0.50 m/s'
    display.wait(2.0)
    assert display.text().startswith('v no data for 2.')


def played(node: SimulatedNode, is_paused: bool, segment: int = 0, rate: float = 1.0,
           position_s: float = 5.0) -> PlayerState:
    return PlayerState(stamp=node.now(), since=node.now(), position=position_s, rate=rate,
                       paused=is_paused, segment=segment)


def test_while_playback_is_paused_data_do_not_age() -> None:
    display = Display({})
    display.send(played(display.node, True), '/bag_player/state')
    display.shown(Float32(0.5))
    for _ in range(30):
        display.send(played(display.node, True), '/bag_player/state')
        display.wait(0.1)
    assert display.text() == 'v 0.50 m/s'


def test_a_value_that_is_left_from_the_live_cell_grows_old_in_paused_playback() -> None:
    display = Display({})
    send_regularly(display, 0.1)
    paused = played(display.node, True)
    for _ in range(30):
        paused.stamp = display.node.now()
        display.send(paused, '/bag_player/state')
        display.wait(0.1)
    assert display.text() in ('v no data for 3.0 s', 'v no data for 3.1 s')
    assert is_grey(display.arrow())
    display.shown(Float64(0.5))  # from the recording
    for _ in range(30):
        paused.stamp = display.node.now()
        display.send(paused, '/bag_player/state')
        display.wait(0.1)
    assert display.text() == 'v 0.50 m/s' and not is_grey(display.arrow())


@pytest.mark.parametrize('is_paused', [True, False])
def test_jumps_of_playback_do_not_make_a_value_that_is_sent_on_change_old(is_paused: bool) -> None:
    display = Display({'unit': '', 'label': 'state'})
    for segment in range(20):  # the operator drags the position
        display.send(played(display.node, is_paused, segment), '/bag_player/state')
        display.send(Float64(3))
        display.wait(0.05)
    for _ in range(50):
        display.send(played(display.node, False, 19), '/bag_player/state')
        display.wait(0.1)
    assert display.text('state') == 'state 3.00'


def test_before_its_first_message_in_a_recording_a_topic_has_no_data() -> None:
    """The number at the position before the jump remained."""
    display = Display({})
    display.send(played(display.node, True, 1), '/bag_player/state')
    assert display.shown(Float32(0.5)) == 'v 0.50 m/s'
    state = played(display.node, True, 2)
    state.not_begun = ['/speed']
    display.send(state, '/bag_player/state')
    display.wait()
    assert display.text() == 'v no data'
    display.send(played(display.node, True, 3), '/bag_player/state')
    display.wait()
    assert display.text() == 'v 0.50 m/s'  # its last message, which the player sends again


def test_a_rate_of_playback_is_no_habit_of_a_topic() -> None:
    display = Display({})
    for rate, pause_s, count in ((4.0, 0.25, 40), (1.0, 1.0, 3)):
        for number in range(count):
            display.send(played(display.node, False, int(rate), rate, number * 1.0),
                         '/bag_player/state')
            display.send(Float64(0.5))
            display.wait(pause_s - 0.02)
            assert display.text() == 'v 0.50 m/s'
            display.wait(0.02)


def test_a_type_that_changes() -> None:
    display = Display({})
    assert display.shown(Float64(0.75)) == 'v 0.75 m/s'
    assert display.shown(Float32(-0.25)) == 'v -0.25 m/s'


@pytest.mark.parametrize('message, problem', [
    (Float32(float('nan')), 'its value is nan'),
    (Float32(float('-inf')), 'its value is -inf'),
    (String('fast'), 'data is not a number but a string'),
    (Odd(), 'the message type odd_msgs/Odd is not known'),
])
def test_bad_message_leaves_the_last_good_state(message: Any, problem: str) -> None:
    display = Display({})
    display.shown(Float32(0.5))
    for _ in range(5):
        display.shown(message)  # its topic has a rate
    assert display.arrow().scale.x == pytest.approx(0.25)
    assert display.text() in ('v no data for 0.8 s', 'v no data for 0.9 s')
    (level, text), = display.node.log
    assert level == 'warn' and text.startswith('d: field data of /speed is not shown: ')
    assert problem in text
    display.wait(0.5)
    assert {it.key: it.value for it in display.reports()[-1].values}['messages'] == '5'
    assert display.shown(Float32(0.25)) == 'v 0.25 m/s'
    display.wait(4.0)
    assert display.reports()[-1].level == DiagnosticStatus.OK


def test_wrong_field_is_named_with_what_there_is() -> None:
    display = Display({'field': 'temprature'})
    assert display.shown(Temperature()) == 'v no data'
    (_, text), = display.node.log
    assert '/speed' in text and 'temprature' in text
    assert 'header, temperature, variance' in text and 'did you mean temperature?' in text


def test_what_is_beyond_a_limit_is_an_alarm_also_if_it_is_not_shown() -> None:
    watched = {'topic': '/watched', 'label': 'watched', 'limits': {'high': 3.0}, 'shown': False}
    display = Display({}, watched)
    display.send(Float32(4.0), '/watched')
    display.wait(1.0)
    alarm = display.reports()[-1]
    assert (alarm.level, alarm.name) == (
        DiagnosticStatus.ERROR, '/d/variable_proc: limits of /watched data')
    display.send(Float32(1.0), '/watched')
    display.wait(1.5)
    assert display.reports()[-1].level == DiagnosticStatus.OK
    with pytest.raises(KeyError):
        display.text('watched')


def test_an_alarm_is_said_no_longer_when_its_values_have_ended() -> None:
    display = Display({'limits': {'high': 3.0}})
    for _ in range(10):
        display.shown(Float32(4.0))
    assert display.reports()[-1].level == DiagnosticStatus.ERROR
    display.wait(4.0)
    display.reports()
    display.wait(30.0)
    assert display.reports() == [], 'neither that it lasts nor that it is over'
    for _ in range(10):
        display.shown(Float32(1.0))
    assert [it.level for it in display.reports()] == [DiagnosticStatus.OK]


def test_of_what_is_played_there_is_no_alarm() -> None:
    display = Display({'limits': {'high': 3.0}})
    display.shown(Float32(4.0))
    display.wait(1.0)
    assert display.reports()[-1].level == DiagnosticStatus.ERROR
    for _ in range(10):
        display.send(played(display.node, False), '/bag_player/state')
        display.wait(0.2)
    assert display.reports()[-1].level == DiagnosticStatus.OK


def test_no_more_markers_than_the_rate_and_none_for_nobody() -> None:
    node = SimulatedNode('/d/variable_proc')
    VariableProcessor(node, 'd', read({}, marker_rate=20.0))
    for _ in range(500):
        node.send('/speed', Float32(0.5))
        node.advance(0.004)
    assert len(node.sent('marker_array')) in (39, 40)
    node.publishers['/d/marker_array'].connections = 0
    node.advance(2.0)
    assert len(node.sent('marker_array')) in (39, 40)


def test_a_message_is_decoded_once_for_all_its_variables() -> None:
    node = SimulatedNode()
    source = NewestMessage(node, '/speed', PlaybackFollower(node))
    assert source.newest() is None
    node.send('/speed', Float32(0.5))
    raw = source.newest()
    assert raw is not None and raw.time_s == node.now_s
    assert source.decode(raw) is source.decode(raw)


@pytest.mark.parametrize('message, message_class, problem', [
    (RawMessage('my_msgs/Odd', '0', b'', 0.0), None, 'my_msgs/Odd is not known'),
    (RawMessage('std_msgs/Float32', '0', b'1234', 0.0), Float32, 'another version of std_msgs'),
    (RawMessage('std_msgs/Float32', Float32._md5sum, b'12', 0.0), Float32, 'bytes are not those'),
])
def test_what_cannot_be_decoded(message, message_class, problem):
    with pytest.raises(ValueError, match=problem):
        decode(message, message_class)


@pytest.mark.parametrize('value, color', [
    (-1.0, (0.9, 0.1, 0.1)), (0.0, (0.0, 0.0, 1.0)), (20.0, (0.0, 0.0, 1.0)),
    (40.0, (0.0, 0.5, 0.5)), (60.0, (0.0, 1.0, 0.0)), (90.0, (0.0, 1.0, 0.0)),
    (90.1, (0.9, 0.1, 0.1))])
def test_colors_by_scale_and_warning_limits(value, color):
    display = Display({'color': [0, 0, 1], 'limits': {'low': 0.0, 'high': 90.0}, 'scale': 1.0,
                       'color_scale': {'begin': 20.0, 'end': 60.0, 'color': [0, 1, 0]},
                       'offset': -100.0})
    display.shown(Float32(value))
    found = display.arrow().color
    assert (found.r, found.g, found.b) == pytest.approx(color)


def test_offset_is_read_live() -> None:
    display = Display({'offset': 1.0, 'offset_param': 'setpoint'})
    display.node.params['/d/setpoint'] = 0.25
    assert display.shown(Float32(1.25)) == 'v 1.25 m/s, 1.00 above 0.25'
    assert display.arrow().scale.x == pytest.approx(0.5)
    display.node.params['/d/setpoint'] = 0.75
    display.wait()
    assert display.text() == 'v 1.25 m/s, 0.50 above 0.75'
    assert display.arrow().scale.x == pytest.approx(0.25)
    del display.node.params['/d/setpoint']
    display.wait()
    assert display.text() == 'v 1.25 m/s, 0.25 above 1'


@pytest.mark.parametrize('value', ['high', True, float('nan'), {'a': 1}])
def test_a_parameter_that_is_no_number_is_named_now_and_then(value: Any) -> None:
    node = SimulatedNode(params={'/r/setpoint': value})
    number = LiveNumber(node, 'setpoint', 255.0)
    for _ in range(15):
        assert number.value() == 255.0
        node.advance(1.0)
    assert node.log == 2 * [('warn', f'parameter /r/setpoint: a number is expected, not {value!r}; '
                                     '255 is used')]
    node.params['/r/setpoint'] = 'another'
    number.value()
    assert "'another'" in node.log[-1][1]
