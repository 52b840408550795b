# SPDX-License-Identifier: BSD-3-Clause
"""The topics that can be recorded, by device, with their rates; folded or open."""
from __future__ import annotations

from typing import Dict, List, Optional, Tuple

from PyQt5.QtCore import QEvent, QSize, Qt, pyqtSignal
from PyQt5.QtWidgets import QHeaderView, QSizePolicy, QTreeWidget, QTreeWidgetItem, QWidget

from process_visualizer.figures import count_text, live_rate_text, long_time_text
from process_visualizer.gui.recording.recording_choices import (
    RecordingChoices,
    TopicHealth,
    TopicRow,
)
from process_visualizer.gui.toolkit.labels import plain_tip
from process_visualizer.gui.toolkit.theme import color
from process_visualizer.gui.toolkit.widgets import (
    ElidedLabel,
    FoldButton,
    RowDelegate,
    color_row,
    in_column,
    in_row,
    small,
    tool_button,
)


class TopicTree(QTreeWidget):
    """A list of topics; names get the room left by other columns; nothing can be selected."""

    def __init__(self, name: str, columns: int, parent: Optional[QWidget] = None) -> None:
        super().__init__(parent)
        self.setObjectName(name)
        self.setColumnCount(columns)
        self.setRootIsDecorated(False)
        self.setUniformRowHeights(True)
        self.setSelectionMode(QTreeWidget.NoSelection)
        self.setFocusPolicy(Qt.TabFocus)
        self.setTextElideMode(Qt.ElideMiddle)
        self.setItemDelegate(RowDelegate(self))
        self.header().setStretchLastSection(False)
        self.header().setSectionResizeMode(QHeaderView.ResizeToContents)
        self.header().setSectionResizeMode(0, QHeaderView.Stretch)

    def event(self, event: QEvent) -> bool:
        """Tick with the space bar even if that is a shortcut of the window."""
        if event.type() == QEvent.ShortcutOverride and event.key() == Qt.Key_Space:
            event.accept()
        return bool(super().event(event))


_NAME, _RATE = 0, 1
_MIN_ROWS = 6
_UNHEALTHY = (TopicHealth.SILENT, TopicHealth.NO_PUBLISHER, TopicHealth.NO_MESSAGE)


class TopicList(QWidget):
    """A line with the number of ticked and silent topics; open, it lists them."""

    chosen = pyqtSignal()
    """The operator has opened or folded the list."""

    def __init__(self, choices: RecordingChoices, parent: Optional[QWidget] = None) -> None:
        super().__init__(parent)
        self._choices = choices
        self._items: Dict[str, QTreeWidgetItem] = {}
        self._is_locked = False
        self._fold = FoldButton('fold_topics', 'Topics', 'Which topics are recorded')
        self._summary = small(ElidedLabel(Qt.ElideRight))
        self._summary.setAlignment(Qt.AlignRight | Qt.AlignVCenter)
        self._preset = tool_button('preset_topics', 'revert', 'Tick the topics that the '
                                                              'configuration records',
                                   choices.preset_topics)
        self._tree = _tree()
        self._set_up_fold()
        self._lay_out()
        self._tree.itemChanged.connect(self._take_tick)
        choices.topics_changed.connect(self.rebuild)
        self.rebuild()

    def rebuild(self) -> None:
        """Rebuild the list of topics; items are complete before the view asks about them."""
        self._tree.blockSignals(True)
        self._tree.clear()
        self._items = {}
        parents: Dict[str, QTreeWidgetItem] = {}
        for row in self._choices.topics:
            if row.device not in parents:
                parents[row.device] = _device_item(row.device)
            self._items[row.name] = _topic_item(parents[row.device], row)
        self._tree.addTopLevelItems(list(parents.values()))
        self._tree.expandAll()
        self._tree.blockSignals(False)
        self._is_locked = False
        self._fit_height()
        self.refresh()

    def refresh(self) -> None:
        """Show ticks, and rates or silences."""
        rows = self._choices.topics
        self._tree.blockSignals(True)
        for row in rows:
            if row.name in self._items:
                _show(self._items[row.name], row)
        self._tree.blockSignals(False)
        text, is_warning = summary(rows)
        self._summary.setText(text)
        color(self._summary, 'warning' if is_warning else 'quiet')

    def lock(self, is_locked: bool) -> None:
        """Lock the check boxes during a recording."""
        if is_locked == self._is_locked:
            return
        self._is_locked = is_locked
        self._preset.setEnabled(not is_locked)
        self._tree.blockSignals(True)
        items = [*self._items.values(), *map(self._tree.topLevelItem,
                                             range(self._tree.topLevelItemCount()))]
        for item in items:
            flags = item.flags() | Qt.ItemIsUserCheckable
            item.setFlags(flags ^ Qt.ItemIsUserCheckable if is_locked else flags)
        self._tree.blockSignals(False)

    def open(self, is_open: bool) -> None:
        """Unfold the list, or fold it."""
        self._fold.setChecked(is_open)
        self.setSizePolicy(QSizePolicy.Preferred,
                           QSizePolicy.Expanding if is_open else QSizePolicy.Maximum)
        self._tree.setVisible(is_open)
        self._preset.setVisible(is_open)

    def _take_tick(self, item: QTreeWidgetItem, column: int) -> None:
        name = item.data(_NAME, Qt.UserRole)
        if name and column == _NAME:
            self._choices.tick(name, item.checkState(_NAME) == Qt.Checked)

    def _fit_height(self) -> None:
        rows = self._tree.topLevelItemCount() + len(self._items)
        height = self._tree.sizeHintForRow(0) if rows else 20
        frame = 2 * self._tree.frameWidth()
        self._tree.setMinimumHeight(height * min(rows, _MIN_ROWS) + frame)
        self._tree.setMaximumHeight(height * rows + frame)

    def _set_up_fold(self) -> None:
        self._fold.setStyleSheet('QToolButton { border: 0; padding: 0; }')
        self._fold.toggled.connect(self.open)
        self._fold.clicked.connect(lambda: self.chosen.emit())
        self.open(False)

    def _lay_out(self) -> None:
        header = in_row(self._fold, self._summary, self._preset, wide=self._summary)
        layout = in_column(self, 2, header)
        layout.addWidget(self._tree, 1)
        layout.addStretch(0)


def summary(rows: List[TopicRow]) -> Tuple[str, bool]:
    """Return the text of the folded list, and whether it is a warning."""
    ticked = [row for row in rows if row.is_ticked]
    if not ticked:
        return 'none ticked', True
    text = f'{len(ticked)} of {count_text(len(rows), "topic")}'
    bad = [row for row in ticked if row.health in _UNHEALTHY]
    silent = [row for row in bad if row.health is TopicHealth.SILENT]
    counts = ((len(silent), 'no data'), (len(bad) - len(silent), 'without messages'))
    return ' · '.join([text, *(f'{count} {word}' for count, word in counts if count)]), bool(silent)


def rate_or_silence(row: TopicRow) -> str:
    """Return the text beside a topic."""
    if row.health is TopicHealth.UNKNOWN or row.rate_hz is None:
        return ''
    if row.health is TopicHealth.SILENT and row.silence_s is not None:
        return f'no data for {long_time_text(row.silence_s)}'
    if row.health in _UNHEALTHY:
        return row.health.value
    return live_rate_text(row.rate_hz, row.silence_s or 0.0, row.is_latched)


def _show(item: QTreeWidgetItem, row: TopicRow) -> None:
    item.setCheckState(_NAME, Qt.Checked if row.is_ticked else Qt.Unchecked)
    text = rate_or_silence(row)
    if item.text(_RATE) != text:
        item.setText(_RATE, text)
    is_warning = row.is_ticked and row.health in _UNHEALTHY
    color_row(item, _RATE, 'warning' if is_warning else 'quiet')
    color_row(item, _NAME, 'text' if row.is_ticked else 'quiet')
    lost = f'; {row.dropped} dropped, {row.lost} lost' if row.dropped or row.lost else ''
    item.setToolTip(_NAME, plain_tip(f'{row.name}{lost}'))


def _device_item(device: str) -> QTreeWidgetItem:
    item = QTreeWidgetItem([device])
    item.setFlags(Qt.ItemIsEnabled | Qt.ItemIsUserCheckable | Qt.ItemIsAutoTristate)
    font = item.font(_NAME)
    font.setBold(True)
    item.setFont(_NAME, font)
    return item


def _topic_item(parent: QTreeWidgetItem, row: TopicRow) -> QTreeWidgetItem:
    item = QTreeWidgetItem(parent, [row.name.lstrip('/')])
    item.setFlags(Qt.ItemIsEnabled | Qt.ItemIsUserCheckable | Qt.ItemNeverHasChildren)
    item.setData(_NAME, Qt.UserRole, row.name)
    item.setTextAlignment(_RATE, int(Qt.AlignRight | Qt.AlignVCenter))
    _show(item, row)
    return item


def _tree() -> TopicTree:
    tree = TopicTree('record_topics', 2)
    tree.setAccessibleName('Topics to record')
    tree.setHeaderHidden(True)
    tree.setIndentation(16)
    tree.setIconSize(QSize(14, 14))
    tree.setHorizontalScrollBarPolicy(Qt.ScrollBarAlwaysOff)
    return tree
