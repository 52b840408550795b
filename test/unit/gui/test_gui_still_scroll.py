# SPDX-License-Identifier: BSD-3-Clause
"""What is clicked stays where it is, though it cannot be clicked again."""
from __future__ import annotations

from typing import Any

from PyQt5.QtCore import Qt
from PyQt5.QtTest import QTest
from PyQt5.QtWidgets import QApplication, QPushButton, QVBoxLayout, QWidget

from process_visualizer.gui.toolkit.scrolling import StillScroll


def test_a_button_that_is_disabled_by_its_click_does_not_move(qtbot: Any) -> None:
    """Qt gives the keyboard to the next one, which is below what can be seen."""
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
