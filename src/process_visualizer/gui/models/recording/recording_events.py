# SPDX-License-Identifier: BSD-3-Clause
"""Reports on changes of a recording's state: bags that are finished, failures."""
from __future__ import annotations

from typing import NamedTuple, Optional, Sequence, Tuple

from process_visualizer.gui.models.recording.recording_advice import repair
from process_visualizer.gui.models.recording.recording_clock import RecordingClock
from process_visualizer.gui.models.recording.recording_state import RecordingState
from process_visualizer.gui.models.recording.recording_types import (
    FinishedBag,
    Phase,
    figures_of,
)
from process_visualizer.gui.ros.snapshots import RecorderSnapshot


class Step(NamedTuple):
    """The next state; the files of a recording that has ended (else None); what failed, or ''."""

    state: RecordingState
    ended: Optional[Tuple[str, ...]] = None
    failure: str = ''


def failed(state: RecordingState, message: str) -> Step:
    """Return the step to what the operator is to be told."""
    return Step(state._replace(error=message), None, message)


def updated(state: RecordingState, snapshot: RecorderSnapshot, now_s: float) -> Step:
    """Return the step after the recorder told its state, which is not late."""
    after = _followed(state, snapshot, now_s)
    if state.path and after.phase is Phase.IDLE:
        return _ended_by_itself(after, now_s)
    return Step(_with_last_figures(after))


def ended(state: RecordingState, files: Sequence[str], now_s: float) -> Step:
    """Return the step after the recorder told which files are finished; there may be none."""
    bag = FinishedBag(tuple(files), state.snapshot.problems) if files else None
    left = '' if state.left in files else state.left
    after = state._replace(path='', left=left, finished=bag, ended=state.ended.union(files))
    after = after.answered(Phase.IDLE, now_s)
    return Step(_with_last_figures(after), None if bag is None else bag.files)


def gone(state: RecordingState) -> Step:
    """Return the step after the recorder's process has ended; ``left`` is to be looked at."""
    return Step(state._replace(phase=Phase.GONE, path='', left=state.path, is_silent=False))


def left_behind(state: RecordingState, path: str, is_there: bool) -> Step:
    """Return the step after the look whether a recorder that has ended has finished its bag."""
    if not is_there:
        return failed(state, f'the recorder ended before its bag was finished. {repair(path)}')
    return Step(state._replace(finished=FinishedBag((path,)),
                               ended=state.ended.union((path,))), (path,))


def _followed(state: RecordingState, snapshot: RecorderSnapshot, now_s: float) -> RecordingState:
    """Take the phase that the recorder tells, but while a command waits for its answer."""
    phase = state.phase if state.is_asked else Phase(snapshot.phase)
    is_recording = phase is Phase.RECORDING
    path, clock, marks = state.path, state.clock, state.marks
    if is_recording and snapshot.files:
        path = snapshot.files[0]
    if path != state.path:  # somebody else has started it
        clock, marks = RecordingClock(), ()
    return state._replace(phase=phase, path=path, marks=marks, snapshot=snapshot, is_silent=False,
                          clock=clock.updated(snapshot.duration_s, is_recording, now_s))


def _ended_by_itself(state: RecordingState, now_s: float) -> Step:
    snapshot = state.snapshot
    if state.path not in snapshot.files:
        return Step(_with_last_figures(state._replace(path='', left=state.path)))
    step = ended(state, snapshot.files, now_s)
    if not snapshot.problems:
        return step
    message = f'the recording has ended by itself: {snapshot.problems[-1]}'
    return step._replace(state=step.state._replace(error=message), failure=message)


def _with_last_figures(state: RecordingState) -> RecordingState:
    """The last figures of a recording come with the first state after it."""
    bag, snapshot = state.finished, state.snapshot
    if bag is None or snapshot.phase != 'idle' or snapshot.files != bag.files:
        return state
    return state._replace(finished=bag._replace(figures=figures_of(snapshot)))
