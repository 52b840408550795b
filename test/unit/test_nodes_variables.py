# SPDX-License-Identifier: BSD-3-Clause
"""The variable processor without a master: parameters, places of texts, markers, decoding."""
import io

import pytest
from std_msgs.msg import Float32, String
from visualization_msgs.msg import Marker

from process_visualizer.nodes.common.newest_message import RawMessage, decode
from process_visualizer.nodes.common.value_board import ShownValue, TextPlace, ValueBoard
from process_visualizer.nodes.variable_processor import (
    Variable,
    marker_namespaces,
    text_places,
)
from process_visualizer.parameters.reading import ParameterError, Parameters
from process_visualizer.parameters.variable_parameters import VariablesParameters

SPEED = {'topic': '/speed', 'frame': '/tool', 'scale': 0.5, 'label': 'v', 'unit': 'm/s'}


def read(*variables, **others):
    values = {'variables': [{**SPEED, **variable} for variable in variables], **others}
    return VariablesParameters.read(Parameters(values, '/d/variable_proc'))


def raw(message, time_s):
    buffer = io.BytesIO()
    message.serialize(buffer)
    return RawMessage(message._type, message._md5sum, buffer.getvalue(), time_s)


class Source:
    """Stands for a topic: the message that came last."""

    def __init__(self):
        self.last = None
        self.count = 0  # of decoded messages

    def newest(self):
        return self.last

    def decode(self, message):
        self.count += 1
        return decode(message, {'std_msgs/Float32': Float32, 'std_msgs/String': String}.get(
            message.message_type))


class Said(list):
    """Stands for the complaints of the node."""

    def add(self, _key, text):
        self.append(text)

    def note_good(self, _key):
        pass


@pytest.fixture
def warnings():
    return Said()


@pytest.fixture
def shown(warnings):
    """A function of parameters that returns a source, and a function from the time to markers."""
    def make(**values):
        parameters = read(values)
        source = Source()
        variable = Variable(warnings, parameters.variables[0], source)
        board = ValueBoard(0.05, 1.0)

        def markers(now_s):
            sample = variable.sample()
            text = variable.text(sample.age_s(now_s), 1.0)
            value = ShownValue('variable/v', variable.style(), sample, text,
                               TextPlace('tool', (0, 0, 1)))
            return {marker.id: marker for marker in board.markers([value], now_s)}
        return source, markers
    return make


def test_no_longer_than_it_may_be(shown):
    source, markers = shown(scale=0.1, max=0.6)
    for value, length_m in ((2.0, 0.2), (90.0, 0.6)):
        source.last = raw(Float32(value), 5.0)
        arrow = markers(5.0)[0]
        assert arrow.type == Marker.ARROW and arrow.scale.x == pytest.approx(length_m)


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
    ({'frame': 3}, r'variables\[0\]/frame: a text'),
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


def test_arrow_and_text(shown):
    source, markers = shown(offset=1.0, axis=[0, 1, 0], color=[1.0, 0.0, 0.0])
    source.last = raw(Float32(data=1.5), 10.0)
    made = markers(10.1)
    arrow, text = made[0], made[1]
    assert (arrow.type, arrow.header.frame_id, arrow.frame_locked) == (Marker.ARROW, 'tool', True)
    assert arrow.header.stamp.to_sec() == 0.0
    assert arrow.scale.x == pytest.approx(0.25)
    assert (arrow.color.r, arrow.color.g, arrow.color.b) == (1.0, 0.0, 0.0)
    turn = arrow.pose.orientation
    assert (turn.x, turn.y, turn.z, turn.w) == pytest.approx((0, 0, 0.5 ** 0.5, 0.5 ** 0.5))
    assert (text.ns, text.text) == ('variable/v', 'v 1.50 m/s, 0.50 above 1')


def test_negative_value_points_the_other_way(shown):
    source, markers = shown()
    source.last = raw(Float32(data=-0.5), 10.0)
    made = markers(10.1)
    turn = made[0].pose.orientation  # half a turn: x onto -x
    assert abs(turn.w) < 1e-6
    assert made[0].scale.x == pytest.approx(0.25)
    assert made[1].text == 'v -0.50 m/s'


@pytest.mark.parametrize('values, value', [({}, 0.009), ({'scale': 0}, 100.0)])
def test_short_arrow_is_removed(shown, values, value):
    source, markers = shown(**values)
    source.last = raw(Float32(data=value), 10.0)
    made = markers(10.1)
    assert made[0].action == Marker.DELETE
    assert made[1].action == Marker.ADD


def test_never_any_data(shown):
    _, markers = shown(color=[1.0, 0.0, 0.0])
    made = markers(10.0)
    assert (made[0].action, made[1].text) == (Marker.DELETE, 'v no data')
    assert made[1].color.r == made[1].color.g == made[1].color.b


def test_stale_is_grey(shown):
    source, markers = shown(color=[1.0, 0.0, 0.0])
    source.last = raw(Float32(data=0.5), 10.0)
    assert markers(11.0)[1].text == 'v 0.50 m/s'
    made = markers(13.2)
    assert made[1].text == 'v no data for 3.2 s'
    assert made[0].scale.x == pytest.approx(0.25)
    for marker in made.values():
        assert marker.color.r == marker.color.g == marker.color.b


@pytest.mark.parametrize('message, problem', [
    (Float32(data=float('nan')), 'its value is nan'),
    (Float32(data=float('-inf')), 'its value is -inf'),
    (String(data='fast'), 'data is a text'),
])
def test_bad_message_leaves_the_last_good_state(shown, warnings, message, problem):
    source, markers = shown()
    source.last = raw(Float32(data=0.5), 10.0)
    markers(10.0)
    for step in range(5):
        source.last = raw(message, 10.2 + 0.1 * step)
        made = markers(10.2 + 0.1 * step)
    assert made[0].scale.x == pytest.approx(0.25)
    assert len(warnings) == 5
    assert all(part in warnings[0] for part in ('/speed', 'data', problem))
    assert markers(12.0)[1].text == 'v no data for 2.0 s'


def test_each_message_is_decoded_once(shown):
    source, markers = shown()
    source.last = raw(Float32(data=0.5), 10.0)
    for step in range(10):
        markers(10.0 + 0.03 * step)
    assert source.count == 1


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
def test_colours_by_scale_and_warning_limits(shown, value, color):
    source, markers = shown(color=[0, 0, 1], limits={'low': 0.0, 'high': 90.0},
                            color_scale={'begin': 20.0, 'end': 60.0, 'color': [0, 1, 0]},
                            scale=1.0, offset=-100.0)
    source.last = raw(Float32(data=value), 10.0)
    found = markers(10.1)[0].color
    assert (found.r, found.g, found.b) == pytest.approx(color)


def test_offset_is_read_live(shown, monkeypatch):
    class Live:
        def __init__(self, name, default):
            self.name = name

        def value(self):
            return setpoints[self.name]

    setpoints = {'setpoint': 0.25}
    monkeypatch.setattr('process_visualizer.nodes.variable_processor.LiveNumber', Live)
    source, markers = shown(offset=1.0, offset_param='setpoint')
    source.last = raw(Float32(data=1.25), 10.0)
    made = markers(10.0)
    assert (made[0].scale.x, made[1].text) == (pytest.approx(0.5), 'v 1.25 m/s, 1.00 above 0.25')
    setpoints['setpoint'] = 0.75
    made = markers(10.2)
    assert (made[0].scale.x, made[1].text) == (pytest.approx(0.25), 'v 1.25 m/s, 0.50 above 0.75')
