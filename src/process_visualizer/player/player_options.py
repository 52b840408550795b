# SPDX-License-Identifier: BSD-3-Clause
"""The command line of the player: the options of `rosbag play`, and some of its own."""
from __future__ import annotations

import argparse
import math
import re
from dataclasses import dataclass
from enum import Enum
from typing import Any, Callable, Dict, List, NamedTuple, Optional, Sequence, Tuple

from process_visualizer.cell.values import number
from process_visualizer.playback.timeline import MAX_REQUESTED_RATE, CommandRefused, checked_rate
from process_visualizer.playback.topic_choice import checked_prefix, resolved_name


class Command(Enum):
    """A command that a key gives to the player; the value is the name of its method."""

    TOGGLE_PAUSED = 'toggle_paused'
    STEP = 'step'
    SEEK_BY = 'seek_by'
    SEEK_TO_BEGIN = 'seek_to_begin'
    SEEK_TO_END = 'seek_to_end'
    FASTER = 'faster'
    SLOWER = 'slower'
    REVERSE = 'reverse'
    TOGGLE_LOOP = 'toggle_loop'
    TOGGLE_PAUSE_TOPICS = 'toggle_pause_topics'
    LOOP_BEGIN = 'loop_begin'
    LOOP_END = 'loop_end'
    HELP = 'help'
    QUIT = 'quit'


class KeyAction(NamedTuple):
    """A command with its distance: messages for STEP, seconds for SEEK_BY, otherwise 0."""

    command: Command
    amount: int = 0


_KEYS: Tuple[Tuple[str, KeyAction], ...] = (
    (' ', KeyAction(Command.TOGGLE_PAUSED)),
    ('s', KeyAction(Command.STEP, 1)),
    ('.', KeyAction(Command.STEP, 1)),
    ('S', KeyAction(Command.STEP, -1)),
    (',', KeyAction(Command.STEP, -1)),
    ('left', KeyAction(Command.SEEK_BY, -1)),
    ('right', KeyAction(Command.SEEK_BY, 1)),
    ('down', KeyAction(Command.SEEK_BY, -10)),
    ('up', KeyAction(Command.SEEK_BY, 10)),
    ('home', KeyAction(Command.SEEK_TO_BEGIN)),
    ('end', KeyAction(Command.SEEK_TO_END)),
    ('[', KeyAction(Command.SLOWER)),
    (']', KeyAction(Command.FASTER)),
    ('r', KeyAction(Command.REVERSE)),
    ('l', KeyAction(Command.TOGGLE_LOOP)),
    ('t', KeyAction(Command.TOGGLE_PAUSE_TOPICS)),
    ('a', KeyAction(Command.LOOP_BEGIN)),
    ('b', KeyAction(Command.LOOP_END)),
    ('?', KeyAction(Command.HELP)),
    ('q', KeyAction(Command.QUIT)),
    ('\x03', KeyAction(Command.QUIT)),  # Ctrl-C if the terminal does not turn it into a signal
)
_ACTIONS: Dict[str, KeyAction] = dict(_KEYS)

KEY_HELP = """\
  space         pause or play
  s .           one message forward       S ,        one message back
  right left    1 s forward or back       up down    10 s forward or back
  home end      to the beginning, end     r          reverse the direction
  ]             faster                    [          slower
  l             loop on or off            a b        loop from here, to here
  t             pause at --pause-topics, or not
  ?             this help                 q Ctrl-C   quit"""
"""Description of the keys, for a terminal 80 columns wide."""


def key_action(key: str) -> Optional[KeyAction]:
    """Return the action of a key (as named by KeyDecoder), or None if it has none."""
    return _ACTIONS.get(key)


_MAX_S = 1e9
_MAX_HZ = 10_000.0
_MAX_QUEUE = 1_000_000
_REMAP = re.compile(r'(?P<source>[/A-Za-z][A-Za-z0-9_/]*):=(?P<target>.*)\Z', re.DOTALL)
_NOT_OFFERED = {
    '--try-future-version': 'bags of version 2.0 are read',
}


@dataclass(frozen=True)
class PlayerOptions:
    """The options of playback; times are seconds from the recording's beginning."""

    files: Tuple[str, ...]
    rate: float  # negative: backward; with --immediate, MAX_REQUESTED_RATE in the same direction
    start_s: Optional[float]  # None: the beginning, or the end when playing backward
    duration_s: Optional[float]  # None: all
    skip_empty_s: Optional[float]  # None: nothing is skipped
    loop: bool
    paused: bool
    pause_topics: Tuple[str, ...]  # global names
    rate_control_topic: str  # a name, or '' for none
    rate_control_max_delay_s: float
    delay_s: float  # from advertising to playing
    wait_for_subscribers: bool
    keep_alive: bool
    topics: Tuple[str, ...]  # names or patterns; empty: all
    exclude: Tuple[str, ...]
    prefix: str  # '' or a global name
    recorded_stamps: bool  # otherwise stamps are moved to the present
    clock: bool
    clock_hz: float
    queue_size: int
    quiet: bool
    reindex: bool
    pauses_beside_others: bool  # pause if other nodes publish the same topics, else only warn


def parse_options(arguments: Sequence[str]) -> PlayerOptions:
    """Read the command line, given without the program's name and ROS's remappings.

    Raises:
        SystemExit: after a message, with 2 for an invalid command line, or 0 after the help.
    """
    parser = _parser()
    values = parser.parse_intermixed_args(list(arguments))
    files = [*values.files, *values.bags]
    if not files:
        parser.error('no bag is given; name one or more files'
                     + (', before --topics and --exclude or after --bags'
                        if values.topics or values.exclude or values.pause_topics else ''))
    if values.duration and values.rate < 0.0:
        parser.error('argument -u/--duration: only for playing forwards')
    stamps = values.stamps or ('recorded' if values.clock else 'present')
    return PlayerOptions(
        files=tuple(files),
        rate=math.copysign(MAX_REQUESTED_RATE, values.rate) if values.immediate else values.rate,
        start_s=values.start, duration_s=values.duration,
        skip_empty_s=values.skip_empty, loop=values.loop, paused=values.pause,
        pause_topics=tuple(values.pause_topics), rate_control_topic=values.rate_control_topic or '',
        rate_control_max_delay_s=values.rate_control_max_delay, delay_s=values.delay,
        wait_for_subscribers=values.wait_for_subscribers, keep_alive=values.keep_alive,
        topics=tuple(values.topics), exclude=tuple(values.exclude), prefix=values.prefix,
        recorded_stamps=stamps == 'recorded', clock=values.clock, clock_hz=values.hz,
        queue_size=values.queue, quiet=values.quiet, reindex=values.reindex,
        pauses_beside_others=values.others == 'pause')


def topic_remaps(arguments: Sequence[str], namespace: str = '/') -> Dict[str, str]:
    """Return the topic remappings (FROM:=TO) of a raw command line, as global names.

    Relative names belong to the namespace of the node. Its private names and parameters
    (~name, _name, __name) are not topics of a recording and are left to rospy.

    Raises:
        ValueError: a topic is remapped to an invalid name.
    """
    found = filter(None, map(_REMAP.match, arguments))
    return {resolved_name(it.group('source'), namespace): resolved_name(it.group('target'),
                                                                        namespace)
            for it in found}


def without_topic_remaps(arguments: Sequence[str]) -> List[str]:
    """Return a raw command line without topic remappings: rospy would apply them a second time."""
    return [it for it in arguments if not _REMAP.match(it)]


class _NotOffered(argparse.Action):
    """Action that exits with a message instead of ignoring an option of `rosbag play`."""

    def __call__(self, parser: argparse.ArgumentParser, namespace: argparse.Namespace,
                 values: Any, option_string: Optional[str] = None) -> None:
        reason = _NOT_OFFERED[self.option_strings[-1]]
        parser.error(f'{option_string} of rosbag play is not offered: {reason}')


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog='bag_player', usage='bag_player FILE [FILE ...] [options] [FROM:=TO ...]',
        description='Plays recordings, forwards and backwards at any rate.',
        epilog=f'keys while playing:\n{KEY_HELP}',
        formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('files', metavar='FILE', nargs='*', help='a bag; several are played as '
                                                                 'one recording')
    parser.add_argument('--bags', metavar='FILE', nargs='+', action='extend', default=[],
                        help='more bags, for use after --topics')
    _add_playing(parser)
    _add_choice(parser)
    _add_publishing(parser)
    for option in _NOT_OFFERED:
        parser.add_argument(option, nargs='*', action=_NotOffered, help=argparse.SUPPRESS)
    return parser


def _add_playing(parser: argparse.ArgumentParser) -> None:
    group = parser.add_argument_group('playing')
    group.add_argument('-r', '--rate', metavar='FACTOR', type=_rate, default=1.0,
                       help='speed factor; negative values play backwards (default: 1)')
    group.add_argument('-i', '--immediate', action='store_true',
                       help='play without waiting between messages, in the direction of --rate')
    group.add_argument('-s', '--start', metavar='SEC', type=_seconds,
                       help='begin SEC seconds into the recording, also when playing backwards')
    group.add_argument('-u', '--duration', metavar='SEC', type=_above_zero(_MAX_S, 's'),
                       help='play only SEC seconds of the recording; not backwards')
    group.add_argument('--skip-empty', metavar='SEC', type=_seconds,
                       help='skip parts without messages that are longer than SEC seconds')
    group.add_argument('-l', '--loop', action='store_true', help='repeat what is played')
    group.add_argument('--pause', action='store_true', help='start paused')
    group.add_argument('--pause-topics', metavar='TOPIC', nargs='+', action='extend', default=[],
                       type=_argument(resolved_name), help='pause before each message of these '
                                                           'topics')
    group.add_argument('--rate-control-topic', metavar='TOPIC',
                       type=_argument(resolved_name),
                       help='wait for the node that publishes this topic, by the stamps in its '
                            'headers')
    group.add_argument('--rate-control-max-delay', metavar='SEC', type=_seconds, default=1.0,
                       help='by how much that node may be behind (default: 1)')
    group.add_argument('-d', '--delay', metavar='SEC', type=_seconds, default=0.2,
                       help='wait SEC seconds before playing, so that subscribers can connect '
                            '(default: 0.2)')
    group.add_argument('--wait-for-subscribers', action='store_true',
                       help='wait for a subscriber of every topic before playing')
    group.add_argument('-k', '--keep-alive', action='store_true',
                       help='stay at the end instead of exiting')


def _add_choice(parser: argparse.ArgumentParser) -> None:
    group = parser.add_argument_group('choice of topics (also FROM:=TO)')
    group.add_argument('--topics', metavar='TOPIC', nargs='+', action='extend', default=[],
                       help='play only these; patterns such as "/camera/*" may be used')
    group.add_argument('--exclude', metavar='TOPIC', nargs='+', action='extend', default=[],
                       help='do not play these')
    group.add_argument('-p', '--prefix', type=_argument(checked_prefix), default='',
                       help='put PREFIX before the name of every topic')


def _add_publishing(parser: argparse.ArgumentParser) -> None:
    group = parser.add_argument_group('publishing')
    group.add_argument('--stamps', choices=['present', 'recorded'],
                       help='move the stamps in the messages to the present, or leave them '
                            '(default: present; recorded with --clock)')
    group.add_argument('--clock', action='store_true',
                       help='publish the time of the recording on /clock, for use_sim_time')
    group.add_argument('--hz', type=_above_zero(_MAX_HZ, 'Hz'), default=100.0,
                       help='how many times a second --clock publishes (default: 100)')
    group.add_argument('--others', choices=['warn', 'pause'], default='warn',
                       help='what to do when other nodes publish the same topics (default: warn)')
    group.add_argument('--queue', metavar='SIZE', type=_queue_size, default=100,
                       help='messages kept for a slow subscriber; 0: all (default: 100)')
    group.add_argument('-q', '--quiet', action='store_true', help='show no progress')
    group.add_argument('--reindex', action='store_true',
                       help='play an indexed copy of a bag without an index, without asking')


def _argument(convert: Callable[[str], Any]) -> Callable[[str], Any]:
    """Return a converter whose errors argparse shows verbatim."""
    def converted(text: str) -> Any:
        try:
            return convert(text)
        except (ValueError, CommandRefused) as error:
            raise argparse.ArgumentTypeError(str(error)) from None
    return converted


@_argument
def _rate(text: str) -> float:
    rate = number(text)
    checked_rate(rate)
    return rate


@_argument
def _seconds(text: str) -> float:
    value = number(text)
    if not 0.0 <= value <= _MAX_S:
        raise ValueError(f'must be from 0 to {_MAX_S:.0f} s, not {text}')
    return value


def _above_zero(most: float, unit: str) -> Callable[[str], Any]:
    """Return a converter for numbers above 0 and up to a maximum."""
    @_argument
    def converted(text: str) -> float:
        value = number(text)
        if not 0.0 < value <= most:
            raise ValueError(f'must be more than 0 and at most {most:.0f} {unit}, not {text}')
        return value
    return converted


@_argument
def _queue_size(text: str) -> int:
    value = number(text)
    if value != int(value) or not 0 <= value <= _MAX_QUEUE:
        raise ValueError(f'must be a whole number from 0 to {_MAX_QUEUE}, not {text}')
    return int(value)
