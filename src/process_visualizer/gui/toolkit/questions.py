# SPDX-License-Identifier: BSD-3-Clause
"""Dialogs that do not block: the window keeps working while they are open."""
from __future__ import annotations

from typing import Callable, Optional

from PyQt5.QtCore import Qt
from PyQt5.QtWidgets import QMessageBox, QWidget

from process_visualizer.gui.toolkit.sentences import sentence

_TITLE = 'Process Visualizer'


def message_box(parent: Optional[QWidget], text: str,
                symbol: QMessageBox.Icon = QMessageBox.Warning) -> QMessageBox:
    """Return a message box to open; it deletes itself when it is closed."""
    box = QMessageBox(symbol, _TITLE, sentence(text), parent=parent)
    box.setObjectName('message')
    box.setTextInteractionFlags(Qt.TextSelectableByMouse)
    box.setAttribute(Qt.WA_DeleteOnClose)
    return box


def ask(parent: QWidget, question: str, yes: str, action: Callable[[], None],
        otherwise: Callable[[], None] = lambda: None) -> QMessageBox:
    """Ask a question; do the action if the answer is ``yes``, the text of its button.

    ``otherwise`` is called if it is closed in any other way.

    Returns the open dialog, so that a question can be closed when it is no longer needed.
    """
    box = message_box(parent, question, QMessageBox.Question)
    box.setObjectName('question')
    accept = box.addButton(yes, QMessageBox.AcceptRole)
    accept.setObjectName('yes')
    accept.clicked.connect(lambda: action())
    box.addButton(QMessageBox.Cancel)
    box.finished.connect(lambda _code: None if box.clickedButton() is accept else otherwise())
    box.open()
    return box
