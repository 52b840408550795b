# SPDX-License-Identifier: BSD-3-Clause
"""Messages of nodes reach the operator: omitted data with reasons, and the frame of the poses."""
from __future__ import annotations

import math
import shutil
import threading
from pathlib import Path
from typing import Any, Iterator, List

import numpy as np
import pytest
import rospy
from geometry_msgs.msg import PoseStamped
from operator_at_work import Operator, nodes
from PyQt5.QtCore import Qt
from PyQt5.QtTest import QTest
from PyQt5.QtWidgets import QPlainTextEdit
from sensor_msgs.msg import JointState
from std_msgs.msg import Float64

from process_visualizer.gui.cell.devices_panel import DevicesView
from process_visualizer.robot.kinematics import Kinematics, Placement

DATA = Path(__file__).resolve().parents[1] / 'data'
HOLD_S = 0.6
JOINTS = [f'panda_joint{number}' for number in range(1, 8)] + ['panda_finger_joint1']
CELL = """<visualizer>
  <device type="robot" name="arm">
    <base frame="panda_link0" />  <!-- bolted -->
    <model path="panda_hand.urdf" />
    <topic ns="arm" name="joints" type="joint_states" />
    <topic ns="arm" name="pose" type="tool_center_frame" />
    <variable topic="/arm/heat" field="data" frame="panda_hand" offset_param="/arm/zero" />
  </device>
</visualizer>
"""
BAD_TEXT = 'it holds NaN or infinity'


class Driver:
    """Plays the arm's driver: it stands still at one pose after the other.

    Its poses are those of panda_link7, which is 0.107 m from the hand.
    """

    def __init__(self) -> None:
        self.is_wrong = True
        self._model = Kinematics((DATA / 'panda_hand.urdf').read_text())
        self._joints = rospy.Publisher('/arm/joints', JointState, queue_size=1)
        self._poses = rospy.Publisher('/arm/pose', PoseStamped, queue_size=1)
        self._heat = rospy.Publisher('/arm/heat', Float64, queue_size=1)
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def end(self) -> None:
        self._ended.set()
        self._thread.join()

    def _run(self) -> None:
        random = np.random.default_rng(5)
        while not self._ended.is_set():
            places = [*random.uniform(-1.0, 1.0, 7).tolist(), 0.02]
            for _ in range(round(HOLD_S / 0.02)):
                self._send(places)
                if self._ended.wait(0.02):
                    return

    def _send(self, places: List[float]) -> None:
        found = self._model.placement('panda_link7', 'panda_link0', dict(zip(JOINTS, places)))
        assert found is not None
        joints = JointState(name=JOINTS, position=places)
        joints.header.stamp = rospy.Time.now()
        self._joints.publish(joints)
        self._poses.publish(pose(found, self.is_wrong))
        self._heat.publish(0.1)


def pose(place: Placement, is_wrong: bool) -> PoseStamped:
    """Return the message of a pose; a wrong one has NaN as rotation."""
    message = PoseStamped()
    message.header.stamp = rospy.Time.now()
    at, turn = message.pose.position, message.pose.orientation
    at.x, at.y, at.z = place.position
    turn.x, turn.y, turn.z, turn.w = (math.nan,) * 4 if is_wrong else place.quaternion
    return message


@pytest.fixture
def operator(qtbot: Any) -> Iterator[Operator]:
    person = Operator(qtbot)
    yield person
    person.close()


def test_what_nodes_say(operator: Operator, tmp_path: Path) -> None:
    shutil.copy(DATA / 'panda_hand.urdf', tmp_path)
    config = tmp_path / 'cell.xml'
    config.write_text(CELL)
    launch(operator, config)
    driver = Driver()
    try:
        a_message_is_left_out_and_why(operator)
        driver.is_wrong = False
        what_is_mended_goes_away(operator)
        a_line_of_a_log_stands_there_too(operator)
        the_tool_is_learned_and_written(operator, config)
    finally:
        driver.end()


def devices(operator: Operator) -> DevicesView:
    return operator.widget('devices', DevicesView)


def told(operator: Operator) -> str:
    return '; '.join(it.text for it in operator.launcher.states.warnings('arm'))


def launch(operator: Operator, config: Path) -> None:
    operator.launcher.cell.open(str(config))
    operator.wait(lambda: operator.launcher.blocked_reason() == '', 'it can be launched')
    operator.click('launch')
    operator.wait(lambda: '/arm/robot_proc' in nodes() and operator.launcher.launch.is_running,
                  'all is up')
    assert devices(operator).state_text('arm') == 'running'


def a_message_is_left_out_and_why(operator: Operator) -> None:
    operator.wait(lambda: BAD_TEXT in told(operator), 'the warning',
                  instead=lambda: told(operator))
    row = devices(operator).topLevelItem(0)
    # at the beginning there may be one more, about data that has not arrived yet
    operator.wait(lambda: row.text(1) == '1 warning: click to read', 'one warning',
                  instead=lambda: f'{row.text(1)}: {told(operator)}')
    QTest.mouseClick(devices(operator).viewport(), Qt.LeftButton,
                     pos=devices(operator).visualItemRect(row).center() + _right(operator))
    operator.wait(lambda: BAD_TEXT in warnings_text(operator), 'all of it')
    assert '/arm/robot_proc, warning, ' in warnings_text(operator)


def warnings_text(operator: Operator) -> str:
    return operator.widget('warnings_text', QPlainTextEdit).toPlainText()


def _right(operator: Operator) -> Any:
    """Return the step from the middle of a row to its right column."""
    rectangle = devices(operator).visualItemRect(devices(operator).topLevelItem(0))
    return (rectangle.topRight() - rectangle.topLeft()) / 4


def what_is_mended_goes_away(operator: Operator) -> None:
    operator.wait(lambda: BAD_TEXT not in told(operator), 'it has gone',
                  instead=lambda: told(operator))
    assert BAD_TEXT not in warnings_text(operator)
    operator.widget('warnings').close()


def a_line_of_a_log_stands_there_too(operator: Operator) -> None:
    """The line is like that of another maker's driver."""
    rospy.set_param('/arm/zero', 'none')
    operator.wait(lambda: "parameter /arm/zero: a number is expected, not 'none'" in told(operator),
                  'the line', instead=lambda: told(operator))
    rospy.set_param('/arm/zero', 0.0)


def the_tool_is_learned_and_written(operator: Operator, config: Path) -> None:
    operator.wait(lambda: operator.widget('tool').isVisible(), 'the tool',
                  instead=lambda: told(operator))
    assert operator.text('tool_text') == (
        'The poses of arm on /arm/pose are those of the frame panda_link7, 0.107 m from the frame '
        'panda_hand that is shown. Write <tool frame="panda_link7" /> into cell.xml?')
    operator.click('tool_write')
    operator.wait(lambda: operator.widget('apply').isEnabled(), 'it can be applied')
    assert not operator.widget('tool').isVisible()
    assert config.read_text() == CELL.replace(
        'name="arm">\n', 'name="arm">\n    <tool frame="panda_link7" />\n')
    operator.click('apply')
    operator.wait(lambda: rospy.get_param('/arm/robot_proc/tool_frame', '') == 'panda_link7'
                  and operator.launcher.launch.is_running, 'it is applied')
    operator.wait(lambda: 'panda' not in told(operator), 'nothing is said of the tool',
                  instead=lambda: told(operator))
