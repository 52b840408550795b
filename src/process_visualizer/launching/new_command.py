"""The command ``cell new``: a configuration from what runs, or from a bag."""
from __future__ import annotations

import argparse
import dataclasses
from typing import Sequence

import rosgraph
import rospy

from process_visualizer.bags.recording import Recording
from process_visualizer.discovery.bag_look import look_into
from process_visualizer.discovery.new_configuration import (
    NewConfiguration,
    new_configuration,
    write_new,
)
from process_visualizer.discovery.recorded_models import recorded_models
from process_visualizer.launching.ros_master import RosMaster
from process_visualizer.nodes.system_look import look_at_system

DEFAULT_FILE = 'cell.xml'


def add_new_options(command: argparse.ArgumentParser) -> None:
    """Add the options of ``cell new``."""
    command.add_argument('bags', metavar='BAG', nargs='*',
                         help='look into this recording instead of at what runs')
    command.add_argument('-o', '--output', metavar='FILE', default=DEFAULT_FILE,
                         help=f'the file to write ({DEFAULT_FILE})')
    command.add_argument('--force', action='store_true', help='overwrite what is there')


def execute_new(options: argparse.Namespace) -> int:
    """Write the configuration; return the exit code.

    Raises:
        BagError: a bag cannot be read.
        ValueError: nothing was seen, or there is no master.
        OSError: a file is there already, or cannot be written.
    """
    if options.bags:
        new = from_bags(options.bags)
    else:
        check_master()
        rospy.init_node('cell_new', anonymous=True, disable_signals=True)
        new = from_system()
    for path in write_new(new, options.output, options.force):
        print(path)
    print(f'{new.summary}; look at its comments, then: '
          f'rosrun process_visualizer cell check {options.output}')
    return 0


def from_bags(paths: Sequence[str]) -> NewConfiguration:
    """Return a configuration for a recording.

    Raises:
        BagError: it cannot be read.
        ValueError: it holds nothing of a device.
    """
    with Recording(paths) as recording:
        models, remarks = recorded_models(recording)
        seen = look_into(recording)
    told = remarks if models else [*remarks, *seen.remarks]
    return new_configuration(dataclasses.replace(seen, remarks=tuple(told)), models)


def from_system() -> NewConfiguration:
    """Return a configuration for what runs; this process must be a node.

    Raises:
        ValueError: nothing runs that belongs into one, or the master has gone.
    """
    try:
        return new_configuration(look_at_system(rosgraph.Master(rospy.get_name())))
    except (rosgraph.MasterException, ConnectionError) as error:
        raise ValueError(f'the ROS master does not answer any more: {error}') from error


def check_master() -> None:
    """Raise ValueError if no master answers."""
    master = RosMaster()
    if not master.is_online():
        raise ValueError(f'there is no ROS master at {master.uri}; start the drivers, or name a '
                         'bag')
