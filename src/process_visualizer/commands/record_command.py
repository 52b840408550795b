# SPDX-License-Identifier: BSD-3-Clause
"""The command ``cell record``: starts a recorder, watches it and stops it."""
from __future__ import annotations

import argparse
import dataclasses
import os
import signal
import subprocess
import sys
import threading
from dataclasses import dataclass
from typing import Any, List, Optional, Sequence, Tuple

import rosgraph
import rospy
from roslib.packages import find_node

from process_visualizer.bagio.recording import Recording
from process_visualizer.bagio.report import as_text, make_report
from process_visualizer.cell.model import Cell, Device
from process_visualizer.cell.stored_configuration import configuration_text
from process_visualizer.cell.values import positive
from process_visualizer.clients.bag_recorder import (
    BagRecorder,
    RecorderError,
    RecorderUnreachable,
    RecordingOptions,
)
from process_visualizer.generate.launch_file import recorded_topics
from process_visualizer.launching.ros_api import PATIENT_TIMEOUT_S, MasterClient
from process_visualizer.launching.roslaunch_process import dying_with_parent
from process_visualizer.msg import RecorderState
from process_visualizer.ros_names import BAG_RECORDER, PACKAGE
from process_visualizer.shown_text import say

# The command line of ``cell record``: the options of `rosbag record`, and some more.

_UNITS_S = {'s': 1.0, 'm': 60.0, 'h': 3600.0}
_WITHOUT_LIMIT_MB = 1_000_000
_NOT_OFFERED = {
    ('-j', '--bz2'): '--lz4 compresses while recording, and "rosbag compress" a finished bag',
    ('--max-splits',): 'nothing that was recorded is deleted; to keep what just happened, use the '
                       "recorder's memory (the service ~save_recent)",
    ('-l', '--limit'): 'end a recording with --duration or --size',
    ('--chunksize',): 'a chunk has 1 MB, or what arrives in half a second',
    ('--udp',): 'messages lost on the way would go unnoticed',
    ('-p', '--publish'): 'the topic ~state of the recorder shows when it records',
}


@dataclass(frozen=True)
class RecordOptions:
    """The choice of what to record and when to stop.

    ``recording`` has the topics of the command line; the topics of the configuration's devices and
    of ``node`` are added to them.
    """

    config: Optional[str]  # the configuration file
    devices: Optional[str]  # A,B; None: all devices of the configuration
    node: str  # whose subscriptions are recorded; '': no node
    recording: RecordingOptions
    size_bytes: int  # recording ends at this size; 0: no limit
    duration_s: float  # recording ends after this time; 0: no limit
    queue_mb: Optional[int]
    is_quiet: bool


def add_record_options(command: argparse.ArgumentParser) -> None:
    """Add the options of ``cell record``."""
    command.set_defaults(repeated='words')
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
        ValueError: the options contradict each other, or there is nothing to record.
    """
    configs = [word for word in values.words if word.endswith('.xml') or os.path.isfile(word)]
    topics = tuple(word for word in values.words if word not in configs)
    _check(values, configs, topics)
    is_split = values.split
    return RecordOptions(
        configs[0] if configs else None, values.devices, values.node,
        _recording(values, topics), 0 if is_split else values.size << 20,
        0.0 if is_split else values.duration, values.buffsize, values.quiet)


class _NotOffered(argparse.Action):
    """Rejects an option of rosbag record, and names the alternative."""

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
                       help='or NAME.bag; existing files are never overwritten')
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
    """Return the recorder's parameter for a queue of this size [MB; 0: no limit]."""
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


_READY_TIMEOUT_S = 10.0
_STATE_TIMEOUT_S = 1.0  # states arrive twice a second, unless the recorder has died


def record(cell: Optional[Cell], devices: Sequence[Device], options: RecordOptions) -> int:
    """Record until SIGINT, SIGTERM or the limit, then print the report; return the exit code.

    Raises:
        OSError: the configuration cannot be read.
    """
    if not rosgraph.is_master_online():
        say(f'cell: there is no ROS master at {rosgraph.get_master_uri()}; start the cell first',
            file=sys.stderr)
        return 1
    name = f'bag_recorder_{os.getpid()}'
    process = subprocess.Popen(_command(name, options), start_new_session=True,
                               stdin=subprocess.DEVNULL)
    try:
        rospy.init_node('cell_record', anonymous=True, disable_signals=True)
        run = RecordRun(process, options)
        return run.run(BagRecorder(run.take_state, f'/{name}'),
                       _recording_options(cell, devices, options),
                       rospy.get_param('/use_sim_time', False))
    except RecorderError as error:
        say(f'cell: {error}', file=sys.stderr)
        return 1
    finally:
        process.send_signal(signal.SIGINT)
        process.wait()


class RecordRun:
    """One recording by a recorder of its own; reports problems to the operator at once."""

    def __init__(self, process: 'subprocess.Popen[bytes]', options: RecordOptions) -> None:
        """Initialize with the recorder's process, whose states are passed to `take_state`."""
        self._process = process
        self._wanted = options
        self._end = threading.Event()
        self._reported_problems = 0
        self._ended = False  # without being stopped
        self._files: List[str] = []

    def run(self, recorder: BagRecorder, options: RecordingOptions,
            is_time_simulated: bool) -> int:
        """Record until a signal, the limit or the end of the recorder; return the exit code.

        With simulated time, wait until the clock starts: earlier messages would have no time.

        Raises:
            RecorderError: the recorder's process has ended, or refuses to start or stop.
        """
        recorder.wait_until_ready(_READY_TIMEOUT_S)
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, lambda *_: self._end.set())
        threading.Thread(target=self._follow_process, daemon=True).start()
        if is_time_simulated:
            self._wait_for_time(recorder)
        if self._process.poll() is not None:
            raise RecorderError('the recorder has died before it recorded anything; its own '
                                'messages say why')
        if self._end.is_set():
            return 1
        path = recorder.start(options)
        self._files = [path]
        self._print(f'recording {path}')
        if self._wanted.duration_s:
            rospy.Timer(rospy.Duration.from_sec(self._wanted.duration_s),
                        lambda _: self._end.set(), oneshot=True)
        self._end.wait()
        return self.finish(recorder)

    def _wait_for_time(self, recorder: BagRecorder) -> None:
        self._print('waiting for the first message on /clock, as the time is simulated')
        while not self._end.is_set() and recorder.wait_for(
                lambda state: not state.stamp.is_zero(), _STATE_TIMEOUT_S) is None:
            pass

    def _print(self, text: str) -> None:
        if not self._wanted.is_quiet:
            say(text)

    def finish(self, recorder: BagRecorder) -> int:
        """Stop the recording and print the report; return 1 if it had ended by itself, else 0.

        Raises:
            RecorderError: the recorder's process has ended, or refuses to stop.
        """
        if self._process.poll() is not None:
            raise RecorderError('the recorder has died; "rosrun process_visualizer cell reindex '
                                f'{self._files[-1]}.active" makes a bag from what it has written')
        ended = self._ended
        with Recording(self._files if ended else self._stop(recorder)) as recording:
            self._print(as_text(make_report(recording)))
        return 1 if ended else 0

    def _stop(self, recorder: BagRecorder) -> List[str]:
        """Stop by the service or, if it does not answer, by a signal; return the bags."""
        try:
            return recorder.stop()
        except RecorderUnreachable:
            self._process.send_signal(signal.SIGINT)
            self._process.send_signal(signal.SIGCONT)  # a suspended process would never end
            self._process.wait()
            return self._files

    def take_state(self, state: RecorderState) -> None:
        """Report new problems; note whether the recording must end or has ended by itself."""
        new = min(state.problem_count - self._reported_problems, len(state.problems))
        for problem in state.problems[len(state.problems) - new:]:
            say(problem, file=sys.stderr)
        self._reported_problems = state.problem_count
        if state.files:
            self._files = list(state.files)
            self._ended = state.state == RecorderState.IDLE
        if self._ended or 0 < self._wanted.size_bytes <= state.bytes:
            self._end.set()

    def _follow_process(self) -> None:
        self._process.wait()
        self._end.set()


def _recording_options(cell: Optional[Cell], devices: Sequence[Device],
                       options: RecordOptions) -> RecordingOptions:
    topics = [*recorded_topics(devices), *options.recording.topics,
              *_subscriptions(options.node)]
    return dataclasses.replace(
        options.recording, topics=tuple(dict.fromkeys(topics)),
        configuration='' if cell is None else configuration_text(cell))


def _subscriptions(node: str) -> List[str]:
    """Return the topics that a node subscribes to, according to the master."""
    if not node:
        return []
    name = rosgraph.names.resolve_name(node, '/')
    subscribers = MasterClient('/cell_record', timeout_s=PATIENT_TIMEOUT_S).getSystemState()[1]
    topics = [topic for topic, names in subscribers if name in names]
    if not topics:
        raise RecorderError(f'{name} subscribes to no topic; "rosnode list" shows the nodes')
    return topics


def _command(name: str, options: RecordOptions) -> List[str]:
    """Return the recorder's command; if this process dies, it is interrupted and ends its bag."""
    programs = find_node(PACKAGE, BAG_RECORDER)
    if not programs:
        raise OSError('the program bag_recorder is not built; build the workspace')
    queue = [] if options.queue_mb is None else [queue_parameter(options.queue_mb)]
    folder = options.recording.folder  # other computers may choose only folders below it
    return [*dying_with_parent(), programs[0], f'__name:={name}', '_recent_duration:=0',
            *([f'_folder:={folder}'] if folder else []), *queue]
