# SPDX-License-Identifier: BSD-3-Clause
"""A recorder that the tests control, devices, and the states that it would send."""
from __future__ import annotations

import threading
from typing import Any, Callable, List, Optional, Sequence

from process_visualizer.cell.errors import Location
from process_visualizer.cell.model import Device, DeviceType, Topic
from process_visualizer.clients.bag_recorder import RecordingOptions
from process_visualizer.gui.recording.recording_model import BagVerdict
from process_visualizer.gui.ros.snapshots import RecorderSnapshot, TopicSnapshot

HERE = Location('cell.xml', 1)
BAG = '/bags/seam.bag'


def topic(name: str, record: bool = True) -> Topic:
    return Topic(name, None, None, record, HERE)


def devices() -> List[Device]:
    return [Device(DeviceType.ROBOT, 'robot', HERE,
                   topics=(topic('/robot/q_act'), topic('/robot/tcf'))),
            Device(DeviceType.DEPTH_SENSOR, 'kinect', HERE,
                   topics=(topic('/kinect/image'), topic('/kinect/points', False)))]


def seen(name: str, rate_hz: float = 125.0, silence_s: Optional[float] = 0.01,
         publishers: int = 1, messages: int = 1000,
         is_latched: bool = False) -> TopicSnapshot:
    return TopicSnapshot(name, 'std_msgs/Float32MultiArray', publishers, messages, rate_hz,
                         messages * 60, 0, 0, silence_s, is_latched)


def told(phase: str = 'idle', **values: Any) -> RecorderSnapshot:
    topics = (seen('/robot/q_act'), seen('/robot/tcf'), seen('/kinect/image', 30.0))
    return RecorderSnapshot(phase, **{'rate': 20e6, 'recent_s': 30.0, 'topics': topics, **values})


class StandInRecorder:
    """Recorder with preset answers; while ``gate`` is not set every command waits."""

    def __init__(self) -> None:
        self.gate = threading.Event()
        self.gate.set()
        self.error: Optional[Exception] = None
        self.path = BAG
        self.options: Optional[RecordingOptions] = None
        self.commands: List[str] = []
        self.stamps_s: List[float] = []  # of marks
        self.verdict = BagVerdict(True, 'complete')
        self.judged: List[Sequence[str]] = []
        self.judging = threading.Event()
        self.judging.set()

    def judge(self, paths: Sequence[str]) -> BagVerdict:
        self.judging.wait()
        self.judged.append(paths)
        return self.verdict

    def start(self, options: RecordingOptions) -> str:
        self.options = options
        return str(self._do('start', lambda: self.path))

    def save_recent(self, options: RecordingOptions) -> str:
        self.options = options
        return str(self._do('save_recent', lambda: self.path))

    def stop(self) -> List[str]:
        return list(self._do('stop', lambda: [self.path]))

    def mark(self, label: str, stamp_s: float) -> None:
        self.stamps_s.append(stamp_s)
        self._do(f'mark {label}', lambda: None)

    def _do(self, command: str, answer: Callable[[], Any]) -> Any:
        assert self.gate.wait(60)
        self.commands.append(command)
        if self.error is not None:
            raise self.error
        return answer()
