# SPDX-License-Identifier: BSD-3-Clause
"""Unexpected errors end up in the log and in one dialog."""
from __future__ import annotations

import sys
import threading
from typing import Iterator, List

import pytest
from PyQt5.QtCore import Qt, QTimer
from PyQt5.QtGui import QGuiApplication
from PyQt5.QtWidgets import QLabel, QPlainTextEdit, QPushButton, QWidget

from process_visualizer.gui.app.main import (
    CaughtError,
    ErrorDialog,
    UncaughtErrors,
    install_hooks,
)

pytestmark = pytest.mark.qt_no_exception_capture


@pytest.fixture(autouse=True)
def hooks() -> Iterator[None]:
    """Restores the hooks of the test process."""
    before = sys.excepthook, threading.excepthook
    yield
    sys.excepthook, threading.excepthook = before


@pytest.fixture
def window(qtbot) -> QWidget:
    widget = QWidget()
    qtbot.addWidget(widget)
    widget.show()
    return widget


def fail() -> None:
    raise KeyError('nothing of this name')


def dialog_of(window: QWidget) -> ErrorDialog:
    found = window.findChild(ErrorDialog)
    assert found is not None
    return found


def test_an_error_in_the_gui_thread(window, qtbot, tmp_path, monkeypatch, capfd):
    monkeypatch.setenv('ROS_HOME', str(tmp_path))
    install_hooks(window)
    QTimer.singleShot(0, fail)
    qtbot.waitUntil(lambda: dialog_of(window).isVisible())
    dialog = dialog_of(window)
    assert not dialog.isModal()
    assert "KeyError: 'nothing of this name'" in dialog.text.toPlainText()
    log = tmp_path / 'process_visualizer' / 'launcher.log'
    assert 'in fail' in log.read_text() and 'in fail' in capfd.readouterr().err
    assert str(log) in dialog.findChild(QLabel, 'error_message').text()


def test_an_error_in_a_thread(window, qtbot, tmp_path, monkeypatch):
    monkeypatch.setenv('ROS_HOME', str(tmp_path))
    install_hooks(window)
    thread = threading.Thread(target=fail)
    thread.start()
    thread.join()
    qtbot.waitUntil(lambda: dialog_of(window).isVisible())
    assert 'in fail' in dialog_of(window).text.toPlainText()


def test_ctrl_c_goes_its_usual_way(qtbot, monkeypatch):
    errors = UncaughtErrors()
    usual: List[type] = []
    monkeypatch.setattr(sys, '__excepthook__', lambda kind, *_: usual.append(kind))
    with qtbot.assertNotEmitted(errors.caught):
        errors.take(KeyboardInterrupt, KeyboardInterrupt(), None)
    assert usual == [KeyboardInterrupt]


def test_a_log_that_cannot_be_written_stops_nothing(qtbot, tmp_path, capfd):
    (tmp_path / 'file').touch()
    errors = UncaughtErrors(str(tmp_path / 'file' / 'launcher.log'))
    assert errors.log_file == '' and 'not logged' in capfd.readouterr().err
    with qtbot.waitSignal(errors.caught):
        errors.take(ValueError, ValueError('x'), None)


def error(number: int) -> CaughtError:
    return CaughtError(f'ValueError: {number}', f'trace {number}', f'file.py:{number}')


@pytest.fixture
def dialog(qtbot) -> ErrorDialog:
    widget = ErrorDialog('/log')
    qtbot.addWidget(widget)
    return widget


def test_repeated_errors_are_counted(dialog):
    for number in (1, 2, 1, 1):
        dialog.add(error(number))
    text = dialog.findChild(QPlainTextEdit, 'error_text').toPlainText()
    assert text == '3×  ValueError: 1\n\ntrace 1\n\n1×  ValueError: 2\n\ntrace 2'
    assert '4 errors' in dialog.findChild(QLabel, 'error_message').text()
    dialog.findChild(QPushButton, 'error_copy').click()
    assert QGuiApplication.clipboard().text() == text


def test_what_was_seen_is_forgotten(dialog, qtbot):
    dialog.add(error(1))
    qtbot.keyClick(dialog, Qt.Key_Escape)
    assert not dialog.isVisible()
    dialog.add(error(2))
    assert dialog.text.toPlainText() == '1×  ValueError: 2\n\ntrace 2' and dialog.isVisible()


def test_there_is_an_end_to_different_errors(dialog):
    for number in range(100):
        dialog.add(error(number))
    assert dialog.text.toPlainText().count('trace') == 20
