# SPDX-License-Identifier: BSD-3-Clause
"""A frame with a symbol and a text, and buttons below."""
from __future__ import annotations

from typing import Optional

from PyQt5.QtCore import QSize, Qt
from PyQt5.QtWidgets import QFrame, QGridLayout, QHBoxLayout, QLabel, QPushButton, QWidget

from process_visualizer.gui.toolkit.icons import icon
from process_visualizer.gui.toolkit.theme_following import ThemeFollower, set_sheet

_ICON_PX = 18


class NoticeFrame(QFrame):
    """The object name of the frame is ``name``, that of its text ``name_text``.

    ``colour`` is good, warning or bad (see Theme).
    """

    def __init__(self, name: str, colour: str, parent: Optional[QWidget] = None,
                 symbol: str = 'warning') -> None:
        super().__init__(parent)
        self.setObjectName(name)
        set_sheet(self, f'QFrame#{name} {{ border: 1px solid <{colour}>; border-radius: 5px; '
                        f'background: <behind_{colour}>; }}')
        self._text = QLabel()
        self._text.setObjectName(f'{name}_text')
        self._text.setWordWrap(True)
        self._text.setTextFormat(Qt.PlainText)
        self._text.setTextInteractionFlags(Qt.TextSelectableByMouse)
        self._sign, self._symbol = QLabel(), symbol
        self._draw_sign()
        ThemeFollower(self, self._draw_sign)
        self._layout = QGridLayout(self)
        self._layout.setContentsMargins(8, 6, 8, 6)
        self._layout.setColumnStretch(1, 1)
        self._layout.addWidget(self._sign, 0, 0, Qt.AlignTop)
        self._layout.addWidget(self._text, 0, 1)

    def _draw_sign(self) -> None:
        self._sign.setPixmap(icon(self._symbol).pixmap(QSize(_ICON_PX, _ICON_PX)))

    def add_buttons(self, *buttons: QPushButton) -> None:
        """Add buttons below the text."""
        row = QHBoxLayout()
        for button in buttons:
            row.addWidget(button)
        row.addStretch(1)
        self._layout.addLayout(row, 1, 1)
