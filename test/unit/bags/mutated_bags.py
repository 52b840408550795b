# SPDX-License-Identifier: BSD-3-Clause
"""Small bags of every kind, damaged at random; the number of a bag determines its damage.

As a program it tests many: `python3 mutated_bags.py FIRST COUNT`.
"""
from __future__ import annotations

import bz2
import os
import random
import struct
import sys
import tempfile
import time
from pathlib import Path
from typing import Callable, Dict, List, NamedTuple, Tuple

import lz4.frame
from every_reader import read_all
from small_bags import devices, whole_bags

from process_visualizer.bagio.bag_file import MAGIC, OP_CHUNK, Record, record_at

_ODD = (0, 1, 2, 4, 11, 12, 127, 128, 255, 256, 4096, 65_535, 1 << 20, (1 << 31) - 1, 1 << 31,
        (1 << 32) - 1)
_MIN_BYTES = 100


class Damaged(NamedTuple):
    """Damaged bag: its bytes and the kind of damage."""

    data: bytes
    story: str


def damaged(bags: Dict[str, bytes], number: int) -> Damaged:
    """The damaged bag with this number."""
    chance = random.Random(number)
    names = sorted(bags)
    name = chance.choice([*names, *(it for it in names if 'without' not in it)])
    data, story = bytes(bags[name]), [name]
    for _ in range(chance.choice((1, 1, 1, 2, 3, 6))):
        if len(data) < _MIN_BYTES:
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
    """Change four bytes anywhere, as of a length, a count or an offset."""
    return _with_number(chance, data, _place(chance, data))


def change_length(chance: random.Random, data: bytes) -> bytes:
    """Change the length of a record's header, of its data, or of a field."""
    places = [at for record, begin in _records(data) for at in _lengths(data, record, begin)]
    return _with_number(chance, data, chance.choice(places)) if places else data


def change_field(chance: random.Random, data: bytes) -> bytes:
    """Change the value of a field of a record outside the chunks."""
    places = [data.find(b'=', begin, record.end) + 1 for record, begin in _records(data)[1:]]
    return _with_number(chance, data, chance.choice(places)) if places else data


def change_content(chance: random.Random, data: bytes) -> bytes:
    """Change something inside a chunk and compress it again in the same position."""
    chunks = [found for found in _records(data) if found[0].fields.get(b'op') == bytes([OP_CHUNK])]
    if not chunks:
        return data
    record, _ = chance.choice(chunks)
    pack, unpack = _PACKERS.get(record.fields.get(b'compression', b''), (bytes, bytes))
    try:
        content = unpack(bytes(record.data))
    except (OSError, RuntimeError, ValueError, EOFError):
        return data  # already damaged
    content = chance.choice((change_bytes, change_bit, change_number, change_text))(chance, content)
    packed = pack(content)
    begin = record.end - len(record.data)
    return data[:begin - 4] + struct.pack('<I', len(packed)) + packed + data[record.end:]


def change_text(chance: random.Random, data: bytes) -> bytes:
    """Change a text inside a record: in a definition, in JSON or in a name."""
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
        other = other[:len(word)].ljust(len(word), b' ')  # keeps the length, and so all positions
    return data[:at] + other + data[at + len(word):]


def cut_off(chance: random.Random, data: bytes) -> bytes:
    """Cut off the end."""
    return data[:_place(chance, data)]


def take_out(chance: random.Random, data: bytes) -> bytes:
    """Remove a part."""
    at = _place(chance, data)
    return data[:at] + data[at + chance.choice((1, 4, 100, 5000)):]


def put_in(chance: random.Random, data: bytes) -> bytes:
    """Insert bytes."""
    at = _place(chance, data)
    count = chance.choice((1, 4, 100))
    return data[:at] + bytes(chance.randrange(256) for _ in range(count)) + data[at:]


def swap_records(chance: random.Random, data: bytes) -> bytes:
    """Swap two records after the bag header."""
    places = [(begin, record.end) for record, begin in _records(data)[1:]]
    if len(places) < 2:
        return data
    (a, b), (c, d) = sorted(chance.sample(places, 2))
    return data[:a] + data[c:d] + data[b:c] + data[a:b] + data[d:]


def repeat_record(chance: random.Random, data: bytes) -> bytes:
    """Duplicate a record."""
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
    """The records of a bag and their positions, up to the first damaged one."""
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
    """Positions of the lengths in a record: of its header, its fields and its data."""
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
    """A position outside the padding after the bag header, which nothing reads."""
    if len(data) < 4200 or chance.random() < 0.05:
        return chance.randrange(max(1, min(len(data), 120)))
    return chance.randrange(4100, len(data))


def main(first: int, count: int) -> None:
    """Read this many damaged bags; print those that raise other errors or take long."""
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
            except Exception as error:  # this is what the program looks for
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
