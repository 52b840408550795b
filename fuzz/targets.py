# SPDX-License-Identifier: BSD-3-Clause
"""The targets, their inputs, which are random changes of good ones, and their permitted refusals.

Each input is determined by its number, so that a failure can be reproduced.
"""
from __future__ import annotations

import math
import random
import re
import struct
import sys
import tempfile
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Callable, List, NamedTuple, Tuple

_ROOT = Path(__file__).parents[1]
sys.path[:0] = [str(_ROOT / 'test' / 'unit' / folder) for folder in ('bags', 'cell')]

from bad_input import BAD_INPUT  # noqa: E402
from bags_fake_clock import FakeClock  # noqa: E402
from every_reader import read_all  # noqa: E402
from geometry_msgs.msg import (  # noqa: E402
    PoseStamped,
    TransformStamped,
    TwistStamped,
    WrenchStamped,
)
from message_readers import MESSAGES, readers, serialized  # noqa: E402
from mutated_bags import damaged  # noqa: E402
from small_bags import devices, whole_bags  # noqa: E402
from std_msgs.msg import Float32MultiArray  # noqa: E402

from process_visualizer.bagio.json_text import parsed_json  # noqa: E402
from process_visualizer.bagio.message_definition import (  # noqa: E402
    DefinitionError,
    parse_definitions,
)
from process_visualizer.bagio.message_layout import StampLocator  # noqa: E402
from process_visualizer.cell.errors import ConfigurationError  # noqa: E402
from process_visualizer.cell.stored_configuration import stored_configuration  # noqa: E402
from process_visualizer.cell.xml_parser import XmlParser  # noqa: E402
from process_visualizer.nodes.robot.message_reader import (  # noqa: E402
    POSE_DECODERS,
    WRENCH_DECODERS,
)
from process_visualizer.playback.player_control import PlayerControl  # noqa: E402
from process_visualizer.playback.timeline import CommandRefused, Timeline  # noqa: E402
from process_visualizer.robot.frames import Frame, FrameTree  # noqa: E402

Fed = Callable[[int], bool]
"""Takes the number of an input; returns whether it was refused, and raises on a failure."""
_WILD = (0.0, -0.0, 1e-9, -1e-9, 1.0, -1.0, 1e9, 1e18, 1e38, -1e308, 1e308, math.inf, -math.inf,
         math.nan, 5e-324, 2.0 ** 63, -2.0 ** 63)
_ODD_BYTES = (b'', b'\0', b'\xff', b'\xff\xff\xff\xff', b'\xff\xff\xff\x7f', b'\0\0\0\x80',
              b'\xc3\x28', b'$(eval 1)', b'&x;', b'<!--', b']]>', b'<a ', b'"', b"'", b'>',
              b'\xe2\x80\xae', b'\x1b[31m', b'1e999', b'NaN', b'..', b'/', b'~', b'{', b'[' * 60)


class Target(NamedTuple):
    """A target: its name, its share of the inputs, and the function that feeds it."""

    name: str
    share: float
    begin: Callable[[Path], Fed]


def configurations(folder: Path) -> Fed:
    """Feed the parser of configurations: whole files with random changes, and words of others."""
    whole = [it.text for it in BAD_INPUT]
    whole += [path.read_text() for path in (
        _ROOT / 'devices.xml', _ROOT / 'sewing_cell' / 'devices' / 'simulated.xml',
        _ROOT / 'test' / 'data' / 'listing_5_1.xml')]
    words = sorted(set(re.findall(r'[\w.$()/-]+|"[^"]*"|<[^<>]*>', '\n'.join(whole))))
    path = folder / 'cell.xml'

    def feed(number: int) -> bool:
        chance = random.Random(number)
        text = chance.choice(whole)
        for _ in range(chance.choice((1, 1, 2, 4, 10))):
            text = _changed_text(chance, text, words)
        path.write_bytes(_changed(chance, text.encode()) if chance.random() < 0.3
                         else text.encode())
        try:
            XmlParser().parse(str(path))
        except ConfigurationError:
            return True
        return False

    return feed


def bags(folder: Path) -> Fed:
    """Feed everything that reads bags."""
    whole, its_devices, path = whole_bags(folder), devices(folder), folder / 'a.bag'

    def feed(number: int) -> bool:
        path.write_bytes(damaged(whole, number).data)
        return bool(read_all(path, its_devices))

    return feed


def messages(_folder: Path) -> Fed:
    """Feed every reader of messages as bytes, in playback, curves, tables and nodes."""
    fed: List[Tuple[bytes, Callable[[bytes], Any]]] = []
    for message in MESSAGES:
        fed += [(serialized(message), read) for read in readers(message).values()]
    for message, decoders in ((PoseStamped(), POSE_DECODERS),
                              (Float32MultiArray(data=[1.0] * 7), POSE_DECODERS),
                              (WrenchStamped(), WRENCH_DECODERS),
                              (Float32MultiArray(data=[1.0] * 6), WRENCH_DECODERS)):
        fed.append((serialized(message), decoders[message._type]))
    fed += [(serialized(it), StampLocator(it._type, it._full_text).offsets)
            for it in (TwistStamped(), TransformStamped())]

    def feed(number: int) -> bool:
        chance = random.Random(number)
        data, read = chance.choice(fed)
        try:
            read(_changed(chance, data))
        except (MemoryError, RecursionError, AssertionError, SystemError):
            raise
        except Exception:  # any exception; each reader's own test checks the kind
            return True
        return False

    return feed


def definitions(_folder: Path) -> Fed:
    """Feed the parser of message definitions, as a publisher or a bag provides them."""
    whole = [(it._type, it._full_text) for it in MESSAGES]
    words = sorted({word for _, text in whole for word in text.split()})

    def feed(number: int) -> bool:
        chance = random.Random(number)
        kind, text = chance.choice(whole)
        for _ in range(chance.choice((1, 2, 5))):
            text = _changed_text(chance, text, words)
        try:
            parse_definitions(kind, text)
            StampLocator(kind, text)
        except DefinitionError:
            return True
        return False

    return feed


def stored(_folder: Path) -> Fed:
    """Feed the reader of the configuration in a bag or on a parameter server: JSON."""
    whole = (b'{"file": "a.xml", "files": {"a.xml": "<visualizer/>"}, "arguments": {"a": "1"}, '
             b'"path": "/home/a/a.xml", "texts": {}}')

    def feed(number: int) -> bool:
        chance = random.Random(number)
        try:
            stored_configuration(parsed_json(_changed(chance, whole).decode('utf-8', 'replace')))
        except (TypeError, AttributeError, ValueError):
            return True
        return False

    return feed


def requests(_folder: Path) -> Fed:
    """Feed the player's commands and ``~set_frame`` with any numbers, in any order."""
    playback: Any = SimpleNamespace(not_begun=lambda position_ns: ())  # all topics have begun
    control = PlayerControl(Timeline(0, 10 ** 10, FakeClock()), playback)
    tree = FrameTree([Frame('world', name, (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)) for name in 'abc'])

    def feed(number: int) -> bool:
        chance = random.Random(number)

        def any_number() -> float:
            return chance.choice((*_WILD, chance.uniform(-20.0, 20.0)))

        acts: List[Callable[[], Any]] = [
            lambda: control.seek(any_number()), lambda: control.seek_by(any_number()),
            lambda: control.set_rate(any_number()), control.toggle_paused, control.play,
            lambda: control.set_loop(chance.random() < 0.8, any_number(), any_number()),
            lambda: tree.move(chance.choice(('', 'a', 'b', 'c', 'd', 'world')),
                              chance.choice(('a', 'b', 'c', 'd', 'world', '')),
                              (any_number(), any_number(), any_number()),
                              (any_number(), any_number(), any_number()), {'a': 'b'})]
        try:
            chance.choice(acts)()
        except (CommandRefused, ValueError):
            return True
        finally:
            status = control.status()
            assert math.isfinite(status.position_s) and math.isfinite(status.rate), status
            _assert_no_loop(tree)
        return False

    return feed


def _assert_no_loop(tree: FrameTree) -> None:
    parents = {frame.child: frame.parent for frame in tree.frames()}
    for name in parents:
        for _ in range(len(parents) + 1):
            name = parents.get(name, '')
        assert not name, parents


TARGETS: Tuple[Target, ...] = (
    Target('messages', 0.56, messages), Target('requests', 0.25, requests),
    Target('stored', 0.13, stored), Target('definitions', 0.045, definitions),
    Target('configurations', 0.014, configurations), Target('bags', 0.001, bags))
"""The slowest target is the last one."""


def _changed(chance: random.Random, data: bytes) -> bytes:
    """Change bytes or a number of four, remove, insert or repeat a piece, or cut the end off."""
    for _ in range(chance.choice((1, 1, 1, 2, 4, 8))):
        at = chance.randrange(len(data) + 1)
        end = at + chance.choice((0, 1, 4, 8, 50))
        kind = chance.randrange(6)
        if kind == 0:
            data = data[:at] + bytes([chance.randrange(256)]) + data[at + 1:]
        elif kind == 1:
            data = data[:at] + struct.pack('<I', chance.choice(
                (0, 1, 255, 65535, 1 << 24, 0x0fffffff, 0xffffffff, len(data)))) + data[at + 4:]
        elif kind == 2:
            data = data[:at] + data[end:]
        elif kind == 3:
            data = data[:at] + chance.choice(_ODD_BYTES) + data[at:]
        elif kind == 4:
            data = data[:end] + data[at:]
        else:
            data = data[:at]
    return data


def _changed_text(chance: random.Random, text: str, words: List[str]) -> str:
    """Replace words by others, insert others between them, or leave some out."""
    at = chance.randrange(len(text) + 1)
    found = re.compile(r'[\w.$()/-]+|"[^"]*"|<[^<>]*>').search(text, at)
    begin, end = found.span() if found is not None else (at, at)
    other = chance.choice(words) if chance.random() < 0.8 else \
        chance.choice(_ODD_BYTES).decode('utf-8', 'replace')
    kind = chance.randrange(4)
    if kind == 0:
        return text[:begin] + text[end:]
    if kind == 1:
        return text[:end] + ' ' + other + text[end:]
    if kind == 2:
        return text[:end] + text[begin:]
    return text[:begin] + other + text[end:]


def temporary_folder() -> 'tempfile.TemporaryDirectory[str]':
    """Return a folder for the files of one target."""
    return tempfile.TemporaryDirectory(prefix='fuzz-')
