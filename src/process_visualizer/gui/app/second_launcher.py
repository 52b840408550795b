# SPDX-License-Identifier: BSD-3-Clause
"""A launcher on a master whose cell another one has: it says who, and lets the user look on."""
from __future__ import annotations

import os
import sys
from tempfile import TemporaryDirectory

import yaml
from PyQt5.QtCore import QObject, QProcess, pyqtSignal
from PyQt5.QtWidgets import QMessageBox, QPushButton

from process_visualizer.generate.plan import RVIZ_FILE
from process_visualizer.gui.toolkit.questions import message_box
from process_visualizer.launching.cell_owner import CellOwner
from process_visualizer.ros_names import PACKAGE, RVIZ
from process_visualizer.rviz.onlooker_view import onlooker_view
from process_visualizer.rviz.view_file import read_view
from process_visualizer.rviz.window_geometry import moved_aside

_NOTHING = 'It has launched nothing, so there is nothing to look at yet.'
_LOOK_ON = 'You can look on: an RViz that shows the same and changes nothing.'
_ELSEWHERE = '"rosrun process_visualizer cell view" shows it here, and changes nothing in it.'
_OR = 'To launch a cell here, quit that launcher, or set ROS_MASTER_URI to another port.'


class SecondLauncher(QObject):
    """Asks; ``ended`` when the user has answered, and looks on no more."""

    ended = pyqtSignal()

    def __init__(self, owner: CellOwner) -> None:
        super().__init__()
        self._owner = owner
        self._folder = TemporaryDirectory(prefix='process_visualizer_looking_on_')
        self._rviz = QProcess(self)
        self._rviz.setProcessChannelMode(QProcess.ForwardedChannels)
        self._rviz.finished.connect(lambda *_: self.close())
        self._rviz.errorOccurred.connect(self._take_error)
        self.box = message_box(None, self._text(), QMessageBox.Information)
        self.look_on: QPushButton = self.box.addButton('Look on', QMessageBox.AcceptRole)
        self.look_on.setObjectName('look_on')
        self.look_on.setEnabled(self._is_launched)
        self.box.addButton(QMessageBox.Close)
        self.box.finished.connect(self._answered)
        self.box.open()
        self._is_asking = True
        print(owner.text, file=sys.stderr, flush=True)

    def close(self) -> None:
        """Leave the question, and look on no more."""
        if self._is_asking:
            self.box.reject()
        elif self._rviz.state() != QProcess.NotRunning:
            self._rviz.terminate()
        else:
            self._folder.cleanup()
            self.ended.emit()

    @property
    def _view(self) -> str:
        return os.path.join(self._owner.folder, RVIZ_FILE)

    @property
    def _is_launched(self) -> bool:
        return bool(self._owner.folder) and os.path.isfile(self._view)

    def _text(self) -> str:
        what = _LOOK_ON if self._is_launched else \
            _NOTHING if self._owner.folder else _ELSEWHERE
        return f'{self._owner.text}.\n\n{what} {_OR}'

    def _answered(self, _code: int) -> None:
        self._is_asking = False
        if self.box.clickedButton() is self.look_on:
            self._start()
        else:
            self.close()

    def _start(self) -> None:
        path = os.path.join(self._folder.name, 'looking_on.rviz')
        try:
            view = onlooker_view(read_view(self._view))
            view['Window Geometry'] = moved_aside(view.get('Window Geometry'))
            content = yaml.safe_dump(view, sort_keys=False)
            with open(path, 'w', encoding='utf-8') as file:
                file.write(content)
        except (OSError, ValueError) as error:
            self._tell(str(error))
            return
        self._rviz.start('rosrun', [PACKAGE, RVIZ, '-d', path,
                                    f'__name:=rviz_looking_on_{os.getpid()}'])

    def _take_error(self, error: QProcess.ProcessError) -> None:
        """One that has run and is ended, by whomever, is no problem."""
        if error == QProcess.FailedToStart:
            self._tell(self._rviz.errorString())

    def _tell(self, reason: str) -> None:
        print(f'RViz cannot be started to look on: {reason}', file=sys.stderr, flush=True)
        self.close()
