# SPDX-License-Identifier: BSD-3-Clause
"""An object that nobody modelled comes near a robot: the operator is told, and when it is gone."""
from __future__ import annotations

from pathlib import Path
from typing import Any, Callable, Iterator, List

import pytest
import rospy
from operator_at_work import Operator, nodes
from PyQt5.QtCore import QTimer
from PyQt5.QtWidgets import QPlainTextEdit, QPushButton

from process_visualizer.gui.views.cell.alarm_strip import AlarmChip
from process_visualizer.gui.views.live.live_timeline import LiveTimeline
from process_visualizer.health.device_state import Level
from process_visualizer.health.object_spans import times
from process_visualizer.msg import DetectedObject, DetectedObjects

CELL = """<visualizer>
  <device type="depth_sensor" name="kinect">
    <base frame="kinect_link" />
    <topic ns="kinect" name="cloud" type="pointcloud" />
    <objects warn="0.5" stop="0.2" />
  </device>
</visualizer>
"""


class Finder:
    """Plays object_finder, whose real node gets no clouds here: ten messages a second."""

    def __init__(self) -> None:
        self.objects: List[DetectedObject] = []
        self._publisher = rospy.Publisher('/kinect/objects', DetectedObjects, queue_size=1)
        self._timer = QTimer(interval=100)
        self._timer.timeout.connect(self._publish)
        self._timer.start()

    def see(self, distance_m: float, level: int) -> None:
        thing = DetectedObject(number=3, link='arm/hand', distance=distance_m, level=level)
        thing.size.x, thing.size.y, thing.size.z = 0.24, 0.18, 0.3
        self.objects = [thing]

    def end(self) -> None:
        self._timer.stop()
        self._publisher.unregister()

    def _publish(self) -> None:
        message = DetectedObjects(objects=self.objects)
        message.header.stamp = rospy.Time.now()
        self._publisher.publish(message)


@pytest.fixture
def operator(qtbot: Any) -> Iterator[Operator]:
    person = Operator(qtbot)
    yield person
    person.close()


def chips(operator: Operator) -> List[str]:
    """What is told of objects; on a busy machine there may be other alarms."""
    texts = [it.text.text().split('  ')[1] for it in operator.window.findChildren(AlarmChip)
             if it.isVisible()]
    return [text for text in texts if 'object' in text]


def await_chips(operator: Operator, is_right: Callable[[List[str]], bool], what: str) -> None:
    operator.wait(lambda: is_right(chips(operator)), what, instead=lambda: chips(operator))


def test_an_object_near_a_robot(operator: Operator, tmp_path: Path) -> None:
    config = tmp_path / 'cell.xml'
    config.write_text(CELL)
    operator.launcher.cell.open(str(config))
    operator.wait(lambda: operator.launcher.blocked_reason() == '', 'it can be launched')
    operator.click('launch')
    operator.wait(lambda: '/kinect/object_finder' in nodes()
                  and operator.launcher.launch.is_running, 'all is up')
    finder = Finder()
    try:
        it_is_told(operator, finder)
        it_goes_away(operator, finder)
    finally:
        finder.end()


def it_is_told(operator: Operator, finder: Finder) -> None:
    finder.see(0.31, DetectedObject.WARN)
    await_chips(operator, lambda it: it == [
        "kinect: object 3 is 0.31 m from arm's hand: 24 × 18 × 30 cm"], 'an alarm')
    finder.see(0.12, DetectedObject.STOP)
    await_chips(operator, lambda it: 'object 3 is 0.12 m' in ''.join(it), 'it is nearer')
    assert operator.launcher.alarms.alarms[0].condition.level is Level.BAD
    buttons = operator.window.findChildren(QPushButton, 'alarm_replay')
    assert any(it.isVisible() for it in buttons)  # that of the chip before may not be deleted yet


def it_goes_away(operator: Operator, finder: Finder) -> None:
    finder.objects = []
    await_chips(operator, lambda it: not it, 'nothing is near')
    operator.click('show_events')
    events = operator.widget('events_text', QPlainTextEdit).toPlainText()
    assert [line.split('  ')[1][:24] for line in events.splitlines() if 'object' in line] == [
        'kinect: object 3 is 0.31', 'kinect: object 3 is 0.12', 'kinect: object 3 is 0.12']
    timeline = operator.widget('live_timeline', LiveTimeline)
    assert len(times(timeline.near, Level.WARNING)) == len(times(timeline.near, Level.BAD)) == 1
