# SPDX-License-Identifier: BSD-3-Clause
"""The command ``cell record``: starts a recorder, watches it and stops it."""
from __future__ import annotations

import dataclasses
import os
import signal
import subprocess
import sys
import threading
from typing import List, Optional, Sequence

import rosgraph
import rospy
from roslib.packages import find_node

from process_visualizer.bags.recording import Recording
from process_visualizer.cell.model import Cell, Device
from process_visualizer.cell.stored_configuration import configuration_text
from process_visualizer.clients.bag_recorder import BagRecorder
from process_visualizer.clients.recording_options import (
    RecorderError,
    RecorderUnreachable,
    RecordingOptions,
)
from process_visualizer.commands.record_options import RecordOptions, queue_parameter
from process_visualizer.generate.launch_file import recorded_topics
from process_visualizer.launching.asked_master import PATIENT_TIMEOUT_S, AskedMaster
from process_visualizer.launching.roslaunch_process import dying_with_parent
from process_visualizer.msg import RecorderState
from process_visualizer.report.report import make_report
from process_visualizer.report.report_text import as_text
from process_visualizer.ros_names import BAG_RECORDER, PACKAGE
from process_visualizer.shown_text import say

_READY_TIMEOUT_S = 10.0
_STATE_TIMEOUT_S = 1.0  # states come twice a second; none come of a recorder that has died


def record(cell: Optional[Cell], devices: Sequence[Device], options: RecordOptions) -> int:
    """Record until SIGINT, SIGTERM or the limit, then report; return the exit code.

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
    """One recording by its own recorder; reports to the operator at once what matters."""

    def __init__(self, process: 'subprocess.Popen[bytes]', options: RecordOptions) -> None:
        """Watch the recorder's process; its states come to `take_state`."""
        self._process = process
        self._wanted = options
        self._end = threading.Event()
        self._reported_problems = 0
        self._ended = False  # by itself
        self._files: List[str] = []

    def run(self, recorder: BagRecorder, options: RecordingOptions,
            is_time_simulated: bool) -> int:
        """Record until a signal or the limit, or until the recorder ends; return the exit code.

        If time is simulated, wait for the first one: messages before it have none.
        """
        recorder.wait_until_ready(_READY_TIMEOUT_S)
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, lambda *_: self._end.set())
        threading.Thread(target=self._follow_process, daemon=True).start()
        if is_time_simulated:
            self._wait_for_time(recorder)
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
        """Stop the recording and report; return 1 if it had ended by itself, else 0.

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
        """Stop by the service or, if the master is gone, by a signal; return the bags."""
        try:
            return recorder.stop()
        except RecorderUnreachable:
            self._process.send_signal(signal.SIGINT)
            self._process.send_signal(signal.SIGCONT)  # one that was stopped would never end
            self._process.wait()
            return self._files

    def take_state(self, state: RecorderState) -> None:
        """Tell new problems, and note whether the recording has to end or has ended by itself."""
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
    """The topics that a node subscribes to, as the master knows them."""
    if not node:
        return []
    name = rosgraph.names.resolve_name(node, '/')
    subscribers = AskedMaster('/cell_record', timeout_s=PATIENT_TIMEOUT_S).getSystemState()[1]
    topics = [topic for topic, names in subscribers if name in names]
    if not topics:
        raise RecorderError(f'{name} subscribes to no topic; "rosnode list" shows the nodes')
    return topics


def _command(name: str, options: RecordOptions) -> List[str]:
    """The recorder's program; it is interrupted, and finishes its bag, if this process dies."""
    programs = find_node(PACKAGE, BAG_RECORDER)
    if not programs:
        raise OSError('the program bag_recorder is not built; build the workspace')
    queue = [] if options.queue_mb is None else [queue_parameter(options.queue_mb)]
    folder = options.recording.folder  # others in the network may choose one below it only
    return [*dying_with_parent(), programs[0], f'__name:={name}', '_recent_duration:=0',
            *([f'_folder:={folder}'] if folder else []), *queue]
