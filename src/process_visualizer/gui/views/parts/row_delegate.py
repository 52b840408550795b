# SPDX-License-Identifier: BSD-3-Clause
"""Draws a selected row so that its icons and the colours of its texts keep their meaning."""
from __future__ import annotations

from PyQt5.QtCore import QModelIndex, Qt
from PyQt5.QtGui import QColor, QPalette
from PyQt5.QtWidgets import (
    QAbstractItemView,
    QStyledItemDelegate,
    QStyleOptionViewItem,
    QTreeWidgetItem,
)

from process_visualizer.gui.toolkit.theme import theme
from process_visualizer.gui.toolkit.theme_following import colour_selection

_COLOUR = Qt.UserRole + 64


class RowDelegate(QStyledItemDelegate):
    """Texts of a selected row stay red, amber or grey; its background is pale."""

    def __init__(self, view: QAbstractItemView) -> None:
        super().__init__(view)
        colour_selection(view, 'selected')

    def initStyleOption(self, option: QStyleOptionViewItem, index: QModelIndex) -> None:
        """Give the text of a selected row the colour that it has otherwise."""
        super().initStyleOption(option, index)
        palette = option.palette
        name = index.data(_COLOUR)
        if name:
            palette.setColor(QPalette.Text, QColor(getattr(theme(), name)))
        palette.setColor(QPalette.Base, QColor(theme().indicator))
        palette.setBrush(QPalette.HighlightedText, palette.brush(QPalette.Text))
        option.palette = palette


def colour_row(row: QTreeWidgetItem, column: int, name: str) -> None:
    """Set the colour of a text that a RowDelegate draws: the name of a field of Theme."""
    if row.data(column, _COLOUR) != name:
        row.setData(column, _COLOUR, name)
