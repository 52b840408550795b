# SPDX-License-Identifier: BSD-3-Clause
"""Notices about files, new configurations, tools, mixtures, a lost master and unsaved edits."""
from __future__ import annotations

import itertools
import os
from typing import Callable, List, Optional, Sequence

from PyQt5.QtCore import Qt, pyqtSignal
from PyQt5.QtWidgets import (
    QFileDialog,
    QFrame,
    QGridLayout,
    QHBoxLayout,
    QMenu,
    QPushButton,
    QToolButton,
    QWidget,
)

from process_visualizer.cell.model import Mode
from process_visualizer.gui.cell.calibration_model import ToolModel
from process_visualizer.gui.cell.cell_model import CellModel, NewConfigurationModel
from process_visualizer.gui.cell.edited_values import UnsavedModel
from process_visualizer.gui.cell.launch_model import MixtureModel
from process_visualizer.gui.cell.master_model import MasterModel
from process_visualizer.gui.toolkit.desktop import working_folder
from process_visualizer.gui.toolkit.icons import icon
from process_visualizer.gui.toolkit.labels import listing, plain_label, plain_tip, sentence
from process_visualizer.gui.toolkit.theme import color, set_sheet
from process_visualizer.gui.toolkit.widgets import ElidedLabel, NoticeFrame, tool_button


class ChangedNotice(QWidget):
    """Names changed files in a quiet line; hidden while the configuration is as it was read."""

    def __init__(self, cell: CellModel, parent: Optional[QWidget] = None) -> None:
        super().__init__(parent)
        self._files = cell.files
        self._text = ElidedLabel()
        self._text.setObjectName('configuration_changed')
        color(self._text, 'quiet')
        reload = QPushButton(icon('reload'), 'Reload (F5)')
        reload.setObjectName('reload_changed')
        reload.setToolTip('Read the configuration again; what runs stays as it is until Apply')
        reload.clicked.connect(cell.reload)
        layout = QHBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addWidget(self._text, 1)
        layout.addWidget(reload)
        self._files.changed.connect(self._show)
        self._show()

    def _show(self) -> None:
        outdated = self._files.outdated
        names = ', '.join(map(os.path.basename, outdated))
        self._text.setText(f'{names} {"has" if len(outdated) == 1 else "have"} changed')
        self._text.setToolTip(plain_tip('\n'.join(outdated)))
        self.setVisible(bool(outdated))


class MadeNotice(NoticeFrame):
    """Shows a new configuration, until the notice is closed or another configuration is open."""

    open_wanted = pyqtSignal(str, int)
    """A file should be opened in the editor at a line."""

    def __init__(self, model: NewConfigurationModel, parent: Optional[QWidget] = None) -> None:
        super().__init__('made', 'good', parent, symbol='ok')
        self._path = ''
        edit = QPushButton(icon('open'), 'Open it in the editor')
        edit.setObjectName('made_edit')
        edit.setToolTip('Your editor (VISUAL or EDITOR); afterwards, F5 reads the file again')
        edit.clicked.connect(lambda: self.open_wanted.emit(self._path, 1))
        close = QPushButton('Close')
        close.setObjectName('made_close')
        close.clicked.connect(self.hide)
        self.add_buttons(edit, close)
        self.hide()
        model.summary_ready.connect(self._text.setText)
        model.made.connect(self._show_made)

    def follow(self, path: str) -> None:
        """Hide if another configuration is open; ``path`` is that of the open one."""
        if path != self._path:
            self.hide()

    def _show_made(self, path: str) -> None:
        self._path = path
        self.setToolTip(plain_tip(path))
        self.show()


_MAX_SENTENCES = 3
_MEANING = {
    Mode.PLAYBACK: '{}: the picture mixes live data with the recording. Stop that node.',
    Mode.REALTIME: '{}, which plays a recording: the picture mixes live data with it. Stop that '
                   'player.'}


class MixtureNotice(NoticeFrame):
    """Shows the sentences of a mixture model; hidden without any."""

    def __init__(self, model: MixtureModel, parent: Optional[QWidget] = None) -> None:
        super().__init__('mixture', 'bad', parent)
        self._model = model
        model.changed.connect(self._show)
        self._show()

    def _show(self) -> None:
        sentences, mode = self._model.sentences, self._model.mode
        if sentences and mode is not None:
            more = len(sentences) - _MAX_SENTENCES
            text = '; '.join(sentences[:_MAX_SENTENCES])
            text += f'; and {more} more' if more > 0 else ''
            self._text.setText(_MEANING[mode].format(text))
            self._text.setToolTip(plain_tip('\n'.join(sentences)))
        self.setVisible(bool(sentences) and mode is not None)


class LostMasterNotice(NoticeFrame):
    """Offers a remedy while the ROS master is lost; a dialog could be answered by mistake."""

    remedy_wanted = pyqtSignal()

    def __init__(self, master: MasterModel, parent: Optional[QWidget] = None) -> None:
        super().__init__('lost_master', 'bad', parent)
        self._master = master
        remedy = QPushButton('Start again…')
        remedy.setObjectName('lost_master_remedy')
        remedy.setToolTip('Quit all nodes, and restart the launcher; you will be asked first')
        remedy.clicked.connect(self.remedy_wanted)
        self.add_buttons(remedy)
        for changed in (master.lost, master.returned):
            changed.connect(self._show)
        self._show()

    def _show(self) -> None:
        self._text.setText(f'{self._master.problem}: nothing can be launched.')
        self.setVisible(self._master.is_lost)


class ToolNotice(NoticeFrame):
    """Offers the learned tool frame of a tool model; hidden while nothing is offered."""

    def __init__(self, model: ToolModel, parent: Optional[QWidget] = None) -> None:
        super().__init__('tool', 'warning', parent)
        self._model = model
        self._write = QPushButton(icon('save'), 'Write')
        self._write.setObjectName('tool_write')
        self._write.setToolTip('Write it into the file and keep a backup beside it; the rest of '
                               'the file stays as it is. Apply restarts the robot.')
        self._write.clicked.connect(model.write)
        self._dismiss = QPushButton('Not now')
        self._dismiss.setObjectName('tool_dismiss')
        self._dismiss.setToolTip('Leave the file as it is; you will not be asked again in '
                                 'this session')
        self._dismiss.clicked.connect(model.dismiss)
        self.add_buttons(self._write, self._dismiss)
        model.changed.connect(self._show)
        self._show()

    def _show(self) -> None:
        offered = self._model.offered
        if offered is not None:
            file = os.path.basename(offered.file)
            self._text.setText(f'{sentence(offered.text)}. Write {offered.element} into {file}?')
            self._write.setText(f'Write into {file}')
            self._write.setAccessibleName(f'Write {offered.element} into {offered.file}')
            self.setAccessibleName(f'Tool frame of {offered.device}')
        self._write.setEnabled(not self._model.is_saving)
        self.setVisible(offered is not None)


class UnsavedNotice(NoticeFrame):
    """Offers unsaved edits; stays until it is answered."""

    def __init__(self, model: UnsavedModel, parent: Optional[QWidget] = None) -> None:
        super().__init__('unsaved', 'warning', parent)
        self._model = model
        take = QPushButton('Use')
        take.setObjectName('unsaved_take')
        take.setToolTip('Edit them again in the tab Calibration; nothing is written into a file')
        take.clicked.connect(model.take)
        discard = QPushButton('Discard')
        discard.setObjectName('unsaved_discard')
        discard.clicked.connect(model.discard_offer)
        self.add_buttons(take, discard)
        model.changed.connect(self._show)
        self._show()

    def _show(self) -> None:
        offered = self._model.offered
        if offered:
            self._text.setText(f'Left unsaved: {listing(offered)}.')
        self.setVisible(bool(offered))


_CONFIGURATIONS, _BAGS = 'Configurations (*.xml)', 'Recordings (*.bag)'
_FILE = 'cell'
_TEXT = ('These devices are an example. Running drivers, or a recording of them, are enough to '
         'make a configuration of your own cell.')


class NewConfigurationView(QFrame):
    """Offers to make a configuration; ``button`` is for a row of buttons. Asks without blocking."""

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
        text = plain_label(_TEXT)
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
        dialog.selectFile(_free_name(self._folder(), given))
        dialog.fileSelected.connect(lambda path: self._model.make(path, given))
        dialog.open()

    def _dialog(self, name: str, title: str, kind: str) -> QFileDialog:
        dialog = QFileDialog(self._window, title, self._folder(), kind)
        dialog.setObjectName(name)
        dialog.setAttribute(Qt.WA_DeleteOnClose)
        return dialog

    def _folder(self) -> str:
        """Return the folder of the user's open configuration if writable, or the working folder."""
        folder = os.path.dirname(self._current())
        return folder if self.isHidden() and os.access(folder, os.W_OK) else working_folder()


def _free_name(folder: str, bags: Sequence[str]) -> str:
    """Return an unused name for a new configuration, after the recording if there is one."""
    stem = os.path.splitext(os.path.basename(bags[0]))[0] if bags else _FILE
    names = (f'{stem}{number}.xml' for number in itertools.chain([''], itertools.count(2)))
    return next(it for it in names if not os.path.exists(os.path.join(folder, it)))
