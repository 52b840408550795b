# SPDX-License-Identifier: BSD-3-Clause
"""Draws a selected row so that its icons and the colours of its texts keep their meaning."""
from __future__ import annotations

from PyQt5.QtCore import QModelIndex
from PyQt5.QtGui import QColor, QPalette
from PyQt5.QtWidgets import QAbstractItemView, QStyledItemDelegate, QStyleOptionViewItem

from process_visualizer.gui.toolkit.style import SELECTED


class RowDelegate(QStyledItemDelegate):
    """Texts of a selected row stay red, amber or grey; its background is pale."""

    def __init__(self, view: QAbstractItemView) -> None:
        super().__init__(view)
        palette = view.palette()
        palette.setColor(QPalette.Highlight, QColor(SELECTED))
        view.setPalette(palette)

    def initStyleOption(self, option: QStyleOptionViewItem, index: QModelIndex) -> None:
        """Give the text of a selected row the colour that it has otherwise."""
        super().initStyleOption(option, index)
        palette = option.palette
        palette.setBrush(QPalette.HighlightedText, palette.brush(QPalette.Text))
        option.palette = palette
