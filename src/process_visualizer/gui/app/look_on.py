# SPDX-License-Identifier: BSD-3-Clause
"""Watching cells: another launcher's, one on another computer, and this one in browsers."""
from __future__ import annotations

import os
import sys
import time
from tempfile import TemporaryDirectory
from typing import Callable, List, Mapping, Optional, Sequence, Tuple

import yaml
from PyQt5.QtCore import QObject, QProcess, Qt, QTimer, pyqtSignal
from PyQt5.QtGui import QGuiApplication, QImage, QPixmap
from PyQt5.QtWidgets import (
    QComboBox,
    QDialog,
    QHBoxLayout,
    QLineEdit,
    QMessageBox,
    QPlainTextEdit,
    QPushButton,
    QVBoxLayout,
    QWidget,
)

from process_visualizer.generate.plan import RVIZ_FILE
from process_visualizer.gui.toolkit.desktop import output_lines
from process_visualizer.gui.toolkit.dialogs import message_box, show_aside
from process_visualizer.gui.toolkit.labels import plain_label
from process_visualizer.gui.toolkit.widgets import MeaningGuard
from process_visualizer.launching.cell_owner import CELL_NODES, CellOwner
from process_visualizer.launching.cell_watch import MASTER_OTHER, CellLook, CellWatch
from process_visualizer.launching.run_record import start_time
from process_visualizer.ros_names import PACKAGE, RVIZ
from process_visualizer.rviz.views import onlooker_view, read_view
from process_visualizer.rviz.window_geometry import Rectangle, moved_aside
from process_visualizer.shown_text import shown

_NOTHING = 'That launcher has not started anything, so there is nothing to watch yet.'
_WATCH = 'You can watch the cell in an RViz that shows the same and changes nothing.'
_ELSEWHERE = '"rosrun process_visualizer cell view" shows it here, and changes nothing in it.'
_OWNER_ENDED = 'The other launcher has ended.'
_LOOK_MS = 1000
_OR = 'To launch a cell here, quit that launcher, or set ROS_MASTER_URI to another port.'


class SecondLauncher(QObject):
    """Offers to watch the other launcher's cell; emits ``ended`` when the user declines or stops.

    RViz keeps its last picture when the cell ends, and shows no sign of that. So a box in front of
    it then says since when the picture is out of date.
    """

    ended = pyqtSignal()
    _looked = pyqtSignal(object)
    """A CellLook, from the thread of the watch."""

    def __init__(self, owner: CellOwner) -> None:
        super().__init__()
        self._owner = owner
        self._folder = TemporaryDirectory(prefix='process_visualizer_looking_on_')
        self._rviz = QProcess(self)
        self._rviz.setProcessChannelMode(QProcess.ForwardedChannels)
        self._rviz.finished.connect(lambda *_: self.close())
        self._rviz.errorOccurred.connect(self._take_error)
        self._watch = CellWatch(lambda: CELL_NODES, self._looked.emit, refuses_s=0.0)
        self._looked.connect(self.take_look)
        self.stale: Optional[QMessageBox] = None
        self.box = message_box(None, self._text(), QMessageBox.Information)
        self.watch: QPushButton = self.box.addButton('Watch', QMessageBox.AcceptRole)
        self.watch.setObjectName('watch_cell')
        self.watch.setEnabled(self._is_launched)
        self.start: QPushButton = self.box.addButton('Start here', QMessageBox.AcceptRole)
        self.start.setObjectName('start_here')
        self.restarts = False
        """True if the user wants this launcher to start now that the other one has ended."""
        self.box.addButton(QMessageBox.Close)
        self.box.finished.connect(self._answered)
        self._owner_began = start_time(owner.process_id) if owner.user else None
        self._timer = QTimer(self, interval=_LOOK_MS)
        self._timer.timeout.connect(self._look_at_owner)
        self._timer.start()
        self.box.open()
        self.start.hide()  # Qt has shown it
        self._is_asking = True
        print(owner.text, file=sys.stderr, flush=True)

    def take_look(self, look: CellLook) -> None:
        """Show since when nothing has been received from the cell, until it answers again."""
        is_stale = look.silent >= set(CELL_NODES) or look.master_problem == MASTER_OTHER
        if is_stale and self.stale is None:
            self.stale = self._say_it_is_stale()
        elif not is_stale and self.stale is not None:
            self.stale.disconnect()
            self.stale.close()
            self.stale = None

    def _say_it_is_stale(self) -> QMessageBox:
        since = time.strftime('%H:%M:%S')
        print(f'nothing has been received from the cell since {since}', file=sys.stderr, flush=True)
        box = message_box(None, 'This picture is out of date: nothing has been received from the '
                          f'cell since {since}. It was quit, or its ROS master was restarted.')
        box.setWindowFlag(Qt.WindowStaysOnTopHint)
        stop = box.addButton('Stop watching', QMessageBox.RejectRole)
        stop.setObjectName('stop_watching')
        box.finished.connect(lambda _code: self.close())
        show_aside(box)
        return box

    def close(self) -> None:
        """Close the question, or stop watching."""
        self._watch.close()
        if self._is_asking:
            self.box.reject()
        elif self._rviz.state() != QProcess.NotRunning:
            self._rviz.terminate()
        else:
            self._folder.cleanup()
            self.ended.emit()

    def _look_at_owner(self) -> None:
        """Offer to start in place of a launcher on this computer that has ended."""
        if self._is_asking and self._owner_began is not None and (
                start_time(self._owner.process_id) != self._owner_began):
            self._timer.stop()
            self.box.setText(_OWNER_ENDED)
            self.watch.hide()
            self.start.show()

    @property
    def _view(self) -> str:
        return os.path.join(self._owner.folder, RVIZ_FILE)

    @property
    def _is_launched(self) -> bool:
        return bool(self._owner.folder) and os.path.isfile(self._view)

    def _text(self) -> str:
        what = _WATCH if self._is_launched else \
            _NOTHING if self._owner.folder else _ELSEWHERE
        return f'{self._owner.text}.\n\n{what} {_OR}'

    def _answered(self, _code: int) -> None:
        self._is_asking = False
        self._timer.stop()
        self.restarts = self.box.clickedButton() is self.start
        if self.box.clickedButton() is self.watch:
            self._start()
        else:
            self.close()

    def _start(self) -> None:
        path = os.path.join(self._folder.name, 'looking_on.rviz')
        try:
            view = onlooker_view(read_view(self._view))
            room = QGuiApplication.primaryScreen().availableGeometry()
            view['Window Geometry'] = moved_aside(
                view.get('Window Geometry'),
                Rectangle(room.x(), room.y(), room.width(), room.height()))
            content = yaml.safe_dump(view, sort_keys=False)
            with open(path, 'w', encoding='utf-8') as file:
                file.write(content)
        except (OSError, ValueError) as error:
            self._report(str(error))
            return
        self._rviz.start('rosrun', [PACKAGE, RVIZ, '-d', path,
                                    f'__name:=rviz_looking_on_{os.getpid()}'])
        self._watch.begin()

    def _take_error(self, error: QProcess.ProcessError) -> None:
        """Report a failed start, but not that a running RViz was ended."""
        if error == QProcess.FailedToStart:
            self._report(self._rviz.errorString())

    def _report(self, reason: str) -> None:
        print(f'RViz cannot be started for watching: {reason}', file=sys.stderr, flush=True)
        self.close()


_EXPLANATION = ('The name or address of the computer on which the cell runs. Its view appears in '
                'an RViz of its own; nothing is changed in it. Start the cell there with '
                '"cell run --remote", or the launcher with remote:=true (see docs/remote.md).')
_LOOKING, _ENDED = 'Looking for the cell on {}…', 'Watching has ended.'
_MAX_LINES = 500
_END_VIEW_MS = 10_000


def _command(parent: QWidget, lines_name: str, read: Callable[[], None],
             update: Callable[[], None]) -> Tuple[QPlainTextEdit, QProcess]:
    """Return the lines of a command that a dialog runs, and its process.

    ``read`` is called for new output, ``update`` when the process starts or ends.
    """
    lines, process = QPlainTextEdit(), QProcess(parent)
    lines.setObjectName(lines_name)
    lines.setReadOnly(True)
    lines.setMaximumBlockCount(_MAX_LINES)
    process.setProcessChannelMode(QProcess.MergedChannels)
    process.readyReadStandardOutput.connect(read)
    process.stateChanged.connect(update)
    process.finished.connect(lambda *_: read())
    return lines, process


class WatchDialog(QDialog):
    """Asks for the computer, and shows the output of ``cell view``; closing it ends RViz."""

    def __init__(self, parent: QWidget, program: str = 'rosrun') -> None:
        """``program`` is the command that runs nodes of packages."""
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
        self.lines, self._process = _command(self, 'watch_lines', self._read, self._update)
        self._process.finished.connect(lambda *_: self.lines.appendPlainText(_ENDED))
        self._process.errorOccurred.connect(self._take_error)
        self._is_stopping = False
        self.button.clicked.connect(self._toggle)
        self._meaning = MeaningGuard(self.button)
        self.host.textChanged.connect(self._update)
        self._lay_out()
        self._update()

    def _lay_out(self) -> None:
        explanation = plain_label(_EXPLANATION)
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
        """Close the dialog, and end RViz."""
        if self.is_watching:
            self._process.finished.connect(lambda *_: super(WatchDialog, self).done(result))
            self._process.terminate()
            self.hide()
        else:
            super().done(result)

    def end(self) -> None:
        """End the command, as the window is about to close; it needs some seconds to end RViz."""
        if self.is_watching:
            self.hide()
            self._is_stopping = True
            self._process.terminate()
            self._process.waitForFinished(_END_VIEW_MS)
        self._process.blockSignals(True)  # the widgets that follow it are about to be deleted

    def _toggle(self) -> None:
        if self.is_watching:
            self._is_stopping = True
            self._process.terminate()
            return
        host = self.host.text().strip()
        self._is_stopping = False
        self.lines.setPlainText(_LOOKING.format(host))
        self._process.start(self._program, [PACKAGE, 'cell', 'view', f'--master={host}'])

    def _take_error(self, _error: object) -> None:
        """Report why the command ended, unless it was stopped, which may end it by a signal."""
        if not self._is_stopping:
            self.lines.appendPlainText(self._process.errorString())

    def _read(self) -> None:
        for line in output_lines(self._process):
            self.lines.appendPlainText(shown(line[6:] if line.startswith('cell: ') else line))

    def _update(self) -> None:
        self.button.setText('Stop watching' if self.is_watching else 'Watch')
        self._meaning.show('stop' if self.is_watching else 'watch')
        self.button.setEnabled(self.is_watching or bool(self.host.text().strip()))
        self.host.setEnabled(not self.is_watching)


_FOR_HERE = ('A browser on this computer shows the running cell at the address below. It cannot '
             'change anything.')
_FOR_OTHERS = ('Any browser, also on a phone, shows the running cell at the address below. Nobody '
               'there can change anything. Others need the whole address, with the token in it.')
_HERE = 'this computer only'
_QR_PX = 220
_END_MS = 1000
_BLACK, _WHITE = 0xFF000000, 0xFFFFFFFF
_WATCHES, _LEAVES = ' watches', ' watches no longer'


class ServeDialog(QDialog):
    """Runs ``cell serve``, which keeps running while the dialog is closed."""

    def __init__(self, parent: QWidget, addresses: Sequence[str],
                 cell: Callable[[], Tuple[str, Mapping[str, str]]], program: str = 'rosrun'
                 ) -> None:
        """Set what ``cell serve`` needs.

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
        self.lines, self._process = _command(self, 'serve_lines', self._read, self._update)
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
        self.viewers.setText('' if not self.url.text() else 'No viewers' if not count else
                             f'Viewers: {", ".join(sorted(self._watching))}')

    def _take_error(self, error: QProcess.ProcessError) -> None:
        """Report a failed start, but not that a running command was ended."""
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
