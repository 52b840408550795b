# SPDX-License-Identifier: BSD-3-Clause
"""Sends commands to the recorder, follows its state, and finds the verdict on a finished bag."""
from __future__ import annotations

import os
import time
from typing import Any, Callable, List, NamedTuple, Optional, Sequence, Tuple

from PyQt5.QtCore import QObject, pyqtSignal

from process_visualizer.bagio.bag_errors import BagError
from process_visualizer.bagio.recording import Recording
from process_visualizer.bagio.reindex import recovered_text, reindex
from process_visualizer.bagio.report import make_report, verdict
from process_visualizer.cell.model import Mode
from process_visualizer.clients.bag_recorder import RecorderError, RecorderUnreachable
from process_visualizer.generate.plan import BAG_PART
from process_visualizer.gui.recording.recording_choices import DiskRoom, RecordingChoices, disk_room
from process_visualizer.gui.recording.recording_state import (
    RecordingState,
    RecordingStep,
    active,
    advice,
    checked,
    ended,
    failed,
    gone,
    left_behind,
    not_recovered,
    obstacle,
    recovered,
    updated,
)
from process_visualizer.gui.recording.recording_types import (
    RecordedMark,
    RecorderClient,
    RecordingPhase,
    SenderClock,
)
from process_visualizer.gui.ros.snapshots import RecorderSnapshot
from process_visualizer.gui.session import Session
from process_visualizer.gui.toolkit.labels import listing
from process_visualizer.gui.toolkit.tasks import SilenceWatch, TaskProgress, Tasks

_VERDICT_LINE = 'verdict'


class BagVerdict(NamedTuple):
    """The verdict of the report on a recording; good unless something is known to be missing."""

    is_good: bool
    text: str


Judge = Callable[[Sequence[str]], BagVerdict]


def verdict_on(paths: Sequence[str]) -> BagVerdict:
    """Return the verdict on a recording; takes long for a large recording."""
    try:
        with Recording(paths) as recording:
            report = make_report(recording)
    except BagError as error:
        return BagVerdict(False, str(error))
    return BagVerdict(report.is_good, verdict(report))


class FinishedVerdict(QObject):
    """Judges one recording after the other; only the verdict on the last one counts."""

    changed = pyqtSignal()

    def __init__(self, tasks: Tasks, parent: QObject,
                 judge: Judge = verdict_on) -> None:
        super().__init__(parent)
        self._tasks, self._judge = tasks, judge
        self._paths: Tuple[str, ...] = ()
        self._verdict: Optional[BagVerdict] = None

    @property
    def verdict(self) -> Optional[BagVerdict]:
        """The verdict on the last recording; None until it is known."""
        return self._verdict

    def look_at(self, paths: Sequence[str]) -> None:
        """Find the verdict on a recording."""
        asked = self._paths = tuple(paths)
        self._verdict = None
        self.changed.emit()
        if asked:
            self._tasks.run(_VERDICT_LINE, lambda: self._judge(asked),
                            lambda found: self._take(asked, found))

    def _take(self, paths: Tuple[str, ...], found: BagVerdict) -> None:
        if paths == self._paths:
            self._verdict = found
            self.changed.emit()


_LINE = 'recorder'
_LOOK_PERIOD_S = 5.0


class RecordingModel(QObject):
    """Records according to the choices; commands return at once, and signals report the outcome.

    Its knowledge is an immutable value, ``state``. This class connects that value to the outside:
    the recorder, the disk, the time, and the views.
    """

    changed = pyqtSignal()
    failed = pyqtSignal(str)
    unheard = pyqtSignal()
    """The recorder no longer reports: it hangs, or has ended."""
    finished = pyqtSignal(str)
    """A bag is complete; its path (of a split recording, the path of the first file)."""
    broken_off = pyqtSignal(str)
    """The recorder has ended without finishing its bag; the path that the bag would have."""

    def __init__(self, tasks: Tasks, client: RecorderClient, session: Session,
                 parent: Optional[QObject] = None,
                 now_s: Callable[[], float] = time.monotonic, judge: Judge = verdict_on) -> None:
        super().__init__(parent)
        self._tasks, self._client, self._now_s = tasks, client, now_s
        self.choices = RecordingChoices(tasks, session, self)
        self.verdict = FinishedVerdict(tasks, self, judge)
        self.choices.changed.connect(self._follow_choices)
        self.verdict.changed.connect(self.changed)
        self._looked_s = now_s()
        self._state = RecordingState()
        self._sender = SenderClock()
        self._unsent: Tuple[RecordedMark, ...] = ()  # marks that the recorder did not confirm
        self._silence = SilenceWatch(self)
        self._silence.silent.connect(self._take_silence)
        session.run_changed.connect(lambda: self._follow_run(session))

    @property
    def state(self) -> RecordingState:
        """The state of the recording."""
        return self._state

    @property
    def phase(self) -> RecordingPhase:
        """The phase of the recorder."""
        return self._state.phase

    @property
    def is_recording(self) -> bool:
        """Return whether a recording is being made (closing the window then asks first)."""
        return self._state.is_busy

    @property
    def elapsed_s(self) -> float:
        """The time since the recording began, or the length of the last recording; for a clock."""
        return self._state.elapsed_s(self._now_s())

    @property
    def room(self) -> DiskRoom:
        """The room for recording on the disk."""
        snapshot = self._state.snapshot
        if not self.is_recording:
            snapshot = snapshot._replace(rate=self.incoming)
        return disk_room(self.phase, snapshot, self.choices.free_bytes)

    @property
    def incoming(self) -> float:
        """The present data rate of the topics to record [bytes per s]."""
        return self._state.snapshot.rate * self.choices.ticked_share()

    def _follow_choices(self) -> None:
        self._enter(self._state.chosen(self.choices.options()))

    # Reports of the run and of the recorder

    def _follow_run(self, session: Session) -> None:
        """Note that a recorder was launched, or has ended with its run or on its own."""
        is_running = session.running_mode is Mode.REALTIME
        if is_running != (self.phase is not RecordingPhase.OFF):
            self._silence.stop()
            self._sender = SenderClock()
            self.choices.take_topics(())
            self.choices.look()
            self._enter(self._state.run(is_running))
        if is_running and session.has_ended(BAG_PART) and self.phase is not RecordingPhase.GONE:
            self._silence.stop()
            self._lose_rates()
            self._take(gone(self._state))
            self.take_end_of_run()

    def _take_silence(self) -> None:
        self._lose_rates()
        self._enter(self._state.unheard())

    def _lose_rates(self) -> None:
        """Forget the last rates, which say nothing about the present."""
        self.choices.take_topics(())
        self.unheard.emit()

    def take_end_of_run(self) -> None:
        """Check whether the recorder, which has ended, has finished its bag."""
        path, self._state = self._state.left, self._state._replace(left='')
        if path:
            self._tasks.run('files', lambda: os.path.exists(path),
                            lambda is_there: self._take_left(path, bool(is_there)))

    def _take_left(self, path: str, is_there: bool) -> None:
        if not is_there:
            self.broken_off.emit(path)
        self._take(left_behind(self._state, path, is_there))

    def after_end_of_run(self, act: Callable[[], None]) -> None:
        """Act once it is known whether the recorder has finished its bag; ``finished`` is first."""
        self._tasks.run('files', lambda: None, lambda _: act())

    def take_state(self, snapshot: RecorderSnapshot) -> None:
        """Update from a report of the recorder; in the GUI thread."""
        if self.phase is RecordingPhase.OFF:
            return
        self._silence.hear()
        now_s = self._now_s()
        if not self._state.is_outdated(snapshot, self._sender.sent_s(snapshot.stamp_s, now_s)):
            self.choices.take_topics(snapshot.topics)
            self._take(updated(self._state, snapshot, now_s))
            self._write_unsent()
            self.take_end_of_run()  # after a restart of the recorder
        if now_s - self._looked_s >= _LOOK_PERIOD_S:
            self._looked_s = now_s
            self.choices.look()

    # Commands

    def toggle(self) -> None:
        """Start or stop a recording."""
        if self.phase is RecordingPhase.RECORDING:
            self.stop()
        else:
            self.start()

    def start(self) -> None:
        """Start a recording with the chosen options; ``state`` and ``failed`` show the outcome."""
        options = self.choices.options()
        problem = obstacle(self.phase, self._state.is_silent, options,
                           self.choices.problem)
        if problem:
            self._take(failed(self._state, problem, options))
        elif self.phase is RecordingPhase.IDLE:
            self._write(RecordingPhase.STARTING, lambda: checked(self._client.start, options),
                        lambda path: self._enter(self._state.started(path, self._now_s())))

    def stop(self) -> None:
        """Stop the recording; ``finished`` is emitted when everything is written."""
        if self.phase is RecordingPhase.RECORDING:
            self._enter(self._state.asked_to_stop(self._now_s()))
            self._write_unsent()
            self._tasks.run(_LINE, self._client.stop, self._ended, self._not_stopped)

    def save_recent(self) -> None:
        """Write the recorder's memory (the last 30 s) into a separate bag."""
        if self._state.recent_s > 0:
            options = self.choices.options_to_save(self._state.recent_s)
            self._write(RecordingPhase.STOPPING,
                        lambda: [checked(self._client.save_recent, options)], self._ended)

    def recover(self) -> None:
        """Make a bag of what the recorder wrote before it ended; its file stays as it is."""
        path, progress = self._state.unfinished, TaskProgress(self)
        if not path or self._state.recovered is not None:
            return

        def recovery() -> Tuple[str, str]:
            result = reindex(active(path), progress.go_on)
            return result.path, recovered_text(result)

        def refuse(error: Exception) -> None:
            if not isinstance(error, BagError):
                raise error
            self._take(not_recovered(self._state, str(error)))

        progress.changed.connect(lambda share: self._enter(self._state.recovering(share)))
        self._enter(self._state.recovering(0.0))
        self._tasks.run('recovery', recovery,
                        lambda found: self._take(recovered(self._state, *found)), refuse)

    def set_label(self, label: str) -> None:
        """Set the label for the next mark."""
        self._state = self._state._replace(label=label.strip())

    def mark(self, age_s: float = 0.0) -> None:
        """Write a mark for this moment into the recording, with the set label or with a number.

        A recorder that hangs writes the mark, with this time, when it responds.

        Args:
            age_s: how long ago the moment was, at most since the recording began [s].
        """
        if self.phase is RecordingPhase.RECORDING:
            now_s = self._now_s()
            marked = self._state.marked(now_s, self._sender.stamp_s(now_s), age_s)
            self._write_mark(marked.marks[-1])
            self._enter(marked)

    def dismiss(self) -> None:
        """Dismiss the error, or without an error, the finished bag."""
        self._enter(self._state.seen())

    def forget(self, gone: Sequence[str]) -> None:
        """Withdraw the offer of the finished bag if some of its files are gone."""
        bag = self._state.finished
        if bag is not None and not set(gone).isdisjoint(bag.files):
            self._enter(self._state.dismissed())

    # Outcomes of commands

    def _write(self, phase: RecordingPhase, command: Callable[[], Any],
               on_result: Callable[[Any], None]) -> None:
        """Run a command that writes a bag; if it fails, the recorder is idle as before."""
        chosen, before = self.choices.options(), self._state.finished
        self._enter(self._state.asked_to_write(phase))

        def on_error(error: Exception) -> None:
            self._enter(self._state.refused(RecordingPhase.IDLE, self._now_s())._replace(
                finished=before))
            self._take(failed(self._state, advice(error, ''), chosen))
            self._follow_choices()

        self._tasks.run(_LINE, command, on_result, on_error)

    def _not_stopped(self, error: Exception) -> None:
        """Handle a failed stop; a recorder that refuses it has ended the recording already."""
        path = self._state.path
        if isinstance(error, RecorderError) and not isinstance(error, RecorderUnreachable):
            self._ended(list(self._state.snapshot.files))
        else:
            self._enter(self._state.refused(RecordingPhase.RECORDING, self._now_s()))
        self._fail(advice(error, path))

    def _ended(self, files: List[str]) -> None:
        self._take(ended(self._state, files, self._now_s()))

    def _write_mark(self, mark: RecordedMark) -> None:
        self._tasks.run(_LINE, lambda: self._client.mark(mark.label, mark.stamp_s),
                        lambda _: self._enter(self._state.mark_written(mark)),
                        lambda error: self._not_marked(mark, error))

    def _write_unsent(self) -> None:
        """Send marks again that a recorder did not confirm while it hung."""
        unsent, self._unsent = self._unsent, ()
        for mark in unsent:
            self._write_mark(mark)

    def _not_marked(self, mark: RecordedMark, error: Exception) -> None:
        if isinstance(error, RecorderUnreachable) and self._state.path:
            self._unsent = *self._unsent, mark
            self.changed.emit()
        else:
            self._enter(self._state.not_marked(mark))
            self._fail(f'{mark.label} was not written: {advice(error, self._state.path)}')

    def _lose_unsent(self) -> None:
        """Report the marks of an ended recording that the recorder never accepted."""
        lost, self._unsent = self._unsent, ()
        if lost:
            self._state = self._state.not_marked(*lost)
            labels = listing([it.label for it in lost])
            self._fail(f'{labels} {"was" if len(lost) == 1 else "were"} not written: the recorder '
                       'did not respond before the recording ended')

    # Changes of the state

    def _fail(self, message: str) -> None:
        self._take(failed(self._state, message))

    def _enter(self, state: RecordingState) -> None:
        self._take(RecordingStep(state))

    def _take(self, step: RecordingStep) -> None:
        self._state = step.state
        if not step.state.path:
            self._lose_unsent()
        if step.ended is not None:
            self.verdict.look_at(step.ended)
            self.choices.look()
        self.changed.emit()
        if step.ended:
            self.finished.emit(step.ended[0])
        if step.failure:
            self.failed.emit(step.failure)
