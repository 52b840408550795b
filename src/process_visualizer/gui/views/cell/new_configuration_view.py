# SPDX-License-Identifier: BSD-3-Clause
"""Offers to make a configuration: a button, and a notice while only the example is open."""
from __future__ import annotations

import os
from typing import Callable, List, Optional, Sequence

from PyQt5.QtCore import Qt, pyqtSignal
from PyQt5.QtWidgets import (
    QFileDialog,
    QFrame,
    QGridLayout,
    QLabel,
    QMenu,
    QPushButton,
    QToolButton,
    QWidget,
)

from process_visualizer.gui.models.cell.new_configuration_model import NewConfigurationModel
from process_visualizer.gui.toolkit.theme_following import set_sheet
from process_visualizer.gui.toolkit.working_folder import working_folder
from process_visualizer.gui.views.parts.labels import tool_button

_CONFIGURATIONS, _BAGS = 'Configurations (*.xml)', 'Recordings (*.bag)'
_FILE = 'cell.xml'
_TEXT = ('These devices are an example. Running drivers, or a recording of them, are enough to '
         'make a configuration of your own cell.')


class NewConfigurationView(QFrame):
    """The notice; ``button`` is for a row of buttons. Asks for files without blocking."""

    open_wanted = pyqtSignal()

    def __init__(self, model: NewConfigurationModel, current: Callable[[], str],
                 parent: QWidget) -> None:
        """``current`` returns the path of the configuration that is open."""
        super().__init__(parent)
        self._model, self._current, self._window = model, current, parent
        self.button = self._make_button()
        self.setObjectName('new_offer')
        set_sheet(self, 'QFrame#new_offer { border: 1px solid <mid>; border-radius: 5px; }')
        self._lay_out()
        self.hide()
        model.made.connect(self.hide)
        model.changed.connect(self._show_state)

    def offer(self) -> None:
        """Show the notice until a configuration is made or chosen."""
        self.show()

    def _make_button(self) -> QToolButton:
        button = tool_button('new_configuration', 'new',
                             'Make a configuration from what is running, or from a recording',
                             lambda: None)
        menu = QMenu(button)
        menu.setObjectName('new_menu')
        menu.addAction('Make one from what is running…', self.ask_path)
        menu.addAction('Make one from a recording…', self._ask_bags)
        button.setMenu(menu)
        button.setPopupMode(QToolButton.InstantPopup)
        button.setStyleSheet('QToolButton::menu-indicator { image: none; }')
        return button

    def _lay_out(self) -> None:
        text = QLabel(_TEXT)
        text.setWordWrap(True)
        layout = QGridLayout(self)
        layout.setContentsMargins(8, 6, 8, 6)
        layout.addWidget(text, 0, 0, 1, 2)
        self._buttons = []
        for number, (name, label, action) in enumerate((
                ('new_from_system', 'From what is running…', self.ask_path),
                ('new_from_bag', 'From a recording…', self._ask_bags),
                ('new_open', 'Open a file…', self.open_wanted.emit))):
            button = QPushButton(label)
            button.setObjectName(name)
            button.clicked.connect(lambda _checked, act=action: act())
            layout.addWidget(button, 1 + number // 2, number % 2)
            self._buttons.append(button)

    def _show_state(self) -> None:
        for widget in (self.button, *self._buttons):
            widget.setEnabled(not self._model.is_making)

    def _ask_bags(self) -> None:
        dialog = self._dialog('new_bags', 'The recording to read', _BAGS)
        dialog.setFileMode(QFileDialog.ExistingFiles)
        dialog.filesSelected.connect(self.ask_path)
        dialog.open()

    def ask_path(self, bags: Optional[Sequence[str]] = None) -> None:
        """Ask where to write the configuration; then make it."""
        given: List[str] = list(bags or [])
        dialog = self._dialog('new_path', 'Write the new configuration', _CONFIGURATIONS)
        dialog.setAcceptMode(QFileDialog.AcceptSave)
        dialog.setDefaultSuffix('xml')
        dialog.selectFile(_FILE)
        dialog.fileSelected.connect(lambda path: self._model.make(path, given))
        dialog.open()

    def _dialog(self, name: str, title: str, kind: str) -> QFileDialog:
        dialog = QFileDialog(self._window, title, self._folder(), kind)
        dialog.setObjectName(name)
        dialog.setAttribute(Qt.WA_DeleteOnClose)
        return dialog

    def _folder(self) -> str:
        """The folder of the user's own configuration, if one is open and the folder is writable."""
        folder = os.path.dirname(self._current())
        return folder if self.isHidden() and os.access(folder, os.W_OK) else working_folder()
