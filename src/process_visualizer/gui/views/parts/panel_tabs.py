# SPDX-License-Identifier: BSD-3-Clause
"""Tabs that need no more room than the page that is shown."""
from __future__ import annotations

from PyQt5.QtCore import QSize
from PyQt5.QtWidgets import QTabWidget


class PanelTabs(QTabWidget):
    """The panels of the launcher; Qt's own tabs are as high as the highest page."""

    def __init__(self) -> None:
        super().__init__()
        self.setObjectName('panels')
        self.setDocumentMode(True)
        self.currentChanged.connect(lambda _row: self.updateGeometry())

    def minimumSizeHint(self) -> QSize:
        """Return the width that all pages need, and the height of the present one."""
        size, page = super().minimumSizeHint(), self.currentWidget()
        if page is None:
            return size
        unseen = page.parentWidget().minimumSizeHint().height() - page.minimumSizeHint().height()
        return QSize(size.width(), size.height() - unseen)

    def hasHeightForWidth(self) -> bool:
        """Return False: Qt asks all pages for the height that they would like."""
        return False
