# SPDX-License-Identifier: BSD-3-Clause
"""Dialogs that do not block: the window keeps working while they are open."""
from __future__ import annotations

from typing import Callable, Optional

from PyQt5.QtCore import Qt
from PyQt5.QtGui import QGuiApplication
from PyQt5.QtWidgets import (
    QDialog,
    QDialogButtonBox,
    QHBoxLayout,
    QMessageBox,
    QPlainTextEdit,
    QVBoxLayout,
    QWidget,
)

from process_visualizer.gui.toolkit.labels import html_label, sentence
from process_visualizer.gui.toolkit.theme import tabular_font

_TITLE = 'Process Visualizer'
MESSAGE = 'message'
"""Name of each message box."""
_BESIDE_PX = 24
"""Distance of a message from the window that it is beside."""


def message_box(parent: Optional[QWidget], text: str,
                symbol: QMessageBox.Icon = QMessageBox.Warning) -> QMessageBox:
    """Return a message box, not yet open; it deletes itself when closed."""
    box = QMessageBox(symbol, _TITLE, sentence(text), parent=parent)
    box.setObjectName(MESSAGE)
    box.setTextFormat(Qt.PlainText)
    box.setTextInteractionFlags(Qt.TextSelectableByMouse)
    box.setAttribute(Qt.WA_DeleteOnClose)
    return box


def show_aside(dialog: QDialog) -> None:
    """Show a dialog that the operator did not request: the window keeps the keyboard focus.

    Otherwise the next key that is typed there would answer a dialog that was not read yet. The
    dialog is beside the window, above RViz, where it covers no controls.
    """
    dialog.setWindowModality(Qt.NonModal)
    dialog.setAttribute(Qt.WA_ShowWithoutActivating)
    dialog.setWindowFlag(Qt.WindowStaysOnTopHint)
    dialog.show()
    _move_beside(dialog)


def _move_beside(dialog: QDialog) -> None:
    """Move an open dialog beside its parent's window, if there is room on the screen."""
    parent = dialog.parentWidget()
    if parent is None:
        return
    window, size = parent.window().frameGeometry(), dialog.frameGeometry().size()
    screen = QGuiApplication.primaryScreen().availableGeometry()
    at_right = window.right() + _BESIDE_PX
    at_left = window.left() - _BESIDE_PX - size.width()
    top = window.top() + max((window.height() - size.height()) // 3, 0)
    if at_right + size.width() <= screen.right():
        dialog.move(at_right, top)
    elif at_left >= screen.left():
        dialog.move(at_left, top)


def set_growing_text(box: QMessageBox, text: str) -> None:
    """Set a longer text; the box grows upward and to the left, so that its buttons stay."""
    corner = box.frameGeometry().bottomRight()
    box.setText(text)
    box.adjustSize()
    grown = box.frameGeometry()
    grown.moveBottomRight(corner)
    box.move(max(grown.left(), 0), max(grown.top(), 0))


def ask(parent: QWidget, question: str, yes: str, action: Callable[[], None],
        otherwise: Callable[[], None] = lambda: None) -> QMessageBox:
    """Ask a question; do the action if the operator presses the button with the text ``yes``.

    The question stays above RViz, and takes the keyboard from it. ``otherwise`` is called if it is
    closed in any other way.

    Returns the open dialog, so that a question can be closed when it is no longer needed.
    """
    box = message_box(parent, question, QMessageBox.Question)
    box.setObjectName('question')
    accept = box.addButton(yes, QMessageBox.AcceptRole)
    accept.setObjectName('yes')
    accept.clicked.connect(lambda: action())
    box.addButton(QMessageBox.Cancel)
    box.finished.connect(lambda _code: None if box.clickedButton() is accept else otherwise())
    box.setWindowFlag(Qt.WindowStaysOnTopHint)
    box.open()
    _move_beside(box)
    box.activateWindow()
    return box


_WIDTH, _HEIGHT = 640, 360


class TextDialog(QDialog):
    """A title, a sentence, monospaced text below it, and buttons to copy and to close."""

    def __init__(self, name: str, title: str, parent: Optional[QWidget] = None) -> None:
        super().__init__(parent)
        self.setObjectName(name)
        self.setWindowTitle(title)
        self.setModal(False)
        self.message = html_label()
        self.message.setObjectName(f'{name}_message')
        self.message.setWordWrap(True)
        self.message.setTextInteractionFlags(Qt.TextSelectableByMouse)
        self.text = QPlainTextEdit()
        self.text.setObjectName(f'{name}_text')
        self.text.setReadOnly(True)
        self.text.setLineWrapMode(QPlainTextEdit.NoWrap)
        self.text.setFont(tabular_font(self.text.font()))
        self.buttons = QDialogButtonBox(QDialogButtonBox.Close)
        self._lay_out()
        self.resize(_WIDTH, _HEIGHT)

    def show_text(self, message: str, text: str) -> None:
        """Show a message (rich text) and the text."""
        self.message.setText(message)
        self.text.setPlainText(text)

    def _lay_out(self) -> None:
        copy = self.buttons.addButton('Copy', QDialogButtonBox.ActionRole)
        copy.setObjectName(f'{self.objectName()}_copy')
        copy.setToolTip('Copy the text')
        copy.setAutoDefault(False)
        copy.clicked.connect(
            lambda: QGuiApplication.clipboard().setText(self.text.toPlainText()))
        self.buttons.rejected.connect(self.close)
        self.row = QHBoxLayout()
        self.row.addWidget(self.message, 1)
        layout = QVBoxLayout(self)
        layout.addLayout(self.row)
        layout.addWidget(self.text)
        layout.addWidget(self.buttons)


class KeysDialog(QDialog):
    """A dialog with a table of keys (HTML), as wide as needed."""

    def __init__(self, table: str, parent: Optional[QWidget] = None) -> None:
        super().__init__(parent)
        self.setObjectName('keys')
        self.setWindowTitle('Keys')
        self.setAttribute(Qt.WA_DeleteOnClose)
        buttons = QDialogButtonBox(QDialogButtonBox.Close)
        buttons.rejected.connect(self.close)
        layout = QVBoxLayout(self)
        layout.addWidget(html_label(table))
        layout.addWidget(buttons)
