# SPDX-License-Identifier: BSD-3-Clause
"""A window with text that can be copied; it does not block the program."""
from __future__ import annotations

from typing import Optional

from PyQt5.QtCore import Qt
from PyQt5.QtGui import QGuiApplication
from PyQt5.QtWidgets import (
    QDialog,
    QDialogButtonBox,
    QHBoxLayout,
    QLabel,
    QPlainTextEdit,
    QVBoxLayout,
    QWidget,
)

from process_visualizer.gui.toolkit.style import tabular_font

_WIDTH, _HEIGHT = 640, 360


class TextDialog(QDialog):
    """A title, a sentence, monospaced text below it, and buttons to copy and to close."""

    def __init__(self, name: str, title: str, parent: Optional[QWidget] = None) -> None:
        super().__init__(parent)
        self.setObjectName(name)
        self.setWindowTitle(title)
        self.setModal(False)
        self.message = QLabel()
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
