# SPDX-License-Identifier: BSD-3-Clause
"""The running cell in browsers: the switch, the address with its QR code, and the viewers."""
from __future__ import annotations

import sys
from pathlib import Path
from typing import Any, Callable, List

import pytest
from PyQt5.QtCore import QProcess
from PyQt5.QtWidgets import QWidget
from pytestqt.qtbot import QtBot

from process_visualizer.gui.app.look_on import ServeDialog
from process_visualizer.gui.toolkit.desktop import output_lines

URL = 'http://192.168.1.10:11480/aVeryLongToken/'


@pytest.fixture
def dialog(qtbot: QtBot, tmp_path: Path) -> Callable[[str], ServeDialog]:
    """A dialog with a program that replaces rosrun."""
    parent = QWidget()
    qtbot.addWidget(parent)

    def made(script: str) -> ServeDialog:
        path = tmp_path / 'rosrun'
        path.write_text(f'#!/bin/sh\n{script}\n')
        path.chmod(0o755)
        found = ServeDialog(parent, ['192.168.1.10'], lambda: ('cell.xml', {'seed': '3'}),
                            str(path))
        found.setParent(parent)
        return found
    return made


def test_the_address_and_who_is_looking_are_shown(
        qtbot: QtBot, dialog: Callable[[str], ServeDialog]) -> None:
    it = dialog(f'echo "$@"\necho {URL}\necho "10.0.0.5 watches"\necho "10.0.0.6 watches"\n'
                'echo "10.0.0.5 watches no longer"\nexec sleep 600')
    it.address.setCurrentIndex(1)
    it.button.click()
    qtbot.waitUntil(lambda: 'no longer' in it.lines.toPlainText())
    assert it.lines.toPlainText().splitlines()[0] == (
        'process_visualizer cell serve cell.xml seed:=3 --address=192.168.1.10')
    assert it.url.text() == URL
    assert it.viewers.text() == 'Viewers: 10.0.0.6'
    picture = it.code.pixmap()
    assert picture is not None
    assert picture.width() == picture.height() >= 100
    assert it.button.text() == 'Stop showing'
    assert not it.address.isEnabled()
    it.close()
    assert it.is_serving, 'it goes on while the dialog is closed'
    it.end()
    qtbot.waitUntil(lambda: not it.is_serving)
    assert (it.url.text(), it.viewers.text()) == ('', '')


def test_a_token_is_spoken_of_only_if_others_are_served(
        dialog: Callable[[str], ServeDialog]) -> None:
    it = dialog('')
    assert 'token' not in it.explanation.text() and 'phone' not in it.explanation.text()
    it.address.setCurrentIndex(1)
    assert 'Others need the whole address, with the token' in it.explanation.text()
    it.address.setCurrentIndex(0)
    assert 'token' not in it.explanation.text()


def test_for_this_computer_only_there_is_no_code(
        qtbot: QtBot, dialog: Callable[[str], ServeDialog]) -> None:
    it = dialog('echo "$@"\necho http://127.0.0.1:11480/\nexec sleep 600')
    it.button.click()
    qtbot.waitUntil(lambda: bool(it.url.text()))
    assert it.lines.toPlainText() == 'process_visualizer cell serve cell.xml seed:=3'
    assert it.code.pixmap() is None or it.code.pixmap().isNull()
    assert it.viewers.text() == 'No viewers'
    it.end()
    qtbot.waitUntil(lambda: not it.is_serving)


def test_what_is_wrong_is_shown(qtbot: QtBot, dialog: Callable[[str], ServeDialog]) -> None:
    it = dialog('echo "cell: no cell runs" >&2\nexit 1')
    it.button.click()
    qtbot.waitUntil(lambda: 'no cell runs' in it.lines.toPlainText())
    qtbot.waitUntil(lambda: not it.is_serving)
    assert it.lines.toPlainText() == 'no cell runs'
    assert it.button.text() == 'Show'


def test_a_line_that_comes_in_parts_is_one(qtbot: Any) -> None:
    process = QProcess()
    lines: List[str] = []
    process.readyReadStandardOutput.connect(lambda: lines.extend(output_lines(process)))
    process.finished.connect(lambda *_: lines.extend(output_lines(process)))
    script = ('import sys; out = sys.stdout.buffer; out.write("http://ö".encode()[:-1]); '
              'out.flush(); sys.stdin.readline(); out.write("ö/\\n end".encode()[1:])')
    process.start(sys.executable, ['-c', script])
    qtbot.waitUntil(lambda: process.bytesAvailable() > 0)
    assert lines == []
    process.write(b'\n')
    qtbot.waitUntil(lambda: process.state() == QProcess.NotRunning)
    qtbot.waitUntil(lambda: lines == ['http://ö/', ' end'])
