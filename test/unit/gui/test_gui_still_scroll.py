# SPDX-License-Identifier: BSD-3-Clause
"""A clicked widget stays where it is, even if the click disables it."""
from __future__ import annotations

from typing import Any, Callable

import pytest
from PyQt5.QtCore import QPoint, Qt
from PyQt5.QtTest import QTest
from PyQt5.QtWidgets import QApplication, QHBoxLayout, QPushButton, QVBoxLayout, QWidget

from process_visualizer.gui.toolkit.scrolling import Column, ColumnScroll, NoticePlace, StillScroll


def test_a_button_that_is_disabled_by_its_click_does_not_move(qtbot: Any) -> None:
    """Qt moves the focus to the next button, which is below the visible part."""
    content = QWidget()
    layout = QVBoxLayout(content)
    first, far = QPushButton('Find runs'), QPushButton('Cancel')
    layout.addWidget(first)
    layout.addSpacing(1000)
    layout.addWidget(far)
    area = StillScroll()
    area.setWidget(content)
    area.resize(200, 150)
    qtbot.addWidget(area)
    area.show()
    QApplication.setActiveWindow(area)
    first.setFocus()
    first.setEnabled(False)
    assert (QApplication.focusWidget(), area.verticalScrollBar().value()) == (far, 0)
    first.setEnabled(True)
    first.setFocus()
    QTest.keyClick(first, Qt.Key_Tab)
    assert area.verticalScrollBar().value() > 0


@pytest.mark.parametrize('place', [NoticePlace, lambda body: ColumnScroll(_column(body))])
def test_a_scroll_bar_moves_no_button(qtbot: Any, place: Callable[[QWidget], QWidget]) -> None:
    body = QWidget()
    layout = QHBoxLayout(body)
    layout.addStretch(1)
    button = QPushButton('Ack')
    layout.addWidget(button)
    area = place(body)
    qtbot.addWidget(area)
    area.resize(300, 200)
    area.show()
    QApplication.processEvents()
    before = button.mapTo(area, QPoint(0, 0)).x()
    body.setMinimumHeight(400)
    qtbot.waitUntil(lambda: area.verticalScrollBar().maximum() > 0)
    assert button.mapTo(area, QPoint(0, 0)).x() == before


def _column(body: QWidget) -> Column:
    column = Column()
    QVBoxLayout(column).addWidget(body)
    return column
