# SPDX-License-Identifier: BSD-3-Clause
"""A substitute for RViz once it has ended: why, and a button that starts it again."""
from __future__ import annotations

from PyQt5.QtCore import Qt, pyqtSignal
from PyQt5.QtGui import QCloseEvent
from PyQt5.QtWidgets import QLabel, QPushButton, QVBoxLayout, QWidget


class RvizPlace(QWidget):
    """Belongs to the launcher's window; who owns it places it. Hidden while there is no text."""

    restart_wanted = pyqtSignal()

    def __init__(self, window: QWidget) -> None:
        super().__init__(window, Qt.Tool | Qt.FramelessWindowHint)
        self.setAttribute(Qt.WA_X11NetWmWindowTypeDialog)  # as the timeline
        self.setAttribute(Qt.WA_ShowWithoutActivating)
        self.setObjectName('rviz_place')
        self.setWindowTitle('RViz')
        self._text = QLabel()
        self._text.setObjectName('rviz_place_text')
        self._text.setAlignment(Qt.AlignCenter)
        self._text.setWordWrap(True)
        restart = QPushButton('Restart RViz')
        restart.setObjectName('rviz_place_restart')
        restart.clicked.connect(self.restart_wanted)
        layout = QVBoxLayout(self)
        layout.addStretch(1)
        layout.addWidget(self._text)
        layout.addWidget(restart, 0, Qt.AlignCenter)
        layout.addStretch(1)
        self.hide()

    def show_text(self, text: str) -> None:
        """Say why RViz is not here; with an empty text it is."""
        self._text.setText(text)
        self.setVisible(bool(text) and self.parentWidget().isVisible())

    def closeEvent(self, event: QCloseEvent) -> None:
        """Stay: it is a part of the launcher."""
        event.ignore()
