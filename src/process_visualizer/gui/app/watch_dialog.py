# SPDX-License-Identifier: BSD-3-Clause
"""Watch…: shows a cell that runs on another computer, by the command ``cell view``."""
from __future__ import annotations

from PyQt5.QtCore import QProcess, Qt
from PyQt5.QtWidgets import (
    QDialog,
    QHBoxLayout,
    QLabel,
    QLineEdit,
    QPlainTextEdit,
    QPushButton,
    QVBoxLayout,
    QWidget,
)

from process_visualizer.ros_names import PACKAGE
from process_visualizer.shown_text import shown

_EXPLANATION = ('The name or address of the computer on which the cell runs. Its view appears in '
                'an RViz of its own; nothing is changed in it. There it has to be started with '
                '--remote (see docs/remote.md).')
_MOST_LINES = 500


class WatchDialog(QDialog):
    """Asks for the computer, and shows what ``cell view`` says; closing it ends RViz."""

    def __init__(self, parent: QWidget, program: str = 'rosrun') -> None:
        """``program`` runs the nodes of packages."""
        super().__init__(parent)
        self.setObjectName('watch')
        self.setWindowTitle('Watch a cell on another computer')
        self.setAttribute(Qt.WA_DeleteOnClose)
        self._program = program
        self.host = QLineEdit()
        self.host.setObjectName('watched_computer')
        self.host.setPlaceholderText('cell-pc, or 192.168.1.10')
        self.button = QPushButton('Watch')
        self.button.setObjectName('watch_button')
        self.button.setDefault(True)
        self.lines = QPlainTextEdit()
        self.lines.setObjectName('watch_lines')
        self.lines.setReadOnly(True)
        self.lines.setMaximumBlockCount(_MOST_LINES)
        self._process = QProcess(self)
        self._process.setProcessChannelMode(QProcess.MergedChannels)
        self._process.readyReadStandardOutput.connect(self._read)
        self._process.stateChanged.connect(self._update)
        self._process.errorOccurred.connect(
            lambda *_: self.lines.appendPlainText(self._process.errorString()))
        self.button.clicked.connect(self._toggle)
        self.host.textChanged.connect(self._update)
        self._lay_out()
        self._update()

    def _lay_out(self) -> None:
        explanation = QLabel(_EXPLANATION)
        explanation.setWordWrap(True)
        row = QHBoxLayout()
        row.addWidget(self.host, 1)
        row.addWidget(self.button)
        layout = QVBoxLayout(self)
        layout.addWidget(explanation)
        layout.addLayout(row)
        layout.addWidget(self.lines, 1)
        self.resize(620, 320)

    @property
    def is_watching(self) -> bool:
        """Return whether the command runs."""
        return bool(self._process.state() != QProcess.NotRunning)

    def done(self, result: int) -> None:
        """End RViz, too."""
        if self.is_watching:
            self._process.finished.connect(lambda *_: super(WatchDialog, self).done(result))
            self._process.terminate()
            self.hide()
        else:
            super().done(result)

    def _toggle(self) -> None:
        if self.is_watching:
            self._process.terminate()
            return
        host = self.host.text().strip()
        self.lines.clear()
        self._process.start(self._program, [PACKAGE, 'cell', 'view', f'--master={host}'])

    def _read(self) -> None:
        text = bytes(self._process.readAllStandardOutput().data()).decode('utf-8', 'replace')
        for line in text.splitlines():
            self.lines.appendPlainText(shown(line[6:] if line.startswith('cell: ') else line))

    def _update(self) -> None:
        self.button.setText('Stop watching' if self.is_watching else 'Watch')
        self.button.setEnabled(self.is_watching or bool(self.host.text().strip()))
        self.host.setEnabled(not self.is_watching)
