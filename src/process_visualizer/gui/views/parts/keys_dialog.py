# SPDX-License-Identifier: BSD-3-Clause
"""Shows all keys."""
from __future__ import annotations

from typing import Optional

from PyQt5.QtCore import Qt
from PyQt5.QtWidgets import QDialog, QDialogButtonBox, QLabel, QVBoxLayout, QWidget


class KeysDialog(QDialog):
    """A table of keys (HTML) as wide as needed; the window keeps working while it is open."""

    def __init__(self, table: str, parent: Optional[QWidget] = None) -> None:
        super().__init__(parent)
        self.setObjectName('keys')
        self.setWindowTitle('Keys')
        self.setAttribute(Qt.WA_DeleteOnClose)
        buttons = QDialogButtonBox(QDialogButtonBox.Close)
        buttons.rejected.connect(self.close)
        layout = QVBoxLayout(self)
        layout.addWidget(QLabel(table))
        layout.addWidget(buttons)
