# SPDX-License-Identifier: BSD-3-Clause
"""The devices in use, and above them the problems of the file that was read."""
from __future__ import annotations

from typing import Optional, Sequence

from PyQt5.QtWidgets import QLabel, QSizePolicy, QVBoxLayout, QWidget

from process_visualizer.cell.errors import Problem
from process_visualizer.gui.toolkit.theme_following import colour
from process_visualizer.gui.views.cell.devices_view import DevicesView
from process_visualizer.gui.views.cell.problems_view import ProblemsView

_PROBLEMS_AND_DEVICES_PX = 168
"""The height of the problems above devices: three of two lines and a title."""
_NO_LIMIT_PX = 16777215


class DevicesPanel(QWidget):
    """Devices, problems, or both."""

    def __init__(self, parent: Optional[QWidget] = None) -> None:
        super().__init__(parent)
        self.devices = DevicesView()
        self.problems = ProblemsView()
        self.problems.setSizePolicy(QSizePolicy.Preferred, QSizePolicy.Preferred)
        self._note = QLabel()
        self._note.setObjectName('problems_note')
        self._note.setWordWrap(True)
        colour(self._note, 'quiet')
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(4)
        for widget in (self.problems, self._note, self.devices):
            layout.addWidget(widget)
        self.show_problems([])

    def show_problems(self, problems: Sequence[Problem], note: str = '') -> None:
        """Show problems; ``note`` says which devices are in use nevertheless.

        Without a note there are none, and only the problems are shown.
        """
        self.problems.set_problems(problems)
        self.problems.setMaximumHeight(_PROBLEMS_AND_DEVICES_PX if note else _NO_LIMIT_PX)
        self._note.setText(note)
        self.problems.setVisible(bool(problems))
        self._note.setVisible(bool(problems and note))
        self.devices.setVisible(bool(not problems or note))
