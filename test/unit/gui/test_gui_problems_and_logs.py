# SPDX-License-Identifier: BSD-3-Clause
"""The list of problems, and the log of a dead node."""
from __future__ import annotations

from typing import List, Tuple

import pytest
from PyQt5.QtCore import Qt
from PyQt5.QtGui import QGuiApplication
from PyQt5.QtWidgets import QLabel, QListWidget, QPlainTextEdit, QPushButton, QWidget

from process_visualizer.cell.errors import Location, Problem
from process_visualizer.gui.cell.devices_panel import LogView, ProblemsView, problem_html
from process_visualizer.launching.part_report import NodeReport, NodeState, PartReport, PartState

PROBLEMS = [Problem(Location('/cells/a.xml', 7), 'devise', 'there is no <devise>; write <device>'),
            Problem(Location('/cells/b.xml', 12), '', 'no device')]


@pytest.fixture
def view(qtbot) -> ProblemsView:
    widget = ProblemsView()
    qtbot.addWidget(widget)
    widget.resize(440, 300)
    widget.set_problems(PROBLEMS)
    widget.show()
    return widget


def test_a_click_opens_the_place(view, qtbot):
    wanted: List[Tuple[str, int]] = []
    view.open_wanted.connect(lambda file, line: wanted.append((file, line)))
    problems = view.findChild(QListWidget, 'problems')
    assert problems.count() == 2
    area = problems.visualItemRect(problems.item(1))
    qtbot.mouseClick(problems.viewport(), Qt.LeftButton, pos=area.center())
    assert wanted == [('/cells/b.xml', 12)]


def test_the_number_of_problems(view):
    assert '2 problems' in view.findChild(QLabel, 'problems_title').text().replace('\u2009', ' ')
    view.set_problems(PROBLEMS[:1])
    assert '1 problem<' in view.findChild(QLabel, 'problems_title').text()
    assert view.findChild(QListWidget, 'problems').count() == 1


def test_copy_all(view):
    view.findChild(QPushButton, 'copy_problems').click()
    assert QGuiApplication.clipboard().text() == '\n'.join(map(str, PROBLEMS))


def test_all_can_be_read_where_the_list_has_no_room(view):
    view.findChild(QPushButton, 'show_problems').click()
    text = view.findChild(QPlainTextEdit, 'all_problems_text')
    assert text.isVisible() and not text.window().isModal()
    assert text.toPlainText() == '\n\n'.join(map(str, PROBLEMS))
    assert text.lineWrapMode() == QPlainTextEdit.WidgetWidth  # nothing is cut off
    tips = [view.findChild(QListWidget, 'problems').item(row).toolTip() for row in (0, 1)]
    assert all(it.message in tip for it, tip in zip(PROBLEMS, tips))


def test_what_stands_in_the_file_is_no_html():
    assert problem_html(PROBLEMS[0]).endswith('there is no &lt;devise&gt;; write &lt;device&gt;')


NODE = NodeReport('/robot/robot_proc', NodeState.EXITED, 1, 2, '', ('first', 'KeyError: 3'))


@pytest.fixture
def parent(qtbot) -> QWidget:
    widget = QWidget()
    qtbot.addWidget(widget)
    return widget


def test_the_log_of_a_node(parent):
    report = PartReport('robot', PartState.RUNNING, (NODE,))
    log = LogView.show_node(parent, report, '/robot/robot_proc')
    assert log.isVisible() and not log.isModal()
    message = log.findChild(QLabel, 'log_message').text()
    assert message == ('<b>/robot/robot_proc</b> of robot: ended with code 1. '
                       'It was restarted 2 times.')
    assert log.findChild(QPlainTextEdit, 'log_text').toPlainText() == 'first\nKeyError: 3'
    log.findChild(QPushButton, 'log_copy').click()
    assert QGuiApplication.clipboard().text() == 'first\nKeyError: 3'


def test_the_log_of_a_part(parent):
    report = PartReport('kinect', PartState.FAILED, (), 'a required node ended', ('bye',))
    log = LogView.show_node(parent, report, '')
    assert 'kinect</b> is failed: a required' in log.findChild(QLabel, 'log_message').text()
    assert log.findChild(QPlainTextEdit, 'log_text').toPlainText() == 'bye'
