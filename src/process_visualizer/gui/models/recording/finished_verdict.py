# SPDX-License-Identifier: BSD-3-Clause
"""The verdict on the last recording: that of `cell report`, found in a task."""
from __future__ import annotations

from typing import Callable, NamedTuple, Optional, Sequence, Tuple

from PyQt5.QtCore import QObject, pyqtSignal

from process_visualizer.bags.bag_errors import BagError
from process_visualizer.bags.recording import Recording
from process_visualizer.gui.toolkit.tasks import Tasks
from process_visualizer.report.report import make_report
from process_visualizer.report.report_text import verdict

_LINE = 'verdict'


class BagVerdict(NamedTuple):
    """The verdict of the report on a recording; good if nothing is known to be missing."""

    is_good: bool
    text: str


Judge = Callable[[Sequence[str]], BagVerdict]


def verdict_on(paths: Sequence[str]) -> BagVerdict:
    """Return the verdict on a recording; takes long for a large one."""
    try:
        with Recording(paths) as recording:
            report = make_report(recording)
    except BagError as error:
        return BagVerdict(False, str(error))
    return BagVerdict(report.is_good, verdict(report))


class FinishedVerdict(QObject):
    """Looks at one recording after the other; only the verdict on the last counts."""

    changed = pyqtSignal()

    def __init__(self, tasks: Tasks, parent: QObject,
                 judge: Judge = verdict_on) -> None:
        super().__init__(parent)
        self._tasks, self._judge = tasks, judge
        self._paths: Tuple[str, ...] = ()
        self._verdict: Optional[BagVerdict] = None

    @property
    def verdict(self) -> Optional[BagVerdict]:
        """The verdict on the recording that was looked at last; None until it is known."""
        return self._verdict

    def look_at(self, paths: Sequence[str]) -> None:
        """Find the verdict on a recording."""
        asked = self._paths = tuple(paths)
        self._verdict = None
        self.changed.emit()
        if asked:
            self._tasks.run(_LINE, lambda: self._judge(asked),
                            lambda found: self._take(asked, found))

    def _take(self, paths: Tuple[str, ...], found: BagVerdict) -> None:
        if paths == self._paths:
            self._verdict = found
            self.changed.emit()
