# SPDX-License-Identifier: BSD-3-Clause
"""An operator changes what runs: the played topics, the mode, the view of RViz."""
from __future__ import annotations

import re
from pathlib import Path
from typing import Any, Iterator, Set

import pytest
import rospy
from operator_at_work import Operator, nodes, processes
from PyQt5.QtCore import Qt
from PyQt5.QtWidgets import QTreeWidget
from test_operator_session import REALTIME, Player, launch, open_the_cell, play_back, record

from process_visualizer.ros_names import PLAYBACK_RATE
from process_visualizer.rviz.window_geometry import Rectangle

RVIZ = Rectangle(460, 0, 1140, 620)


@pytest.fixture
def operator(qtbot: Any) -> Iterator[Operator]:
    person = Operator(qtbot)
    yield person
    person.close()


def test_changes(operator: Operator, tmp_path: Path) -> None:
    """Only what differs is restarted."""
    player = Player(operator)
    open_the_cell(operator)
    launch(operator)
    save_the_view(operator)
    bag = record(operator, tmp_path)
    shown_by = operator.beside(shown_by_whom)
    play_back(operator, bag)
    assert operator.beside(shown_by_whom) == shown_by != set()
    leave_a_topic_out(operator, player)
    play_backwards(operator, player)
    to_live_and_back(operator, player)
    assert operator.beside(shown_by_whom) == shown_by


def shown_by_whom() -> Set[str]:
    """Return the processes of RViz and of the nodes that draw in it."""
    return {it for it in processes('GUI_TEST_MARK') if re.search(r'/(rviz|robot_proc)\b', it)}


def save_the_view(operator: Operator) -> None:
    """Save RViz's own state: in a small window, it shows the scene and no lists."""
    view = operator.launcher.view
    view.save('mine')
    operator.wait(lambda: view.chosen == 'mine', 'the view is saved')
    geometry = (view.content or {})['Window Geometry']
    assert (geometry['X'], geometry['Width']) == (RVIZ.x, RVIZ.width)
    assert geometry['Hide Left Dock'] and geometry['Hide Right Dock']
    view.choose(None)
    operator.wait(lambda: view.chosen is None, 'the generated view is chosen')


def leave_a_topic_out(operator: Operator, player: Player) -> None:
    """Only the player is restarted, and it continues at the same position."""
    operator.click('loop')
    player.wait(lambda it: it.loop is not None and not it.paused, 'it loops')
    operator.press(Qt.Key_Space)
    before = player.wait(lambda it: it.paused, 'paused')
    shown_by = operator.beside(shown_by_whom)
    operator.click('bag_details')
    topics = operator.widget('bag_topics', QTreeWidget)
    row = topics.findItems('/edge_finder_lower', Qt.MatchExactly)[0]
    operator.click_check_box(topics, row)
    assert operator.text('apply') == 'Apply: restart the player'
    operator.click('apply')
    after = player.wait(lambda it: row.text(0) not in dict(it.topics) and it.segment > 0
                        and it.loop is not None and it.paused
                        and abs(it.position_s - before.position_s) < 0.01, 'it is there again')
    assert (after.rate, after.loop) == (before.rate, pytest.approx(before.loop, abs=1e-6))
    operator.wait(lambda: 'Paused' in operator.text('status'), 'the status says so')
    assert operator.beside(shown_by_whom) == shown_by
    operator.click('bag_details')


def play_backwards(operator: Operator, player: Player) -> None:
    """It plays again and again, as it loops."""
    operator.click('play_backwards')
    player.wait(lambda it: it.rate < 0.0 and not it.paused, 'it plays backwards')
    operator.wait(lambda: 'backwards' in operator.text('status'), 'the status says so')
    operator.press(Qt.Key_Space)
    player.wait(lambda it: it.paused, 'paused')
    operator.click('loop')
    player.wait(lambda it: it.loop is None, 'no loop any more')


def to_live_and_back(operator: Operator, player: Player) -> None:
    """One click each way; playback continues at the same position."""
    before = player.next()
    assert before.rate < 0.0
    operator.click('realtime')
    operator.wait(lambda: operator.text('status').startswith(REALTIME), 'live')
    assert {'/simulator', '/bag_recorder'} <= operator.beside(nodes)
    assert '/bag_player' not in operator.beside(nodes)
    assert operator.beside(lambda: rospy.get_param(PLAYBACK_RATE)) == 1.0
    live = operator.launcher.live
    operator.wait(lambda: live.window is not None and bool(live.window.curves), 'live curves')
    operator.click('playback')
    player.wait(lambda it: it.paused and it.rate == before.rate
                and abs(it.position_s - before.position_s) < 0.01, 'the same place')
