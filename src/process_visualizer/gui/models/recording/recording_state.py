# SPDX-License-Identifier: BSD-3-Clause
"""The state of a recording, as a value, and what commands make of it."""
from __future__ import annotations

from typing import FrozenSet, NamedTuple, Optional, Tuple

from process_visualizer.gui.models.recording.recording_clock import RecordingClock
from process_visualizer.gui.models.recording.recording_types import (
    Figures,
    FinishedBag,
    Mark,
    Phase,
    figures_of,
)
from process_visualizer.gui.ros.snapshots import RecorderSnapshot

RECENT_S = 30.0
"""What the recorder keeps in memory (its parameter ~recent_duration)."""
NOTHING_TOLD = RecorderSnapshot('idle')
_LATE_S = 0.1
"""How much later than it was a state may seem to be sent."""


class RecordingState(NamedTuple):
    """All that the operator sees of recording; times are those of one monotonic clock.

    ``is_asked``: a command waits for its answer, so what the recorder tells changes no phase.
    ``is_silent``: a recorder that runs tells nothing at present; what it did, it may go on doing.
    ``path`` is the recording that is made, or ''; ``left`` what was recorded when the run was told
    to end, or when the recorder ended, or ''; ``ended`` are the files of all that ended in this
    run. ``finished`` and ``error`` are shown until the next command. ``label`` is that of the next
    mark, or ''.
    ``snapshot`` is what the recorder said last, ``answered_s`` when a command was answered last.
    """

    phase: Phase = Phase.OFF
    is_asked: bool = False
    is_silent: bool = False
    path: str = ''
    left: str = ''
    ended: FrozenSet[str] = frozenset()
    finished: Optional[FinishedBag] = None
    error: str = ''
    marks: Tuple[Mark, ...] = ()
    label: str = ''
    snapshot: RecorderSnapshot = NOTHING_TOLD
    clock: RecordingClock = RecordingClock()
    answered_s: float = float('-inf')

    # What follows from it

    @property
    def is_busy(self) -> bool:
        """Return whether a recording is being made (then the window may not just be closed)."""
        return self.phase in (Phase.STARTING, Phase.RECORDING, Phase.STOPPING)

    @property
    def is_made(self) -> bool:
        """Return whether there is a recording of which the recorder tells figures."""
        return bool(self.path) and self.phase in (Phase.RECORDING, Phase.STOPPING)

    @property
    def is_saving(self) -> bool:
        """Return whether the last seconds are being written."""
        return self.phase is Phase.STOPPING and not self.path

    @property
    def figures(self) -> Optional[Figures]:
        """Those of the recording that is made or was made last, which ``finished`` names.

        None where there is none: what the recorder counts meanwhile belongs to no recording.
        """
        if self.is_made:
            return figures_of(self.snapshot)
        return None if self.finished is None else self.finished.figures

    @property
    def next_label(self) -> str:
        """The label of the next mark, if the operator gives none."""
        return f'mark {len(self.marks) + 1}'

    @property
    def recent_s(self) -> float:
        """Return how much of the past can be saved now, at most the last 30 s."""
        return min(self.snapshot.recent_s, RECENT_S) if self.phase is Phase.IDLE else 0.0

    def elapsed_s(self, now_s: float) -> float:
        """Return the time since the recording began, or how long the last one was."""
        if self.is_made:
            return self.clock.elapsed_s(now_s)
        return 0.0 if self.figures is None else self.figures.duration_s

    def is_late(self, snapshot: RecorderSnapshot, sent_s: float) -> bool:
        """Return whether it was sent before the answer to the last command, which came faster."""
        if sent_s - self.answered_s > _LATE_S:
            return False
        if self.path:
            return self.path not in snapshot.files
        return snapshot.phase != 'idle' and not self.ended.isdisjoint(snapshot.files)

    # What becomes of it

    def run(self, is_running: bool) -> 'RecordingState':
        """Return the state after a recorder was launched, or has ended with its run."""
        return self._replace(
            phase=Phase.WAITING if is_running else Phase.OFF, is_asked=False, is_silent=False,
            path='', left='' if is_running else self.path, ended=frozenset(), error='',
            snapshot=NOTHING_TOLD, clock=RecordingClock())

    def asked_to_write(self, phase: Phase) -> 'RecordingState':
        """Return the state after the command to begin a bag: what was before is forgotten."""
        return self.dismissed()._replace(phase=phase, is_asked=True, marks=())

    def asked_to_stop(self, now_s: float) -> 'RecordingState':
        """Return the state after the command to stop."""
        clock = self.clock.updated(self.elapsed_s(now_s), False, now_s)
        return self._replace(phase=Phase.STOPPING, is_asked=True, error='', clock=clock)

    def answered(self, phase: Phase, now_s: float) -> 'RecordingState':
        """Return the state after a command was answered; where no recorder is launched, OFF."""
        return self._replace(phase=Phase.OFF if self.phase is Phase.OFF else phase,
                             is_asked=False, answered_s=now_s)

    def started(self, path: str, now_s: float) -> 'RecordingState':
        """Return the state after the recorder told which file it records."""
        if self.phase is Phase.OFF:
            return self._replace(left=path)  # the run is ending, and finishes it
        snapshot = self.snapshot._replace(phase='recording', files=(path,), problems=(),
                                          messages=0, bytes=0, dropped=0, lost=0)
        clock = RecordingClock().updated(0.0, True, now_s)
        return self._replace(path=path, snapshot=snapshot, clock=clock).answered(
            Phase.RECORDING, now_s)

    def refused(self, phase: Phase, now_s: float) -> 'RecordingState':
        """Return the state after a command failed: as before, but where the recorder is gone."""
        is_there = self.is_asked and self.phase is not Phase.GONE
        return self.answered(phase if is_there else self.phase, now_s)

    def marked(self, now_s: float) -> 'RecordingState':
        """Return the state with one mark more, which has the prepared label or a number."""
        mark = Mark(self.elapsed_s(now_s), self.label or self.next_label)
        return self._replace(marks=(*self.marks, mark), label='')

    def not_marked(self, mark: Mark) -> 'RecordingState':
        """Return the state after the recorder did not take this mark."""
        return self._replace(marks=tuple(it for it in self.marks if it is not mark))

    def dismissed(self) -> 'RecordingState':
        """Return the state after the operator has seen the finished bag or the error."""
        return self._replace(error='', finished=None)
