# SPDX-License-Identifier: BSD-3-Clause
"""The state of recording, its changes by commands and reports, and why a command is refused."""
from __future__ import annotations

from typing import Callable, FrozenSet, NamedTuple, Optional, Sequence, Tuple

from process_visualizer.clients.bag_recorder import (
    RecorderError,
    RecorderUnreachable,
    RecordingOptions,
)
from process_visualizer.figures import count_text
from process_visualizer.gui.recording.recording_choices import look_at
from process_visualizer.gui.recording.recording_types import (
    Figures,
    FinishedBag,
    RecordedMark,
    RecordingClock,
    RecordingPhase,
    figures_of,
)
from process_visualizer.gui.ros.snapshots import RecorderSnapshot

RECENT_S = 30.0
"""Length of the recorder's memory (its parameter ~recent_duration)."""
NOT_RESPONDING = 'The recorder is not responding'
"""For a recorder that runs but does not report at present, which is no reason to end it."""
NOTHING_TOLD = RecorderSnapshot('idle')
_MIN_RECENT_S = 1.0
_HOLE_S, _MEASURED_S = 1.5, 4.0
"""Report gap that counts as abnormal [s], and the time after it until reported rates are valid [s].

Reports arrive every half second. The recorder measures rates once a second, and the first
measurement after it hung covers that time.
"""
_SENT_ERROR_S = 0.1
"""Maximum error of the estimated time at which a state was sent [s]."""


class RecordingState(NamedTuple):
    """Everything that the operator sees of recording; times are on one monotonic clock.

    ``is_asked``: a command waits for its answer, so reports of the recorder change no phase.
    ``is_silent``: the running recorder does not report at present; it may still be recording.
    ``path`` is the current recording, or ''. ``left`` is the recording that was being made when the
    end of the run was requested, or when the recorder ended, or ''. ``ended`` are the files of all
    recordings that ended in this run. ``finished`` and ``error`` are shown until the next command.
    ``unfinished`` is the recording that its recorder did not finish, which ``error`` is about, or
    ''; ``recovered`` is the finished share of its recovery (0 to 1), None while there is none.
    ``refused_options`` are the options of the failed command that ``error`` is about; None if
    ``error`` is about something else. ``label`` is the label of the next mark, or ''.
    ``snapshot`` is the recorder's last report, without rates once the recorder is silent.
    ``answered_s`` is the time of the last answer to a command, ``heard_s`` that of the last report;
    ``rated_s`` is the time after which reported rates are valid.
    """

    phase: RecordingPhase = RecordingPhase.OFF
    is_asked: bool = False
    is_silent: bool = False
    path: str = ''
    left: str = ''
    ended: FrozenSet[str] = frozenset()
    finished: Optional[FinishedBag] = None
    error: str = ''
    unfinished: str = ''
    recovered: Optional[float] = None
    refused_options: Optional[RecordingOptions] = None
    marks: Tuple[RecordedMark, ...] = ()
    label: str = ''
    snapshot: RecorderSnapshot = NOTHING_TOLD
    clock: RecordingClock = RecordingClock()
    answered_s: float = float('-inf')
    heard_s: Optional[float] = None
    rated_s: float = float('-inf')

    # Properties

    @property
    def is_busy(self) -> bool:
        """Return whether a recording is being made (closing the window then asks first)."""
        return self.phase in (
            RecordingPhase.STARTING,
            RecordingPhase.RECORDING,
            RecordingPhase.STOPPING,
        )

    @property
    def is_made(self) -> bool:
        """Return whether there is a recording on which the recorder reports figures."""
        return bool(self.path) and self.phase in (RecordingPhase.RECORDING, RecordingPhase.STOPPING)

    @property
    def is_saving(self) -> bool:
        """Return whether the last seconds are being written."""
        return self.phase is RecordingPhase.STOPPING and not self.path

    @property
    def figures(self) -> Optional[Figures]:
        """The figures of the current recording or of the last one (``finished``).

        None without a recording: the recorder's counts then belong to no recording.
        """
        if self.is_made:
            return figures_of(self.snapshot)
        return None if self.finished is None else self.finished.figures

    @property
    def next_label(self) -> str:
        """The label of the next mark if the operator gives none."""
        return f'mark {len(self.marks) + 1}'

    @property
    def recent_s(self) -> float:
        """The length of the past that can be saved now [s], at most the last 30 s."""
        can_save = self.phase is RecordingPhase.IDLE and not self.is_silent
        return min(self.snapshot.recent_s, RECENT_S) if can_save else 0.0

    @property
    def save_obstacle(self) -> str:
        """Return why the last seconds cannot be saved now; empty if they can."""
        if self.recent_s >= _MIN_RECENT_S:
            return ''
        if self.is_silent:
            return f'{NOT_RESPONDING}. Save when it responds'
        if self.is_busy:
            return 'Possible when nothing is being recorded'
        if self.phase is RecordingPhase.IDLE:
            return 'The recorder has received nothing yet'
        return 'Possible while the devices run in real-time mode'

    def elapsed_s(self, now_s: float) -> float:
        """Return the time since the recording began, or the length of the last recording [s]."""
        if self.is_made:
            return self.clock.elapsed_s(now_s)
        return 0.0 if self.figures is None else self.figures.duration_s

    @property
    def unwritten(self) -> Tuple[RecordedMark, ...]:
        """The marks that the recorder has not accepted yet."""
        return tuple(it for it in self.marks if not it.is_written) if self.is_made else ()

    def is_outdated(self, snapshot: RecorderSnapshot, sent_s: float) -> bool:
        """Return whether a report was sent before the last command's answer, which overtook it."""
        if sent_s - self.answered_s > _SENT_ERROR_S:
            return False
        if self.path:
            return self.path not in snapshot.files
        return snapshot.phase != 'idle' and not self.ended.isdisjoint(snapshot.files)

    # Changes

    def run(self, is_running: bool) -> 'RecordingState':
        """Return the state after a recorder was launched, or has ended with its run."""
        return self._replace(
            phase=RecordingPhase.WAITING if is_running else RecordingPhase.OFF,
            is_asked=False,
            is_silent=False,
            path='',
            left='' if is_running else self.path,
            ended=frozenset(),
            error=self.error if self.unfinished else '',
            refused_options=None,
            snapshot=NOTHING_TOLD,
            clock=RecordingClock(),
            heard_s=None,
            rated_s=float('-inf'),
        )

    def asked_to_write(self, phase: RecordingPhase) -> 'RecordingState':
        """Return the state after the command to begin a bag; marks and notices are cleared."""
        return self.dismissed()._replace(phase=phase, is_asked=True, marks=())

    def asked_to_stop(self, now_s: float) -> 'RecordingState':
        """Return the state after the command to stop."""
        clock = self.clock.updated(self.elapsed_s(now_s), False, now_s)
        return self._replace(phase=RecordingPhase.STOPPING, is_asked=True, error='',
                             refused_options=None, clock=clock)

    def answered(self, phase: RecordingPhase, now_s: float) -> 'RecordingState':
        """Return the state after a command was answered; OFF stays OFF."""
        return self._replace(
            phase=RecordingPhase.OFF if self.phase is RecordingPhase.OFF else phase,
            is_asked=False,
            answered_s=now_s,
        )

    def started(self, path: str, now_s: float) -> 'RecordingState':
        """Return the state after the recorder reported which file it records."""
        if self.phase is RecordingPhase.OFF:
            return self._replace(left=path)  # the run is ending, and finishes the recording
        snapshot = self.snapshot._replace(phase='recording', files=(path,), problems=(),
                                          messages=0, bytes=0, dropped=0, lost=0)
        clock = RecordingClock().updated(0.0, True, now_s)
        return self._replace(path=path, snapshot=snapshot, clock=clock).answered(
            RecordingPhase.RECORDING, now_s)

    def refused(self, phase: RecordingPhase, now_s: float) -> 'RecordingState':
        """Return the state after a command failed: in ``phase`` unless the recorder is gone."""
        is_there = self.is_asked and self.phase is not RecordingPhase.GONE
        return self.answered(phase if is_there else self.phase, now_s)

    def marked(self, now_s: float, stamp_s: float = 0.0, age_s: float = 0.0) -> 'RecordingState':
        """Return the state with another mark, with the set label or a number.

        The marked moment was ``age_s`` ago, at most since the recording began.
        """
        moment_s = self._moment_s(now_s, stamp_s)
        age_s = min(max(age_s, 0.0), moment_s)
        mark = RecordedMark(moment_s - age_s, self.label or self.next_label,
                            stamp_s - age_s if stamp_s else 0.0)
        return self._replace(marks=(*self.marks, mark), label='')

    def _moment_s(self, now_s: float, stamp_s: float) -> float:
        """Return the time since the recording began [s], as the bag will have it if possible.

        Reports may be seconds late, so those of the recorder's clock count, not their arrival.
        """
        report = self.snapshot
        if not stamp_s or report.phase != RecordingPhase.RECORDING.value \
                or self.path not in report.files:
            return self.clock.moment_s(now_s)
        return max(report.duration_s + stamp_s - report.stamp_s, 0.0)

    def mark_written(self, mark: RecordedMark) -> 'RecordingState':
        """Return the state after the recorder accepted this mark."""
        return self._replace(marks=tuple(it._replace(is_written=True) if it is mark else it
                                         for it in self.marks))

    def not_marked(self, *lost: RecordedMark) -> 'RecordingState':
        """Return the state after the recorder did not accept these marks."""
        return self._replace(marks=tuple(
            it for it in self.marks if not any(it is mark for mark in lost)))

    def unheard(self) -> 'RecordingState':
        """Return the state after a long silence of the recorder: rates are not known."""
        return self._replace(is_silent=True, snapshot=self.snapshot._replace(
            rate=0.0, time_left_s=None, topics=()))

    def dismissed(self) -> 'RecordingState':
        """Return the state after the operator has seen the finished bag or the error."""
        unfinished = '' if self.recovered is None else self.unfinished
        return self._replace(error='', unfinished=unfinished, refused_options=None, finished=None)

    def seen(self) -> 'RecordingState':
        """Return the dismissed state; a bag finished before a refused command is kept."""
        is_before = self.refused_options is not None
        return self.dismissed()._replace(finished=self.finished if is_before else None)

    def chosen(self, options: RecordingOptions) -> 'RecordingState':
        """Return the state after a choice: an error about other options is removed."""
        is_other = self.refused_options not in (None, options)
        return self._replace(error='', refused_options=None) if is_other else self

    def recovering(self, share: float) -> 'RecordingState':
        """Return the state while a finished bag is made of ``unfinished``."""
        return self._replace(recovered=share)


# Advice for an operator whose command cannot be carried out.

def checked(command: Callable[[RecordingOptions], str], options: RecordingOptions) -> str:
    """Run a command unless there is a problem with the disk; off the GUI thread.

    Raises:
        RecorderError: there is a problem with the disk, or the command is refused.
    """
    problem = look_at(options.folder, options.name, options.prefix).problem
    if problem:
        raise RecorderError(problem)
    return command(options)


def obstacle(
    phase: RecordingPhase, is_silent: bool, options: RecordingOptions, problem: str
) -> str:
    """Return why recording is not possible, or ''; ``problem`` is about name and folder."""
    if phase in (RecordingPhase.STARTING, RecordingPhase.RECORDING, RecordingPhase.STOPPING):
        return ''
    if phase in (RecordingPhase.OFF, RecordingPhase.WAITING):
        return 'the recorder is not running; launch the devices in real-time mode first'
    if phase is RecordingPhase.GONE:
        return 'the recorder has ended; restart it from its alarm'
    if is_silent:
        return f'{NOT_RESPONDING}. Start when it responds'
    if not options.topics:
        return 'no topic is ticked; open the list of topics and tick what is to be recorded'
    return problem


def repair(path: str) -> str:
    """Return advice for a file that the recorder has not finished."""
    return (f'Its data is in {active(path)}; Recover on the tab Recording (or "rosrun '
            f'process_visualizer cell reindex {active(path)}") makes a bag of it')


def active(path: str) -> str:
    """Return the path of a recording while the recorder writes it."""
    return f'{path}.active'


def advice(error: Exception, path: str) -> str:
    """Return the message for the operator; an unexpected error is raised again."""
    if isinstance(error, RecorderUnreachable):
        going_on = f'{path} is still being recorded. ' if path else ''
        return f'{error}. {going_on}Try again when it responds'
    if isinstance(error, (RecorderError, OSError)):
        return str(error)
    raise error


class RecordingStep(NamedTuple):
    """The next state; the files of an ended recording, else None; the failure, or ''."""

    state: RecordingState
    ended: Optional[Tuple[str, ...]] = None
    failure: str = ''


def failed(state: RecordingState, message: str, refused: Optional[RecordingOptions] = None
           ) -> RecordingStep:
    """Return the step with an error message; ``refused`` are the refused options, if any."""
    return RecordingStep(state._replace(error=message, refused_options=refused), None, message)


def updated(state: RecordingState, snapshot: RecorderSnapshot, now_s: float) -> RecordingStep:
    """Return the step after a report of the recorder that is not outdated."""
    after = _followed(state, snapshot, now_s)
    if state.path and after.phase is RecordingPhase.IDLE:
        return _ended_by_itself(after, now_s)
    return RecordingStep(_with_last_figures(after))


def ended(state: RecordingState, files: Sequence[str], now_s: float) -> RecordingStep:
    """Return the step after the recorder reported the finished files, possibly none.

    An outdated report may have looked like a recording; files that ended before are not announced
    again.
    """
    is_known = state.path not in ('', *files) and state.ended.issuperset(files)
    bag = FinishedBag(tuple(files), state.snapshot.problems) if files and not is_known else None
    left = '' if state.left in files else state.left
    after = state._replace(path='', left=left, finished=state.finished if is_known else bag,
                           ended=state.ended.union(files))
    after = after.answered(RecordingPhase.IDLE, now_s)
    return RecordingStep(_with_last_figures(after), None if bag is None else bag.files)


def gone(state: RecordingState) -> RecordingStep:
    """Return the step after the recorder's process has ended; ``left`` must be checked."""
    left = _files_of(state, state.path)[-1]  # the earlier files of a split recording are complete
    return RecordingStep(state.unheard()._replace(phase=RecordingPhase.GONE, path='', left=left,
                                                  is_silent=False))


def _files_of(state: RecordingState, path: str) -> Tuple[str, ...]:
    """Return the files of the recording that has this one, in the order of time."""
    files = state.snapshot.files
    return files if path in files else (path,)


def left_behind(state: RecordingState, path: str, is_there: bool) -> RecordingStep:
    """Return the step after the check whether an ended recorder has finished its bag."""
    if not is_there:
        count = len(_files_of(state, path)) - 1
        said = 'the recorder ended before its bag was finished. ' + (
            f'{count_text(count, "earlier file")} of it {"is" if count == 1 else "are"} complete. '
            if count else '') + repair(path)
        return failed(state._replace(unfinished=path), said)
    files = _files_of(state, path)
    return RecordingStep(state._replace(finished=FinishedBag(files),
                                        ended=state.ended.union(files)), files)


def recovered(state: RecordingState, path: str, said: str) -> RecordingStep:
    """Return the step after ``path`` was made of the unfinished recording; ``said``: how much."""
    return RecordingStep(
        state.dismissed()._replace(recovered=None, unfinished='',
                                   finished=FinishedBag((path,), recovery=said),
                                   ended=state.ended.union((path,))), (path,))


def not_recovered(state: RecordingState, message: str) -> RecordingStep:
    """Return the step after a failed recovery, which can be tried again."""
    return failed(state._replace(recovered=None), message)


def _followed(state: RecordingState, snapshot: RecorderSnapshot, now_s: float) -> RecordingState:
    """Return the state with a report; its phase counts only if no command waits for its answer."""
    phase = state.phase if state.is_asked else RecordingPhase(snapshot.phase)
    is_recording = phase is RecordingPhase.RECORDING
    path, clock, marks = state.path, state.clock, state.marks
    if is_recording and snapshot.files:
        path = snapshot.files[0]
    if path != state.path:  # started by another client
        clock, marks = RecordingClock(), ()
    rated_s = state.rated_s
    if state.heard_s is not None and now_s - state.heard_s > _HOLE_S:
        rated_s = now_s + _MEASURED_S
    if now_s < rated_s:
        snapshot = snapshot._replace(rate=0.0, time_left_s=None)
    return state._replace(phase=phase, path=path, marks=marks, snapshot=snapshot, is_silent=False,
                          heard_s=now_s, rated_s=rated_s,
                          clock=clock.updated(snapshot.duration_s, is_recording, now_s))


def _ended_by_itself(state: RecordingState, now_s: float) -> RecordingStep:
    snapshot = state.snapshot
    if state.path not in snapshot.files:
        return RecordingStep(_with_last_figures(state._replace(path='', left=state.path)))
    step = ended(state, snapshot.files, now_s)
    if not snapshot.problems:
        return step
    problem = snapshot.problems[-1]
    message = problem if 'recording was stopped' in problem else \
        f'the recording has stopped: {problem}'
    return step._replace(state=step.state._replace(error=message), failure=message)


def _with_last_figures(state: RecordingState) -> RecordingState:
    """Return the state with the last figures and problems, from the first idle report."""
    bag, snapshot = state.finished, state.snapshot
    if bag is None or snapshot.phase != 'idle' or snapshot.files != bag.files:
        return state
    problems = snapshot.problems if bag.figures is None else bag.problems
    return state._replace(finished=bag._replace(figures=figures_of(snapshot), problems=problems))
