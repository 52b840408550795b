# SPDX-License-Identifier: BSD-3-Clause
"""Pages one on the other, which need no more height than the one that is shown."""
from __future__ import annotations

from PyQt5.QtCore import QSize
from PyQt5.QtWidgets import QStackedWidget


class CurrentPage(QStackedWidget):
    """Qt's own stack is as high as the highest page."""

    def __init__(self) -> None:
        super().__init__()
        self.currentChanged.connect(lambda _row: self.updateGeometry())

    def minimumSizeHint(self) -> QSize:
        """Return the width that all pages need, and the height of the present one."""
        size, page = super().minimumSizeHint(), self.currentWidget()
        return size if page is None else QSize(size.width(), page.minimumSizeHint().height())
