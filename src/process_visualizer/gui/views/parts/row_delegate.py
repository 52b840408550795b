# SPDX-License-Identifier: BSD-3-Clause
"""Draws a selected row so that its icons and the colours of its texts keep their meaning."""
from __future__ import annotations

from PyQt5.QtCore import QModelIndex, QRect, Qt
from PyQt5.QtGui import QColor, QPainter, QPalette
from PyQt5.QtWidgets import (
    QAbstractItemView,
    QStyle,
    QStyledItemDelegate,
    QStyleOptionViewItem,
    QTreeWidgetItem,
)

from process_visualizer.gui.toolkit.style import colour_indicators
from process_visualizer.gui.toolkit.theme import theme
from process_visualizer.gui.toolkit.theme_following import colour_selection

_COLOUR = Qt.UserRole + 64


class RowDelegate(QStyledItemDelegate):
    """Texts of a selected row stay red, amber or grey; its background is pale.

    Ticks have the same colour in all rows, whatever that of the text; a box that stands for some
    of several has a bar.
    """

    def __init__(self, view: QAbstractItemView) -> None:
        super().__init__(view)
        colour_selection(view, 'selected')

    def paint(self, painter: QPainter, option: QStyleOptionViewItem, index: QModelIndex) -> None:
        """Draw the row, and its box once more: Qt gives the tick the colour of the text."""
        super().paint(painter, option, index)
        row = QStyleOptionViewItem(option)
        self.initStyleOption(row, index)
        if not row.features & QStyleOptionViewItem.HasCheckIndicator:
            return
        style = row.widget.style()
        row.rect = style.subElementRect(QStyle.SE_ItemViewItemCheckIndicator, row, row.widget)
        colour_indicators(row.palette, theme())
        row.state &= ~(QStyle.State_HasFocus | QStyle.State_On | QStyle.State_Off)
        is_partial = row.checkState == Qt.PartiallyChecked
        row.state |= QStyle.State_On if row.checkState == Qt.Checked else QStyle.State_Off
        style.drawPrimitive(QStyle.PE_IndicatorItemViewItemCheck, row, painter, row.widget)
        if is_partial:
            painter.fillRect(_bar(row.rect), row.palette.brush(QPalette.Text))

    def initStyleOption(self, option: QStyleOptionViewItem, index: QModelIndex) -> None:
        """Give the text of a selected row the colour that it has otherwise."""
        super().initStyleOption(option, index)
        palette = option.palette
        name = index.data(_COLOUR)
        if name:
            palette.setColor(QPalette.Text, QColor(getattr(theme(), name)))
        palette.setBrush(QPalette.HighlightedText, palette.brush(QPalette.Text))
        option.palette = palette


def _bar(box: QRect) -> QRect:
    """The bar in a box that is ticked in part."""
    margin = max(box.width() // 4, 2)
    height = max(box.height() // 5, 2)
    return QRect(box.left() + margin, box.center().y() - height // 2 + 1 - height % 2,
                 box.width() - 2 * margin, height)


def colour_row(row: QTreeWidgetItem, column: int, name: str) -> None:
    """Set the colour of a text that a RowDelegate draws: the name of a field of Theme."""
    if row.data(column, _COLOUR) != name:
        row.setData(column, _COLOUR, name)
