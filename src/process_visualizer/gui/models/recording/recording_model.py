# SPDX-License-Identifier: BSD-3-Clause
"""Recording: what the recorder does, and the commands to it."""
from __future__ import annotations

import os
import time
from typing import Any, Callable, List, Optional, Tuple

from PyQt5.QtCore import QObject, pyqtSignal

from process_visualizer.clients.recording_options import (
    RecorderError,
    RecorderUnreachable,
    RecordingOptions,
)
from process_visualizer.gui.models.recording.bag_target import LEAST_FREE_BYTES
from process_visualizer.gui.models.recording.finished_verdict import (
    FinishedVerdict,
    Judge,
    verdict_on,
)
from process_visualizer.gui.models.recording.recording_advice import advice, checked, repair
from process_visualizer.gui.models.recording.recording_choices import RecordingChoices
from process_visualizer.gui.models.recording.recording_clock import RecordingClock
from process_visualizer.gui.models.recording.recording_types import (
    Figures,
    FinishedBag,
    Phase,
    RecorderClient,
    figures_of,
)
from process_visualizer.gui.models.recording.silence_watch import SilenceWatch
from process_visualizer.gui.ros.snapshots import RecorderSnapshot
from process_visualizer.gui.toolkit.tasks import Tasks

RECENT_S = 30.0
"""What the recorder keeps in memory (its parameter ~recent_duration)."""
_LINE = 'recorder'
_LOOK_PERIOD_S = 5.0
_LOW_DISK_S = 300.0
_LATE_S = 2.0
"""How long after a command's answer a state may still come that was sent before it."""


class RecordingModel(QObject):
    """Records what the choices say; commands return at once, what becomes of them is signalled."""

    changed = pyqtSignal()
    failed = pyqtSignal(str)
    finished = pyqtSignal(str)
    """A bag is complete; its path (of a recording in parts, that of the first)."""

    def __init__(self, tasks: Tasks, client: RecorderClient, parent: Optional[QObject] = None,
                 now_s: Callable[[], float] = time.monotonic, judge: Judge = verdict_on) -> None:
        super().__init__(parent)
        self._tasks, self._client, self._now_s = tasks, client, now_s
        self.choices = RecordingChoices(tasks, self)
        self.verdict = FinishedVerdict(tasks, self, judge)
        for part in (self.choices, self.verdict):
            part.changed.connect(self.changed)
        self._clock = RecordingClock(now_s)
        self._looked_s = self._answered_s = now_s()
        self._snapshot = RecorderSnapshot('idle')
        self._phase = Phase.OFF
        self._is_asked = False  # and has not answered yet
        self._path = ''  # of the recording that is being made
        self._left = ''  # what was recorded when the run was told to end
        self._finished: Optional[FinishedBag] = None
        self._error = ''
        self._marks: List[Tuple[float, str]] = []
        self._label = ''
        self._silence = SilenceWatch(self)
        self._silence.silent.connect(self._recorder_is_gone)

    # What the operator sees

    @property
    def phase(self) -> Phase:
        """What the recorder does."""
        return self._phase

    @property
    def is_recording(self) -> bool:
        """Whether a recording is being made (then the window may not just be closed)."""
        return self._phase in (Phase.STARTING, Phase.RECORDING, Phase.STOPPING)

    @property
    def path(self) -> str:
        """The file that is being recorded, or ''."""
        return self._path

    @property
    def snapshot(self) -> RecorderSnapshot:
        """What the recorder said last; of a recording, ``figures`` are to be shown."""
        return self._snapshot

    @property
    def figures(self) -> Optional[Figures]:
        """Those of the recording that is made or was made last, which ``finished_bag`` names.

        None where there is none: what the recorder counts meanwhile belongs to no recording.
        """
        if self._is_made:
            return figures_of(self._snapshot)
        return None if self._finished is None else self._finished.figures

    @property
    def finished_bag(self) -> Optional[FinishedBag]:
        """What was recorded or saved last, until the next command or ``dismiss``."""
        return self._finished

    @property
    def error(self) -> str:
        """What failed last, until the next command or ``dismiss``."""
        return self._error

    @property
    def marks(self) -> List[Tuple[float, str]]:
        """The marks of this recording: elapsed time [s] and label."""
        return list(self._marks)

    @property
    def label(self) -> str:
        """The label that the operator prepares for the next mark, or ''."""
        return self._label

    @property
    def next_label(self) -> str:
        """The label of the next mark, if the operator gives none."""
        return f'mark {len(self._marks) + 1}'

    @property
    def elapsed_s(self) -> float:
        """The time since the recording began, or how long the last one was; for a clock."""
        if self._is_made:
            return self._clock.elapsed_s()
        return 0.0 if self.figures is None else self.figures.duration_s

    @property
    def _is_made(self) -> bool:
        return bool(self._path) and self._phase in (Phase.RECORDING, Phase.STOPPING)

    @property
    def free_bytes(self) -> Optional[int]:
        """The room on the disk, None where it is not known."""
        if self._phase is Phase.RECORDING and self._snapshot.free_bytes:
            return self._snapshot.free_bytes
        return self.choices.free_bytes

    @property
    def time_left_s(self) -> Optional[float]:
        """How long can be recorded at the present rate until the disk is full, if it is known."""
        if self._phase is Phase.RECORDING:
            return self._snapshot.time_left_s
        if self.free_bytes is None or self._snapshot.rate <= 0:
            return None
        return max(0, self.free_bytes - LEAST_FREE_BYTES) / self._snapshot.rate

    @property
    def is_saving(self) -> bool:
        """Whether the last seconds are being written."""
        return self._phase is Phase.STOPPING and not self._path

    @property
    def is_disk_low(self) -> bool:
        """Whether the disk is full in less than five minutes."""
        return self.time_left_s is not None and self.time_left_s < _LOW_DISK_S

    @property
    def recent_s(self) -> float:
        """How much of the past can be saved now, at most the last 30 s."""
        return min(self._snapshot.recent_s, RECENT_S) if self._phase is Phase.IDLE else 0.0

    # What the run and the recorder say

    def set_running(self, is_running: bool) -> None:
        """Tell that a recorder has been launched, or that it has ended with its run."""
        if is_running == (self._phase is not Phase.OFF):
            return
        self._silence.stop()
        self._left, self._error = '' if is_running else self._path, ''
        self._snapshot, self._path, self._is_asked = RecorderSnapshot('idle'), '', False
        self._clock.take(0.0, False)
        self.choices.take_topics(())
        self.choices.look()
        self._enter(Phase.WAITING if is_running else Phase.OFF)

    def take_end_of_run(self) -> None:
        """Tell that every node has ended: the recorder has finished its bag, or never will."""
        path, self._left = self._left, ''
        if path:
            self._tasks.run('files', lambda: os.path.exists(path),
                            lambda is_there: self._tell_left(path, bool(is_there)))

    def take_state(self, snapshot: RecorderSnapshot) -> None:
        """Take what the recorder says; in the GUI thread."""
        if self._phase is Phase.OFF:
            return
        self._silence.hear()
        if not self._is_late(snapshot):
            self._snapshot = snapshot
            self.choices.take_topics(snapshot.topics)
            self._follow(Phase(snapshot.phase))
            self._complete_figures(snapshot)
        if self._now_s() - self._looked_s >= _LOOK_PERIOD_S:
            self._looked_s = self._now_s()
            self.choices.look()
        self.changed.emit()

    # Commands

    def toggle(self) -> None:
        """Start, or stop."""
        if self._phase is Phase.RECORDING:
            self.stop()
        else:
            self.start()

    def start(self) -> None:
        """Start a recording with the chosen options; ``phase`` and ``failed`` tell the rest."""
        options = self.choices.options()
        problem = self._problem_before(options)
        if problem:
            self._fail(problem)
        elif self._phase is Phase.IDLE:
            self._forget()
            self._ask(Phase.STARTING)
            self._run(lambda: checked(self._client.start, options), self._started)

    def stop(self) -> None:
        """Stop; ``finished`` tells when everything is written."""
        if self._phase is Phase.RECORDING:
            self._error = ''
            self._clock.take(self.elapsed_s, False)
            self._ask(Phase.STOPPING)
            self._tasks.run(_LINE, self._client.stop, self._ended, self._not_stopped)

    def save_recent(self) -> None:
        """Write what is in memory (the last 30 s) into a bag of its own."""
        if self.recent_s > 0:
            options = self.choices.options_to_save(self.recent_s)
            self._forget()
            self._ask(Phase.STOPPING)
            self._run(lambda: [checked(self._client.save_recent, options)], self._ended)

    def set_label(self, label: str) -> None:
        """Take the label that the operator prepares for the next mark."""
        self._label = label.strip()

    def mark(self) -> None:
        """Write a moment, now, into the recording, with the prepared label or with a number."""
        if self._phase is Phase.RECORDING:
            entry = (self.elapsed_s, self._label or self.next_label)
            self._marks.append(entry)
            self._label = ''
            self._tasks.run(_LINE, lambda: self._client.mark(entry[1]), None,
                            lambda error: self._mark_failed(entry, error))
            self.changed.emit()

    def dismiss(self) -> None:
        """The operator has seen the finished bag or the error."""
        self._error, self._finished = '', None
        self.changed.emit()

    # How commands end

    def _run(self, command: Callable[[], Any], on_result: Callable[[Any], None]) -> None:
        """Run a command after whose failure the recorder is idle as before."""
        def on_error(error: Exception) -> None:
            self._answer(Phase.IDLE)
            self._fail(advice(error, ''))

        self._tasks.run(_LINE, command, on_result, on_error)

    def _not_stopped(self, error: Exception) -> None:
        """Where the recorder answers that it cannot stop as it should, it has ended already."""
        path = self._path
        if isinstance(error, RecorderError) and not isinstance(error, RecorderUnreachable):
            self._ended(list(self._snapshot.files))
        else:
            self._answer(Phase.RECORDING)
        self._fail(advice(error, path))

    def _started(self, path: str) -> None:
        if self._phase is Phase.OFF:
            self._left = path  # the run is ending, and finishes it
            return
        self._path = path
        self._clock.restart()
        self._snapshot = self._snapshot._replace(phase='recording', files=(path,), problems=(),
                                                 messages=0, bytes=0, dropped=0, lost=0)
        self._answer(Phase.RECORDING)

    def _ended(self, files: List[str]) -> None:
        self._path = ''
        self._finished = FinishedBag(tuple(files), self._snapshot.problems)
        self._complete_figures(self._snapshot)
        self.verdict.look_at(files)
        self.choices.look()
        self._answer(Phase.IDLE)
        if files:
            self.finished.emit(files[0])

    def _mark_failed(self, entry: Tuple[float, str], error: Exception) -> None:
        if entry in self._marks:
            self._marks.remove(entry)
        self._fail(f'{entry[1]} was not written: {advice(error, self._path)}')

    # How states change the phase

    def _is_late(self, snapshot: RecorderSnapshot) -> bool:
        """Whether it was sent before the answer to the last command, which came faster."""
        if self._now_s() - self._answered_s > _LATE_S:
            return False
        if self._path:
            return self._path not in snapshot.files
        return (self._finished is not None and snapshot.phase != 'idle'
                and snapshot.files == self._finished.files)

    def _follow(self, told: Phase) -> None:
        """Take the phase that the recorder tells, but while a command waits for its answer."""
        before, path = self._phase, self._path
        if not self._is_asked:
            self._phase = told
        if self._phase is Phase.RECORDING:
            self._path = self._snapshot.files[0] if self._snapshot.files else path
        if self._phase is Phase.RECORDING and before in (Phase.IDLE, Phase.WAITING):
            self._clock.restart()  # somebody else has started it
        self._clock.take(self._snapshot.duration_s, self._phase is Phase.RECORDING)
        if path and self._phase is Phase.IDLE:
            self._ended_by_itself(path)

    def _complete_figures(self, snapshot: RecorderSnapshot) -> None:
        """The last figures of a recording come with the first state after it."""
        done = self._finished
        if done is not None and snapshot.phase == 'idle' and snapshot.files == done.files:
            self._finished = done._replace(figures=figures_of(snapshot))

    def _ended_by_itself(self, path: str) -> None:
        if path not in self._snapshot.files:
            self._path = ''
            self._fail(f'the recorder was started anew while it recorded. {repair(path)}')
            return
        self._ended(list(self._snapshot.files))
        if self._snapshot.problems:
            self._fail(f'the recording has ended by itself: {self._snapshot.problems[-1]}')

    def _tell_left(self, path: str, is_there: bool) -> None:
        if is_there:
            self._finished = FinishedBag((path,))
            self.verdict.look_at([path])
            self.finished.emit(path)
        else:
            self._fail(f'the recorder could not finish its bag. {repair(path)}')

    def _recorder_is_gone(self) -> None:
        path, self._path = self._path, ''
        self._enter(Phase.GONE)
        if path:
            self._fail(f'the recorder does not answer any more. {repair(path)}. Quit all nodes '
                       'and launch again to go on')

    # Small things

    def _problem_before(self, options: RecordingOptions) -> str:
        if self._phase in (Phase.STARTING, Phase.RECORDING, Phase.STOPPING):
            return ''
        if self._phase in (Phase.OFF, Phase.WAITING):
            return 'nothing to record with: launch the devices in real-time mode first'
        if self._phase is Phase.GONE:
            return 'the recorder does not answer; quit all nodes and launch again'
        if not options.topics:
            return 'no topic is ticked; open the list of topics and tick what is to be recorded'
        return self.choices.problem

    def _forget(self) -> None:
        self._error, self._finished = '', None
        self._marks.clear()

    def _fail(self, message: str) -> None:
        self._error = message
        self.changed.emit()
        self.failed.emit(message)

    def _ask(self, phase: Phase) -> None:
        self._is_asked = True
        self._enter(phase)

    def _answer(self, phase: Phase) -> None:
        self._is_asked, self._answered_s = False, self._now_s()
        self._enter(Phase.OFF if self._phase is Phase.OFF else phase)

    def _enter(self, phase: Phase) -> None:
        self._phase = phase
        self.changed.emit()
