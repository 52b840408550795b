# SPDX-License-Identifier: BSD-3-Clause
"""Choice of the curves to show, of their order and lanes; it takes effect at once."""
from __future__ import annotations

from typing import Callable, Dict, List, Optional, Sequence

from PyQt5.QtCore import Qt, pyqtSignal
from PyQt5.QtGui import QDropEvent
from PyQt5.QtWidgets import (
    QAbstractItemView,
    QDialog,
    QDialogButtonBox,
    QHBoxLayout,
    QPushButton,
    QTreeWidget,
    QTreeWidgetItem,
    QVBoxLayout,
    QWidget,
)

from process_visualizer.curves.position_values import Key
from process_visualizer.gui.lanes.lane_choice import LaneChoice, LaneChoices
from process_visualizer.gui.lanes.timeline_lanes import Lane, distinct
from process_visualizer.gui.toolkit.labels import plain_label, plain_tip
from process_visualizer.gui.toolkit.theme import readable_color
from process_visualizer.gui.toolkit.widgets import RowDelegate

# A list of lanes; overlaid curves are listed below the first curve of their lane.

_FOLDED = int(Qt.UserRole) + 1


class CurvesTree(QTreeWidget):
    """A list of curves; rows are dragged between others, or onto one to share its lane.

    Its methods do the same without a mouse.
    """

    rearranged = pyqtSignal()
    """The operator has changed the choice."""

    def __init__(self) -> None:
        super().__init__()
        self._curves: Dict[Key, Lane] = {}
        self.setItemDelegate(RowDelegate(self))
        self.setObjectName('curves_list')
        self.setAccessibleName('Lanes and their curves')
        self.setHeaderHidden(True)
        self.setItemsExpandable(False)
        self.setDragDropMode(QAbstractItemView.InternalMove)
        self.itemChanged.connect(self.rearranged)

    def fill(self, curves: Sequence[Lane], choice: LaneChoice) -> None:
        """Show curves as arranged in a choice."""
        self._curves = {curve.key: curve for curve in curves}
        self.blockSignals(True)
        self.clear()
        for keys in choice.lanes(tuple(self._curves)):
            first, *others = (_item(self._curves[key], key not in choice.hidden) for key in keys)
            first.addChildren(others)
            self.addTopLevelItem(first)
            _set_folded(first, choice.is_folded(keys))
        self._color()
        self.expandAll()
        self.blockSignals(False)
        self.setCurrentItem(self.topLevelItem(0))

    def _color(self) -> None:
        """Give the rows the colors of the curves in their lanes."""
        for items in self.lanes():
            for item, curve in zip(items, distinct([self._curves[key_of_item(it)]
                                                    for it in items])):
                item.setForeground(0, readable_color(curve.color))

    def lanes(self) -> List[List[QTreeWidgetItem]]:
        """Return the items of each lane, its first curve first."""
        tops = [self.topLevelItem(row) for row in range(self.topLevelItemCount())]
        return [[top, *(top.child(row) for row in range(top.childCount()))] for top in tops]

    def move(self, steps: int) -> None:
        """Move the current row up (-1) or down (+1) by one within its level of the list."""
        item = self.currentItem()
        parent = item.parent() or self.invisibleRootItem()
        row = parent.indexOfChild(item) + steps
        if 0 <= row < parent.childCount():
            self._place(item, parent, row)

    def join(self) -> None:
        """Overlay the current lane on the lane above; give an overlaid curve a lane of its own."""
        item, root = self.currentItem(), self.invisibleRootItem()
        row = root.indexOfChild(item.parent() or item)
        if item.parent() is not None:
            self._place(item, root, row + 1)
        elif row > 0:
            above = self.topLevelItem(row - 1)
            self._place(item, above, above.childCount())

    def fold(self) -> None:
        """Fold the lane of the current row, or unfold it."""
        top = self.currentItem().parent() or self.currentItem()
        _set_folded(top, not is_folded(top))

    def dropEvent(self, event: QDropEvent) -> None:
        """Move the current row; the copy action keeps Qt from removing it itself."""
        self.drop(self.itemAt(event.pos()), self.dropIndicatorPosition())
        event.setDropAction(Qt.CopyAction)
        event.accept()

    def drop(self, target: Optional[QTreeWidgetItem],
             where: QAbstractItemView.DropIndicatorPosition) -> None:
        """Put the current row on, above or below a target row; without a target, at the end."""
        item, root = self.currentItem(), self.invisibleRootItem()
        if target is None:
            parent, row = root, root.childCount()
        elif where == QAbstractItemView.OnItem:
            parent = target.parent() or target
            row = parent.childCount()
        elif where == QAbstractItemView.BelowItem and target.childCount():
            parent, row = target, 0
        else:
            parent = target.parent() or root
            row = parent.indexOfChild(target) + (where == QAbstractItemView.BelowItem)
        if item not in (target, parent):
            is_before = parent is (item.parent() or root) and parent.indexOfChild(item) < row
            self._place(item, parent, row - is_before)

    def _place(self, item: QTreeWidgetItem, parent: QTreeWidgetItem, row: int) -> None:
        self.blockSignals(True)
        (item.parent() or self.invisibleRootItem()).removeChild(item)
        parent.insertChild(row, item)
        self._settle()
        self.setCurrentItem(item)

    def _settle(self) -> None:
        for top, *others in self.lanes():
            for item in others:
                top.addChildren(item.takeChildren())
                _set_folded(item, False)
        self._color()
        self.expandAll()
        self.blockSignals(False)
        self.rearranged.emit()


def key_of_item(item: QTreeWidgetItem) -> Key:
    """Return the key of an item's curve."""
    device, label, topic = item.data(0, Qt.UserRole)
    return device, label, topic


def is_folded(item: QTreeWidgetItem) -> bool:
    """Return whether an item is the first of a folded lane."""
    return bool(item.data(0, _FOLDED))


def _set_folded(item: QTreeWidgetItem, folded: bool) -> None:
    if is_folded(item) != folded:
        item.setData(0, _FOLDED, folded)
        item.setText(0, item.text(0) + '  (folded)' if folded
                     else item.text(0)[:-len('  (folded)')])


def _item(curve: Lane, is_shown: bool) -> QTreeWidgetItem:
    text = f'{curve.label}  [{curve.unit}]' if curve.unit else curve.label
    item = QTreeWidgetItem([text])
    item.setToolTip(0, plain_tip(text))
    item.setData(0, Qt.UserRole, curve.key)
    item.setFlags(Qt.ItemIsEnabled | Qt.ItemIsSelectable | Qt.ItemIsUserCheckable
                  | Qt.ItemIsDragEnabled | Qt.ItemIsDropEnabled)
    item.setCheckState(0, Qt.Checked if is_shown else Qt.Unchecked)
    return item


_WIDTH, _HEIGHT = 420, 380
_HINT = ('Tick the curves to be shown. Drag them into their order, or one onto another to draw '
         'both in one lane.')


class CurvesDialog(QDialog):
    """All curves, each with a check box, and buttons for everything the mouse can do."""

    def __init__(self, curves: Sequence[Lane], choices: LaneChoices,
                 parent: Optional[QWidget] = None) -> None:
        super().__init__(parent)
        self._curves, self._choices = tuple(curves), choices
        self.setObjectName('curves')
        self.setWindowTitle('Curves')
        self.setAttribute(Qt.WA_DeleteOnClose)
        self.tree = CurvesTree()
        self._lay_out()
        self.tree.currentItemChanged.connect(self._name_buttons)
        self.tree.rearranged.connect(self._choose)
        self.tree.fill(self._curves, choices.choice)
        self._name_buttons()
        self.resize(_WIDTH, _HEIGHT)

    def _lay_out(self) -> None:
        row = QHBoxLayout()
        self.up = _button('curves_up', 'Up', lambda: self.tree.move(-1))
        self.down = _button('curves_down', 'Down', lambda: self.tree.move(1))
        self.join = _button('curves_join', 'Overlay on the one above', self.tree.join)
        self.fold = _button('curves_fold', 'Fold', self.tree.fold)
        for button in (self.up, self.down, self.join, self.fold):
            row.addWidget(button)
        buttons = QDialogButtonBox(QDialogButtonBox.Close)
        buttons.rejected.connect(self.close)
        reset = _button('curves_reset', 'All, as in the configuration', self._reset)
        buttons.addButton(reset, QDialogButtonBox.ResetRole)
        hint = plain_label(_HINT)
        hint.setWordWrap(True)
        layout = QVBoxLayout(self)
        layout.addWidget(hint)
        layout.addWidget(self.tree)
        layout.addLayout(row)
        layout.addWidget(buttons)

    def _name_buttons(self) -> None:
        """Name the buttons by what they do with the current row."""
        item = self.tree.currentItem()
        for button in (self.up, self.down, self.join, self.fold):
            button.setEnabled(item is not None)
        if item is None:
            return
        is_overlaid = item.parent() is not None
        self.join.setText('Own lane' if is_overlaid else 'Overlay on the one above')
        self.join.setEnabled(is_overlaid or item is not self.tree.topLevelItem(0))
        self.fold.setText('Unfold' if is_folded(item.parent() or item) else 'Fold')

    def _choose(self) -> None:
        """Choose what the list shows."""
        lanes = self.tree.lanes()
        self._choices.choose(self._choices.choice.rearranged(
            [[key_of_item(item) for item in lane] for lane in lanes],
            {key_of_item(item) for lane in lanes for item in lane
             if item.checkState(0) == Qt.Unchecked},
            {key_of_item(lane[0]) for lane in lanes if is_folded(lane[0])}))
        self._name_buttons()

    def _reset(self) -> None:
        self._choices.choose(LaneChoice())
        self.tree.fill(self._curves, self._choices.choice)


def _button(name: str, text: str, pressed: Callable[[], None]) -> QPushButton:
    button = QPushButton(text)
    button.setObjectName(name)
    button.setAutoDefault(False)
    button.clicked.connect(lambda: pressed())
    return button
