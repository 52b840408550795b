# SPDX-License-Identifier: BSD-3-Clause
"""Files that are dropped on the window: a recording, or a configuration."""
from __future__ import annotations

import os
from typing import NamedTuple, Optional, Sequence, Tuple

from PyQt5.QtCore import QEvent, QObject, pyqtSignal
from PyQt5.QtGui import QDropEvent
from PyQt5.QtWidgets import QWidget

from process_visualizer.cell.model import Mode
from process_visualizer.gui.app.launcher import Launcher
from process_visualizer.gui.toolkit.dialogs import ask

_BAGS = ('.bag', '.bag.active')
_WHAT = 'Drop a recording (all .bag files of a split one), or one configuration (.xml).'


class Dropped(NamedTuple):
    """The files of a recording, or a configuration, or why nothing can be done with them."""

    bags: Tuple[str, ...] = ()
    configuration: str = ''
    refusal: str = ''


def sort_out(paths: Sequence[str]) -> Dropped:
    """Sort dropped paths by kind; '' stands for anything that is not a local file."""
    names = [path.lower() for path in paths]
    if paths and all(name.endswith(_BAGS) for name in names):
        return Dropped(bags=tuple(paths))
    if len(paths) == 1 and names[0].endswith('.xml'):
        return Dropped(configuration=paths[0])
    strange = next((os.path.basename(path) for path in paths
                    if path and not path.lower().endswith((*_BAGS, '.xml'))), '')
    return Dropped(refusal=f'{strange} cannot be opened here. {_WHAT}' if strange else _WHAT)


class DropTarget(QObject):
    """Lets a window accept files dropped anywhere on it, except during a recording."""

    play_wanted = pyqtSignal(object)
    """The operator wants to quit the running nodes, and to play a recording (its paths)."""
    configuration_wanted = pyqtSignal(str)
    refused = pyqtSignal(str)

    def __init__(self, window: QWidget, launcher: Launcher) -> None:
        super().__init__(window)
        self._window, self._launcher = window, launcher
        window.setAcceptDrops(True)
        window.installEventFilter(self)

    def eventFilter(self, window: Optional[QObject], event: Optional[QEvent]) -> bool:
        """Take files; leave all other events to the window."""
        if not isinstance(event, QDropEvent) or not event.mimeData().hasUrls():
            return super().eventFilter(window, event)
        event.acceptProposedAction()
        if event.type() == QEvent.Drop:
            self._take(sort_out([url.toLocalFile() for url in event.mimeData().urls()]))
        return True

    def _take(self, dropped: Dropped) -> None:
        if dropped.refusal:
            self.refused.emit(dropped.refusal)
        elif self._launcher.recording.is_recording:
            self.refused.emit('A recording is in progress: stop it before you open another file.')
        elif dropped.configuration:
            self.configuration_wanted.emit(dropped.configuration)
        else:
            self._open(dropped.bags)

    def _open(self, bags: Tuple[str, ...]) -> None:
        """Open a recording in playback mode, after a question if nodes run in real-time mode."""
        session = self._launcher.session
        if self._launcher.launch.is_idle or session.mode is Mode.PLAYBACK:
            self._launcher.bag.open(bags)
            session.set_mode(Mode.PLAYBACK)
        else:
            ask(self._window, f'Leave real-time mode, and play {os.path.basename(bags[0])}?',
                'Play', lambda: self.play_wanted.emit(bags))
