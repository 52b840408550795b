"""The command ``cell record``: a recorder of its own, started, watched and stopped again."""
from __future__ import annotations

import argparse
import os
import signal
import subprocess
import sys
import threading
from typing import List, Sequence

import rosgraph
import rospy
from roslib.packages import find_node

from process_visualizer.bags.recording import Recording
from process_visualizer.bags.recording_options import (
    RecorderError,
    RecorderUnreachable,
    RecordingOptions,
)
from process_visualizer.bags.report import make_report
from process_visualizer.bags.report_text import as_text
from process_visualizer.cell.model import Cell, Device
from process_visualizer.cell.stored_configuration import configuration_text
from process_visualizer.generate.launch_file import recorded_topics
from process_visualizer.launching.roslaunch_process import dying_with_parent
from process_visualizer.msg import RecorderState
from process_visualizer.nodes.bag_recorder import BagRecorder

_READY_TIMEOUT_S = 10.0


def add_record_options(command: argparse.ArgumentParser) -> None:
    """Add the options of the command to its parser."""
    command.add_argument('--folder', default='.', help='created if there is none')
    command.add_argument('--prefix', default='', help='the bag is called PREFIX_DATE.bag')
    command.add_argument('--name', default='', help='or NAME.bag; never overwrites')
    command.add_argument('--lz4', action='store_true', help='compress')
    command.add_argument('--split-mb', type=int, default=0, metavar='MB',
                         help='begin a new file at this size')
    command.add_argument('--split-s', type=float, default=0.0, metavar='S',
                         help='begin a new file after this time')


def record(cell: Cell, devices: Sequence[Device], options: argparse.Namespace) -> int:
    """Record the devices' topics until SIGINT or SIGTERM, then report; return the exit code.

    Raises:
        OSError: the configuration cannot be read.
    """
    if not rosgraph.is_master_online():
        print(f'cell: there is no ROS master at {rosgraph.get_master_uri()}; start the cell first',
              file=sys.stderr)
        return 1
    name = f'bag_recorder_{os.getpid()}'
    process = subprocess.Popen(_command(name), start_new_session=True, stdin=subprocess.DEVNULL)
    try:
        rospy.init_node('cell_record', anonymous=True, disable_signals=True)
        return _Recording(f'/{name}', process).run(_options(cell, devices, options))
    except RecorderError as error:
        print(f'cell: {error}', file=sys.stderr)
        return 1
    finally:
        process.send_signal(signal.SIGINT)
        process.wait()


class _Recording:
    """One recording by a recorder of its own; what the operator has to know is told at once."""

    def __init__(self, node: str, process: 'subprocess.Popen[bytes]') -> None:
        self._process = process
        self._end = threading.Event()
        self._told = 0  # problems
        self._ended = False  # by itself
        self._files: List[str] = []
        self._recorder = BagRecorder(self._take_state, node)

    def run(self, options: RecordingOptions) -> int:
        """Record until a signal, or until the recorder ends; return the exit code."""
        self._recorder.wait_until_ready(_READY_TIMEOUT_S)
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, lambda *_: self._end.set())
        path = self._recorder.start(options)
        self._files = [path]
        print(f'recording {path}', flush=True)
        threading.Thread(target=self._follow_process, daemon=True).start()
        self._end.wait()
        return self._finish()

    def _finish(self) -> int:
        if self._process.poll() is not None:
            raise RecorderError('the recorder has died; "rosrun process_visualizer cell reindex '
                                f'{self._files[-1]}.active" makes a bag of what it has written')
        ended = self._ended
        with Recording(self._files if ended else self._stop()) as recording:
            print(as_text(make_report(recording)))
        return 1 if ended else 0

    def _stop(self) -> List[str]:
        """Stop by the service or, if the master is gone with it, by a signal; return the bags."""
        try:
            return self._recorder.stop()
        except RecorderUnreachable:
            self._process.send_signal(signal.SIGINT)
            self._process.wait()
            return self._files

    def _take_state(self, state: RecorderState) -> None:
        new = min(state.problem_count - self._told, len(state.problems))
        for problem in state.problems[len(state.problems) - new:]:
            print(problem, file=sys.stderr, flush=True)
        self._told = state.problem_count
        if state.files:
            self._files = list(state.files)
            self._ended = state.state == RecorderState.IDLE
        if self._ended:
            self._end.set()

    def _follow_process(self) -> None:
        self._process.wait()
        self._end.set()


def _options(cell: Cell, devices: Sequence[Device],
             options: argparse.Namespace) -> RecordingOptions:
    return RecordingOptions(
        topics=tuple(recorded_topics(devices)), folder=os.path.abspath(options.folder),
        prefix=options.prefix, name=options.name, compression='lz4' if options.lz4 else 'none',
        split_bytes=options.split_mb << 20, split_duration_s=options.split_s,
        configuration=configuration_text(cell))


def _command(name: str) -> List[str]:
    """The recorder's program; it is interrupted, and finishes its bag, if this process dies."""
    programs = find_node('process_visualizer', 'bag_recorder')
    if not programs:
        raise OSError('the program bag_recorder is not built; build the workspace')
    return [*dying_with_parent(), programs[0], f'__name:={name}', '_recent_duration:=0']
