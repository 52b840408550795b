# SPDX-License-Identifier: BSD-3-Clause
"""The topics of a recording, with ticks for those that are played."""
from __future__ import annotations

from typing import Dict, Optional

from PyQt5.QtCore import Qt
from PyQt5.QtGui import QResizeEvent
from PyQt5.QtWidgets import QSizePolicy, QTreeWidgetItem, QWidget

from process_visualizer.bags.catalogue import Catalogue, CatalogueTopic
from process_visualizer.gui.models.playback.played_topics import PlayedTopics
from process_visualizer.gui.views.parts.row_delegate import colour_row
from process_visualizer.gui.views.recording.topic_tree import TopicTree
from process_visualizer.health.device_state import recorded_rate_text
from process_visualizer.health.figures import count_text

_NAME, _COUNT, _RATE, _TYPE = range(4)
_MOST_ROWS = 8
_WIDE_PX = 560


class PlayedTopicsTable(TopicTree):
    """Topics with counts and rates; those of the devices can be ticked."""

    def __init__(self, played: PlayedTopics, parent: Optional[QWidget] = None) -> None:
        super().__init__('bag_topics', 4, parent)
        self._played = played
        self._rows: Dict[str, QTreeWidgetItem] = {}
        self._found: Optional[object] = None
        self.setAccessibleName('Topics of the recording')
        self.setHeaderLabels(['Topic', 'Messages', 'Rate', 'Type'])
        self.setAlternatingRowColors(True)
        self.setSizePolicy(QSizePolicy.Expanding, QSizePolicy.Fixed)
        self.itemChanged.connect(self._take_tick)
        played.changed.connect(self._show_ticks)

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Hide the types if there is no room for them; a topic's tooltip has them."""
        super().resizeEvent(event)
        self.setColumnHidden(_TYPE, event.size().width() < _WIDE_PX)

    def show_topics(self, found: Catalogue) -> None:
        """Show the topics of a recording."""
        if self._found == found.topics:
            return
        self._found = found.topics
        self.clear()
        self._rows = {topic.name: _row(topic) for topic in found.topics}
        self.addTopLevelItems(list(self._rows.values()))
        self._show_ticks()
        rows = min(len(found.topics), _MOST_ROWS)
        self.setFixedHeight(self.header().sizeHint().height() + 4
                            + rows * max(self.sizeHintForRow(0), 18))

    def _show_ticks(self) -> None:
        self.blockSignals(True)
        for name, row in self._rows.items():
            is_offered, is_ticked = self._played.is_offered(name), self._played.is_ticked(name)
            row.setData(_NAME, Qt.CheckStateRole,
                        (Qt.Checked if is_ticked else Qt.Unchecked) if is_offered else None)
            colour_row(row, _NAME, 'text' if is_ticked else 'quiet')
            row.setToolTip(_NAME, row.data(_NAME, Qt.UserRole) + (
                '' if is_offered else '\nNo ticked device has it: it is not played'))
        self.blockSignals(False)

    def _take_tick(self, row: QTreeWidgetItem, column: int) -> None:
        if column == _NAME and row.data(_NAME, Qt.CheckStateRole) is not None:
            self._played.tick(row.text(_NAME), row.checkState(_NAME) == Qt.Checked)


def _row(topic: CatalogueTopic) -> QTreeWidgetItem:
    row = QTreeWidgetItem([topic.name, count_text(topic.message_count), recorded_rate_text(topic),
                           topic.types[0].split('/')[-1]])
    row.setFlags(Qt.ItemIsEnabled | Qt.ItemIsUserCheckable | Qt.ItemNeverHasChildren)
    row.setTextAlignment(_COUNT, Qt.AlignRight)
    row.setTextAlignment(_RATE, Qt.AlignRight)
    row.setData(_NAME, Qt.UserRole, f'{topic.name}\n{", ".join(topic.types)}')
    return row
