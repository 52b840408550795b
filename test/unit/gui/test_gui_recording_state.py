# SPDX-License-Identifier: BSD-3-Clause
"""The state of a recording after any sequence of commands, answers and recorder states.

A simple model of a recorder receives commands, ends by itself, is used by another user, falls
silent and ends with its run. Its states may arrive after the answer to a later command.
"""
from __future__ import annotations

from typing import Callable, Dict, List, Optional, Tuple

from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import (
    RuleBasedStateMachine,
    initialize,
    invariant,
    precondition,
    rule,
)

from process_visualizer.gui.recording import recording_state as events
from process_visualizer.gui.recording.recording_choices import DiskRoom, disk_room
from process_visualizer.gui.recording.recording_state import RecordingState
from process_visualizer.gui.recording.recording_types import (
    FinishedBag,
    RecordedMark,
    RecordingClock,
    RecordingPhase,
)
from process_visualizer.gui.ros.snapshots import RecorderSnapshot

BAG = '/bags/seam.bag'


class Recorder:
    """The behavior of the recorder node, without delays."""

    def __init__(self) -> None:
        self.files: Tuple[str, ...] = ()
        self.is_recording = False
        self.begun_s = self.ended_s = 0.0
        self.problems: Tuple[str, ...] = ()
        self._count = 0

    def start(self, now_s: float) -> str:
        self._count += 1
        self.files, self.problems = (f'/bags/{self._count}.bag',), ()
        self.is_recording, self.begun_s = True, now_s
        return self.files[0]

    def end(self, now_s: float, *problems: str) -> List[str]:
        self.is_recording, self.ended_s, self.problems = False, now_s, problems
        return list(self.files)

    def state(self, now_s: float) -> RecorderSnapshot:
        end_s = now_s if self.is_recording else self.ended_s
        return RecorderSnapshot('recording' if self.is_recording else 'idle', self.files,
                                end_s - self.begun_s, problems=self.problems, recent_s=30.0)

    def restart(self) -> None:
        """Start a new process: it has no memory, and no bag name from before."""
        self.files, self.is_recording, self.problems = (), False, ()


def test_a_late_state_of_an_older_recording_does_not_end_the_newest_bag_twice() -> None:
    """Another user recorded a bag just before the last seconds were saved."""
    old = RecorderSnapshot('recording', ('/bags/old.bag',), 3.0)
    asked = RecordingState().run(True).asked_to_write(RecordingPhase.STOPPING)
    saved = events.ended(asked, [BAG], 100.0)
    assert saved.ended == (BAG,)
    late = events.updated(saved.state, old, 100.05).state
    again = events.ended(late.asked_to_stop(100.06), [BAG], 100.07)
    assert again.ended is None and again.state.finished == saved.state.finished
    assert again.state.phase is RecordingPhase.IDLE


def test_after_the_recorder_stood_still_its_rates_are_not_believed_at_once() -> None:
    """Its first measurement afterward covers the time in which it received nothing."""
    state = RecordingState().run(True)

    def rates(now_s: float, rate: float) -> Tuple[float, Optional[float]]:
        nonlocal state
        state = events.updated(state, RecorderSnapshot(
            'recording', (BAG,), now_s, rate=rate, time_left_s=1e9 / rate), now_s).state
        return state.snapshot.rate, state.snapshot.time_left_s

    assert rates(10.0, 1e6) == (1e6, 1000.0)
    assert rates(10.5, 1e6) == (1e6, 1000.0)
    state = state.unheard()
    assert rates(18.0, 1e5) == (0.0, None)
    assert [rates(18.5 + 0.5 * it, 1e5) for it in range(7)] == 7 * [(0.0, None)]
    assert rates(22.0, 1e6) == (1e6, 1000.0)


def test_a_name_that_is_recorded_once_more_is_announced_once_more() -> None:
    """The first bag was moved away; its name is free again."""
    state = RecordingState().run(True)
    for begin_s in (100.0, 200.0):
        state = state.asked_to_write(RecordingPhase.STARTING).started(BAG, begin_s)
        step = events.ended(state.asked_to_stop(begin_s + 9.0), [BAG], begin_s + 9.1)
        assert step.ended == (BAG,)
        state = step.state
    saved = events.ended(state.asked_to_write(RecordingPhase.STOPPING), [BAG], 300.0)
    assert saved.ended == (BAG,)


class Sequences(RuleBasedStateMachine):
    """The state as the model updates it, together with a recorder."""

    def __init__(self) -> None:
        super().__init__()
        self.now_s = 100.0
        self.recorder = Recorder()
        self.state = RecordingState()
        self.sent: List[Tuple[float, RecorderSnapshot]] = []
        self.answer: Optional[Callable[[], events.RecordingStep]] = None
        self.finished: List[str] = []
        self.marked_in: Dict[int, Tuple[RecordedMark, str]] = {}
        self.shown: Tuple[str, float] = ('', 0.0)

    # The run

    @initialize()
    def launch(self) -> None:
        self.recorder.restart()
        self.take(events.RecordingStep(self.state.run(True)))
        self.hear()

    @precondition(lambda self: self.is_quiet)
    @rule(is_there=st.booleans())
    def launch_again(self, is_there: bool) -> None:
        self.end_run()
        path, self.state = self.state.left, self.state._replace(left='')
        if path:
            self.take(events.left_behind(self.state, path, is_there))
        self.launch()

    def end_run(self) -> None:
        self.sent.clear()
        self.take(events.RecordingStep(self.state.run(False)))

    @property
    def is_quiet(self) -> bool:
        return self.answer is None

    # Commands of the operator, which the recorder follows at once and answers later

    @precondition(lambda self: self.state.phase is RecordingPhase.IDLE and self.is_quiet)
    @rule(is_refused=st.booleans(), is_saving=st.booleans(), is_quick=st.booleans())
    def write(self, is_refused: bool, is_saving: bool, is_quick: bool) -> None:
        self.take(events.RecordingStep(self.state.asked_to_write(
            RecordingPhase.STOPPING if is_saving else RecordingPhase.STARTING)))
        if is_refused or self.recorder.is_recording:
            self.answer = self.refuse
        else:
            self.answer = self.write_bag(is_saving)
        if is_quick:
            self.hear_answer()

    def write_bag(self, is_saving: bool) -> Callable[[], events.RecordingStep]:
        path = self.recorder.start(self.now_s)
        if is_saving:
            self.recorder.end(self.now_s)
        self.tell()
        if is_saving:
            return lambda: events.ended(self.state, [path], self.now_s)
        return lambda: events.RecordingStep(self.state.started(path, self.now_s))

    def refuse(self) -> events.RecordingStep:
        was_gone = self.state.phase is RecordingPhase.GONE
        step = events.RecordingStep(self.state.refused(RecordingPhase.IDLE, self.now_s))
        assert step.state.phase in (RecordingPhase.IDLE, RecordingPhase.OFF) or was_gone
        return step

    @precondition(lambda self: self.state.phase is RecordingPhase.RECORDING and self.is_quiet)
    @rule(is_reached=st.booleans(), is_quick=st.booleans())
    def stop(self, is_reached: bool, is_quick: bool) -> None:
        self.take(events.RecordingStep(self.state.asked_to_stop(self.now_s)))
        if is_reached:
            files = self.recorder.end(self.now_s)
            self.tell()
            self.answer = lambda: events.ended(self.state, files, self.now_s)
        else:
            self.answer = lambda: events.RecordingStep(
                self.state.refused(RecordingPhase.RECORDING, self.now_s)
            )
        if is_quick:
            self.hear_answer()

    @precondition(lambda self: self.answer is not None)
    @rule()
    def hear_answer(self) -> None:
        answer, self.answer = self.answer, None
        assert answer is not None
        self.take(answer())
        assert not self.state.is_asked

    @precondition(lambda self: self.state.phase is RecordingPhase.RECORDING)
    @rule(label=st.sampled_from(['', 'it tears']), is_written=st.booleans())
    def mark(self, label: str, is_written: bool) -> None:
        self.state = self.state._replace(label=label)
        before = self.state.marks
        self.take(events.RecordingStep(self.state.marked(self.now_s)))
        mark = self.state.marks[-1]
        assert mark.label and self.state.label == ''
        self.marked_in[id(mark)] = (mark, self.state.path)
        if not is_written:
            self.take(events.RecordingStep(self.state.not_marked(mark)))
            assert self.state.marks == before

    @rule()
    def dismiss(self) -> None:
        self.take(events.RecordingStep(self.state.dismissed()))
        assert self.state.error == '' and self.state.finished is None

    @precondition(lambda self: self.answer is not None)
    @rule(is_there=st.booleans())
    def end_the_run_meanwhile(self, is_there: bool) -> None:
        self.end_run()
        self.hear_answer()
        assert self.state.phase is RecordingPhase.OFF
        self.launch_again(is_there)

    # Actions of the recorder by itself, or for another user

    @precondition(lambda self: self.is_quiet)
    @rule(problems=st.sampled_from([(), ('the disk is full',)]), is_anew=st.booleans())
    def end_or_start_by_itself(self, problems: Tuple[str, ...], is_anew: bool) -> None:
        if is_anew:
            self.recorder.restart()
        elif self.recorder.is_recording:
            self.recorder.end(self.now_s, *problems)
        else:
            self.recorder.start(self.now_s)
        self.tell()

    @precondition(lambda self: self.state.phase is not RecordingPhase.GONE)
    @rule()
    def end(self) -> None:
        self.sent.clear()
        self.take(events.gone(self.state))

    def tell(self) -> None:
        self.sent.append((self.now_s, self.recorder.state(self.now_s)))

    @rule()
    def hear(self) -> None:
        """Receive the oldest state on its way, or the recorder's current one."""
        if not self.sent:
            self.tell()
        sent_s, snapshot = self.sent.pop(0)
        if self.state.is_outdated(snapshot, sent_s):
            return
        was_asked, before = self.state.is_asked, self.state.phase
        self.take(events.updated(self.state, snapshot, self.now_s))
        if was_asked:
            assert self.state.phase is before
        else:
            assert self.state.phase is RecordingPhase(snapshot.phase)

    @rule(seconds=st.floats(0.0, 30.0))
    def wait(self, seconds: float) -> None:
        """Let time pass while states are on their way."""
        self.now_s += seconds

    def take(self, step: events.RecordingStep) -> None:
        if step.failure:
            assert step.state.error == step.failure
        if step.ended is not None:
            assert step.state.finished is not None
            assert step.state.finished.files == step.ended
            self.finished.extend(step.ended[:1])
        self.state = step.state

    # Invariants

    @invariant()
    def a_recording_has_a_path(self) -> None:
        assert self.state.phase is not RecordingPhase.RECORDING or self.state.path

    @invariant()
    def a_finished_bag_is_told_once(self) -> None:
        assert len(self.finished) == len(set(self.finished))

    @invariant()
    def marks_belong_to_the_recording(self) -> None:
        if self.state.path:
            assert {self.marked_in[id(it)][1] for it in self.state.marks} <= {self.state.path}

    @invariant()
    def who_waits_for_an_answer_has_asked(self) -> None:
        assert not self.state.is_asked or self.answer is not None
        assert not self.state.is_asked or self.state.phase in (
            RecordingPhase.STARTING,
            RecordingPhase.STOPPING,
            RecordingPhase.GONE,
        )

    @invariant()
    def nothing_is_recorded_where_nothing_runs(self) -> None:
        if self.state.phase in (
            RecordingPhase.OFF,
            RecordingPhase.WAITING,
            RecordingPhase.IDLE,
            RecordingPhase.GONE,
        ):
            assert self.state.path == '' and not self.state.is_busy

    @invariant()
    def the_clock_of_a_recording_never_goes_back(self) -> None:
        if self.state.phase is not RecordingPhase.RECORDING:
            self.shown = ('', 0.0)
            return
        path, shown_s = self.shown
        self.shown = (self.state.path, self.state.elapsed_s(self.now_s))
        assert path != self.state.path or self.shown[1] >= shown_s


TestSequences = Sequences.TestCase
TestSequences.settings = settings(max_examples=300, stateful_step_count=50)


def recording(**values: object) -> RecordingState:
    """Return the state within a recording of BAG that was answered at 10 s."""
    state = (
        RecordingState(phase=RecordingPhase.IDLE)
        .asked_to_write(RecordingPhase.STARTING)
        .started(BAG, 10.0)
    )
    return state._replace(**values)


def test_a_bag_that_was_stopped_while_the_run_ends_is_not_told_again() -> None:
    state = recording().asked_to_stop(11.0).run(False)
    assert state.left == BAG
    step = events.ended(state, [BAG], 12.0)
    assert step.ended == (BAG,) and step.state.left == '' and step.state.phase is RecordingPhase.OFF


def test_of_a_split_recording_only_the_last_file_can_be_unfinished() -> None:
    files = (BAG, '/bags/b_1.bag', '/bags/b_2.bag')
    dead = events.gone(recording(snapshot=RecorderSnapshot('recording', files))).state
    assert dead.left == files[-1]
    step = events.left_behind(dead, dead.left, False)
    assert step.state.unfinished == files[-1]
    assert '2 earlier files of it are complete' in step.failure
    assert f'Its data is in {files[-1]}.active' in step.failure
    assert events.left_behind(dead, dead.left, True).ended == files


def test_a_stop_that_nobody_answers_does_not_make_a_recording_of_a_recorder_that_is_gone() -> None:
    state = events.gone(recording().asked_to_stop(11.0)).state
    assert state.refused(RecordingPhase.RECORDING, 20.0).phase is RecordingPhase.GONE


def test_a_mark_is_told_at_its_place_in_the_bag_however_late_reports_are() -> None:
    """The report of 2 s after the beginning came 8 s late."""
    state = recording()
    report = state.snapshot._replace(phase='recording', files=(state.path,), duration_s=2.0,
                                     stamp_s=5002.0)
    state = events.updated(state, report, 110.0).state
    [mark] = state.marked(111.0, 5011.0).marks
    assert mark.time_s == 11.0
    [mark] = state.marked(111.0).marks  # the recorder's clock is unknown
    assert mark.time_s == 3.0


def test_marks_of_one_recording_are_not_shown_with_what_somebody_else_starts_then() -> None:
    state = recording().marked(11.0)
    state = events.ended(state, [BAG], 12.0).state
    assert [it.label for it in state.marks] == ['mark 1']  # shown with the finished bag
    state = events.updated(state, RecorderSnapshot('starting', (BAG,), 2.0), 20.0).state
    other = RecorderSnapshot('recording', ('/bags/other.bag',), 0.5)
    state = events.updated(state, other, 21.0).state
    assert state.marks == () and state.elapsed_s(21.0) == 0.5


def test_marks_do_not_stay_when_something_else_is_recorded_after_the_recorder_has_ended() -> None:
    state = events.gone(recording().marked(11.0)).state
    other = RecorderSnapshot('recording', ('/bags/other.bag',), 5.0)
    assert events.updated(state, other, 15.0).state.marks == ()


def test_a_state_is_outdated_that_was_sent_before_an_answer() -> None:
    before = RecorderSnapshot('idle', ('/bags/earlier.bag',))
    assert recording().is_outdated(before, 10.0) and not recording().is_outdated(before, 10.2)
    assert not recording().is_outdated(RecorderSnapshot('recording', (BAG,)), 10.0)


def test_a_state_is_outdated_also_when_the_finished_bag_was_dismissed() -> None:
    state = events.ended(recording(), [BAG], 20.0).state.dismissed()
    assert state.is_outdated(RecorderSnapshot('recording', (BAG,)), 20.0)


def test_a_state_is_outdated_also_when_something_else_was_saved_since() -> None:
    state = events.ended(events.ended(recording(), [BAG], 20.0).state, ['/bags/2.bag'], 20.5).state
    assert state.is_outdated(RecorderSnapshot('recording', (BAG,)), 20.5)


def test_a_state_with_the_last_figures_is_not_late() -> None:
    state = events.ended(recording(), [BAG], 20.0).state
    assert state.figures is None
    assert state.is_outdated(RecorderSnapshot('stopping', (BAG,)), 20.0)
    last = RecorderSnapshot('idle', (BAG,), 9.0, messages=7)
    assert not state.is_outdated(last, 21.0)
    after = events.updated(state, last, 21.0).state
    assert after.figures is not None and after.figures.messages == 7
    assert after.elapsed_s(99.0) == 9.0
    assert after.finished == FinishedBag((BAG,), (), after.figures)


def test_the_clock_stops_with_the_recorder() -> None:
    clock = RecordingClock().updated(3.0, True, 100.0)
    assert (clock.elapsed_s(101.0), clock.elapsed_s(999.0)) == (4.0, 4.5)
    assert clock.updated(3.5, True, 101.0).elapsed_s(101.0) == 4.0
    assert clock.updated(3.5, False, 101.0).elapsed_s(999.0) == 3.5


def test_the_room_is_the_recorders_while_it_records() -> None:
    snapshot = RecorderSnapshot('recording', rate=1e6, free_bytes=5 << 30, time_left_s=200.0)
    assert disk_room(RecordingPhase.RECORDING, snapshot, 9 << 30) == DiskRoom(
        5 << 30, 200.0, (5 << 30) - 200_000_000, True)
    assert disk_room(RecordingPhase.RECORDING, snapshot, None).is_low
    assert disk_room(RecordingPhase.IDLE, snapshot, 2 << 30) == DiskRoom(2 << 30, (1 << 30) / 1e6)
    assert disk_room(RecordingPhase.IDLE, snapshot, None) == DiskRoom(None, None)
    assert disk_room(RecordingPhase.IDLE, snapshot._replace(rate=0.0), 1) == DiskRoom(1, None)
