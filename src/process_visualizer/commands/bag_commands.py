# SPDX-License-Identifier: BSD-3-Clause
"""The commands of ``cell`` about bags: report, mark, reindex, configuration."""
from __future__ import annotations

import argparse
import sys
from typing import Any, Callable, Dict, NamedTuple

from process_visualizer.bags.bag_errors import BagError, BagUnindexed
from process_visualizer.bags.marks import Mark, add_mark, marks_path
from process_visualizer.bags.recorder_topics import recorded_configuration
from process_visualizer.bags.recording import Recording
from process_visualizer.bags.reindex import reindex
from process_visualizer.cell.confinement import confined
from process_visualizer.cell.errors import ConfigurationError
from process_visualizer.cell.provenance import Origin, Provenance
from process_visualizer.cell.stored_configuration import write_configuration
from process_visualizer.cell.xml_reader import read_xml
from process_visualizer.report.report import make_report
from process_visualizer.report.report_text import as_json, as_text
from process_visualizer.shown_text import say


def add_bag_commands(commands: 'argparse._SubParsersAction[Any]') -> None:
    """Add the commands to those of ``cell``; ``execute_bag_command`` runs them."""
    for name, (help_text, add_options, _) in _COMMANDS.items():
        command = commands.add_parser(name, help=help_text, description=help_text)
        command.set_defaults(bag_command=name)
        add_options(command)


def execute_bag_command(options: argparse.Namespace) -> int:
    """Run one of the commands; return its exit code.

    Raises:
        BagError: a bag cannot be read, or a file beside it cannot be written.
        ValueError: a mark is not within its bag.
        OSError: a file of a configuration cannot be written.
    """
    try:
        return _COMMANDS[options.bag_command].run(options)
    except BagUnindexed as error:
        raise advised(error) from error


def advised(error: BagUnindexed) -> BagError:
    """Return the error with what to do about it."""
    return BagError(error.file, f'{error.reason}: '
                    f'"rosrun process_visualizer cell reindex {error.file}"')


def _add_bags(command: argparse.ArgumentParser) -> None:
    command.add_argument('bags', metavar='BAG', nargs='+',
                         help='the bag, or all parts of one recording')


def _add_report_options(command: argparse.ArgumentParser) -> None:
    _add_bags(command)
    command.add_argument('--json', action='store_true', help='output for programs')


def _report(options: argparse.Namespace) -> int:
    with Recording(options.bags) as recording:
        report = make_report(recording)
    say(as_json(report) if options.json else as_text(report))
    return 0 if report.is_good else 2


def _add_mark_options(command: argparse.ArgumentParser) -> None:
    command.add_argument('bag', metavar='BAG')
    command.add_argument('position', metavar='SECONDS', type=float, help='from its beginning')
    command.add_argument('label', metavar='LABEL')


def _mark(options: argparse.Namespace) -> int:
    with Recording([options.bag]) as recording:
        begin_ns, end_ns = recording.begin_ns, recording.end_ns
    duration_s = (end_ns - begin_ns) / 1e9
    if not 0.0 <= options.position <= duration_s:
        raise ValueError(f'{options.bag} goes from 0 to {duration_s:.3f} s')
    path = add_mark(options.bag, Mark(begin_ns + round(options.position * 1e9), options.label))
    if path != marks_path(options.bag):
        say(f'note: the folder of the bag cannot be written; the mark is in {path}',
            file=sys.stderr)
    return 0


def _add_reindex_options(command: argparse.ArgumentParser) -> None:
    command.add_argument('bag', metavar='FILE', help='NAME.bag or NAME.bag.active')


def _reindex(options: argparse.Namespace) -> int:
    done = reindex(options.bag)
    for gap in done.gaps:
        say(gap, file=sys.stderr)
    say(f'{done.path}: {done.message_count} messages')
    return 0


def _add_configuration_options(command: argparse.ArgumentParser) -> None:
    _add_bags(command)
    command.add_argument('--output', metavar='DIR', default='.', help='the folder')


def _configuration(options: argparse.Namespace) -> int:
    with Recording(options.bags) as recording:
        configuration, damage = recorded_configuration(recording), recording.damage
    if configuration is None:
        for gap in damage:
            say(gap, file=sys.stderr)
        say(f'cell: {options.bags[0]} holds no configuration', file=sys.stderr)
        return 1
    words = [f'{name}:={value}' for name, value in configuration.arguments.items()]
    path = write_configuration(configuration, options.output)
    say(' '.join([path, *words]))
    _tell_what_it_starts(path, options.output)
    return 0


def _tell_what_it_starts(path: str, folder: str) -> None:
    """Name what is ignored as long as it is in the bag, and counts as soon as the file is opened.

    A file that cannot be read is not refused here: it is written as it was.
    """
    try:
        found = confined(read_xml(path), Provenance(Origin.BAG, folder)).ignored
    except ConfigurationError:
        return
    for it in found:
        say(f'note: {it.location}: <{it.element}> runs or reads something when this file is '
            'opened; read it first', file=sys.stderr)


class _Command(NamedTuple):
    help_text: str
    add_options: Callable[[argparse.ArgumentParser], None]
    run: Callable[[argparse.Namespace], int]


_COMMANDS: Dict[str, _Command] = {
    'report': _Command('report what is in a bag and whether it is complete; exit code 2 if it is '
                       'empty or something is known to be missing',
                       _add_report_options, _report),
    'mark': _Command('label a moment of a finished bag, in a file beside it',
                     _add_mark_options, _mark),
    'reindex': _Command('make a bag from the file that a killed recorder left, as a copy beside it',
                        _add_reindex_options, _reindex),
    'configuration': _Command('write the configuration that a bag was recorded with',
                              _add_configuration_options, _configuration),
}
