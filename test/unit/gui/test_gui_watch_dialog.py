# SPDX-License-Identifier: BSD-3-Clause
"""Watch…: the output of cell view is shown, and the program ends with the dialog."""
from __future__ import annotations

from pathlib import Path

import pytest
from PyQt5.QtWidgets import QWidget
from pytestqt.qtbot import QtBot

from process_visualizer.gui.app.look_on import WatchDialog


@pytest.fixture
def program(tmp_path: Path) -> str:
    """Stand-in for rosrun: prints its arguments and waits."""
    path = tmp_path / 'rosrun'
    path.write_text('#!/bin/sh\necho "$@"\necho "cell: no \x1b[31mcolor"\nexec sleep 600\n')
    path.chmod(0o755)
    return str(path)


def test_what_is_said_is_shown_until_the_user_ends_it(qtbot: QtBot, program: str) -> None:
    parent = QWidget()
    qtbot.addWidget(parent)
    dialog = WatchDialog(parent, program)
    assert not dialog.button.isEnabled()
    dialog.host.setText(' -x ')
    dialog.button.click()
    qtbot.waitUntil(lambda: 'color' in dialog.lines.toPlainText())
    assert dialog.lines.toPlainText().splitlines() == [
        'Looking for the cell on -x…', 'process_visualizer cell view --master=-x',
        'no \\x1b[31mcolor']
    assert dialog.button.text() == 'Stop watching'
    dialog.button.click()
    qtbot.waitUntil(lambda: dialog.lines.toPlainText().endswith('\nWatching has ended.'))
    assert 'crash' not in dialog.lines.toPlainText()
    assert not dialog.is_watching
    assert dialog.button.text() == 'Watch'
    assert dialog.host.isEnabled()


def test_a_window_that_closes_ends_what_it_watches(qtbot: QtBot, program: str) -> None:
    """Otherwise the viewer is killed and leaves its files, and its end reaches deleted widgets."""
    parent = QWidget()
    qtbot.addWidget(parent)
    dialog = WatchDialog(parent, program)
    dialog.host.setText('cell-pc')
    dialog.button.click()
    qtbot.waitUntil(lambda: 'color' in dialog.lines.toPlainText())
    dialog.end()
    assert not dialog.is_watching and not dialog.isVisible()
    said = dialog.lines.toPlainText()
    dialog._process.finished.emit(0)
    assert dialog.lines.toPlainText() == said
