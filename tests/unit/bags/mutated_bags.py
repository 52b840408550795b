"""Small bags of every kind, damaged at random; what is done with a damage is told by its number.

As a program it goes through many: `python3 mutated_bags.py FIRST COUNT`.
"""
from __future__ import annotations

import bz2
import contextlib
import json
import os
import random
import struct
import sys
import tempfile
import time
import warnings
from pathlib import Path
from typing import Any, Callable, Dict, Iterator, List, NamedTuple, Tuple

import lz4.frame
import rosbag
from genpy import Time
from geometry_msgs.msg import PoseStamped, TransformStamped, WrenchStamped
from sensor_msgs.msg import JointState
from std_msgs.msg import Float32MultiArray, String, UInt16
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import Marker, MarkerArray

from process_visualizer.bags.bag_errors import BagError
from process_visualizer.bags.bag_records import MAGIC, OP_CHUNK, Record, record_at
from process_visualizer.bags.catalogue import read_catalogue
from process_visualizer.bags.curves import read_curves
from process_visualizer.bags.marks import read_marks
from process_visualizer.bags.message_loader import MessageLoader
from process_visualizer.bags.playback_event import EventMaker
from process_visualizer.bags.position_values import PositionValues
from process_visualizer.bags.recorder_topics import (
    ACCOUNT,
    CONFIGURATION,
    MARKS,
    recorded_configuration,
)
from process_visualizer.bags.recording import Recording
from process_visualizer.bags.reindex import reindex
from process_visualizer.bags.report import make_report
from process_visualizer.bags.report_text import as_json, as_text
from process_visualizer.bags.stamps import with_stamps_moved
from process_visualizer.bags.topic_messages import topic_messages
from process_visualizer.cell.model import Device
from process_visualizer.cell.stored_configuration import write_configuration
from process_visualizer.cell.xml_parser import XmlParser

BEGIN_S = 1_600_000_000
CELL = """<visualizer>
  <device type="robot" name="ur"><base frame="ur/link0"/>
    <topic name="tcf" type="tool_center_frame"/><topic name="ft" type="force_sensor"/></device>
  <device type="robot" name="r2"><base frame="r2/link0"/>
    <topic name="tf" type="tool_center_frame" msg="tf2_msgs/TFMessage"/>
    <topic name="wrench" type="force_sensor"/></device>
  <device type="other" name="machine"><base frame="machine/base"/><topic name="edge"/>
    <variable topic="joints" field="position[1]" frame="machine/base" axis="x"/></device>
</visualizer>"""
_ODD = (0, 1, 2, 4, 11, 12, 127, 128, 255, 256, 4096, 65_535, 1 << 20, (1 << 31) - 1, 1 << 31,
        (1 << 32) - 1)
_SMALL_CHUNK_BYTES = 1500
_LEAST_BYTES = 100


class Damaged(NamedTuple):
    """A damaged bag: its bytes, and what was done to it."""

    data: bytes
    story: str


def devices(folder: Path) -> Tuple[Device, ...]:
    """The devices whose curves are read."""
    path = folder / 'cell.xml'
    path.write_text(CELL)
    return tuple(XmlParser().parse(str(path)).devices)


def whole_bags(folder: Path) -> Dict[str, bytes]:
    """Bags without a damage, by what they are."""
    bags = {}
    for compression in ('none', 'bz2', 'lz4'):
        for chunk_bytes in (_SMALL_CHUNK_BYTES, 1 << 20):
            path = folder / 'whole.bag'
            with rosbag.Bag(str(path), 'w', compression=compression,
                            chunk_threshold=chunk_bytes) as bag:
                for topic, message, time_s, header in _messages():
                    header.update(type=message._type, md5sum=message._md5sum, topic=topic,
                                  message_definition=message._full_text)
                    bag.write(topic, message, _time(time_s), connection_header=header)
            data = bags[f'{compression} {chunk_bytes}'] = path.read_bytes()
            bags[f'{compression} {chunk_bytes} without index'] = without_index(data)
    return bags


def without_index(data: bytes) -> bytes:
    """A bag as a recorder leaves it that was killed."""
    at = data.index(b'index_pos=') + len(b'index_pos=')
    end = int.from_bytes(data[at:at + 8], 'little')
    return data[:at] + bytes(8) + data[at + 8:end]


def _time(time_s: float) -> Time:
    return Time(*divmod(BEGIN_S * 10 ** 9 + round(time_s * 1e9), 10 ** 9))


def _messages() -> Iterator[Tuple[str, Any, float, Dict[str, str]]]:
    """Topic, message, time, and what its publisher said beside the usual."""
    configuration = {'file': '/c/cell.xml', 'files': {'/c/cell.xml': CELL}, 'arguments': {'a': '1'}}
    latched = {'latching': '1', 'callerid': '/node'}
    yield CONFIGURATION, String(json.dumps(configuration)), 0.0, dict(latched)
    yield '/tf_static', TFMessage([_transform('world', 'ur/link0', 0.0)]), 0.0, dict(latched)
    yield '/tf_static', TFMessage([_transform('world', 'r2/link0', 0.0)]), 0.0, {
        'latching': '1', 'callerid': '/other'}
    yield '/markers', MarkerArray([Marker(ns='a', id=3)]), 0.1, dict(latched)
    for number in range(30):
        yield from _cycle(number, 0.1 * number)
    yield MARKS, String('the seam tears'), 1.5, dict(latched)
    account = {'topics': {'/ft': {'received': 30, 'dropped': 0}},
               'clock_jumps': [{'time': BEGIN_S + 1.0, 'seconds': -0.5}]}
    yield ACCOUNT, String(json.dumps(account)), 3.1, dict(latched)


def _cycle(number: int, time_s: float) -> Iterator[Tuple[str, Any, float, Dict[str, str]]]:
    pose, wrench, joints = PoseStamped(), WrenchStamped(), JointState()
    for message in (pose, wrench, joints):
        message.header.seq, message.header.stamp = number, _time(time_s)
        message.header.frame_id = 'ur/link0'
    pose.pose.position.x = wrench.wrench.force.y = 0.1 * time_s
    joints.name, joints.position = ['a', 'b'], [0.1, time_s]
    odd_publisher = {'callerid': f'/publisher{number % 2}'}
    yield '/tcf', pose, time_s, {}
    yield '/wrench', wrench, time_s, {}
    yield '/joints', joints, time_s, {}
    yield '/ft', Float32MultiArray(data=[0.0, time_s, 1.0]), time_s, odd_publisher
    yield '/edge', UInt16(number), time_s, {}
    yield '/tf', TFMessage([_transform('a', 'b', time_s), _transform('r2/link0', 'r2/tool',
                                                                     time_s)]), time_s, {}


def _transform(parent: str, child: str, time_s: float) -> TransformStamped:
    transform = TransformStamped(child_frame_id=child)
    transform.header.frame_id, transform.header.stamp = parent, _time(time_s)
    transform.transform.translation.x = 0.1 * time_s
    transform.transform.rotation.w = 1.0
    return transform


def damaged(bags: Dict[str, bytes], number: int) -> Damaged:
    """The damaged bag with this number."""
    chance = random.Random(number)
    names = sorted(bags)
    name = chance.choice([*names, *(it for it in names if 'without' not in it)])
    data, story = bytes(bags[name]), [name]
    for _ in range(chance.choice((1, 1, 1, 2, 3, 6))):
        if len(data) < _LEAST_BYTES:
            break
        change = chance.choice(_CHANGES)
        data = change(chance, data)
        story.append(change.__name__)
    return Damaged(data, ', '.join(story))


def change_bytes(chance: random.Random, data: bytes) -> bytes:
    """Change some bytes anywhere."""
    changed = bytearray(data)
    for _ in range(chance.randint(1, 8)):
        value = chance.choice((0, 1, 0x7f, 0x80, 0xff, chance.randrange(256)))
        changed[_place(chance, data)] = value
    return bytes(changed)


def change_bit(chance: random.Random, data: bytes) -> bytes:
    """Change one bit."""
    changed = bytearray(data)
    changed[_place(chance, data)] ^= 1 << chance.randrange(8)
    return bytes(changed)


def change_number(chance: random.Random, data: bytes) -> bytes:
    """Change four bytes, as of a length, a count or an offset, anywhere."""
    return _with_number(chance, data, _place(chance, data))


def change_length(chance: random.Random, data: bytes) -> bytes:
    """Change the length of a record's header, of its data, or of a field."""
    places = [at for record, begin in _records(data) for at in _lengths(data, record, begin)]
    return _with_number(chance, data, chance.choice(places)) if places else data


def change_field(chance: random.Random, data: bytes) -> bytes:
    """Change the value of a field of a record outside of the chunks."""
    places = [data.find(b'=', begin, record.end) + 1 for record, begin in _records(data)[1:]]
    return _with_number(chance, data, chance.choice(places)) if places else data


def change_content(chance: random.Random, data: bytes) -> bytes:
    """Change something inside a chunk, and compress it again where it was."""
    chunks = [found for found in _records(data) if found[0].fields.get(b'op') == bytes([OP_CHUNK])]
    if not chunks:
        return data
    record, _ = chance.choice(chunks)
    pack, unpack = _PACKERS.get(record.fields.get(b'compression', b''), (bytes, bytes))
    try:
        content = unpack(bytes(record.data))
    except (OSError, RuntimeError, ValueError, EOFError):
        return data  # damaged already
    content = chance.choice((change_bytes, change_bit, change_number, change_text))(chance, content)
    packed = pack(content)
    begin = record.end - len(record.data)
    return data[:begin - 4] + struct.pack('<I', len(packed)) + packed + data[record.end:]


def change_text(chance: random.Random, data: bytes) -> bytes:
    """Change a text inside a record: of a definition, of JSON, of a name."""
    words = (b'uint32', b'float64', b'Header', b'MSG:', b'std_msgs/', b'time', b'"topics"',
             b'"time"', b'-0.5', b'"file"', b'position', b'[]', b'\n', b'=====', b'/tf',
             b'sensor_msgs', b'md5sum')
    others = (b'string', b'time[] ', b'x' * 200, b'', b'NaN', b'Infinity', b'[' * 50, b'\xff\xfe',
              b'1e999', b'\0', b'"', b'{', b'geometry_msgs/Pose', b'uint8[4294967]', b'stamp')
    word = chance.choice(words)
    at = data.find(word, chance.randrange(len(data) + 1))
    if at < 0:
        return data
    other = chance.choice(others)
    if chance.random() < 0.7:
        other = other[:len(word)].ljust(len(word), b' ')  # so that all else stays in its place
    return data[:at] + other + data[at + len(word):]


def cut_off(chance: random.Random, data: bytes) -> bytes:
    """Cut the end off."""
    return data[:_place(chance, data)]


def take_out(chance: random.Random, data: bytes) -> bytes:
    """Take a part out."""
    at = _place(chance, data)
    return data[:at] + data[at + chance.choice((1, 4, 100, 5000)):]


def put_in(chance: random.Random, data: bytes) -> bytes:
    """Put bytes in."""
    at = _place(chance, data)
    count = chance.choice((1, 4, 100))
    return data[:at] + bytes(chance.randrange(256) for _ in range(count)) + data[at:]


def swap_records(chance: random.Random, data: bytes) -> bytes:
    """Let two records behind the header of the bag change places."""
    places = [(begin, record.end) for record, begin in _records(data)[1:]]
    if len(places) < 2:
        return data
    (a, b), (c, d) = sorted(chance.sample(places, 2))
    return data[:a] + data[c:d] + data[b:c] + data[a:b] + data[d:]


def repeat_record(chance: random.Random, data: bytes) -> bytes:
    """Let a record stand there twice."""
    places = [(begin, record.end) for record, begin in _records(data)[1:]]
    begin, end = chance.choice(places) if places else (0, 0)
    return data[:end] + data[begin:]


_CHANGES: Tuple[Callable[[random.Random, bytes], bytes], ...] = (
    change_bytes, change_bit, change_number, change_length, change_field, change_content,
    change_content, change_content, change_text, cut_off, take_out, put_in, swap_records,
    repeat_record)
_PACKERS: Dict[bytes, Tuple[Callable[[bytes], bytes], Callable[[bytes], bytes]]] = {
    b'bz2': (bz2.compress, bz2.decompress), b'lz4': (lz4.frame.compress, lz4.frame.decompress)}


def _records(data: bytes) -> List[Tuple[Record, int]]:
    """The records of a bag, and where each begins; up to the first that is damaged."""
    found, at, view = [], len(MAGIC), memoryview(data)
    while at < len(data):
        try:
            record = record_at(view, at)
        except ValueError:
            break
        found.append((record, at))
        at = record.end
    return found


def _lengths(data: bytes, record: Record, begin: int) -> List[int]:
    """Where the lengths of a record are: of its header, its fields, its data."""
    header_end = begin + 4 + int.from_bytes(data[begin:begin + 4], 'little')
    found, at = [begin, header_end], begin + 4
    while at < header_end:
        found.append(at)
        at += 4 + int.from_bytes(data[at:at + 4], 'little')
    return found


def _with_number(chance: random.Random, data: bytes, place: int) -> bytes:
    old = int.from_bytes(data[place:place + 4], 'little')
    new = chance.choice((*_ODD, old + 1, old - 1, old * 2, old ^ 1 << chance.randrange(32)))
    return data[:place] + struct.pack('<I', new % (1 << 32)) + data[place + 4:]


def _place(chance: random.Random, data: bytes) -> int:
    """A place outside of the filling behind the header of the bag, which nothing reads."""
    if len(data) < 4200 or chance.random() < 0.05:
        return chance.randrange(max(1, min(len(data), 120)))
    return chance.randrange(4100, len(data))


def read_all(path: Path, its_devices: Tuple[Device, ...]) -> List[str]:
    """Do with a bag all that there is; return the project's own errors.

    Raises:
        Exception: any other; that is what is looked for.
    """
    errors = []
    for read in (_read_messages, _read_events, _report, _catalogue,
                 lambda it: read_curves([it], its_devices, 50),
                 lambda it: _position_values(it, its_devices), _reindex):
        try:
            with warnings.catch_warnings():
                warnings.simplefilter('error')
                read(str(path))
        except BagError as error:
            assert str(error).startswith(str(path.parent)), error
            errors.append(str(error))
    return errors


def _read_messages(path: str) -> None:
    with Recording([path]) as recording:
        loader = MessageLoader(recording)
        for position in range(len(recording.index)):
            message = loader.load(position)
            if message is not None:
                with_stamps_moved(message.data, message.stamp_offsets, lambda stamp_ns: 1)
        topic_messages(recording, range(len(recording.index.connections)), recording.begin_ns,
                       recording.end_ns, 1 << 30)
        assert all(path in problem or problem.startswith(loader_topics(recording))
                   for problem in loader.problems)


def loader_topics(recording: Recording) -> Tuple[str, ...]:
    return tuple(it.topic for it in recording.index.connections)


def _read_events(path: str) -> None:
    with Recording([path]) as recording:
        index = recording.index
        events = EventMaker(index, MessageLoader(recording), recording.begin_ns)
        for position in range(0, len(index), max(1, len(index) // 20)):
            for event in (events.forward(position), events.backward(position),
                          events.scene(position), events.scene(position + 1, True)):
                assert event.size > 0


def _report(path: str) -> None:
    with Recording([path]) as recording:
        report = make_report(recording)
        assert as_text(report).encode()
        assert as_json(report).encode()
        read_marks(recording)
        configuration = recorded_configuration(recording)
    if configuration is not None:
        # a file system does not have every name
        with tempfile.TemporaryDirectory() as folder, contextlib.suppress(OSError):
            write_configuration(configuration, folder)


def _position_values(path: str, its_devices: Tuple[Device, ...]) -> None:
    values = PositionValues([path], its_devices)
    try:
        for position_s in (0.0, 1.0, 1.05, 3.0):
            values.at(position_s)
    finally:
        values.close()


def _catalogue(path: str) -> None:
    catalogue = read_catalogue([path])
    assert all(path in problem for problem in catalogue.problems)


def _reindex(path: str) -> None:
    copy = reindex(path)
    with Recording([copy.path]) as recording:
        assert not recording.gaps
        assert len(recording.index) == copy.message_count
    _read_messages(copy.path)


def main(first: int, count: int) -> None:
    """Read so many damaged bags; print what raises something else or takes long."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        bags, its_devices = whole_bags(folder), devices(folder)
        path = folder / 'a.bag'
        failed = refused = 0
        for number in range(first, first + count):
            bag = damaged(bags, number)
            path.write_bytes(bag.data)
            begin_s = time.process_time()
            try:
                refused += bool(read_all(path, its_devices))
            except Exception as error:  # what is looked for
                failed += 1
                print(number, bag.story, repr(error)[:300], _where(error), flush=True)
            if time.process_time() - begin_s > 2.0:
                print(number, bag.story, f'{time.process_time() - begin_s:.1f} s', flush=True)
        print(f'{count} damaged bags: {refused} refused in some way, {failed} failed')


def _where(error: BaseException) -> str:
    trace = error.__traceback__
    places = []
    while trace is not None:
        code = trace.tb_frame.f_code
        places.append(f'{os.path.basename(code.co_filename)}:{trace.tb_lineno}')
        trace = trace.tb_next
    return ' '.join(places[-4:])


if __name__ == '__main__':
    main(*map(int, sys.argv[1:3]))
