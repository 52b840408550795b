# SPDX-License-Identifier: BSD-3-Clause
"""Asks which curves are shown, in which order and lanes; what is chosen is shown at once."""
from __future__ import annotations

from typing import Callable, Optional, Sequence

from PyQt5.QtCore import Qt
from PyQt5.QtWidgets import (
    QDialog,
    QDialogButtonBox,
    QHBoxLayout,
    QLabel,
    QPushButton,
    QVBoxLayout,
    QWidget,
)

from process_visualizer.gui.models.playback.lane_choice import LaneChoice
from process_visualizer.gui.models.playback.lane_choices import LaneChoices
from process_visualizer.gui.views.lanes.curves_tree import CurvesTree, is_folded, key_of_item
from process_visualizer.gui.views.lanes.timeline_lanes import Lane

_WIDTH, _HEIGHT = 420, 380
_HINT = ('Tick the curves to be shown. Drag them into their order, or one onto another to draw '
         'both in one lane.')


class CurvesDialog(QDialog):
    """All curves, each with a tick, and buttons that do what the mouse can do."""

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
        hint = QLabel(_HINT)
        hint.setWordWrap(True)
        layout = QVBoxLayout(self)
        layout.addWidget(hint)
        layout.addWidget(self.tree)
        layout.addLayout(row)
        layout.addWidget(buttons)

    def _name_buttons(self) -> None:
        """Say what the buttons do with the current row."""
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
        """Take what is shown."""
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
