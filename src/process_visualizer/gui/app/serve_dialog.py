# SPDX-License-Identifier: BSD-3-Clause
"""The running cell in browsers: the switch, the address as text and QR code, and who is looking."""
from __future__ import annotations

from typing import Callable, List, Mapping, Sequence, Tuple

from PyQt5.QtCore import QProcess, Qt
from PyQt5.QtGui import QImage, QPixmap
from PyQt5.QtWidgets import (
    QComboBox,
    QDialog,
    QHBoxLayout,
    QPlainTextEdit,
    QPushButton,
    QVBoxLayout,
    QWidget,
)

from process_visualizer.gui.toolkit.desktop import output_lines
from process_visualizer.gui.toolkit.labels import plain_label
from process_visualizer.gui.toolkit.widgets import MeaningGuard
from process_visualizer.ros_names import PACKAGE
from process_visualizer.shown_text import shown

_FOR_HERE = ('A browser on this computer shows the running cell at the address below. It cannot '
             'change anything.')
_FOR_OTHERS = ('Any browser, also on a phone, shows the running cell at the address below. Nobody '
               'there can change anything. Others need the whole address, with the token in it.')
_HERE = 'this computer only'
_MAX_LINES = 500
_QR_PX = 220
_END_MS = 1000
_BLACK, _WHITE = 0xFF000000, 0xFFFFFFFF
_WATCHES, _LEAVES = ' watches', ' watches no longer'


class ServeDialog(QDialog):
    """Runs ``cell serve``, which keeps running while the dialog is closed."""

    def __init__(self, parent: QWidget, addresses: Sequence[str],
                 cell: Callable[[], Tuple[str, Mapping[str, str]]], program: str = 'rosrun'
                 ) -> None:
        """Take what ``cell serve`` needs.

        Args:
            parent: the window.
            addresses: the addresses of this computer.
            cell: returns the file of the configuration, and its arguments.
            program: the command that runs nodes of packages.
        """
        super().__init__(parent)
        self.setObjectName('serve')
        self.setWindowTitle('Show the running cell in browsers')
        self._cell, self._program = cell, program
        self._watching: List[str] = []
        self.address = QComboBox()
        self.address.setObjectName('served_address')
        self.address.setAccessibleName('Who can open the page')
        self.address.addItem(_HERE, '')
        for it in addresses:
            self.address.addItem(f'others, too: {it}', it)
        self.explanation = plain_label()
        self.explanation.setObjectName('serve_explanation')
        self.explanation.setWordWrap(True)
        self.button = QPushButton('Show')
        self.button.setObjectName('serve_button')
        self.url = plain_label()
        self.url.setObjectName('served_url')
        self.url.setWordWrap(True)
        self.url.setTextInteractionFlags(Qt.TextSelectableByMouse | Qt.TextSelectableByKeyboard)
        self.code = plain_label()
        self.code.setAccessibleName('The address as a QR code')
        self.viewers = plain_label()
        self.viewers.setObjectName('viewers')
        self.lines = QPlainTextEdit()
        self.lines.setObjectName('serve_lines')
        self.lines.setReadOnly(True)
        self.lines.setMaximumBlockCount(_MAX_LINES)
        self._process = QProcess(self)
        self._process.setProcessChannelMode(QProcess.MergedChannels)
        self._process.readyReadStandardOutput.connect(self._read)
        self._process.finished.connect(lambda *_: self._read())
        self._process.stateChanged.connect(self._update)
        self._process.errorOccurred.connect(self._take_error)
        self.button.clicked.connect(self._toggle)
        self._meaning = MeaningGuard(self.button)
        self.address.currentIndexChanged.connect(self._explain)
        self._lay_out()
        self._explain()
        self._update()

    def _lay_out(self) -> None:
        row, below = QHBoxLayout(), QHBoxLayout()
        row.addWidget(self.address, 1)
        row.addWidget(self.button)
        side = QVBoxLayout()
        for widget in (self.url, self.viewers):
            side.addWidget(widget)
        side.addWidget(self.lines, 1)
        below.addLayout(side, 1)
        below.addWidget(self.code, 0, Qt.AlignTop)
        layout = QVBoxLayout(self)
        layout.addWidget(self.explanation)
        layout.addLayout(row)
        layout.addLayout(below, 1)
        self.resize(680, 360)

    def _explain(self) -> None:
        self.explanation.setText(_FOR_OTHERS if self.address.currentData() else _FOR_HERE)

    @property
    def is_serving(self) -> bool:
        """Return whether the command runs."""
        return bool(self._process.state() != QProcess.NotRunning)

    def end(self) -> None:
        """End the page, as the window is about to close; allow it a moment for that."""
        if self.is_serving:
            self._process.terminate()
            self._process.waitForFinished(_END_MS)

    def _toggle(self) -> None:
        if self.is_serving:
            self._process.terminate()
            return
        file, arguments = self._cell()
        address = self.address.currentData()
        self.lines.clear()
        self._watching = []
        self._process.start(self._program, [
            PACKAGE, 'cell', 'serve', file, *(f'{name}:={it}' for name, it in arguments.items()),
            *([f'--address={address}'] if address else [])])

    def _read(self) -> None:
        for line in output_lines(self._process):
            self._take(line)
        self._show_viewers()

    def _take(self, line: str) -> None:
        if line.startswith(('http://', 'https://')) and not self.url.text():
            self.url.setText(line)
            if self.address.currentData():
                self.code.setPixmap(qr_code(line))
            return
        who = line.rpartition(_LEAVES)[0] or line.rpartition(_WATCHES)[0]
        if line == who + _WATCHES:
            self._watching.append(who)
        elif line == who + _LEAVES and who in self._watching:
            self._watching.remove(who)
        self.lines.appendPlainText(shown(line[6:] if line.startswith('cell: ') else line))

    def _show_viewers(self) -> None:
        count = len(self._watching)
        self.viewers.setText('' if not self.url.text() else 'Nobody is looking' if not count else
                             f'Looking now: {", ".join(sorted(self._watching))}')

    def _take_error(self, error: QProcess.ProcessError) -> None:
        """Report a failed start; it is no problem if a running command is ended."""
        if error == QProcess.FailedToStart:
            self.lines.appendPlainText(self._process.errorString())

    def _update(self) -> None:
        self.button.setText('Stop showing' if self.is_serving else 'Show')
        self._meaning.show('stop' if self.is_serving else 'show')
        self.address.setEnabled(not self.is_serving)
        if not self.is_serving:
            self.url.clear()
            self.code.clear()
            self.viewers.clear()


def qr_code(text: str) -> QPixmap:
    """Return a text as a QR code, black on white with its margin."""
    import qrcode  # only now, so that the window opens sooner
    code = qrcode.QRCode(border=4)
    code.add_data(text)
    rows = code.get_matrix()
    image = QImage(len(rows), len(rows), QImage.Format_RGB32)
    for y, row in enumerate(rows):
        for x, is_black in enumerate(row):
            image.setPixel(x, y, _BLACK if is_black else _WHITE)
    scale = max(_QR_PX // len(rows), 2)
    return QPixmap.fromImage(image.scaled(scale * len(rows), scale * len(rows)))
