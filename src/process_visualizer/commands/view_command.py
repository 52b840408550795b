# SPDX-License-Identifier: BSD-3-Clause
"""The command ``cell view``: shows a cell that runs elsewhere, without changing anything in it."""
from __future__ import annotations

import argparse
import contextlib
import os
import shutil
import socket
import sys
from functools import partial
from typing import Dict, Iterator, Tuple

import rosgraph

from process_visualizer.commands.stop_signals import StopRequested, StopSignals
from process_visualizer.launching.ros_master import RosMaster
from process_visualizer.launching.run_record import (
    RunRecord,
    clean_up_crashed_runs,
)
from process_visualizer.remote.link_words import Address, address_of
from process_visualizer.shown_text import say
from process_visualizer.viewing.finding import CellNotFound, find_relay

_NODE = 'cell_view'


def add_view_options(command: argparse.ArgumentParser) -> None:
    """Add the options of ``cell view``."""
    command.add_argument('--master', metavar='HOST', type=_address, default=None,
                         help='the computer on which the cell runs, or HOST:PORT (default: that of '
                              'ROS_MASTER_URI)')
    command.add_argument('--check', action='store_true',
                         help='only say whether the cell can be watched, and what is in the way')
    command.add_argument('--no-rviz', action='store_true',
                         help='without RViz: topics and models for other programs, on a ROS master '
                              'of its own, which is printed')


def execute_view(options: argparse.Namespace) -> int:
    """Show the cell until RViz is closed or Ctrl-C is pressed; return the exit code.

    Raises:
        RosMasterError, OSError: RViz cannot be started.
    """
    wanted = options.master or address_of(rosgraph.get_master_uri())
    try:
        address = find_relay(wanted)
    except CellNotFound as error:
        for problem in error.problems:
            say(f'cell: {problem}', file=sys.stderr)
        return 1
    if options.check:
        say(f'the cell on {address[0]} can be watched (port {address[1]})')
        return 0
    clean_up_crashed_runs()
    try:
        with StopSignals() as signals, signals.raised(), _own_master() as uri:
            if options.no_rviz:
                say(f'ROS_MASTER_URI={uri}')
            return _show(wanted, address, not options.no_rviz)
    except StopRequested:
        return 0


def _address(text: str) -> Address:
    try:
        return address_of(text)
    except ValueError as error:
        raise argparse.ArgumentTypeError(str(error)) from None


def _show(wanted: Address, address: Tuple[str, int], with_rviz: bool) -> int:
    import rospy  # only now, as it reads the address of its master

    from process_visualizer.viewing.viewer import Viewer
    rospy.init_node(_NODE, anonymous=True, disable_signals=True, argv=[])
    record = RunRecord()
    folder = record.begin()
    viewer = Viewer(str(wanted), address, partial(find_relay, wanted), folder, say, with_rviz)
    try:
        return viewer.run()
    except StopRequested:
        return 0
    finally:
        viewer.close()
        rospy.signal_shutdown('the viewer ends')
        shutil.rmtree(folder, ignore_errors=True)
        record.remove()


@contextlib.contextmanager
def _own_master() -> Iterator[str]:
    """Run a ROS master for this computer only; this process uses it from now on."""
    with contextlib.closing(socket.socket()) as probe:
        probe.bind(('localhost', 0))
        port = probe.getsockname()[1]
    own: Dict[str, str] = {'ROS_MASTER_URI': f'http://localhost:{port}',
                           'ROS_HOSTNAME': 'localhost'}
    os.environ.pop('ROS_IP', None)  # the nodes of the viewer are for this computer only
    os.environ.update(own)
    master = RosMaster()
    try:
        master.ensure()
        yield master.uri
    finally:
        master.stop()
