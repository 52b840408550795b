"""The commands of ``cell`` about bags: record, report, reindex, configuration."""
from __future__ import annotations

import argparse
import sys
from typing import Any

from process_visualizer.bags.bag_errors import BagError, BagUnindexed
from process_visualizer.bags.recorder_topics import recorded_configuration
from process_visualizer.bags.recording import Recording
from process_visualizer.bags.reindex import reindex
from process_visualizer.bags.report import make_report
from process_visualizer.bags.report_text import as_json, as_text
from process_visualizer.cell.stored_configuration import write_configuration

_COMMANDS = {
    'report': 'say what is in a bag and whether it is complete; exit code 2 if it is not',
    'reindex': 'make a bag of what a recorder left that was killed, in a copy beside it',
    'configuration': 'write the configuration that a bag was recorded with',
}


def add_bag_commands(commands: 'argparse._SubParsersAction[Any]') -> None:
    """Add the commands to those of ``cell``; ``execute_bag_command`` runs them."""
    for name, help_text in _COMMANDS.items():
        command = commands.add_parser(name, help=help_text, description=help_text)
        command.set_defaults(bag_command=name)
        if name == 'reindex':
            command.add_argument('bag', metavar='FILE', help='NAME.bag or NAME.bag.active')
        else:
            command.add_argument('bags', metavar='BAG', nargs='+',
                                 help='the bag; several are the parts of one recording')
        if name == 'report':
            command.add_argument('--json', action='store_true', help='for programs')
        if name == 'configuration':
            command.add_argument('--output', metavar='DIR', default='.', help='the folder')


def execute_bag_command(options: argparse.Namespace) -> int:
    """Run one of the commands; return its exit code.

    Raises:
        BagError: a bag cannot be read, or a copy of it not be written.
        OSError: a file of a configuration cannot be written.
    """
    if options.bag_command == 'reindex':
        return _reindex(options.bag)
    try:
        with Recording(options.bags) as recording:
            if options.bag_command == 'configuration':
                return _configuration(recording, options.output)
            report = make_report(recording)
    except BagUnindexed as error:
        raise BagError(error.file, f'{error.reason}: '
                       f'"rosrun process_visualizer cell reindex {error.file}"') from error
    print(as_json(report) if options.json else as_text(report))
    return 0 if report.is_complete else 2


def _reindex(bag: str) -> int:
    done = reindex(bag)
    for gap in done.gaps:
        print(gap, file=sys.stderr)
    print(f'{done.path}: {done.message_count} messages')
    return 0


def _configuration(recording: Recording, folder: str) -> int:
    configuration = recorded_configuration(recording)
    if configuration is None:
        print(f'cell: {recording.paths[0]} holds no configuration', file=sys.stderr)
        return 1
    words = [f'{name}:={value}' for name, value in configuration.arguments.items()]
    print(' '.join([write_configuration(configuration, folder), *words]))
    return 0
