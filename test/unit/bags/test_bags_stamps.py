# SPDX-License-Identifier: BSD-3-Clause
"""Stamps in random and damaged messages, and with wrong or hostile definitions."""
import struct
import sys
import tracemalloc

import pytest
from bags_wire_format import messages
from hypothesis import given, settings
from hypothesis import strategies as st

from process_visualizer.bagio.message_definition import DefinitionError, parse_definitions
from process_visualizer.bagio.message_layout import MessageDamaged, StampLocator

NS_PER_S = 1_000_000_000
SHIFT_NS = 12_345_678_901
HEADER = '\n'.join(['=' * 80, 'MSG: std_msgs/Header', 'uint32 seq', 'time stamp',
                    'string frame_id'])


def shifted(stamp_ns):
    return (stamp_ns + SHIFT_NS) % (NS_PER_S << 32)


class Laborious(Exception):
    """Error: more function calls than allowed."""


def call_count(work, most=50_000):
    """Count function calls up to a maximum: a measure of work that is equal on every machine."""
    count = 0

    def note(_frame, event, _argument):
        nonlocal count
        count += event in ('call', 'c_call')
        if count > most:
            raise Laborious(f'more than {most} calls')

    sys.setprofile(note)
    try:
        work()
    finally:
        sys.setprofile(None)
    return count


def peak_bytes(work):
    """Return the peak memory usage."""
    tracemalloc.start()
    try:
        work()
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


def header(seconds=7, nanoseconds=8, frame=b'world'):
    return struct.pack('<III', 1, seconds, nanoseconds) + struct.pack('<I', len(frame)) + frame


@settings(deadline=None)
@given(messages())
def test_exactly_the_stamps_move(message):
    name, definition, data, expected = message
    locator = StampLocator(name, definition)
    locator.check(data)
    assert locator.offsets(data) == expected
    assert locator.has_stamps or not expected
    moved = bytearray(locator.moved(data, shifted))
    for offset in expected:
        seconds, nanoseconds = struct.unpack_from('<II', data, offset)
        old_ns = seconds * NS_PER_S + nanoseconds
        new = divmod(shifted(old_ns), NS_PER_S) if old_ns else (0, 0)
        assert struct.unpack_from('<II', moved, offset) == new
        moved[offset:offset + 8] = data[offset:offset + 8]
    assert moved == data


@settings(deadline=None)
@given(messages(), st.data())
def test_damage_raises_nothing_else(message, data):
    name, definition, original, _ = message
    locator = StampLocator(name, definition)
    damaged = bytearray(original[:data.draw(st.integers(0, len(original)))])
    for _ in range(data.draw(st.integers(0, 4)) if damaged else 0):
        position = data.draw(st.integers(0, len(damaged) - 1))
        damaged[position] ^= 1 << data.draw(st.integers(0, 7))
    for work in (locator.check, lambda it: locator.moved(it, shifted)):
        try:
            work(bytes(damaged))
        except MessageDamaged as error:
            assert 'byte' in str(error)


@settings(deadline=None)
@given(messages(), st.data())
def test_check_finds_every_truncation_and_extension(message, data):
    name, definition, original, _ = message
    locator = StampLocator(name, definition)
    if original:
        with pytest.raises(MessageDamaged):
            locator.check(original[:data.draw(st.integers(0, len(original) - 1))])
    with pytest.raises(MessageDamaged, match='should end'):
        locator.check(original + b'\0')


@settings(deadline=None)
@given(st.text(max_size=200), st.text(alphabet='abT/[]0129 \n#=:MSG', max_size=200))
def test_any_text_is_a_definition_or_a_definition_error(first, second):
    for text in (first, second, f'{first}\n{"=" * 80}\nMSG: {second}'):
        try:
            StampLocator('pkg/Type', text).check(b'')
        except (DefinitionError, MessageDamaged):
            continue


@pytest.mark.parametrize(('definition', 'message'), [
    ('int32', 'not a field'), ('int32 a b', 'not a field'), ('int32[ a', 'not a field'),
    ('int32[-1] a', 'not a field'), ('int32[9999999999] a', 'not a field'),
    ('1x a', 'not a field'), ('a/b/c/d x', 'not a field'), ('__import__("os") x', 'not a field'),
    ('int32 a.b', 'not a field'),
    ('Other a', 'definition of pkg/Other is missing'),
    ('Type a', 'contains itself'), ('Type[] a', 'contains itself'),
    ('int32 a\n' + '=' * 80 + '\nint32 b', 'MSG'),
    (f'Event[99999] events\n{"=" * 80}\nMSG: pkg/Event\ntime stamp', 'stamps'),
    ('#' * 2_000_000, 'too large'), ('int32 a\n' * 20_000, 'too many')])
def test_wrong_definition(definition, message):
    with pytest.raises(DefinitionError, match=message):
        StampLocator('pkg/Type', definition)


def chain(count, line):
    """Return types that each contain the next; the last contains a string."""
    blocks = [line.format(index + 1) for index in range(count)] + ['string s\ntime stamp']
    text = [blocks[0]] + [f'MSG: pkg/T{index}\n{block}' for index, block in enumerate(blocks)
                          if index]
    return ('\n' + '=' * 80 + '\n').join(text)


def test_types_nested_too_deep():
    with pytest.raises(DefinitionError, match='nested more than'):
        StampLocator('pkg/T0', chain(100, 'T{} a'))


@pytest.mark.parametrize('line', ['T{0} a\nT{0} b\nT{0} c', 'T{0}[999999999] a', 'T{0}[] a'])
def test_definition_that_multiplies_costs_little(line):
    def work():
        locator = StampLocator('pkg/T0', chain(35, line))
        for data in (b'\0' * 10_000, b'\xff' * 10_000, b'\1\0\0\0' * 2_500):
            with pytest.raises(MessageDamaged):
                locator.check(data)

    call_count(work)


@pytest.mark.parametrize('element', ['Empty', 'string[0]', 'Empty[999999999]'])
def test_arrays_of_nothing_cost_nothing(element):
    name = element if element.startswith('Empty') else 'Hollow'
    definition = (f'{name if "[" not in name else "Hollow"}[] a\nEmpty[999999999] b\n{"=" * 80}\n'
                  f'MSG: pkg/Empty\n{"=" * 80}\nMSG: pkg/Hollow\n{element} nothing')
    locator = StampLocator('pkg/Type', definition)
    locator.check(b'\xff\xff\xff\xff')


def test_constants_comments_and_line_ends():
    definition = ('string TEXT = a # b = "c"\r\nint32 X=1\r\n  time   stamp # = 1\r\n\r\n'
                  '\tuint8\tvalue\r\n#int32 gone')
    fields = parse_definitions('pkg/msg/Type', definition)['pkg/Type']
    assert [(field.type_name, field.name) for field in fields] == [
        ('time', 'stamp'), ('uint8', 'value')]


def test_names_with_msg_in_between():
    locator = StampLocator('pkg/msg/Type', 'std_msgs/msg/Header header\n'
                           + HEADER.replace('std_msgs/', 'std_msgs/msg/'))
    assert locator.offsets(header()) == [4]


@pytest.mark.parametrize('type_name, field', [
    ('pkg/Type', 'Header header'), ('pkg/Type', 'roslib/Header header'),
    ('pkg/Type', 'std_msgs/Header header'), ('roslib/Header', 'uint32 seq\ntime stamp'),
    ('std_msgs/Type', 'Header header'), ('roslib/Type', 'Header header')])
@pytest.mark.parametrize('heading', ['roslib/Header', 'std_msgs/Header', 'Header',
                                     'roslib/msg/Header', ''])
def test_the_header_by_its_old_names(type_name, field, heading):
    """Until ROS Electric it was roslib/Header; `Header` can mean either."""
    definition = f'{field}\n' + (HEADER.replace('std_msgs/Header', heading) if heading else '')
    assert StampLocator(type_name, definition).offsets(header()) == [4]


@pytest.mark.parametrize('definition', [
    'time clock', 'duration stamp', 'time[] stamp', 'time[2] stamp', 'time time_ref', 'uint8 x'])
def test_other_times_are_data(definition):
    locator = StampLocator('pkg/Type', definition)
    data = b'\1\0\0\0' + b'\1' * 12
    assert not locator.has_stamps
    assert locator.moved(data, shifted) is data


def test_zero_stamps_stay():
    locator = StampLocator('pkg/Type', f'Header a\nHeader b\n{HEADER}')
    data = header(0, 0) + header(5, 0)
    assert locator.moved(data, lambda _: 9 * NS_PER_S + 1) == header(0, 0) + header(9, 1)
    assert locator.moved(header(0, 0) * 2, shifted) == header(0, 0) * 2


@pytest.mark.parametrize('kind', [bytes, bytearray, memoryview])
def test_the_data_itself_is_not_changed(kind):
    locator = StampLocator('pkg/Type', f'Header header\nuint8[] data\n{HEADER}')
    original = header() + b'\3\0\0\0abc'
    data = kind(original)
    assert locator.moved(data, shifted) != original
    assert bytes(data) == original


@pytest.mark.parametrize('stamp_ns', [-1, NS_PER_S << 32])
def test_stamps_that_ros_does_not_have(stamp_ns):
    locator = StampLocator('pkg/Type', 'time stamp')
    with pytest.raises(ValueError, match='not a ROS time'):
        locator.moved(b'\1' * 8, lambda _: stamp_ns)


def test_absurd_length_is_found_at_once():
    locator = StampLocator('pkg/Type', f'string[] names\nHeader header\n{HEADER}')
    with pytest.raises(MessageDamaged, match='17179869180 bytes are expected at byte 4'):
        locator.moved(b'\xff' * 1_000_000, shifted)


def picture(size):
    """A message with this many bytes after its header."""
    return header() + struct.pack('<II', 1, size) + bytes(size)


def test_a_picture_costs_one_copy_and_no_more_calls_than_a_small_one():
    definition = f'Header header\nuint32 height\nuint8[] data\n{HEADER}'
    locator = StampLocator('pkg/Image', definition)
    small, large = picture(10), picture(20_000_000)
    assert (call_count(lambda: locator.moved(large, shifted))
            == call_count(lambda: locator.moved(small, shifted)) < 40)
    assert peak_bytes(lambda: locator.moved(large, shifted)) < 1.01 * len(large)


def test_skipping_is_independent_of_the_size():
    locator = StampLocator('pkg/Two', f'uint8[] picture\nfloat64[] x\nHeader header\n{HEADER}')
    small, large = (struct.pack('<I', size) + bytes(size) + b'\0\0\0\0' + header()
                    for size in (10, 20_000_000))
    assert (call_count(lambda: locator.offsets(large))
            == call_count(lambda: locator.offsets(small)) < 40)
    assert peak_bytes(lambda: locator.offsets(large)) < 2000
