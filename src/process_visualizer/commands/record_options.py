# SPDX-License-Identifier: BSD-3-Clause
"""The command line of ``cell record``: the options of `rosbag record`, and some of its own."""
from __future__ import annotations

import argparse
import os
from dataclasses import dataclass
from typing import Any, List, Optional, Tuple

from process_visualizer.cell.values import positive
from process_visualizer.clients.recording_options import RecordingOptions

_UNITS_S = {'s': 1.0, 'm': 60.0, 'h': 3600.0}
_WITHOUT_LIMIT_MB = 1_000_000
_NOT_OFFERED = {
    ('-j', '--bz2'): '--lz4 compresses while recording, and "rosbag compress" a finished bag',
    ('--max-splits',): 'nothing that was recorded is deleted; to keep what just happened, use the '
                       "recorder's memory (the service ~save_recent)",
    ('-l', '--limit'): 'end a recording with --duration or --size',
    ('--chunksize',): 'a chunk has 1 MB, or what arrives in half a second',
    ('--udp',): 'messages lost on the way would go unnoticed',
    ('-p', '--publish'): 'the topic ~state of the recorder says when it records',
}


@dataclass(frozen=True)
class RecordOptions:
    """The choice of what to record, and until when.

    ``recording`` has the topics of the command line; those of the configuration's devices and of a
    node are added.
    """

    config: Optional[str]  # the configuration file
    devices: Optional[str]  # A,B; None: all of the configuration
    node: str  # whose subscriptions are recorded; '': nobody's
    recording: RecordingOptions
    size_bytes: int  # at which the recording ends; 0: none
    duration_s: float  # after which it ends; 0: none
    queue_mb: Optional[int]
    is_quiet: bool


def add_record_options(command: argparse.ArgumentParser) -> None:
    """Add the options of the command to its parser."""
    command.add_argument('words', metavar='CONFIG|TOPIC', nargs='*',
                         help='the configuration file, topics, or both')
    _add_choice(command.add_argument_group('what is recorded'))
    _add_file(command.add_argument_group('the file'))
    _add_end(command.add_argument_group('end and size'))
    for names in _NOT_OFFERED:
        command.add_argument(*names, nargs='?', action=_NotOffered, help=argparse.SUPPRESS)


def record_options(values: argparse.Namespace) -> RecordOptions:
    """Return the parsed options.

    Raises:
        ValueError: they contradict each other, or there is nothing to record.
    """
    configs = [word for word in values.words if _is_configuration(word)]
    topics = tuple(word for word in values.words if word not in configs)
    _check(values, configs, topics)
    is_split = values.split
    return RecordOptions(
        configs[0] if configs else None, values.devices, values.node,
        _recording(values, topics), 0 if is_split else values.size << 20,
        0.0 if is_split else values.duration, values.buffsize, values.quiet)


class _NotOffered(argparse.Action):
    """Names the alternative instead of ignoring an option."""

    def __call__(self, parser: argparse.ArgumentParser, namespace: argparse.Namespace,
                 values: Any, option_string: Optional[str] = None) -> None:
        reason = _NOT_OFFERED[tuple(self.option_strings)]
        parser.error(f'{option_string} of rosbag record is not offered: {reason}')


def _add_choice(group: 'argparse._ArgumentGroup') -> None:
    group.add_argument('--devices', metavar='A,B',
                       help='the devices of the configuration (default: all)')
    group.add_argument('-a', '--all', action='store_true',
                       help='all topics, including those published later')
    group.add_argument('-e', '--regex', action='store_true',
                       help='the topics are regular expressions for whole names')
    group.add_argument('-x', '--exclude', metavar='REGEX', default='',
                       help='except these, after -a or -e')
    group.add_argument('--node', default='', help='the topics that a node subscribes to now')


def _add_file(group: 'argparse._ArgumentGroup') -> None:
    group.add_argument('--folder', default='.', help='created if there is none')
    group.add_argument('-o', '--output-prefix', '--prefix', dest='prefix', default='',
                       help='the bag is named PREFIX_DATE.bag')
    group.add_argument('-O', '--output-name', '--name', dest='name', default='',
                       help='or NAME.bag; never overwrites')
    group.add_argument('--lz4', action='store_true', help='compress')
    group.add_argument('-q', '--quiet', action='store_true', help='report only problems')
    group.add_argument('-b', '--buffsize', metavar='MB', type=_count,
                       help='memory between network and disk (default: 512; 0: no limit)')
    group.add_argument('--tcpnodelay', action='store_true', help='always on')
    group.add_argument('--repeat-latched', action='store_true', help='always on')


def _add_end(group: 'argparse._ArgumentGroup') -> None:
    group.add_argument('--duration', metavar='S', type=_duration_s, default=0.0,
                       help='end after this time; with a unit: 30s, 5m, 2h')
    group.add_argument('--size', metavar='MB', type=_count, default=0,
                       help='end at about this size')
    group.add_argument('--split', action='store_true',
                       help='begin a new file at this limit instead of ending')
    group.add_argument('--split-mb', type=_count, default=0, metavar='MB',
                       help='the same as --split --size MB')
    group.add_argument('--split-s', type=_duration_s, default=0.0, metavar='S',
                       help='the same as --split --duration S')


def _is_configuration(word: str) -> bool:
    return word.endswith('.xml') or os.path.isfile(word)


def _check(values: argparse.Namespace, configs: List[str], topics: Tuple[str, ...]) -> None:
    if len(configs) > 1:
        raise ValueError(f'one configuration is recorded at a time, not {" and ".join(configs)}')
    if not (configs or topics or values.all or values.node):
        raise ValueError('nothing to record; name a configuration file or topics, or write -a')
    if values.devices is not None and not configs:
        raise ValueError('--devices needs the configuration file that has them')
    if values.exclude and not (values.all or values.regex):
        raise ValueError('-x leaves out topics of -a or -e; write one of them')
    if values.split and not (values.size or values.duration):
        raise ValueError('--split needs --size or --duration')


def _recording(values: argparse.Namespace, topics: Tuple[str, ...]) -> RecordingOptions:
    folder, name = os.path.split(values.name)
    prefix_folder, prefix = os.path.split(values.prefix)
    patterns = (topics if values.regex else ()) + (('.*',) if values.all else ())
    return RecordingOptions(
        topics=() if values.regex else topics, patterns=patterns,
        excluded=(values.exclude,) if values.exclude else (),
        folder=os.path.abspath(os.path.join(values.folder, folder or prefix_folder)),
        prefix=prefix, name=name, compression='lz4' if values.lz4 else 'none',
        split_bytes=(values.split_mb or (values.size if values.split else 0)) << 20,
        split_duration_s=values.split_s or (values.duration if values.split else 0.0))


def queue_parameter(queue_mb: int) -> str:
    """Return the parameter of the recorder for a queue of this size [MB]; 0: no limit."""
    return f'_queue_megabytes:={min(queue_mb, _WITHOUT_LIMIT_MB) or _WITHOUT_LIMIT_MB}'


def _count(text: str) -> int:
    if not text.isdecimal():
        raise argparse.ArgumentTypeError(f'"{text}" is not a whole number; write one such as 100')
    return int(text)


def _duration_s(text: str) -> float:
    digits, unit = (text[:-1], text[-1]) if text[-1:] in _UNITS_S else (text, 's')
    try:
        return positive(digits) * _UNITS_S[unit]
    except ValueError as error:
        raise argparse.ArgumentTypeError(f'{error}, or with a unit: 30s, 5m, 2h') from error
