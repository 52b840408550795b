# SPDX-License-Identifier: BSD-3-Clause
"""One window for all unexpected errors."""
from __future__ import annotations

from typing import Dict, NamedTuple, Optional

from PyQt5.QtCore import QSize, Qt
from PyQt5.QtWidgets import QLabel, QWidget

from process_visualizer.gui.toolkit.icons import icon
from process_visualizer.gui.views.parts.text_dialog import TextDialog

_MOST_ERRORS = 20
_ICON_PX = 28


class CaughtError(NamedTuple):
    """An error: its summary, its traceback, and where it was raised (file:line)."""

    summary: str
    traceback: str
    place: str


class ErrorDialog(TextDialog):
    """Lists each error once, with its count; the program keeps running."""

    def __init__(self, log_file: str, parent: Optional[QWidget] = None) -> None:
        super().__init__('error', 'Process Visualizer: an error', parent)
        self._log_file = log_file
        self._errors: Dict[CaughtError, int] = {}
        picture = QLabel()
        picture.setPixmap(icon('warning').pixmap(QSize(_ICON_PX, _ICON_PX)))
        self.row.insertWidget(0, picture, 0, Qt.AlignTop)
        self.finished.connect(lambda _: self._errors.clear())  # the operator has seen them

    def add(self, error: CaughtError) -> None:
        """Show an error, or count it if it is listed already."""
        known = next((it for it in self._errors
                      if (it.place, it.summary) == (error.place, error.summary)), error)
        if known in self._errors or len(self._errors) < _MOST_ERRORS:
            self._errors[known] = self._errors.get(known, 0) + 1
        self._refresh()
        if not self.isVisible():
            self.show()

    def _refresh(self) -> None:
        total = sum(self._errors.values())
        number = 'An error has' if total == 1 else f'{total} errors have'
        where = f' They are also in <i>{self._log_file}</i>.' if self._log_file else ''
        self.show_text(
            f'<b>{number} occurred in the launcher itself.</b> The program continues; nodes and '
            f'recordings are not affected. Please send this to the maintainer.{where}',
            '\n\n'.join(f'{count}×  {error.summary}\n\n{error.traceback.rstrip()}'
                        for error, count in self._errors.items()))
