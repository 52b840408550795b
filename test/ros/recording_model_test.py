#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""The launcher's recording model with the real recorder, linked as the window links them."""
from __future__ import annotations

import os
import sys
import tempfile
import unittest
from typing import Callable, List

import rostest
from PyQt5.QtCore import QCoreApplication, QEventLoop, QTimer
from recorder_testing import Stream, numbers

from process_visualizer.bags.marks import read_marks
from process_visualizer.bags.recording import Recording
from process_visualizer.cell.errors import Location
from process_visualizer.cell.model import Device, DeviceType, Topic
from process_visualizer.gui.models.recording.recording_choices import NameChoice
from process_visualizer.gui.models.recording.recording_model import RecordingModel
from process_visualizer.gui.models.recording.recording_types import Phase
from process_visualizer.gui.models.recording.topic_ticks import TopicHealth
from process_visualizer.gui.ros.ros_link import RosLink
from process_visualizer.gui.toolkit.tasks import Tasks

TOPIC = '/recording_model_test/numbers'
HERE = Location('cell.xml', 1)
TIMEOUT_MS = 20000


def wait_until(condition: Callable[[], bool]) -> None:
    """Run the GUI thread until the condition holds."""
    loop, clock, deadline = QEventLoop(), QTimer(), QTimer()
    clock.timeout.connect(lambda: loop.quit() if condition() else None)
    deadline.setSingleShot(True)
    deadline.timeout.connect(loop.quit)
    clock.start(10)
    deadline.start(TIMEOUT_MS)
    loop.exec_()
    assert condition(), 'it did not come true'


class RecordingModelTest(unittest.TestCase):
    """Commands of the window, and what the recorder makes of them."""

    def setUp(self) -> None:
        temporary = tempfile.TemporaryDirectory()
        self.addCleanup(temporary.cleanup)
        self.folder = temporary.name
        self.tasks = Tasks()
        self.addCleanup(self.tasks.close)
        self.model = RecordingModel(self.tasks, link.recorder)
        link.recorder_state.connect(self.model.take_state)
        self.addCleanup(lambda: link.recorder_state.disconnect(self.model.take_state))
        self.failures: List[str] = []
        self.finished: List[str] = []
        self.model.failed.connect(self.failures.append)
        self.model.finished.connect(self.finished.append)
        device = Device(DeviceType.OTHER, 'device', HERE,
                        topics=(Topic(TOPIC, None, None, True, HERE),))
        self.model.choices.set_devices([device])
        self.model.choices.set_folder(self.folder)
        self.model.choices.choose_name(NameChoice.NAME)
        self.model.choices.set_name('seam')
        self.model.set_running(True)
        wait_until(lambda: self.model.phase is Phase.IDLE)

    def record(self) -> None:
        """Record until some messages have come."""
        self.model.start()
        wait_until(lambda: self.model.phase is Phase.RECORDING
                   and self.model.state.snapshot.messages > 100)

    def test_a_recording_with_a_mark(self) -> None:
        with Stream(TOPIC):
            self.record()
            row = self.model.choices.topics[0]
            self.assertIs(row.health, TopicHealth.GOOD)
            self.model.set_label('the seam tears')
            self.model.mark()
            self.model.stop()
            wait_until(lambda: bool(self.finished))
            bag = os.path.join(self.folder, 'seam.bag')
            self.assertEqual(self.finished, [bag])
            self.assertGreater(len(numbers(bag, TOPIC)), 100)
            with Recording([bag]) as recording:
                self.assertEqual([mark.label for mark in read_marks(recording)],
                                 ['the seam tears'])
            self.model.start()
            wait_until(lambda: bool(self.failures))
            self.assertIn('seam.bag exists already', self.failures[0])
            self.model.choices.set_name(self.model.choices.free_name)
            self.record()
            self.model.stop()
            wait_until(lambda: len(self.finished) == 2)
        self.assertEqual(self.finished[1], os.path.join(self.folder, 'seam-2.bag'))
        self.assertEqual(len(self.failures), 1)

    def test_save_the_last_seconds(self) -> None:
        with Stream(TOPIC):
            wait_until(lambda: self.model.state.recent_s > 1.0)
            self.model.save_recent()
            wait_until(lambda: bool(self.finished))
        self.assertTrue(os.path.basename(self.finished[0]).startswith('seam_'))
        self.assertGreater(len(numbers(self.finished[0], TOPIC)), 100)
        self.assertEqual(self.failures, [])

    def test_the_folder_is_a_file(self) -> None:
        with Stream(TOPIC):
            self.model.choices.set_folder(os.path.join(self.folder, 'file', 'bags'))
            with open(os.path.join(self.folder, 'file'), 'w', encoding='utf-8'):
                self.model.start()
                wait_until(lambda: bool(self.failures))
        self.assertIn('is no folder', self.failures[0])
        self.assertIs(self.model.phase, Phase.IDLE)


if __name__ == '__main__':
    application = QCoreApplication(sys.argv)
    link = RosLink()
    link.begin()
    rostest.rosrun('process_visualizer', 'recording_model_test', RecordingModelTest)
