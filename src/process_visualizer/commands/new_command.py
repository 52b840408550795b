# SPDX-License-Identifier: BSD-3-Clause
"""The command ``cell new``: a configuration from what is running, or from a bag."""
from __future__ import annotations

import argparse

import rospy

from process_visualizer.clients.system_look import from_system
from process_visualizer.discovery.new_configuration import from_bags, write_new
from process_visualizer.launching.ros_master import RosMaster
from process_visualizer.shown_text import say

DEFAULT_FILE = 'cell.xml'


def add_new_options(command: argparse.ArgumentParser) -> None:
    """Add the options of ``cell new``."""
    command.add_argument('bags', metavar='BAG', nargs='*',
                         help='use this recording instead of what is running')
    command.add_argument('-o', '--output', metavar='FILE', default=DEFAULT_FILE,
                         help=f'the file to write ({DEFAULT_FILE})')
    command.add_argument('--force', action='store_true', help='overwrite an existing file')


def execute_new(options: argparse.Namespace) -> int:
    """Write the configuration; return the exit code.

    Raises:
        BagError: a bag cannot be read.
        ValueError: nothing was seen, or there is no master.
        OSError: the file exists already, or cannot be written.
    """
    if options.bags:
        new = from_bags(options.bags)
    else:
        check_master()
        rospy.init_node('cell_new', anonymous=True, disable_signals=True)
        new = from_system()
    try:
        paths = write_new(new, options.output, None if options.force else ())
    except FileExistsError as error:
        raise FileExistsError(f'{error}; --force overwrites it') from error
    for path in paths:
        say(path)
    say(f'{new.summary}; read its comments, then: '
        f'rosrun process_visualizer cell check {options.output}')
    return 0


def check_master() -> None:
    """Raise ValueError if no master answers."""
    master = RosMaster()
    if not master.is_online():
        raise ValueError(f'there is no ROS master at {master.uri}; start the drivers, or name a '
                         'bag')
