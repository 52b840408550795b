# SPDX-License-Identifier: BSD-3-Clause
"""The panel *Compare*: the runs, ticks for the good ones, and where the others left the band."""
from __future__ import annotations

import os
import time
from typing import Callable, List, Optional, Sequence

from PyQt5.QtCore import QModelIndex, Qt, pyqtSignal
from PyQt5.QtGui import QResizeEvent
from PyQt5.QtWidgets import (
    QCheckBox,
    QFileDialog,
    QHeaderView,
    QPushButton,
    QSizePolicy,
    QStyleOptionViewItem,
    QTreeWidget,
    QTreeWidgetItem,
    QWidget,
)

from process_visualizer.figures import clock_text
from process_visualizer.gui.compare.compare_model import (
    SHARED_ENDINGS,
    Compared,
    CompareModel,
    ListedRun,
)
from process_visualizer.gui.compare.ghost_model import GhostModel
from process_visualizer.gui.compare.live_comparison_model import LiveComparisonModel
from process_visualizer.gui.toolkit.labels import plain_label, plain_tip
from process_visualizer.gui.toolkit.scrolling import TextPlace
from process_visualizer.gui.toolkit.theme import color
from process_visualizer.gui.toolkit.widgets import RowDelegate, color_row, in_column, in_row
from process_visualizer.runs.comparison.comparison import Comparison
from process_visualizer.runs.comparison.live_comparison import beyond_text, lasting_text
from process_visualizer.runs.comparison.live_runs import FinishedRun
from process_visualizer.runs.comparison.wording import (
    amount,
    band_text,
    began,
    unjudged_texts,
    verdict,
)
from process_visualizer.runs.deviation.departures import Departure

_RUNS_PX, _DEPARTURES_PX = 110, 64
_STATE_LINES = 3
_DIFFERED, _DIFFERS_NOW = 'What differed', 'What differs now'
_KINDS = ('Pages (*.html);;Films (*.mp4 *.gif);;Tables (*.csv *.parquet);;'
          'For Foxglove and Lichtblick (*.mcap)')
_MAX_NAME = 0.4  # maximum share of a list's width for names, so that the verdict has room
_EMPTY = 'Open a recording on the tab Playback first.'
_EMPTY_LIVE = 'Add a recording with good runs: the running cell is compared with them.'
_LAUNCH = 'The devices are compared with these runs while they run.'
_FIND = 'Find the runs of the recording, tick those that were good, and compare.'
_LIVE_ONLY = ('Live, variables, forces and speeds are judged; places, timing and roughness only in '
              'a recording.')
_TICK = 'Tick the runs that were good; the first of them is the reference.'


class ComparePanel(QWidget):
    """A list of runs with their verdicts, and below it the departures of the chosen run."""

    seek_wanted = pyqtSignal(float)
    """The operator wants to see this moment of the open recording [s from its beginning]."""
    refused = pyqtSignal(str)
    """The reason why a moment cannot be shown."""

    def __init__(self, model: CompareModel, ghost: GhostModel, live: LiveComparisonModel,
                 folder: Callable[[], str], parent: Optional[QWidget] = None) -> None:
        """Set a function that returns the folder for recordings, used while none is open."""
        super().__init__(parent)
        self._model, self._live, self._folder = model, live, folder
        self._is_live = False
        self._shown: Optional[Compared] = None
        self._listed: Sequence[ListedRun] = ()
        self.setObjectName('compare_panel')
        self.state = plain_label()
        self.state.setObjectName('compare_state')
        self.state.setWordWrap(True)
        color(self.state, 'quiet')
        self.find = _button('find_runs', 'Find runs', model.find_runs)
        self.add = _button('add_recording', 'Add recording…', self._ask_for_recording)
        self.compare = _button('compare_runs', 'Compare', model.compare)
        self.cancel = _button('cancel_comparison', 'Cancel', model.cancel)
        self.reset = _button('reset_anchors', 'Reset alignment',
                             lambda: self._model.reset_anchors(self._row))
        self.reset.setToolTip('Align the chosen run as if no moment had been dragged')
        self.share = _button('share_run', 'Share…', self._ask_where_to_share)
        self.share.setToolTip('Write the chosen run, or A to B of it while the loop is on: a page\n'
                              'that any browser opens, a film, a table, or a file for Foxglove')
        self.ghost = QCheckBox('Ghost')
        self.ghost.setObjectName('show_ghost')
        self.ghost.setToolTip('In the scene: the reference, translucent, in step with the run\n'
                              'that is played or in progress; at each tool the distance\n'
                              'from it as an arrow, 20 times as long')
        self.ghost.setChecked(ghost.is_wanted)
        self.runs = _RowsTree('runs', ('Run', 'Begins', 'Verdict'), _RUNS_PX)
        self.finished = _RowsTree('finished_runs', ('Run ended', 'Length', 'Verdict'),
                                  _DEPARTURES_PX)
        self.finished.keep_end_in_sight()
        self._finished: Sequence[FinishedRun] = ()
        self.departures = _RowsTree('departures', (_DIFFERED, 'From', 'By how much'),
                                    _DEPARTURES_PX)
        layout = in_column(self, 6, TextPlace(_STATE_LINES, self.state), in_row(
            self.find, self.add, self.compare), self.runs, in_row(
            self.ghost, self.reset, self.cancel, wide=self.ghost), self.departures,
            self.finished, in_row(self.share))
        layout.setContentsMargins(0, 6, 0, 0)
        layout.setStretchFactor(self.runs, 3)
        layout.setStretchFactor(self.departures, 2)
        layout.setStretchFactor(self.finished, 2)
        self.ghost.toggled.connect(ghost.set_wanted)
        self.runs.itemChanged.connect(self._tick)
        self.runs.currentItemChanged.connect(lambda *_: self._show_departures())
        self.departures.itemClicked.connect(self._seek)
        self.departures.itemActivated.connect(self._seek)
        model.changed.connect(self._show)
        live.changed.connect(self._show_live)
        self._show()

    def set_live(self, is_live: bool) -> None:
        """Show the comparison of the running cell, or that of the open recording."""
        if is_live != self._is_live:
            self._is_live = is_live
            self._show()

    def _show_live(self) -> None:
        if self._is_live:
            self.state.setText(self._state())
            self._show_departures()
            self._show_finished()

    def _show(self) -> None:
        model = self._model
        is_busy = model.is_comparing
        self.state.setText(self._state())
        self.find.setEnabled(bool(model.paths) and not is_busy)
        self.add.setEnabled((self._is_live or bool(model.runs)) and not is_busy)
        self.compare.setEnabled(bool(model.good) and not is_busy)
        self.cancel.setEnabled(bool(model.activity))
        self.ghost.setEnabled(model.compared is not None)
        self.share.setEnabled(bool(model.runs) and not is_busy and not model.is_writing)
        self._show_runs()
        self._show_departures()
        self._show_finished()

    def _state(self) -> str:
        model = self._model
        if model.activity:
            return model.activity
        said = self._result()
        return f'{model.shared}\n{said}' if model.shared else said

    def _result(self) -> str:
        """Return in words what was compared, or what the operator can do next."""
        model = self._model
        if not model.paths:
            return _EMPTY_LIVE if self._is_live else _EMPTY
        if not model.runs:
            return _FIND
        if model.compared is None:
            return _TICK
        summary = _summary(model.compared)
        return f'{summary}\n{self._live.text or _LAUNCH}' if self._is_live else summary

    def _show_runs(self) -> None:
        """Show all runs; unchanged runs keep their rows, as one may be about to be ticked."""
        tree, model = self.runs, self._model
        tree.blockSignals(True)
        row = self._row_to_show()
        if self._listed is not model.runs:
            self._listed = model.runs
            tree.show_rows([_run_row(it) for it in model.runs])
        tree.give_names_room(model.compared is None)
        for number in range(len(model.runs)):
            item = tree.topLevelItem(number)
            self._show_verdict(item, number)
            item.setCheckState(0, Qt.Checked if number in model.good else Qt.Unchecked)
        chosen = tree.topLevelItem(min(row, tree.topLevelItemCount() - 1))
        if tree.indexOfTopLevelItem(tree.currentItem()) != tree.indexOfTopLevelItem(chosen):
            tree.setCurrentItem(chosen)
            tree.scrollToItem(chosen, QTreeWidget.PositionAtCenter)
        tree.blockSignals(False)

    def _row_to_show(self) -> int:
        """Return the chosen row; for a new result, the row of the first poor run.

        Runs that are not ticked as good come first. A run that was aligned again stays chosen.
        """
        compared, shown = self._model.compared, self._shown
        is_new = compared is not None and (shown is None or compared.good is not shown.good)
        self._shown = compared
        poor = [] if compared is None else [row for row, it in enumerate(compared.comparisons)
                                            if it is not None and it.departures]
        if is_new and poor:
            return min(poor, key=lambda row: (row in self._model.good, row))
        return max(self.runs.indexOfTopLevelItem(self.runs.currentItem()), 0)

    def _show_verdict(self, item: QTreeWidgetItem, number: int) -> None:
        compared = self._model.compared
        found = None if compared is None else compared.comparisons[number]
        is_poor = found is None or bool(found.departures or found.why_not)
        item.setText(2, '' if compared is None else _short_verdict(found))
        has_gaps = found is not None and found.has_gaps
        color_row(item, 2, 'bad' if is_poor else 'warning' if has_gaps else 'good')
        item.setToolTip(2, plain_tip('' if found is None else '\n'.join(
            (verdict(found), *found.notes, *unjudged_texts(found)))))

    @property
    def _row(self) -> int:
        """The number of the chosen run; -1 if no run is chosen."""
        return int(self.runs.indexOfTopLevelItem(self.runs.currentItem()))

    def _chosen(self) -> Optional[Comparison]:
        compared, row = self._model.compared, self._row
        return None if compared is None or row < 0 else compared.comparisons[row]

    def _show_departures(self) -> None:
        chosen = self._chosen()
        self.reset.setEnabled(not self._is_live and chosen is not None
                              and bool(self._model.anchors(self._row)))
        live = self._live.departures if self._live.text and self._is_live else ()
        rows = [_live_row(it.signal.name, lasting_text(it, self._live.now_s), beyond_text(it))
                for it in live]
        if not live and chosen is not None:
            rows = [_row(chosen, it) for it in chosen.departures]
        self.departures.headerItem().setText(0, _DIFFERS_NOW if live else _DIFFERED)
        self.departures.show_rows(rows, takes_room=not self._is_live)

    def _show_finished(self) -> None:
        """Show the finished live runs, the newest last, so that no row moves under the mouse."""
        self.finished.setVisible(self._is_live)
        shown, self._finished = self._finished, self._live.finished
        if shown is self._finished:
            return
        if tuple(shown) == tuple(self._finished[:len(shown)]):
            self.finished.add_rows([_finished_row(it) for it in self._finished[len(shown):]])
        else:
            self.finished.show_rows([])
            self.finished.add_rows([_finished_row(it) for it in self._finished])

    def _tick(self, item: QTreeWidgetItem) -> None:
        self._model.set_good(self.runs.indexOfTopLevelItem(item), item.checkState(0) == Qt.Checked)

    def _seek(self, item: QTreeWidgetItem) -> None:
        position_s = item.data(0, Qt.UserRole)
        if position_s is None:
            return  # of the run in progress
        listed = self._model.runs[self._row]
        if self._is_live:
            self.refused.emit(f'{listed.run.name} is in a recording: choose Playback mode to go '
                              'there')
        elif listed.path in self._model.recording[:1]:
            self.seek_wanted.emit(position_s)
        else:
            self.refused.emit(f'{listed.run.name} is in a recording that is not open: open '
                              f'{listed.path} on the tab Playback to go there')

    def _ask_where_to_share(self) -> None:
        row = max(self._row, 0)
        listed, span = self._model.runs[row], self._model.shared_span(row)  # may change meanwhile
        title = f'Share {listed.run.name}, {clock_text(span.begin_s)} to {clock_text(span.end_s)}'
        dialog = QFileDialog(self, title, _proposed_path(listed), _KINDS)
        dialog.setObjectName('share_dialog')
        dialog.setAttribute(Qt.WA_DeleteOnClose)
        dialog.setAcceptMode(QFileDialog.AcceptSave)
        dialog.setDefaultSuffix(ending_of(_KINDS))
        dialog.filterSelected.connect(lambda kind: dialog.setDefaultSuffix(ending_of(kind)))
        dialog.fileSelected.connect(lambda path: self._model.share(
            listed, span, with_ending(path, dialog.selectedNameFilter())))
        dialog.open()

    def _ask_for_recording(self) -> None:
        beside = self._model.paths[-1] if self._model.paths else self._folder()
        path, _ = QFileDialog.getOpenFileName(self, 'Add a recording', beside,
                                              'Recordings (*.bag)')
        if path:
            self._model.add(path)


def ending_of(kind: str) -> str:
    """Return the first ending, with its dot, of a file filter such as Films (*.mp4 *.gif)."""
    return kind[kind.index('*') + 1:].split(')')[0].split(' ')[0]


def with_ending(path: str, kind: str) -> str:
    """Return the path of a file to share; without a known ending, it gets that of the filter."""
    is_known = os.path.splitext(path)[1].lower() in SHARED_ENDINGS
    return path if is_known else path + ending_of(kind)


def _proposed_path(listed: ListedRun) -> str:
    """Return a path beside the recording, named after the run; the filter adds the ending."""
    name = listed.run.name.replace('.bag', '').replace('#', '_')
    return os.path.join(os.path.dirname(listed.path), os.path.basename(name))


def _run_row(listed: ListedRun) -> QTreeWidgetItem:
    item = QTreeWidgetItem([listed.run.name, clock_text(listed.run.begin_s)])
    item.setToolTip(0, plain_tip(listed.path))
    item.setFlags(item.flags() | Qt.ItemIsUserCheckable)
    return item


def _row(comparison: Comparison, departure: Departure) -> QTreeWidgetItem:
    begin_s = comparison.run.begin_s + comparison.run_s(departure.onset_s)
    item = QTreeWidgetItem([departure.signal.name, clock_text(begin_s), amount(departure)])
    item.setData(0, Qt.UserRole, begin_s)
    hint = (f'{departure.signal.name}, {amount(departure)}\n'
            f'{began(comparison, departure)}\nClick to go there')
    for column in range(3):
        item.setToolTip(column, plain_tip(hint))
    return item


def _finished_row(run: FinishedRun) -> QTreeWidgetItem:
    ended = time.localtime(run.ended_s)
    item = QTreeWidgetItem([time.strftime('%H:%M:%S', ended), clock_text(run.ended_s - run.began_s),
                            run.verdict])
    color_row(item, 2, 'good' if run.is_good else 'warning' if run.is_good_in_part else 'bad')
    hint = (f'{time.strftime("%Y-%m-%d %H:%M:%S", ended)}, reference {run.reference}\n'
            f'{run.verdict}\n{_LIVE_ONLY}')
    for column in range(3):
        item.setToolTip(column, plain_tip(hint))
    return item


def _live_row(*texts: str) -> QTreeWidgetItem:
    item = QTreeWidgetItem(list(texts))
    for column, text in enumerate(texts):
        item.setToolTip(column, plain_tip(text))
    return item


def _short_verdict(found: Optional[Comparison]) -> str:
    if found is None:
        return 'nothing in common with the reference'
    if found.why_not:
        return 'not judged'
    if not found.departures:
        return verdict(found)
    first = found.departures[0]
    return f'{first.signal.name} from {clock_text(found.run.begin_s + found.run_s(first.onset_s))}'


def _summary(compared: Compared) -> str:
    departed = sum(bool(it is not None and it.departures) for it in compared.comparisons)
    in_part = sum(it is not None and not it.departures and it.is_judged_in_part
                  for it in compared.comparisons)
    lines: List[str] = [f'{departed} of {len(compared.comparisons)} runs out of range'
                        + (f', {in_part} judged only in part' if in_part else '')
                        + f'. Range: {band_text(compared.good.band)}.', *compared.good.notes]
    return '\n'.join(lines)


def _button(name: str, text: str, action: Callable[[], None]) -> QPushButton:
    button = QPushButton(text)
    button.setObjectName(name)
    button.clicked.connect(lambda: action())
    return button


class _RowsTree(QTreeWidget):
    """Rows of three columns; the last column has the most room.

    A long name in the first column is elided at its beginning, which runs of a day have in common.
    """

    def __init__(self, name: str, head: Sequence[str], least_px: int) -> None:
        super().__init__()
        self._takes_room = self._is_at_end = False
        self.setItemDelegate(_NameDelegate(self))
        self.setMinimumHeight(least_px)
        self.setSizePolicy(QSizePolicy.Preferred, QSizePolicy.Ignored)
        self.setObjectName(name)
        self.setAccessibleName(head[0])
        self.setHeaderLabels(list(head))
        self.setRootIsDecorated(False)
        self.setUniformRowHeights(True)
        self.header().setSectionResizeMode(1, QHeaderView.ResizeToContents)

    def show_rows(self, items: Sequence[QTreeWidgetItem], takes_room: bool = False) -> None:
        """Replace the rows.

        With ``takes_room``, names get all the room that the last column leaves. This may move the
        last column, so it is only for rows that do not change continuously.
        """
        self._takes_room = takes_room
        self.clear()
        self.addTopLevelItems(list(items))
        self._fit()

    def give_names_room(self, takes_room: bool) -> None:
        """Give names the room of the last column, or take it back; see ``show_rows``."""
        if takes_room != self._takes_room:
            self._takes_room = takes_room
            self._fit()

    def add_rows(self, items: Sequence[QTreeWidgetItem]) -> None:
        """Add rows below the others; the end stays in view unless it was scrolled away."""
        self.addTopLevelItems(list(items))
        self._fit()

    def keep_end_in_sight(self) -> None:
        """Follow the last row, also of rows that were added while the list was hidden."""
        bar, self._is_at_end = self.verticalScrollBar(), True
        bar.valueChanged.connect(self._note_end)
        bar.rangeChanged.connect(lambda _least, most: self._is_at_end and bar.setValue(most))

    def _note_end(self, value: int) -> None:
        self._is_at_end = value == self.verticalScrollBar().maximum()

    def resizeEvent(self, event: QResizeEvent) -> None:
        """Divide the room among the columns again."""
        super().resizeEvent(event)
        self._fit()

    def _fit(self) -> None:
        wanted, _, last = (max(self.sizeHintForColumn(it), self.header().sectionSizeHint(it))
                           for it in range(3))
        width = self.viewport().width()
        left = width - self.columnWidth(1) - last if self._takes_room else 0
        self.setColumnWidth(0, min(wanted, max(int(_MAX_NAME * width), left)))


class _NameDelegate(RowDelegate):
    def initStyleOption(self, option: QStyleOptionViewItem, index: QModelIndex) -> None:
        """Elide a long name at its beginning: it ends with the time and the number of the run."""
        super().initStyleOption(option, index)
        if index.column() == 0:
            option.textElideMode = Qt.ElideLeft
