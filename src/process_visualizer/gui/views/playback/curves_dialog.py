# SPDX-License-Identifier: BSD-3-Clause
"""Asks which curves are shown, and in which order; what is chosen is shown at once."""
from __future__ import annotations

from typing import Optional, Sequence

from PyQt5.QtCore import Qt
from PyQt5.QtWidgets import (
    QAbstractItemView,
    QDialog,
    QDialogButtonBox,
    QLabel,
    QListWidget,
    QListWidgetItem,
    QVBoxLayout,
    QWidget,
)

from process_visualizer.curves.position_values import Key
from process_visualizer.gui.models.playback.lane_choices import LaneChoice, LaneChoices
from process_visualizer.gui.toolkit.colours import readable_colour
from process_visualizer.gui.views.playback.timeline_lanes import Lane

_WIDTH, _HEIGHT = 340, 320


class CurvesDialog(QDialog):
    """A list of all curves, each with a tick; rows are dragged to their place."""

    def __init__(self, lanes: Sequence[Lane], choices: LaneChoices,
                 parent: Optional[QWidget] = None) -> None:
        super().__init__(parent)
        self._lanes = {lane.key: lane for lane in lanes}
        self._choices = choices
        self.setObjectName('curves')
        self.setWindowTitle('Curves')
        self.setAttribute(Qt.WA_DeleteOnClose)
        self.list = QListWidget()
        self.list.setObjectName('curves_list')
        self.list.setDragDropMode(QAbstractItemView.InternalMove)
        self._lay_out()
        self._fill()
        self.list.itemChanged.connect(self._choose)
        self.list.model().rowsMoved.connect(self._choose)
        self.resize(_WIDTH, _HEIGHT)

    def _lay_out(self) -> None:
        buttons = QDialogButtonBox(QDialogButtonBox.Close)
        buttons.rejected.connect(self.close)
        reset = buttons.addButton('All, as in the configuration', QDialogButtonBox.ResetRole)
        reset.setObjectName('curves_reset')
        reset.setAutoDefault(False)
        reset.clicked.connect(self._reset)
        layout = QVBoxLayout(self)
        layout.addWidget(QLabel('Tick the curves to be shown; drag them into their order.'))
        layout.addWidget(self.list)
        layout.addWidget(buttons)

    def _fill(self) -> None:
        choice = self._choices.choice
        self.list.blockSignals(True)
        self.list.clear()
        for key in choice.arranged(tuple(self._lanes)):
            lane = self._lanes[key]
            item = QListWidgetItem(f'{lane.label}  [{lane.unit}]' if lane.unit else lane.label)
            item.setData(Qt.UserRole, key)
            item.setForeground(readable_colour(lane.colour))
            item.setFlags(Qt.ItemIsEnabled | Qt.ItemIsSelectable | Qt.ItemIsUserCheckable
                          | Qt.ItemIsDragEnabled)
            item.setCheckState(Qt.Unchecked if key in choice.hidden else Qt.Checked)
            self.list.addItem(item)
        self.list.blockSignals(False)

    def _choose(self) -> None:
        """Take what is shown; curves that this recording does not have stay as they were."""
        items = [self.list.item(row) for row in range(self.list.count())]
        keys = [self._key(item) for item in items]
        hidden = {self._key(item) for item in items if item.checkState() == Qt.Unchecked}
        before = self._choices.choice
        self._choices.choose(LaneChoice(
            tuple(keys + [key for key in before.order if key not in keys]),
            frozenset(hidden | before.hidden.difference(keys))))

    @staticmethod
    def _key(item: QListWidgetItem) -> Key:
        device, label, topic = item.data(Qt.UserRole)
        return device, label, topic

    def _reset(self) -> None:
        self._choices.choose(LaneChoice())
        self._fill()
