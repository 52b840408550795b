# SPDX-License-Identifier: BSD-3-Clause
"""The command ``cell``: functions of the window for configurations and bags, in a terminal."""
from __future__ import annotations

import argparse
import os
import re
import select
import signal
import sys
from typing import Callable, Dict, List, Optional, Sequence

from process_visualizer.bagio.bag_errors import BagError
from process_visualizer.bagio.recording_calibration import (
    calibration_path,
    saved_poses,
    with_saved_poses,
)
from process_visualizer.cell.environment import require_environment
from process_visualizer.cell.errors import ConfigurationError
from process_visualizer.cell.model import Cell, Mode
from process_visualizer.cell.xml_parser import XmlParser
from process_visualizer.commands.bag_commands import (
    add_bag_commands,
    add_calibration_options,
    add_cut_options,
    execute_bag_command,
    execute_calibration,
    execute_cut,
)
from process_visualizer.commands.compare_command import (
    add_compare_options,
    add_runs_options,
    execute_compare,
    execute_runs,
)
from process_visualizer.commands.configuration_commands import (
    add_new_options,
    add_trust_options,
    check,
    execute_new,
    execute_trust,
    overview,
)
from process_visualizer.commands.expect_command import add_expect_options, execute_expect
from process_visualizer.commands.record_command import add_record_options, record, record_options
from process_visualizer.commands.run_command import run_plan
from process_visualizer.commands.share_commands import (
    add_export_options,
    add_film_options,
    add_picture_options,
    add_share_options,
    execute_export,
    execute_film,
    execute_picture,
    execute_share,
)
from process_visualizer.commands.viewer_commands import (
    add_serve_options,
    add_view_options,
    execute_serve,
    execute_view,
)
from process_visualizer.generate.choice import Choice, RvizStart, Viewers, choose_devices
from process_visualizer.generate.generator import generate
from process_visualizer.generate.plan import Plan, PlanError, write_plan
from process_visualizer.health.other_publishers import MixedSources, refuse_mixture
from process_visualizer.launching.cell_owner import OtherCell
from process_visualizer.launching.ros_master import RosMaster, RosMasterError
from process_visualizer.remote.link_words import ports_of
from process_visualizer.remote.offer import DEFAULT_PORTS
from process_visualizer.robot.description import describe_devices
from process_visualizer.shortage import shortage_words
from process_visualizer.shown_text import say

_DESCRIPTION = ('Checks, shows, generates, runs or records the robot cell of a configuration file, '
                'or makes such a file; reports on recordings.')
_INTERRUPTED, _UNREAD = 128 + signal.SIGINT, 128 + signal.SIGPIPE
"""Exit code of an interrupted command, as in shells."""
_NAMED_VALUE = re.compile('[A-Za-z]\\w*:=')
_COMMANDS = {
    'check': 'report every problem of the configuration; exit code 1 if there is one',
    'show': 'list devices, nodes and topics',
    'generate': 'write the launch file, the RViz file and the models',
    'run': 'generate, start everything, and stop all of it on Ctrl-C',
    'new': 'write a configuration for what is running, or for the contents of a bag',
    'runs': 'list the runs of recordings: the cycles between the events of the configuration',
    'compare': 'compare runs with good ones: what differed, where, and when first; exit code 0 if '
               'all are in range, 2 if one is not, 3 if one could not be judged',
    'share': 'write runs as one page that any browser opens: robots, arrows, curves, verdict',
    'serve': 'show a running cell as a page in browsers, live; nobody there can change anything',
    'export': 'write runs for other programs: numbers as a table (CSV, Parquet), or a run as MCAP',
    'film': 'make a film of runs: robots, arrows, curves, verdict at each moment',
    'picture': 'the same as one picture',
    'calibration': 'print the poses of the devices when a bag was recorded and now; exit code 2 '
                   'if one has moved',
    'cut': 'copy a run, a span, or what happened around a mark or an alarm into a smaller bag',
    'expect': 'print what a depth sensor of the running cell sees now, as <expected> boxes; '
              '--write adds them to the configuration',
    'trust': 'let nodes of a package run when a recording names them; without one, list those',
    'view': 'show a cell that runs on another computer, and change nothing in it',
    'record': "record the devices' topics, or others, until Ctrl-C, then report",
}


_WITHOUT_VALUES = ('new', 'trust', 'view')
"""Commands in which NAME:=VALUE is an ordinary word, as in those for bags."""
_WITHOUT_CONFIG: Dict[str, Callable[[argparse.ArgumentParser], None]] = {
    'record': add_record_options, 'new': add_new_options, 'runs': add_runs_options,
    'compare': add_compare_options, 'share': add_share_options,
    'export': add_export_options, 'film': add_film_options, 'picture': add_picture_options,
    'calibration': add_calibration_options, 'trust': add_trust_options, 'cut': add_cut_options,
    'view': add_view_options, 'serve': add_serve_options, 'expect': add_expect_options}


def _has_lost_reader() -> bool:
    """Return whether the reader of the output has ended, such as "head" after its last line."""
    output = select.poll()
    output.register(sys.stdout.fileno(), 0)
    return any(event & select.POLLERR for _, event in output.poll(0))


def main(arguments: Optional[Sequence[str]] = None) -> int:
    """Run the command; return its exit code."""
    words = list(sys.argv[1:] if arguments is None else arguments)
    has_values = words[:1] and words[0] in _COMMANDS and words[0] not in _WITHOUT_VALUES
    named = list(filter(_NAMED_VALUE.match, words)) if has_values else []
    options = _parsed([word for word in words if word not in named])  # only allowed in one position
    try:
        if hasattr(options, 'bag_command'):
            code = execute_bag_command(options)
        else:
            options.args = [*options.args, *named]
            code = _execute(options)
        sys.stdout.flush()
        return code
    except ConfigurationError as error:
        for problem in error.problems:
            say(problem, file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        return _INTERRUPTED
    except BrokenPipeError as error:
        if not _has_lost_reader():
            say(f'cell: {error}', file=sys.stderr)
            return 1
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # for the flush at the exit
        return _UNREAD
    except (BagError, PlanError, MixedSources, OtherCell, RosMasterError, ValueError,
            OSError) as error:
        say(f'cell: {shortage_words(error) or error}', file=sys.stderr)
        return 1


def _parsed(words: Sequence[str]) -> argparse.Namespace:
    """Return the options; repeated words of a command, such as bags, may appear between options.

    argparse itself accepts them in one position only.
    """
    parser = _parser()
    options, rest = parser.parse_known_args(words)
    repeated = getattr(options, getattr(options, 'repeated', ''), None)
    if not rest:
        return options
    if repeated is None or any(word.startswith('-') for word in rest):
        parser.error(f'unrecognized arguments: {" ".join(rest)}')
    repeated.extend(rest)
    return options


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog='cell', description=_DESCRIPTION)
    commands = parser.add_subparsers(dest='command', required=True, metavar='COMMAND')
    for name, help_text in _COMMANDS.items():
        command = commands.add_parser(name, help=help_text, description=help_text)
        if name in _WITHOUT_CONFIG:
            command.set_defaults(args=[])
            _WITHOUT_CONFIG[name](command)
            continue
        command.add_argument('config', metavar='CONFIG', help='the configuration file')
        command.add_argument('args', metavar='NAME:=VALUE', nargs='*',
                             help='values for the <arg> elements of the configuration')
        if name != 'check':
            command.add_argument('--devices', metavar='A,B', help='the devices (default: all)')
        if name in ('generate', 'run'):
            _add_run_options(command)
    add_bag_commands(commands)
    return parser


def _add_run_options(command: argparse.ArgumentParser) -> None:
    command.add_argument('--mode', choices=[mode.value for mode in Mode], default='realtime')
    command.add_argument('--bag', metavar='FILE', help='recording to play (mode playback)')
    command.add_argument('--output', metavar='DIR', help='folder for the generated files')
    command.add_argument('--no-rviz', action='store_true', help='start without RViz')
    command.add_argument('--remote', action='store_true',
                         help='other computers may watch, with "cell view"')
    command.add_argument('--ports', metavar='FIRST-LAST', type=_ports,
                         help='of which "cell view" uses one (default: '
                              f'{DEFAULT_PORTS[0]}-{DEFAULT_PORTS[-1]})')


def _ports(text: str) -> str:
    try:
        ports_of(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None
    return text


def _execute(options: argparse.Namespace) -> int:
    if options.command == 'record':
        return _record(options)
    if options.command == 'new':
        return execute_new(options)
    if options.command == 'trust':
        return execute_trust(options)
    if options.command == 'view':
        return execute_view(options)
    if options.command == 'expect':
        return execute_expect(options, _named_values(options.args))
    if options.command == 'serve':
        return execute_serve(options, _named_values(options.args))
    if options.command in _RECORDING_COMMANDS:
        if options.command != 'calibration':  # it uses the recorded configuration's file
            _check_used(options.args, options.config)
        return _RECORDING_COMMANDS[options.command](options, _named_values(options.args))
    if options.command == 'check':
        return check(options.config, _named_values(options.args))
    cell = XmlParser(_named_values(options.args)).parse(options.config)
    if options.command == 'show':
        devices = choose_devices(cell, _names(options.devices))
        say(overview(cell, devices, describe_devices(devices)[0]))
        return 0
    choice = _choice(cell, options)
    plan = _plan(choice)
    if options.command == 'generate':
        return _generate(plan, options.output or '.')
    RosMaster().check()
    refuse_mixture(choice)
    return run_plan(plan, options.output, choice)


_RECORDING_COMMANDS = {
    'runs': execute_runs, 'compare': execute_compare, 'share': execute_share,
    'export': execute_export, 'film': execute_film, 'picture': execute_picture,
    'calibration': execute_calibration, 'cut': execute_cut}


def _record(options: argparse.Namespace) -> int:
    wanted = record_options(options)
    _check_used(options.args, wanted.config)
    if wanted.config is None:
        return record(None, (), wanted)
    cell = XmlParser(_named_values(options.args)).parse(wanted.config)
    return record(cell, choose_devices(cell, _names(wanted.devices)), wanted)


def _check_used(words: Sequence[str], config: Optional[str]) -> None:
    """Raise ValueError for values that no configuration uses: a recorded one has its own."""
    if words and config is None:
        raise ValueError(f'"{words[0]}" is a value for a configuration; name its file too')


def _named_values(words: Sequence[str]) -> Dict[str, str]:
    values: Dict[str, str] = {}
    for word in words:
        name, separator, value = word.partition(':=')
        if not separator or not name:
            raise ValueError(f'"{word}" is not an argument; write NAME:=VALUE')
        values[name] = value
    return values


def _names(text: Optional[str]) -> Optional[List[str]]:
    return None if text is None else [name for name in text.split(',') if name]


def _choice(cell: Cell, options: argparse.Namespace) -> Choice:
    mode = Mode(options.mode)
    bag = options.bag
    if bag is not None:
        if mode is not Mode.PLAYBACK:
            raise ValueError('--bag needs --mode playback')
        if not os.path.isfile(bag):
            raise ValueError(f'there is no file "{bag}"')
        bag = os.path.abspath(bag)
        if not bag.isprintable():
            raise ValueError(f'roslaunch cannot pass on the path {bag!a}; rename it')
        cell = _calibrated(cell, bag)
    rviz = RvizStart.NONE if options.no_rviz else RvizStart.REQUIRED
    return Choice(cell, mode, choose_devices(cell, _names(options.devices)), rviz, bag,
                  viewers=Viewers(options.remote, options.ports or ''))


def _calibrated(cell: Cell, bag: str) -> Cell:
    """Return the cell with its base frames at the poses saved for the recording."""
    poses = saved_poses(bag)
    moved = [it.base.frame for it in cell.devices if it.base and it.base.frame in poses]
    if moved:
        say(f'as saved in {calibration_path(bag)}: {", ".join(moved)}')
    return with_saved_poses(cell, poses)


def _plan(choice: Choice) -> Plan:
    """Return the plan, after checking that nothing is missing on this machine."""
    require_environment(choice.cell, choice.mode, [device.name for device in choice.devices])
    plan = generate(choice)
    for warning in plan.warnings:
        say(f'warning: {warning}', file=sys.stderr)
    return plan


def _generate(plan: Plan, folder: str) -> int:
    for path in write_plan(plan, folder):
        say(path)
    return 0
