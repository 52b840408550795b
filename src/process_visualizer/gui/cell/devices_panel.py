# SPDX-License-Identifier: BSD-3-Clause
"""The devices in use, and above them the problems of the file that was read."""
from __future__ import annotations

import html
import os
import time
from typing import Callable, Dict, FrozenSet, List, Mapping, Optional, Sequence, Tuple

from PyQt5.QtCore import QPoint, QRectF, QSize, Qt, pyqtSignal
from PyQt5.QtGui import QGuiApplication, QKeyEvent, QPainter, QPalette, QResizeEvent, QTextDocument
from PyQt5.QtWidgets import (
    QHeaderView,
    QListWidget,
    QListWidgetItem,
    QMenu,
    QPlainTextEdit,
    QPushButton,
    QSizePolicy,
    QStyle,
    QStyledItemDelegate,
    QStyleOptionViewItem,
    QTreeWidget,
    QTreeWidgetItem,
    QVBoxLayout,
    QWidget,
)

from process_visualizer.cell.errors import Problem
from process_visualizer.cell.model import Device
from process_visualizer.figures import count_text
from process_visualizer.gui.cell.device_states_model import DeviceStatesModel
from process_visualizer.gui.toolkit.dialogs import TextDialog
from process_visualizer.gui.toolkit.icons import icon
from process_visualizer.gui.toolkit.labels import html_label, plain_label, plain_tip
from process_visualizer.gui.toolkit.theme import ThemeFollower, color, set_sheet, theme
from process_visualizer.gui.toolkit.widgets import RowDelegate, color_row, in_column, in_row
from process_visualizer.health.device_state import DeviceState, Level, Line
from process_visualizer.health.node_warnings import NodeWarning, Severity, counted
from process_visualizer.launching.part_report import NodeReport, NodeState, PartReport

_NAME, _STATE = 0, 1
_MIN_ROWS, _MAX_ROWS, _ROW_SPACING_PX = 2, 14, 4
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
    """A device, and one of its nodes, whose log is wanted (their names)."""
    warnings_wanted = pyqtSignal(str)
    """The operator wants to see the warnings of a device (its name)."""
    expect_wanted = pyqtSignal(str)
    """The objects that a depth sensor (its name) sees now should become expected ones."""

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
        self.itemClicked.connect(
            lambda item, column: self._read_warnings(item) if column == _STATE else None)
        self._rows: Dict[str, QTreeWidgetItem] = {}
        self._children: Dict[Tuple[str, str, str], QTreeWidgetItem] = {}
        self._warned: Dict[str, FrozenSet[str]] = {}  # the nodes that complain, by device
        self._seen: Mapping[str, Optional[int]] = {}

    def set_devices(self, devices: Tuple[Device, ...], is_ticked: Callable[[str], bool]) -> None:
        """Show these devices; open rows stay open."""
        opened = {name for name, row in self._rows.items() if row.isExpanded()}
        self.blockSignals(True)
        self.clear()
        self._rows, self._children = {}, {}
        for device in devices:
            row = QTreeWidgetItem(self, [f'{device.name} ({device.type.value})', ''])
            row.setToolTip(_NAME, plain_tip(row.text(_NAME)))
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

    def set_seen(self, seen: Mapping[str, Optional[int]]) -> None:
        """Set how many objects each sensor reports; None if it reports nothing now."""
        self._seen = seen

    def sizeHint(self) -> QSize:
        """Return a size with room for all open rows, up to a limit."""
        open_rows = sum(1 + row.childCount() * row.isExpanded() for row in self._rows.values())
        return self._size_of(min(max(open_rows, _MIN_ROWS), _MAX_ROWS))

    def minimumSizeHint(self) -> QSize:
        """Return a size in which some rows can be seen."""
        return self._size_of(_MIN_ROWS)

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Give names and states half of the width each."""
        super().resizeEvent(event)
        self.setColumnWidth(_NAME, event.size().width() // 2)

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Open the warnings of the row with Enter."""
        if event.key() in (Qt.Key_Return, Qt.Key_Enter):
            self._read_warnings(self.currentItem())
        else:
            super().keyPressEvent(event)

    def _size_of(self, rows: int) -> QSize:
        return QSize(300, rows * (self.fontMetrics().height() + _ROW_SPACING_PX)
                     + 2 * self.frameWidth() + 2)

    def selected_device(self) -> str:
        """Return the device whose row, or a row below it, is selected; '' without a selection."""
        items = self.selectedItems()
        return str(items[0].data(_NAME, Qt.UserRole)[1]) if items else ''

    def state_text(self, device: str) -> str:
        """Return the displayed state of a device."""
        return self._rows[device].text(_STATE)

    def _child(self, device: str, kind: str, name: str) -> QTreeWidgetItem:
        key = (device, kind, name)
        if key not in self._children:
            item = QTreeWidgetItem([name.replace(f'/{device}/', '', 1), ''])
            item.setToolTip(_NAME, plain_tip(name))
            item.setData(_NAME, Qt.UserRole, (kind, device, name))
            color_row(item, _NAME, 'quiet')
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
        device = item.data(_NAME, Qt.UserRole)[1]
        if device in self._seen:
            menu.addAction('Expect what is there now…', lambda: self.expect_wanted.emit(device)
                           ).setEnabled(bool(self._seen[device]))
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
    is_same = item.data(_STATE, Qt.UserRole) == int(line.level)
    if is_same and item.toolTip(_STATE) == plain_tip(line.text):
        return
    item.setText(_STATE, line.short or line.text)
    item.setToolTip(_STATE, plain_tip(line.text))
    item.setData(_STATE, Qt.AccessibleTextRole, line.text)
    item.setData(_STATE, Qt.AccessibleDescriptionRole, _HINT if line.short else '')
    item.setData(_STATE, Qt.UserRole, int(line.level))
    color_row(item, _STATE, _COLORS[line.level])
    if line.level in _ICONS and line.text:
        item.setIcon(_STATE, icon(_ICONS[line.level]))
    else:
        item.setData(_STATE, Qt.DecorationRole, None)


# The problems of a configuration; a click on one opens the file there.

_ICON_PX = 18
_MARGIN_PX = 6


class ProblemsView(QWidget):
    """A list with a line for each problem, and buttons that show all in a window and copy them."""

    open_wanted = pyqtSignal(str, int)
    """The operator wants to see this file at this line (from 1)."""

    def __init__(self, parent: Optional[QWidget] = None) -> None:
        super().__init__(parent)
        self._problems: Sequence[Problem] = ()
        self._icon = plain_label()
        self._draw_icon()
        ThemeFollower(self, self._draw_icon)
        self._title = html_label()
        self._title.setObjectName('problems_title')
        self._copy = QPushButton('Copy all')
        self._copy.setObjectName('copy_problems')
        self._copy.setToolTip('Copy all problems as text')
        self._copy.clicked.connect(
            lambda: QGuiApplication.clipboard().setText('\n'.join(map(str, self._problems))))
        self._show_all = QPushButton('Show all')
        self._show_all.setObjectName('show_problems')
        self._show_all.setToolTip('Show all problems in a window of their own')
        self._show_all.clicked.connect(self._open_all)
        self._list = _list()
        self._list.itemClicked.connect(self._open)
        self._list.itemActivated.connect(self._open)
        header = in_row(self._icon, self._title, self._show_all, self._copy, wide=self._title)
        in_column(self, 6, header, self._list)
        self.setSizePolicy(QSizePolicy.Preferred, QSizePolicy.Ignored)

    def set_problems(self, problems: Sequence[Problem]) -> None:
        """Show these problems."""
        if list(problems) == list(self._problems):
            return
        self._problems = problems
        self._title.setText(f'<b>{count_text(len(problems), "problem")}</b>')
        self._list.clear()
        for problem in problems:
            item = QListWidgetItem(str(problem))
            item.setData(Qt.UserRole, problem)
            item.setToolTip(plain_tip(f'{problem}\nClick to open the file there'))
            self._list.addItem(item)

    def _draw_icon(self) -> None:
        self._icon.setPixmap(icon('warning').pixmap(QSize(_ICON_PX, _ICON_PX)))

    def _open_all(self) -> None:
        """Show all problems in a window, as the list may have room for one line only."""
        view = TextDialog('all_problems', 'Problems of the configuration', self)
        view.setAttribute(Qt.WA_DeleteOnClose)
        view.text.setLineWrapMode(QPlainTextEdit.WidgetWidth)
        view.show_text(f'{self._title.text()} in the configuration',
                       '\n\n'.join(map(str, self._problems)))
        view.show()

    def _open(self, item: QListWidgetItem) -> None:
        problem = item.data(Qt.UserRole)
        self.open_wanted.emit(problem.location.file, problem.location.line)


def problem_html(problem: Problem) -> str:
    """Return a problem with its place in front, like a link, and its element."""
    place = f'{os.path.basename(problem.location.file)}:{problem.location.line}'
    element = '' if not problem.element else (
        f'<span style="color:{theme().quiet}">&lt;{html.escape(problem.element)}&gt;</span> ')
    return (f'<span style="color:{theme().accent}"><b>{html.escape(place)}</b></span> {element}<br>'
            f'{html.escape(problem.message)}')


class _ProblemDelegate(QStyledItemDelegate):
    """Draws a problem over as many lines as it needs."""

    def paint(self, painter: QPainter, option: QStyleOptionViewItem, index: object) -> None:
        area = QRectF(option.rect)
        if option.state & (QStyle.State_MouseOver | QStyle.State_Selected):
            painter.fillRect(area, option.palette.brush(QPalette.Midlight))
        painter.save()
        painter.setPen(Qt.NoPen)
        painter.fillRect(QRectF(area.left(), area.bottom() - 1, area.width(), 1),
                         option.palette.brush(QPalette.Midlight))
        painter.translate(area.topLeft())
        self._document(option, index).drawContents(painter)
        painter.restore()

    def sizeHint(self, option: QStyleOptionViewItem, index: object) -> QSize:
        document = self._document(option, index)
        return QSize(int(document.idealWidth()), int(document.size().height()))

    def _width(self) -> int:
        """Return the width beside the scroll bar, whether the bar is shown or not."""
        problems = self.parent()
        return int(problems.width() - 2 * problems.frameWidth()
                   - problems.verticalScrollBar().sizeHint().width())

    def _document(self, option: QStyleOptionViewItem, index: object) -> QTextDocument:
        document = QTextDocument()
        document.setDocumentMargin(_MARGIN_PX)
        document.setDefaultFont(option.font)
        document.setTextWidth(self._width())
        document.setHtml(problem_html(index.data(Qt.UserRole)))  # type: ignore[attr-defined]
        return document


def _list() -> QListWidget:
    problems = QListWidget()
    problems.setObjectName('problems')
    problems.setAccessibleName('Problems')
    problems.setItemDelegate(_ProblemDelegate(problems))
    problems.setMouseTracking(True)
    problems.viewport().setCursor(Qt.PointingHandCursor)
    problems.setHorizontalScrollBarPolicy(Qt.ScrollBarAlwaysOff)
    problems.setVerticalScrollMode(QListWidget.ScrollPerPixel)
    problems.setResizeMode(QListWidget.Adjust)
    set_sheet(problems, 'QListWidget { border: 1px solid <line>; border-radius: 3px; }')
    return problems


_PROBLEMS_AND_DEVICES_PX = 168
"""Maximum height of the problems above devices [px]: three of two lines, and a title."""
_NO_LIMIT_PX = 16777215


class DevicesPanel(QWidget):
    """Devices, problems, or both."""

    def __init__(self, parent: Optional[QWidget] = None) -> None:
        super().__init__(parent)
        self.devices = DevicesView()
        self.problems = ProblemsView()
        self.problems.setSizePolicy(QSizePolicy.Preferred, QSizePolicy.Preferred)
        self._note = plain_label()
        self._note.setObjectName('problems_note')
        self._note.setWordWrap(True)
        color(self._note, 'quiet')
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.setSpacing(4)
        for widget in (self.problems, self._note, self.devices):
            layout.addWidget(widget)
        self.show_problems([])

    def show_problems(self, problems: Sequence[Problem], note: str = '') -> None:
        """Show problems; ``note`` says which devices are in use nevertheless.

        Without a note no devices are in use, and only the problems are shown.
        """
        self.problems.set_problems(problems)
        self.problems.setMaximumHeight(_PROBLEMS_AND_DEVICES_PX if note else _NO_LIMIT_PX)
        self._note.setText(note)
        self.problems.setVisible(bool(problems))
        self._note.setVisible(bool(problems and note))
        self.devices.setVisible(bool(not problems or note))


# The warnings of the nodes of a device, while they last.

class WarningsView(TextDialog):
    """A window with the present warnings of a device; deletes itself."""

    def __init__(self, device: str, states: DeviceStatesModel,
                 parent: Optional[QWidget] = None) -> None:
        super().__init__('warnings', f'{device}: warnings', parent)
        self.setAttribute(Qt.WA_DeleteOnClose)
        self._device, self._states = device, states
        self.text.setLineWrapMode(QPlainTextEdit.WidgetWidth)
        self.text.setPlaceholderText('No more warnings: the problems are over.')
        self.text.setAccessibleName(f'Warnings of {device}')
        states.changed.connect(self.refresh)
        self.refresh()

    def refresh(self) -> None:
        """Show the present warnings; the selection stays if the texts are the same."""
        warnings = self._states.warnings(self._device)
        text = warnings_text(warnings, time.monotonic())
        if text != self.text.toPlainText() and not self.text.textCursor().hasSelection():
            place = self.text.verticalScrollBar().value()
            self.show_text(warnings_message(self._device, warnings), text)
            self.text.verticalScrollBar().setValue(place)


def warnings_message(device: str, warnings: Sequence[NodeWarning]) -> str:
    """Return the number of warnings, in a sentence of rich text."""
    name = f'<b>{html.escape(device)}</b>'
    if not warnings:
        return f'The nodes of {name} have no warnings now.'
    return f'{name}: {counted(warnings)} now. A warning disappears when its cause is gone.'


def warnings_text(warnings: Sequence[NodeWarning], now_s: float) -> str:
    """Return the warnings with their nodes, counts and durations."""
    return '\n\n'.join(f'{_title(it, now_s)}:\n{it.text}' for it in warnings)


def _title(warning: NodeWarning, now_s: float) -> str:
    severity = 'error' if warning.severity is Severity.ERROR else 'warning'
    often = f'{warning.count} times ' if warning.count > 1 else ''
    return f'{warning.node}, {severity}, {often}for {max(now_s - warning.since_s, 0.0):.0f} s'


# The last output of a node (or of the roslaunch of a device) before it ended.

class LogView(TextDialog):
    """A window with a node's name, its exit code and its last lines; deletes itself."""

    def __init__(self, title: str, message: str, lines: Sequence[str],
                 parent: Optional[QWidget] = None) -> None:
        super().__init__('log', title, parent)
        self.setAttribute(Qt.WA_DeleteOnClose)
        self.show_text(message, '\n'.join(lines))
        self.text.verticalScrollBar().setValue(self.text.verticalScrollBar().maximum())
        if not lines:
            self.text.setPlaceholderText('The log is empty.')

    @classmethod
    def show_node(cls, parent: QWidget, report: PartReport, node: str) -> LogView:
        """Open the log of a node of a part, or of the whole part if there is no such node."""
        found = next((it for it in report.nodes if it.name == node), None)
        if found is None:
            view = cls(f'{report.part}: log', part_message(report), report.log_tail, parent)
        else:
            view = cls(f'{node}: log', node_message(report.part, found),
                       found.log_tail or report.log_tail, parent)
        view.show()
        return view


def node_message(part: str, node: NodeReport) -> str:
    """Return the fate of a node, in a sentence of rich text."""
    name = f'<b>{html.escape(node.name)}</b> of {html.escape(part)}'
    again = f' It was restarted {node.restarts} times.' if node.restarts else ''
    if node.state is NodeState.EXITED:
        return f'{name}: {html.escape(node.end_words)}.{again}'
    if node.state is NodeState.FAILED:
        return f'{name} could not be started: {html.escape(node.reason)}'
    state = 'runs' if node.state is NodeState.RUNNING else 'is starting'
    return f'{name} {state}.{again}'


def part_message(report: PartReport) -> str:
    """Return the fate of a part, in a sentence of rich text."""
    reason = f': {html.escape(report.reason)}' if report.reason else ''
    return f'<b>{html.escape(report.part)}</b> is {report.state.value}{reason}'
