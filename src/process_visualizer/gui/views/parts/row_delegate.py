# SPDX-License-Identifier: BSD-3-Clause
"""Draws a selected row so that its icons and the colours of its texts keep their meaning."""
from __future__ import annotations

from PyQt5.QtCore import QModelIndex
from PyQt5.QtGui import QColor, QPalette
from PyQt5.QtWidgets import QStyledItemDelegate, QStyleOptionViewItem

from process_visualizer.gui.toolkit.style import SELECTED


class RowDelegate(QStyledItemDelegate):
    """A pale background instead of the palette's dark one; texts stay red, amber or grey."""

    def initStyleOption(self, option: QStyleOptionViewItem, index: QModelIndex) -> None:
        """Give a selected row the colours that it has otherwise."""
        super().initStyleOption(option, index)
        palette = option.palette
        palette.setColor(QPalette.Highlight, QColor(SELECTED))
        palette.setBrush(QPalette.HighlightedText, palette.brush(QPalette.Text))
        option.palette = palette
