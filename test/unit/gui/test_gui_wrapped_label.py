# SPDX-License-Identifier: BSD-3-Clause
"""Texts of several lines, in which topic names must stay readable."""
from __future__ import annotations

import re
from typing import Any, List

import pytest
from PyQt5.QtCore import Qt
from PyQt5.QtGui import QTextLayout
from PyQt5.QtWidgets import QLabel

from process_visualizer.gui.toolkit.widgets import ElidedLabel, WrappedLabel

TEXTS = ['Not recording: no connection to /camera/rgb/image_color, /camera/depth/image_raw; check '
         'that these nodes still respond', 'In real-time mode.\nNo data from /camera/points',
         '/camera/rgb/image_color_of_the_left_camera/compressed is left out']


def lines_of(label: QLabel) -> List[str]:
    """The lines of the label's text as Qt breaks them."""
    found = []
    for paragraph in QLabel.text(label).split('\n'):
        layout = QTextLayout(paragraph, label.font())
        layout.beginLayout()
        line = layout.createLine()
        while line.isValid():
            line.setLineWidth(label.contentsRect().width())
            found.append(paragraph[line.textStart():line.textStart() + line.textLength()])
            line = layout.createLine()
        layout.endLayout()
    return found


@pytest.mark.parametrize('text', TEXTS)
def test_a_name_is_cut_only_where_it_has_a_line_of_its_own(qtbot: Any, text: str) -> None:
    label = WrappedLabel('text')
    qtbot.addWidget(label)
    label.setText(text)
    label.show()
    for width in range(120, 600, 11):
        label.resize(width, 200)
        lines = lines_of(label)
        cut = [line for line in lines[:-1] if re.search(r'\S$', line) and '/' in line.split()[-1]
               and f'{line}\n' not in f'{QLabel.text(label)}\n']
        assert all(len(line.split()) == 1 for line in cut), (width, lines)
        assert label.text() == text


def test_only_the_last_of_two_lines_is_cut(qtbot: Any) -> None:
    label = ElidedLabel(Qt.ElideRight, lines=2)
    qtbot.addWidget(label)
    label.setText(TEXTS[0])
    width = label.fontMetrics().horizontalAdvance(TEXTS[0])
    assert label.shown_text(width + 10) == TEXTS[0]
    first, second = label.shown_text(int(0.7 * width)).split('\n')
    assert f'{first} {second}' == TEXTS[0]
    first, second = label.shown_text(int(0.3 * width)).split('\n')
    assert TEXTS[0].startswith(f'{first} {second[:-1]}') and second.endswith('…')
    label.setText('/a' * 60)
    assert label.shown_text(200) == label.fontMetrics().elidedText('/a' * 60, Qt.ElideRight, 200)
