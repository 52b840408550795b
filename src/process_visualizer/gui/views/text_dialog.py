"""A window with text that can be copied; it does not hold up the program."""
from __future__ import annotations

from typing import Optional

from PyQt5.QtCore import Qt
from PyQt5.QtGui import QFontDatabase, QGuiApplication
from PyQt5.QtWidgets import (
    QDialog,
    QDialogButtonBox,
    QHBoxLayout,
    QLabel,
    QPlainTextEdit,
    QVBoxLayout,
    QWidget,
)

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
        self.text.setFont(QFontDatabase.systemFont(QFontDatabase.FixedFont))
        self.buttons = QDialogButtonBox(QDialogButtonBox.Close)
        self._lay_out()
        self.resize(_WIDTH, _HEIGHT)

    def show_text(self, message: str, text: str) -> None:
        """Show a message (rich text) and the text, at its end."""
        self.message.setText(message)
        self.text.setPlainText(text)
        self.text.verticalScrollBar().setValue(self.text.verticalScrollBar().maximum())

    def copied_text(self) -> str:
        """What the button copies."""
        return self.text.toPlainText()

    def _lay_out(self) -> None:
        copy = self.buttons.addButton('Copy', QDialogButtonBox.ActionRole)
        copy.setObjectName(f'{self.objectName()}_copy')
        copy.setToolTip('Copy the text')
        copy.clicked.connect(lambda: QGuiApplication.clipboard().setText(self.copied_text()))
        self.buttons.rejected.connect(self.close)
        self.row = QHBoxLayout()
        self.row.addWidget(self.message, 1)
        layout = QVBoxLayout(self)
        layout.addLayout(self.row)
        layout.addWidget(self.text)
        layout.addWidget(self.buttons)
