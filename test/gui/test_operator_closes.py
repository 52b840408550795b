# SPDX-License-Identifier: BSD-3-Clause
"""An operator drags a base frame in RViz, records, and closes the window meanwhile."""
from __future__ import annotations

from pathlib import Path
from typing import Any, Dict, Iterator, List

import pytest
import rospy
from operator_at_work import Operator, launch_small_cell, processes
from PyQt5.QtCore import QPoint, QRect
from PyQt5.QtWidgets import QMessageBox
from screen_mouse import move_to, press, press_key_in, release, topmost_blue
from tf2_msgs.msg import TFMessage
from visualization_msgs.msg import InteractiveMarkerFeedback

from process_visualizer.bagio.catalog import read_catalog
from process_visualizer.generate.rviz_config import CALIBRATION_TOPIC
from process_visualizer.gui.recording.recording_types import RecordingPhase
from process_visualizer.rviz.window_geometry import Rectangle

RVIZ = Rectangle(460, 0, 1140, 620)


@pytest.fixture
def operator(qtbot: Any) -> Iterator[Operator]:
    person = Operator(qtbot)
    yield person
    person.close()


def test_drag_record_and_close(operator: Operator, tmp_path: Path) -> None:
    launch_small_cell(operator, tmp_path)
    drag_the_frame(operator)
    start_recording(operator)
    operator.window.close()
    assert operator.window.isVisible()
    assert 'Finish and keep it, quit all nodes and close?' in operator.widget(
        'question', QMessageBox).text()
    assert operator.text('yes') == 'Finish and close'
    operator.click('yes')
    operator.wait(lambda: not operator.window.isVisible(), 'the window closes')
    operator.close()
    [bag] = tmp_path.glob('*.bag')
    assert read_catalog([str(bag)]).duration_s > 0.5
    assert not list(tmp_path.glob('*.active'))
    assert f'recorded {bag.name}' in Path(f'{bag}.events.txt').read_text()
    assert {it for it in processes('GUI_TEST_MARK') if 'Xvfb' not in it} == set()


def drag_the_frame(operator: Operator) -> None:
    """Drag the arrow that points upwards: the frame moves up, in no other direction."""
    frames: Dict[str, float] = {}
    events: List[int] = []
    ear = rospy.Subscriber(f'{CALIBRATION_TOPIC}/feedback', InteractiveMarkerFeedback,
                           lambda feedback: events.append(feedback.event_type))
    listener = rospy.Subscriber('/tf_static', TFMessage, lambda message: frames.update(
        {it.child_frame_id: it.transform.translation.z for it in message.transforms}))
    model = operator.launcher.calibration
    area = QRect(RVIZ.x, RVIZ.y + 80, RVIZ.width, RVIZ.height - 120)
    operator.window.panels.setCurrentWidget(operator.window.calibration)
    operator.wait(lambda: operator.widget('calibration_marker').isEnabled(), 'it can be moved')
    assert model.base is not None and model.base.frame == 'sensors/base'
    operator.click('calibration_marker')
    operator.wait(lambda: topmost_blue(area) is not None, 'the arrow upwards')
    press_key_in('RViz', 'i')
    tip = topmost_blue(area)
    assert tip is not None
    take_hold(operator, tip + QPoint(0, 12), events)
    for step in range(1, 6):
        count = events.count(InteractiveMarkerFeedback.POSE_UPDATE)
        move_to(tip + QPoint(0, 12 - 20 * step))
        operator.wait(lambda before=count:  # type: ignore[misc]
                      events.count(InteractiveMarkerFeedback.POSE_UPDATE) > before, 'it moves',
                      instead=lambda: events)
    let_go(operator, events)
    operator.wait(lambda: model.pose.xyz[2] > 0.1, 'the frame is higher',
                  instead=lambda: model.pose)
    assert model.pose.xyz[:2] + model.pose.ypr == pytest.approx((0.0,) * 5, abs=1e-6)
    operator.wait(lambda: frames.get('sensors/base') == pytest.approx(model.pose.xyz[2]),
                  'ROS knows it', instead=lambda: frames)
    assert 'Unsaved' in operator.text('calibration_state')
    operator.click('calibration_revert')
    operator.wait(lambda: frames['sensors/base'] == 0.0, 'it is back', instead=lambda: frames)
    for subscriber in (listener, ear):
        subscriber.unregister()


def take_hold(operator: Operator, place: QPoint, events: List[int]) -> None:
    """Press the mouse there, until RViz takes hold of the arrow: it must see the mouse move."""
    held = InteractiveMarkerFeedback.MOUSE_DOWN
    for attempt in range(60):
        move_to(place + QPoint(0, attempt % 2))
        press()
        if operator.is_seen(lambda: held in events, 2.0):
            return
        release()
    raise AssertionError(f'RViz does not take the arrow: {events}')


def let_go(operator: Operator, events: List[int]) -> None:
    """Release the mouse, and wait until RViz has processed all events.

    On a busy computer, presses of ``take_hold`` may still be queued: it would release, take hold
    again and continue dragging. Its reports come from the thread that handles the mouse.
    """
    reports: List[Any] = []
    release()
    operator.launcher.link.displays.connect(reports.append)
    operator.wait(lambda: len(reports) > 2 and events.count(InteractiveMarkerFeedback.MOUSE_UP)
                  >= events.count(InteractiveMarkerFeedback.MOUSE_DOWN), 'RViz lets go',
                  instead=lambda: events)


def start_recording(operator: Operator) -> None:
    recording = operator.launcher.recording
    operator.window.panels.setCurrentIndex(0)
    operator.click('record')
    operator.wait(lambda: recording.phase is RecordingPhase.RECORDING and recording.elapsed_s > 1.0,
                  'it records')
