# SPDX-License-Identifier: BSD-3-Clause
"""A scroll area that moves only when the user means it to."""
from __future__ import annotations

from PyQt5.QtWidgets import QApplication, QScrollArea, QWidget


class StillScroll(QScrollArea):
    """Scrolls to what gets the keyboard by the Tab key, as Qt's does.

    Qt also gives the keyboard to another widget when the one that has it cannot be used any more,
    such as a button that was clicked; nothing may move then.
    """

    def focusNextPrevChild(self, is_next: bool) -> bool:
        """See Qt."""
        focused = QApplication.focusWidget()
        if focused is not None and not focused.isEnabled():
            return QWidget.focusNextPrevChild(self, is_next)
        return super().focusNextPrevChild(is_next)
