# SPDX-License-Identifier: BSD-3-Clause
"""Compares our definitions, checksums, values and chunks with those of the library rosbags.

usage: python3 bench/own_parts.py [--runs 5]    (in the workspace)

All installed message types are parsed and their checksums computed; so are some unusual
definitions that are valid in ROS. Messages are read for the first time, which includes their
definition, and then again; and damaged in thousands of ways. Moving the stamps in the bytes of a
message is compared with reading, changing and writing it with rosbags, and for a picture with a
copy of its bytes: a row that ends with (!) is slower. The last row is a chunk of 530 bytes that
holds 700 MB, though its header says 1 kB: its figure is the memory used. Medians of the runs.
"""
from __future__ import annotations

import argparse
import bz2
import io
import random
import statistics
import subprocess
import sys
import time
from collections import Counter
from importlib import import_module
from pathlib import Path
from typing import Any, Callable, Dict, Iterator, List, Tuple

import genpy.dynamic
from geometry_msgs.msg import TransformStamped, WrenchStamped
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from rosbags.typesys.msg import normalize_msgtype
from sensor_msgs.msg import Image, JointState
from tf2_msgs.msg import TFMessage

from process_visualizer.bagio.message_definition import definition_checksum, parse_definitions
from process_visualizer.bagio.message_layout import StampLocator
from process_visualizer.bagio.message_values import message_values

_UNUSUAL = ('uint8 kIdle=0\nuint8 state', 'float64 EPS=1e-3\nfloat64 x', 'float64 X=1.50\nint8 x',
            'int8 A=+3\nint8 b', 'uint8 A=007\nint8 b', 'int32 x\r\nint32 y\r\n',
            'string S="quoted"\nint8 a', 'bool T=True\nbool a', 'time t\nduration[2] d')
_DAMAGES = 3000
_WILD = (b'\xff\xff\xff\xff', b'\xff\xff\xff\x7f', b'\0\0\0\x10')
_REPEATS = 200
_PICTURE_BYTES = 20_000_000
_BOMB_BYTES = 700 << 20
_BOMBS = {
    'ours': 'from process_visualizer.bagio.chunk_store import Chunk, decompressed\n'
            'from process_visualizer.bagio.bag_errors import RecordError\n'
            'try: decompressed(data, Chunk(0, len(data), "bz2", 1000))\n'
            'except RecordError: pass',
    'rosbags': 'from rosbags.rosbag1.reader import bz2_decompress\nbz2_decompress(data)'}
_MEMORY = """
import resource, sys
data = sys.stdin.buffer.read()
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
{}
print((resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before) / 1024)
"""
Reader = Callable[[bytes], Any]


def main() -> None:
    parser = argparse.ArgumentParser(description='Our parts beside those of rosbags.')
    parser.add_argument('--runs', type=int, default=5)
    runs = parser.parse_args().runs
    types = list(_installed_types())
    right = _md5_of_rosbags, lambda kind, text: definition_checksum(kind, text)
    print(f'{len(types)} types, right checksums (rosbags, ours):',
          *(sum(md5(it._type, it._full_text) == it._md5sum for it in types) for md5 in right))
    print(f'{len(_UNUSUAL)} unusual definitions:',
          *(sum(_is_right(md5, text) for text in _UNUSUAL) for md5 in right))
    _print('parse a definition, ms', *_in_pairs(
        runs, 1, *(lambda parse=parse: [parse(it._type, it._full_text) for it in types]
                   for parse in (lambda kind, text: get_types_from_msg(text, kind),
                                 parse_definitions))), 1e3 / len(types))
    for message in (JointState(name=['joint'] * 7, position=[0.1] * 7), WrenchStamped(), _frames()):
        _compare_readers(message, runs)
    _move_stamps(runs)
    for name, code in _BOMBS.items():
        print(f'memory for the chunk, MB, {name}: {_memory_mb(code):.0f}')


def _installed_types() -> Iterator[Any]:
    for folder in sorted({str(Path(it) / 'geometry_msgs') for it in sys.path}):
        for path in sorted(Path(folder).parent.glob('*/msg/_[A-Z]*.py')):
            yield getattr(import_module(f'{path.parts[-3]}.msg'), path.stem[1:])


def _store(kind: str, text: str) -> Any:
    store = get_typestore(Stores.EMPTY)
    store.register(get_types_from_msg(text, kind))
    return store


def _md5_of_rosbags(kind: str, text: str) -> str:
    return str(_store(kind, text).generate_msgdef(normalize_msgtype(kind))[1])


def _is_right(md5: Callable[[str, str], str], text: str) -> bool:
    try:
        return md5('p/M', text) == genpy.dynamic.generate_dynamic('p/M', text)['p/M']._md5sum
    except Exception as error:  # whatever exception a library raises is a figure here
        print(f'  {text!r}: {type(error).__name__}')
        return False


def _frames() -> TFMessage:
    found = TFMessage()
    for number in range(8):
        transform = TransformStamped(child_frame_id=f'link{number + 1}')
        transform.header.frame_id, transform.transform.rotation.w = f'link{number}', 1.0
        found.transforms.append(transform)
    return found


def _readers(kind: str, text: str) -> Tuple[Reader, Reader]:
    store, name, definitions = _store(kind, text), normalize_msgtype(kind), []
    definitions.append(parse_definitions(kind, text))
    return (lambda data: store.deserialize_ros1(data, name),
            lambda data: message_values(kind, definitions[0], data))


def _compare_readers(message: Any, runs: int) -> None:
    kind, text, data = message._type, message._full_text, _serialized(message)

    def first_of_rosbags() -> None:
        _store(kind, text).deserialize_ros1(data, normalize_msgtype(kind))

    _print(f'{kind}, first, ms', *_in_pairs(
        runs, 1, first_of_rosbags,
        lambda: message_values(kind, parse_definitions(kind, text), data)), 1e3)
    readers = _readers(kind, text)
    _print(f'{kind}, then, us', *_in_pairs(
        runs, _REPEATS, *(lambda read=read: read(data) for read in readers)), 1e6)
    for name, read in zip(('rosbags', 'ours'), readers):
        print(f'  damaged, {name}:', dict(_damaged(read, data)))


def _move_stamps(runs: int) -> None:
    def with_rosbags() -> Any:
        message = store.deserialize_ros1(small, name)
        message.header.stamp.sec += 1
        return store.serialize_ros1(message, name)

    kind, name = WrenchStamped._type, normalize_msgtype(WrenchStamped._type)
    store, small = _store(kind, WrenchStamped._full_text), _serialized(_stamped(WrenchStamped()))
    locator = StampLocator(kind, WrenchStamped._full_text)
    _judge('stamp of a wrench moved, us: rosbags', *_in_pairs(
        runs, _REPEATS, with_rosbags, lambda: locator.moved(small, _later)), 1e6)
    large = _serialized(_stamped(Image(data=bytes(_PICTURE_BYTES))))
    pictures = StampLocator(Image._type, Image._full_text)
    copy_s, move_s = _in_pairs(runs, 5, lambda: bytearray(large),
                               lambda: pictures.moved(large, _later))
    _judge('stamp of a picture of 20 MB moved, ms: 2 copies', 2.0 * copy_s, move_s, 1e3)


def _stamped(message: Any) -> Any:
    message.header.stamp.secs = 5
    return message


def _serialized(message: Any) -> bytes:
    buffer = io.BytesIO()
    message.serialize(buffer)
    return buffer.getvalue()


def _later(stamp_ns: int) -> int:
    return stamp_ns + 10 ** 9


def _judge(what: str, limit_s: float, ours_s: float, scale: float) -> None:
    """Print a row; one that is slower than its peer is marked."""
    print(f'{what} {limit_s * scale:.3f}, ours {ours_s * scale:.3f}'
          f'{" (!)" if ours_s > limit_s else ""}')


def _in_pairs(runs: int, repeats: int, *calls: Callable[[], Any]) -> List[float]:
    """Return the median time [s] of each of the calls, made in turn."""
    times: Dict[int, List[float]] = {number: [] for number in range(len(calls))}
    for _ in range(runs):
        for number, call in enumerate(calls):
            begin = time.perf_counter()
            for _ in range(repeats):
                call()
            times[number].append((time.perf_counter() - begin) / repeats)
    return [statistics.median(it) for it in times.values()]


def _print(what: str, rosbags_s: float, ours_s: float, scale: float) -> None:
    print(f'{what}: rosbags {rosbags_s * scale:.3f}, ours {ours_s * scale:.3f}')


def _damaged(read: Reader, data: bytes) -> 'Counter[str]':
    """Return the results for messages that are cut off, or contain wild numbers."""
    found: Counter[str] = Counter()
    chance = random.Random(3)
    for number in range(_DAMAGES):
        damaged, at = bytearray(data), chance.randrange(len(data) - 4)
        damaged[at:at + 4] = chance.choice(_WILD)
        try:
            read(bytes(damaged[:at] if number % 3 == 0 else damaged))
            found['read'] += 1
        except Exception as error:  # as above
            found[type(error).__name__] += 1
    return found


def _memory_mb(code: str) -> float:
    done = subprocess.run([sys.executable, '-c', _MEMORY.format(code)], check=True,
                          input=bz2.compress(bytes(_BOMB_BYTES)), stdout=subprocess.PIPE)
    return float(done.stdout)


if __name__ == '__main__':
    main()
