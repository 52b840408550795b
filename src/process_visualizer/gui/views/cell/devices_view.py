# SPDX-License-Identifier: BSD-3-Clause
"""The list of devices: check boxes, states, nodes and topics."""
from __future__ import annotations

from typing import Callable, Dict, FrozenSet, List, Optional, Tuple

from PyQt5.QtCore import QPoint, QSize, Qt, pyqtSignal
from PyQt5.QtGui import QKeyEvent, QResizeEvent
from PyQt5.QtWidgets import (
    QHeaderView,
    QMenu,
    QSizePolicy,
    QTreeWidget,
    QTreeWidgetItem,
    QWidget,
)

from process_visualizer.cell.model import Device
from process_visualizer.gui.toolkit.icons import icon
from process_visualizer.gui.views.parts.row_delegate import RowDelegate, colour_row
from process_visualizer.health.device_state import DeviceState, Level, Line

_NAME, _STATE = 0, 1
_FEWEST_ROWS, _MOST_ROWS, _ROW_SPACING_PX = 2, 14, 4
_DEVICE, _NODE, _TOPIC = 'device', 'node', 'topic'
_HINT = 'Press Enter to read the whole text'
_COLORS = {Level.OFF: 'quiet', Level.GOOD: 'good', Level.WAITING: 'quiet', Level.WARNING: 'warning',
           Level.BAD: 'bad'}
_ICONS = {Level.GOOD: 'ok', Level.WAITING: 'waiting', Level.WARNING: 'warning', Level.BAD: 'died'}


class DevicesView(QTreeWidget):
    """A row for each device; below it its nodes and topics."""

    ticked = pyqtSignal(str, bool)
    restart_wanted = pyqtSignal(str)
    log_wanted = pyqtSignal(str, str)
    """Of a node (its name) of a device."""
    warnings_wanted = pyqtSignal(str)
    """Of a device (its name)."""

    def __init__(self, parent: Optional[QWidget] = None) -> None:
        super().__init__(parent)
        self.setObjectName('devices')
        self.setAccessibleName('Devices')
        self.setHeaderHidden(True)
        self.setColumnCount(2)
        self.setItemDelegate(RowDelegate(self))
        self.setIconSize(QSize(14, 14))
        self.setIndentation(16)
        self.header().setSectionResizeMode(_NAME, QHeaderView.Fixed)
        self.header().setStretchLastSection(True)
        self.setTextElideMode(Qt.ElideMiddle)
        self.setHorizontalScrollBarPolicy(Qt.ScrollBarAlwaysOff)
        self.setSizePolicy(QSizePolicy.Expanding, QSizePolicy.Preferred)
        self.expanded.connect(lambda _row: self.updateGeometry())
        self.collapsed.connect(lambda _row: self.updateGeometry())
        self.setToolTip('Tick the devices to launch; open a row to see its nodes and topics')
        self.setContextMenuPolicy(Qt.CustomContextMenu)
        self.customContextMenuRequested.connect(self._show_menu)
        self.itemChanged.connect(self._on_changed)
        self.itemDoubleClicked.connect(self._on_double_click)
        self.itemClicked.connect(self._on_click)
        self._rows: Dict[str, QTreeWidgetItem] = {}
        self._children: Dict[Tuple[str, str, str], QTreeWidgetItem] = {}
        self._warned: Dict[str, FrozenSet[str]] = {}  # the nodes that complain, by device

    def set_devices(self, devices: Tuple[Device, ...], is_ticked: Callable[[str], bool]) -> None:
        """Show these devices; open rows stay open."""
        opened = {name for name, row in self._rows.items() if row.isExpanded()}
        self.blockSignals(True)
        self.clear()
        self._rows, self._children = {}, {}
        for device in devices:
            row = QTreeWidgetItem(self, [f'{device.name} ({device.type.value})', ''])
            row.setToolTip(_NAME, row.text(_NAME))
            row.setData(_NAME, Qt.UserRole, (_DEVICE, device.name, ''))
            row.setCheckState(_NAME, Qt.Checked if is_ticked(device.name) else Qt.Unchecked)
            self._rows[device.name] = row
            for topic in device.topics:
                self._child(device.name, _TOPIC, topic.name)
            row.setExpanded(device.name in opened)
        self.blockSignals(False)
        self.updateGeometry()

    def set_ticks(self, is_ticked: Callable[[str], bool]) -> None:
        """Show which devices are chosen."""
        self.blockSignals(True)
        for name, row in self._rows.items():
            row.setCheckState(_NAME, Qt.Checked if is_ticked(name) else Qt.Unchecked)
        self.blockSignals(False)

    def set_state(self, device: str, state: DeviceState) -> None:
        """Show the state of a device."""
        row = self._rows.get(device)
        if row is None:
            return
        self.blockSignals(True)
        self._warned[device] = frozenset(it.node for it in state.warnings)
        _show(row, state.summary)
        self._remove_nodes(device, state)
        for kind, lines in ((_NODE, state.nodes), (_TOPIC, state.topics)):
            for name, line in lines.items():
                _show(self._child(device, kind, name), line)
        self.blockSignals(False)

    def sizeHint(self) -> QSize:
        """Return a size with room for all open rows, up to a limit."""
        return self._size_of(min(max(self._open_rows(), _FEWEST_ROWS), _MOST_ROWS))

    def minimumSizeHint(self) -> QSize:
        """Return a size in which some rows can be seen."""
        return self._size_of(_FEWEST_ROWS)

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Give names and states half of the width each."""
        super().resizeEvent(event)
        self.setColumnWidth(_NAME, event.size().width() // 2)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Read the warnings of the row with Enter."""
        if event.key() in (Qt.Key_Return, Qt.Key_Enter):
            self._read_warnings(self.currentItem())
        else:
            super().keyPressEvent(event)

    def _size_of(self, rows: int) -> QSize:
        return QSize(300, rows * (self.fontMetrics().height() + _ROW_SPACING_PX)
                     + 2 * self.frameWidth() + 2)

    def _open_rows(self) -> int:
        rows = self._rows.values()
        return sum(1 + row.childCount() * row.isExpanded() for row in rows)

    def selected_device(self) -> str:
        """The device whose row, or a row below it, is selected; empty without one."""
        items = self.selectedItems()
        return str(items[0].data(_NAME, Qt.UserRole)[1]) if items else ''

    def state_text(self, device: str) -> str:
        """The displayed state of a device."""
        return self._rows[device].text(_STATE)

    def _child(self, device: str, kind: str, name: str) -> QTreeWidgetItem:
        key = (device, kind, name)
        if key not in self._children:
            item = QTreeWidgetItem([name.replace(f'/{device}/', '', 1), ''])
            item.setToolTip(_NAME, name)
            item.setData(_NAME, Qt.UserRole, (kind, device, name))
            colour_row(item, _NAME, 'quiet')
            row = self._rows[device]
            nodes = sum(1 for it in self._children if it[:2] == (device, _NODE))
            row.insertChild(nodes if kind == _NODE else row.childCount(), item)
            self._children[key] = item
        return self._children[key]

    def _remove_nodes(self, device: str, state: DeviceState) -> None:
        gone = [key for key in self._children
                if key[:2] == (device, _NODE) and key[2] not in state.nodes]
        for key in gone:
            self._rows[device].removeChild(self._children.pop(key))

    def _on_changed(self, item: QTreeWidgetItem, column: int) -> None:
        kind, device, _ = item.data(_NAME, Qt.UserRole)
        if kind == _DEVICE and column == _NAME:
            self.ticked.emit(device, item.checkState(_NAME) == Qt.Checked)

    def _on_click(self, item: QTreeWidgetItem, column: int) -> None:
        if column == _STATE:
            self._read_warnings(item)

    def _read_warnings(self, item: Optional[QTreeWidgetItem]) -> None:
        if item is not None and self._complains(item):
            self.warnings_wanted.emit(item.data(_NAME, Qt.UserRole)[1])

    def _complains(self, item: QTreeWidgetItem) -> bool:
        """Return whether a device or a node has warnings now."""
        kind, device, name = item.data(_NAME, Qt.UserRole)
        nodes = self._warned.get(device, frozenset())
        return bool(nodes) if kind == _DEVICE else kind == _NODE and name in nodes

    def _on_double_click(self, item: QTreeWidgetItem) -> None:
        kind, device, name = item.data(_NAME, Qt.UserRole)
        if kind == _NODE:
            self.log_wanted.emit(device, name)

    def _show_menu(self, position: QPoint) -> None:
        item = self.itemAt(position)
        if item is None:
            return
        menu = QMenu(self)
        for text, signal_arguments in self._actions(item):
            menu.addAction(text, signal_arguments)
        menu.popup(self.viewport().mapToGlobal(position))

    def _actions(self, item: QTreeWidgetItem) -> List[Tuple[str, Callable[[], None]]]:
        kind, device, name = item.data(_NAME, Qt.UserRole)
        actions: List[Tuple[str, Callable[[], None]]] = [
            (f'Restart {device}', lambda: self.restart_wanted.emit(device))]
        if self._complains(item):
            actions.append((f'Read the warnings of {device}',
                            lambda: self.warnings_wanted.emit(device)))
        if kind == _NODE:
            actions.append((f'Show the log of {name}', lambda: self.log_wanted.emit(device, name)))
        return actions


def _show(item: QTreeWidgetItem, line: Line) -> None:
    if item.toolTip(_STATE) == line.text and item.data(_STATE, Qt.UserRole) == int(line.level):
        return
    item.setText(_STATE, line.short or line.text)
    item.setToolTip(_STATE, line.text)
    item.setData(_STATE, Qt.AccessibleTextRole, line.text)
    item.setData(_STATE, Qt.AccessibleDescriptionRole, _HINT if line.short else '')
    item.setData(_STATE, Qt.UserRole, int(line.level))
    colour_row(item, _STATE, _COLORS[line.level])
    if line.level in _ICONS and line.text:
        item.setIcon(_STATE, icon(_ICONS[line.level]))
    else:
        item.setData(_STATE, Qt.DecorationRole, None)
