# SPDX-License-Identifier: BSD-3-Clause
"""The name and folder of the bag: the options of the thesis' figure 5.3."""
from __future__ import annotations

from typing import Dict, Optional

from PyQt5.QtCore import Qt
from PyQt5.QtWidgets import (
    QButtonGroup,
    QFileDialog,
    QHBoxLayout,
    QLabel,
    QLineEdit,
    QRadioButton,
    QWidget,
)

from process_visualizer.gui.models.recording.recording_choices import NameChoice, RecordingChoices
from process_visualizer.gui.toolkit.theme_following import colour
from process_visualizer.gui.views.parts.labels import small, tool_button
from process_visualizer.gui.views.parts.layouts import in_column, in_row

_TOOLTIPS = {
    NameChoice.DATE: 'Use standard file name: the current date and time',
    NameChoice.PREFIX: 'Use a prefix, with the date and time behind it',
    NameChoice.NAME: 'Use the following file name'}
_TEXTS = {NameChoice.DATE: 'Date and time',
          NameChoice.PREFIX: 'Prefix:', NameChoice.NAME: 'Custom name:'}


class NameOptions(QWidget):
    """Three radio buttons, their texts, the folder, and their problems."""

    def __init__(self, choices: RecordingChoices, parent: Optional[QWidget] = None) -> None:
        super().__init__(parent)
        self._choices = choices
        self._buttons: Dict[NameChoice, QRadioButton] = {}
        self._group = QButtonGroup(self)
        for choice in NameChoice:
            self._add_button(choice)
        self._prefix = _line('record_prefix', 'Prefix', 'seam', 'Put before date and time')
        self._name = _line('record_name', 'File name', 'seam',
                           'The name of the file; never overwrites')
        self._folder = _line('record_folder', 'Folder', '',
                             'Recordings go here; created if it does not exist')
        self._browse = tool_button('choose_record_folder', 'folder', 'Choose the folder',
                                   self._choose_folder)
        self._problem = small(QLabel())
        self._problem.setObjectName('record_problem')
        policy = self._problem.sizePolicy()
        policy.setRetainSizeWhenHidden(True)  # the button below does not move while one types
        self._problem.setSizePolicy(policy)
        self._lay_out()
        self._connect()

    def refresh(self) -> None:
        """Show the choices."""
        choice = self._choices.name_choice
        self._buttons[choice].setChecked(True)
        self._prefix.setEnabled(choice is NameChoice.PREFIX)
        self._name.setEnabled(choice is NameChoice.NAME)
        for line, text in ((self._prefix, self._choices.prefix), (self._name, self._choices.name),
                           (self._folder, self._choices.folder)):
            if not line.hasFocus() and line.text() != text:
                line.setText(text)
        self._show_problem()

    def _show_problem(self) -> None:
        problem, free_name = self._choices.problem, self._choices.free_name
        text = problem[:1].upper() + problem[1:] if self.isEnabled() else ''
        if free_name:
            text = (f'{self._choices.name}.bag exists already.  '
                    f'<a href="free">Use {free_name}</a>')
        if text != self._problem.text():
            self._problem.setText(text)
        self._problem.setVisible(bool(text) and self.isEnabled())

    def _use_free_name(self) -> None:
        name = self._choices.free_name
        self._choices.set_name(name)
        self._name.setText(name)

    def _choose(self, choice: NameChoice) -> None:
        self._choices.choose_name(choice)
        line = {NameChoice.PREFIX: self._prefix, NameChoice.NAME: self._name}.get(choice)
        if line is not None:
            line.setFocus()

    def _choose_folder(self) -> None:
        dialog = QFileDialog(self, 'Folder for recordings', self._choices.folder)
        dialog.setFileMode(QFileDialog.Directory)
        dialog.setOption(QFileDialog.ShowDirsOnly)
        dialog.setAttribute(Qt.WA_DeleteOnClose)
        dialog.fileSelected.connect(self._choices.set_folder)
        dialog.open()

    def _add_button(self, choice: NameChoice) -> None:
        button = QRadioButton(_TEXTS[choice])
        button.setObjectName(f'record_by_{choice.value}')
        button.setToolTip(_TOOLTIPS[choice])
        button.clicked.connect(lambda: self._choose(choice))
        self._group.addButton(button)
        self._buttons[choice] = button

    def _connect(self) -> None:
        self._prefix.textEdited.connect(self._choices.set_prefix)
        self._name.textEdited.connect(self._choices.set_name)
        self._folder.editingFinished.connect(
            lambda: self._choices.set_folder(self._folder.text()))
        self._problem.linkActivated.connect(lambda _: self._use_free_name())

    def _lay_out(self) -> None:
        in_column(self, 4, self._buttons[NameChoice.DATE],
                  _row(self._buttons[NameChoice.PREFIX], self._prefix, _hint('+ date and time')),
                  _row(self._buttons[NameChoice.NAME], self._name, _hint('.bag')),
                  _row(QLabel('Folder:'), self._folder, self._browse), self._problem)
        self._problem.setWordWrap(True)
        colour(self._problem, 'warning')


def _row(before: QWidget, line: QLineEdit, after: QWidget) -> QHBoxLayout:
    layout = in_row(before, line, after, wide=line)
    layout.setSpacing(6)
    return layout


def _line(name: str, accessible_name: str, placeholder: str, hint: str) -> QLineEdit:
    line = QLineEdit()
    line.setObjectName(name)
    line.setAccessibleName(accessible_name)
    line.setPlaceholderText(placeholder)
    line.setToolTip(hint)
    return line


def _hint(text: str) -> QLabel:
    label = QLabel(text)
    colour(label, 'quiet')
    return label
