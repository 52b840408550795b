# SPDX-License-Identifier: BSD-3-Clause
"""Choice of the recording, with its contents and what is missing in it."""
from __future__ import annotations

import html
import os
from datetime import datetime
from typing import Dict, List, Optional, Sequence, Tuple

from PyQt5.QtCore import Qt, pyqtSignal
from PyQt5.QtGui import QResizeEvent
from PyQt5.QtWidgets import (
    QComboBox,
    QFileDialog,
    QHBoxLayout,
    QProgressBar,
    QPushButton,
    QSizePolicy,
    QTreeWidgetItem,
    QVBoxLayout,
    QWidget,
)

from process_visualizer.bagio.catalog import Catalog, CatalogTopic
from process_visualizer.figures import clock_text, count_text, size_text
from process_visualizer.gui.playback.bag_model import BagModel, PlayedTopics
from process_visualizer.gui.recording.topic_list import TopicTree
from process_visualizer.gui.toolkit.icons import icon
from process_visualizer.gui.toolkit.labels import html_label, plain_label, plain_tip
from process_visualizer.gui.toolkit.theme import ThemeFollower, theme
from process_visualizer.gui.toolkit.widgets import FoldButton, color_row, in_column, in_row
from process_visualizer.health.device_state import recorded_rate_text

_NAME, _COUNT, _RATE, _TYPE = range(4)
_MAX_ROWS = 8
_WIDE_PX = 560


class PlayedTopicsTable(TopicTree):
    """The topics of the recording with counts and rates; topics of devices can be ticked."""

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
        """Hide the types if there is no room for them; the tooltips of topics have them, too."""
        super().resizeEvent(event)
        self.setColumnHidden(_TYPE, event.size().width() < _WIDE_PX)

    def show_topics(self, found: Catalog) -> None:
        """Show the topics of a recording."""
        if self._found == found.topics:
            return
        self._found = found.topics
        self.clear()
        self._rows = {topic.name: _row(topic) for topic in found.topics}
        self.addTopLevelItems(list(self._rows.values()))
        self._show_ticks()
        rows = min(len(found.topics), _MAX_ROWS)
        self.setFixedHeight(self.header().sizeHint().height() + 4
                            + rows * max(self.sizeHintForRow(0), 18))

    def _show_ticks(self) -> None:
        self.blockSignals(True)
        for name, row in self._rows.items():
            is_offered, is_ticked = self._played.is_offered(name), self._played.is_ticked(name)
            row.setData(_NAME, Qt.CheckStateRole,
                        (Qt.Checked if is_ticked else Qt.Unchecked) if is_offered else None)
            color_row(row, _NAME, 'text' if is_ticked else 'quiet')
            row.setToolTip(_NAME, plain_tip(row.data(_NAME, Qt.UserRole) + (
                '' if is_offered else '\nNo ticked device has it: it is not played')))
        self.blockSignals(False)

    def _take_tick(self, row: QTreeWidgetItem, column: int) -> None:
        if column == _NAME and row.data(_NAME, Qt.CheckStateRole) is not None:
            self._played.tick(row.text(_NAME), row.checkState(_NAME) == Qt.Checked)


def _row(topic: CatalogTopic) -> QTreeWidgetItem:
    row = QTreeWidgetItem([topic.name, count_text(topic.message_count), recorded_rate_text(topic),
                           topic.types[0].split('/')[-1]])
    row.setFlags(Qt.ItemIsEnabled | Qt.ItemIsUserCheckable | Qt.ItemNeverHasChildren)
    row.setTextAlignment(_COUNT, Qt.AlignRight)
    row.setTextAlignment(_RATE, Qt.AlignRight)
    row.setData(_NAME, Qt.UserRole, f'{topic.name}\n{", ".join(topic.types)}')
    return row


_MAX_NAMED = 3
_MAX_REMARKS = 2


class BagView(QWidget):
    """Recent recordings, a dialog for others, facts, warnings, and on request the topics."""

    configuration_wanted = pyqtSignal(object)
    """The operator wants a configuration made from these files of a recording."""

    def __init__(self, bag: BagModel, parent: Optional[QWidget] = None) -> None:
        super().__init__(parent)
        self._bag = bag
        self.recent = QComboBox()
        self.open = QPushButton(icon('open'), 'Open…')
        self.facts = html_label()
        self.details = FoldButton('bag_details', 'Topics', 'Show the topics of the recording')
        self.topics = PlayedTopicsTable(bag.played)
        self.warnings = html_label()
        self.unindexed = UnindexedRow(bag)
        self.foreign = ForeignRow(bag)
        self.foreign.make.clicked.connect(
            lambda: self.configuration_wanted.emit(bag.foreign_paths))
        self._prepare()
        self._lay_out()
        bag.changed.connect(self._show)
        bag.played.changed.connect(self._show)
        ThemeFollower(self, self._show)
        self._show()

    def _prepare(self) -> None:
        self.recent.setObjectName('recent_bags')
        self.recent.setAccessibleName('Recent recordings')
        self.recent.setSizeAdjustPolicy(QComboBox.AdjustToMinimumContentsLengthWithIcon)
        self.recent.setFocusPolicy(Qt.TabFocus)
        self.recent.activated.connect(lambda row: self._bag.open(self.recent.itemData(row)))
        self.open.setObjectName('open_bag')
        self.open.setToolTip('Open a bag, or all files of a split recording  (Ctrl+O)')
        self.open.clicked.connect(self.choose_files)
        self.facts.setObjectName('bag_facts')
        self.facts.setWordWrap(True)
        self.facts.setTextInteractionFlags(Qt.TextSelectableByMouse)
        self.details.toggled.connect(self.topics.setVisible)
        self.warnings.setObjectName('bag_warnings')
        self.warnings.setWordWrap(True)

    def _lay_out(self) -> None:
        facts = QHBoxLayout()
        facts.setSpacing(0)
        facts.addWidget(self.facts, 1)
        facts.addWidget(self.details, 0, Qt.AlignTop)
        in_column(self, 4, in_row(self.recent, self.open, wide=self.recent), self.unindexed,
                  self.foreign, facts,
                  self.warnings, self.topics)
        self.topics.hide()

    def choose_files(self) -> None:
        """Ask for the files of one recording and open them."""
        paths, _filter = QFileDialog.getOpenFileNames(
            self, 'Open a recording', self._bag.recent.folder,
            'Bags (*.bag *.bag.active);;All files (*)')
        if paths:
            self._bag.recent.look_into(os.path.dirname(paths[0]))
            self._bag.open(paths)

    def _show(self) -> None:
        self._show_recent()
        recording = self._bag.session.recording
        self.facts.setText(self._facts(recording))
        self.facts.setToolTip(plain_tip('' if recording is None else _origin(recording)))
        self.details.setVisible(recording is not None)
        if recording is None:
            self.details.setChecked(False)
        else:
            self.topics.show_topics(recording)
            self.details.setText(_contents(recording, recording.topic_names))
            self.details.setMinimumWidth(self.details.sizeHint().width())  # a tick moves nothing
            self.details.setText(_contents(recording, self._bag.played.left_out))
        warnings = _warnings(self._bag)
        self.warnings.setText('<br>'.join(warnings))
        self.warnings.setVisible(bool(warnings))
        self.warnings.setToolTip(plain_tip(_whole_warnings(self._bag)))

    def _show_recent(self) -> None:
        self.recent.clear()
        for paths in self._bag.recent.all:
            self.recent.addItem(name_of(paths), list(paths))
            self.recent.setItemData(self.recent.count() - 1, plain_tip('\n'.join(paths)),
                                    Qt.ToolTipRole)
        paths = self._bag.session.paths
        is_known = paths in self._bag.recent.all
        self.recent.setCurrentIndex(self._bag.recent.all.index(paths) if is_known else -1)
        self.recent.setEnabled(bool(self._bag.recent.all))
        self.recent.setToolTip(plain_tip('\n'.join(paths) or 'Recordings that were opened before'))

    def _facts(self, found: Optional[Catalog]) -> str:
        if self._bag.is_loading:
            return 'Reading…'
        if found is None:
            return f'<span style="color: {theme().quiet}">Choose a recording to play.</span>'
        return facts_of(found)


class ForeignRow(QWidget):
    """A note on a recording that waits or is of another cell; offers a configuration for it."""

    def __init__(self, bag: BagModel, parent: Optional[QWidget] = None) -> None:
        super().__init__(parent)
        self._bag = bag
        self.text = plain_label()
        self.text.setObjectName('foreign_bag')
        self.text.setWordWrap(True)
        self.make = QPushButton()
        self.make.setObjectName('configuration_of_bag')
        in_column(self, 2, self.text, in_row(self.make))
        bag.changed.connect(self._show)
        self._show()

    def _show(self) -> None:
        bag = self._bag
        self.text.setText(bag.waiting_note)
        self.make.setText('Use the configuration in it…' if bag.holds_configuration
                          else 'Make a configuration from it…')
        self.make.setToolTip('Writes it into a file that you name, and opens that. Programs that '
                             'it would start here are left out' if bag.holds_configuration else
                             'Writes one for its topics into a file that you name, and opens that')
        self.make.setVisible(bool(bag.foreign_paths))
        self.setVisible(bool(bag.waiting_note))


class UnindexedRow(QWidget):
    """Offers an indexed copy of a bag that has no index, and shows the progress."""

    def __init__(self, bag: BagModel, parent: Optional[QWidget] = None) -> None:
        super().__init__(parent)
        self._bag = bag
        self._shown: Optional[object] = None
        self.text = plain_label()
        self.text.setObjectName('unindexed')
        self.text.setWordWrap(True)
        self.bar = QProgressBar()
        self.bar.setObjectName('reindex_progress')
        self.bar.setRange(0, 1000)
        self.make = QPushButton('Make a copy with an index')
        self.make.setObjectName('reindex')
        self.make.setToolTip('The bag itself is only read; the copy is written beside it')
        self.make.clicked.connect(bag.reindex)
        self.cancel = QPushButton('Cancel')
        self.cancel.setObjectName('cancel_reindex')
        self.cancel.setToolTip('Close this bag')
        self.cancel.clicked.connect(bag.dismiss)
        self._lay_out()
        bag.changed.connect(self._show)
        self._show()

    def _lay_out(self) -> None:
        row = QHBoxLayout()
        for widget in (self.make, self.bar, self.cancel):
            row.addWidget(widget)
        row.addStretch(1)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 2, 0, 2)
        layout.addWidget(self.text)
        layout.addLayout(row)

    def _show(self) -> None:
        path, progress = self._bag.unindexed, self._bag.reindexing
        self.setVisible(bool(path))
        self.text.setText(f'{os.path.basename(path)} has no index: its recording was probably '
                          'interrupted. It can be played from a copy that has one.')
        self.text.setToolTip(plain_tip(path))
        self.make.setVisible(progress is None)
        self.bar.setVisible(progress is not None)
        if progress is not None and progress is not self._shown:
            self.bar.setValue(0)
            progress.changed.connect(lambda part: self.bar.setValue(round(1000 * part)))
        self._shown = progress


def name_of(paths: Sequence[str]) -> str:
    """Return the name of a recording in a list: its first file, and the number of other files."""
    more = f'  + {len(paths) - 1} files' if len(paths) > 1 else ''
    return os.path.basename(paths[0]) + more


def facts_of(found: Catalog) -> str:
    """Return length, size and date of a recording in one line."""
    begin = datetime.fromtimestamp(found.begin_ns / 1e9)
    is_recent = begin.year == datetime.now().year
    parts = [clock_text(found.duration_s, 3), size_text(found.size_bytes),
             begin.strftime('%d %b %H:%M' if is_recent else '%Y-%m-%d %H:%M')]
    return '\u2002'.join(part.replace(' ', '\u00a0') for part in parts)


def _contents(found: Catalog, left_out: Sequence[str]) -> str:
    """Return in words the numbers of topics and messages, and how many topics are ticked."""
    number = len(set(left_out) & set(found.topic_names))
    topics = count_text(len(found.topics), 'topic')
    if number:
        topics = f'{len(found.topics) - number} of {topics}'
    return f'{topics}, {count_text(found.message_count, "message")}'


def _origin(found: Catalog) -> str:
    """Return a text with the beginning of a recording and its files."""
    begin = datetime.fromtimestamp(found.begin_ns / 1e9)
    return '\n'.join([begin.strftime('Recorded on %Y-%m-%d at %H:%M:%S'), *found.paths])


def _warnings(bag: BagModel) -> List[str]:
    """Return the warnings before the recording is played, in HTML."""
    lines = [(theme().bad, f'{html.escape(os.path.basename(path))} no longer exists')
             for path in bag.gone]
    lines += [(theme().warning, f'<b>{html.escape(device)}</b>: not in the recording: '
                                f'{html.escape(_named(topics))}')
              for device, topics in bag.missing.items() if not bag.is_foreign]
    problems, remarks = ((), ()) if bag.session.recording is None else (
        bag.session.recording.problems, bag.session.recording.remarks)
    if problems:
        parts = 'a part' if len(problems) == 1 else f'{len(problems)} parts'
        lines.append((theme().warning, f'{parts} of the files cannot be read; the rest is played'))
    lines += [(theme().warning, html.escape(it)) for it in remarks[:_MAX_REMARKS]]
    if len(remarks) > _MAX_REMARKS:
        more = count_text(len(remarks) - _MAX_REMARKS, 'more such remark')
        lines.append((theme().warning, f'and {more}'))
    return [f'<span style="color: {color}">{text}</span>' for color, text in lines]


def _whole_warnings(bag: BagModel) -> str:
    lines = [f'{device}: {", ".join(topics)}' for device, topics in bag.missing.items()]
    return '\n'.join([*bag.gone, *lines, *(() if bag.session.recording is None else (
        *bag.session.recording.problems, *bag.session.recording.remarks))])


def _named(topics: Tuple[str, ...]) -> str:
    more = len(topics) - _MAX_NAMED
    return ', '.join(topics[:_MAX_NAMED]) + (f' and {more} more' if more > 0 else '')
