# SPDX-License-Identifier: BSD-3-Clause
"""Tabs whose height does not depend on what is in them."""
from __future__ import annotations

from PyQt5.QtCore import QSize
from PyQt5.QtWidgets import QSizePolicy, QTabWidget

_LEAST_HEIGHT_PX = 210


class PanelTabs(QTabWidget):
    """The panels of the launcher; each of them scrolls."""

    def __init__(self) -> None:
        super().__init__()
        self.setObjectName('panels')
        self.setDocumentMode(True)
        self.setSizePolicy(QSizePolicy.Preferred, QSizePolicy.Ignored)

    def minimumSizeHint(self) -> QSize:
        """Return the width that all pages need, and a height in which one can be used."""
        return QSize(super().minimumSizeHint().width(), _LEAST_HEIGHT_PX)

    def hasHeightForWidth(self) -> bool:
        """Return False: Qt asks all pages for the height that they would like."""
        return False
