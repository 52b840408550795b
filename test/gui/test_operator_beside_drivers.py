# SPDX-License-Identifier: BSD-3-Clause
"""An operator plays a recording while a driver still runs, and starts one during playback."""
from __future__ import annotations

import os
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Iterator

import pytest
import rosbag
import rosgraph
from genpy import Time
from operator_at_work import Operator, nodes
from PyQt5.QtWidgets import QApplication, QMessageBox
from running_program import SMALL_CELL
from std_msgs.msg import Float64

DRIVER = """
import rospy, std_msgs.msg
rospy.init_node('feed_driver')
publisher = rospy.Publisher('/feed_rate_est', std_msgs.msg.Float64, queue_size=1)
rospy.spin()
"""
WHO = '/feed_rate_est is published by /feed_driver'


@pytest.fixture
def operator(qtbot: Any) -> Iterator[Operator]:
    person = Operator(qtbot)
    yield person
    person.close()


@contextmanager
def driver(operator: Operator) -> Iterator[None]:
    """Run a driver that the cell has not started, until the end of the ``with``."""
    process = subprocess.Popen([sys.executable, '-c', DRIVER])
    try:
        operator.wait(lambda: '/feed_driver' in publishers(), 'the driver')
        yield
    finally:
        process.terminate()
        process.wait()


def publishers() -> 'list[str]':
    found: 'list[str]' = dict(rosgraph.Master('/test').getSystemState()[0]).get(
        '/feed_rate_est', [])
    return found


def test_beside_a_driver(operator: Operator, tmp_path: Path) -> None:
    config, bag = tmp_path / 'cell.xml', tmp_path / 'feed.bag'
    config.write_text(SMALL_CELL)
    with rosbag.Bag(str(bag), 'w') as written:
        for number in range(6000):
            written.write('/feed_rate_est', Float64(number), Time.from_sec(1000.0 + 0.1 * number))
    operator.launcher.cell.open(str(config))
    operator.wait(lambda: operator.widget('launch').isEnabled(), 'it can be launched')
    operator.click('playback')
    operator.launcher.bag.open([str(bag)])
    operator.wait(lambda: operator.launcher.session.paths == (str(bag),), 'the bag is open')
    with driver(operator):
        it_is_asked_and_can_be_left(operator)
        it_is_asked(operator)
    it_begins_by_itself(operator)
    with driver(operator):
        it_is_told_and_pauses(operator)
    operator.wait(lambda: not operator.widget('mixture').isVisible(), 'it is told no more')


def it_is_asked(operator: Operator) -> None:
    operator.click('launch')
    operator.wait(lambda: question(operator) != '', 'the question')
    assert WHO in question(operator)
    assert operator.text('status') == 'Idle'


def it_is_asked_and_can_be_left(operator: Operator) -> None:
    it_is_asked(operator)
    keep_picture(operator, 'asked')
    operator.widget('question', QMessageBox).reject()
    operator.wait(lambda: question(operator) == '', 'the question has gone')
    assert not operator.launcher.guard.is_waiting


def it_begins_by_itself(operator: Operator) -> None:
    playback = operator.launcher.playback
    operator.wait(lambda: playback.state.is_playing and playback.position_s > 0.1, 'it plays')
    assert question(operator) == ''
    assert '/bag_player' in nodes()
    assert not operator.widget('mixture').isVisible()


def it_is_told_and_pauses(operator: Operator) -> None:
    notice = operator.widget('mixture')
    operator.wait(lambda: notice.isVisible() and not operator.launcher.playback.state.is_playing,
                  'it is told and paused')
    assert WHO in operator.text('mixture_text')
    keep_picture(operator, 'told')


def question(operator: Operator) -> str:
    """Return the open question; empty without one."""
    found = operator.window.findChild(QMessageBox, 'question')
    return found.text() if found is not None and found.isVisible() else ''


def keep_picture(operator: Operator, name: str) -> None:
    """Save a picture of the window, to be viewed later."""
    folder = os.environ.get('TEST_PICTURES')
    if folder:
        QApplication.processEvents()  # for the layout
        operator.window.grab().save(f'{folder}/{name}.png')
