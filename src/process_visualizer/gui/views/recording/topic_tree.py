# SPDX-License-Identifier: BSD-3-Clause
"""Common base of lists of topics."""
from __future__ import annotations

from typing import Optional

from PyQt5.QtCore import QEvent, Qt
from PyQt5.QtWidgets import QHeaderView, QTreeWidget, QWidget

from process_visualizer.gui.views.parts.row_delegate import RowDelegate


class TopicTree(QTreeWidget):
    """Topics, whose names get the room left by other columns; nothing can be selected."""

    def __init__(self, name: str, columns: int, parent: Optional[QWidget] = None) -> None:
        super().__init__(parent)
        self.setObjectName(name)
        self.setColumnCount(columns)
        self.setRootIsDecorated(False)
        self.setUniformRowHeights(True)
        self.setSelectionMode(QTreeWidget.NoSelection)
        self.setFocusPolicy(Qt.TabFocus)
        self.setTextElideMode(Qt.ElideMiddle)
        self.setItemDelegate(RowDelegate(self))
        self.header().setStretchLastSection(False)
        self.header().setSectionResizeMode(QHeaderView.ResizeToContents)
        self.header().setSectionResizeMode(0, QHeaderView.Stretch)

    def event(self, event: QEvent) -> bool:
        """Tick with the space bar, also where that is a shortcut of the window."""
        if event.type() == QEvent.ShortcutOverride and event.key() == Qt.Key_Space:
            event.accept()
        return bool(super().event(event))
