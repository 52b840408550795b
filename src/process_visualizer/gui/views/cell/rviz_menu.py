# SPDX-License-Identifier: BSD-3-Clause
"""The menu of RViz: restart it, save its view, choose that of the next launch."""
from __future__ import annotations

from typing import Optional, Tuple

from PyQt5.QtCore import pyqtSignal
from PyQt5.QtWidgets import QActionGroup, QMenu, QWidget


class RvizMenu(QMenu):
    """An RViz that has died can be restarted, but has no view to be saved."""

    restart_wanted = pyqtSignal()
    save_wanted = pyqtSignal()
    chosen = pyqtSignal(object)
    """The name of a saved view, or None for the default one."""

    def __init__(self, parent: Optional[QWidget] = None) -> None:
        super().__init__(parent)
        self.setObjectName('rviz_menu')
        self.setToolTipsVisible(True)
        self._restart = self.addAction('Restart RViz', self.restart_wanted.emit)
        self._save = self.addAction('Save this view as…', self.save_wanted.emit)
        self.addSection('View at next launch')
        self._views = QActionGroup(self)
        self.show_rviz(True)

    def show_rviz(self, is_alive: bool) -> None:
        """Offer what is possible while RViz runs, or after it has died."""
        self._restart.setToolTip('It starts with its present view' if is_alive
                                 else 'It starts with the view of the launch')
        self._save.setEnabled(is_alive)
        self._save.setToolTip('' if is_alive else 'RViz does not run: restart it first')

    def show_views(self, names: Tuple[str, ...], chosen: Optional[str]) -> None:
        """Offer the saved views of the ticked devices."""
        for action in self._views.actions():
            self._views.removeAction(action)
            self.removeAction(action)
            action.deleteLater()
        for name in (None, *names):
            action = self._views.addAction(name or 'default')
            action.setCheckable(True)
            action.setChecked(name == chosen)
            action.triggered.connect(lambda _checked, it=name: self.chosen.emit(it))
        self.addActions(self._views.actions())
