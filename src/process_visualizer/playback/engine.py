# SPDX-License-Identifier: BSD-3-Clause
"""The playback engine: publishes a recording along a timeline, at any rate, in both directions."""
from __future__ import annotations

import queue
from concurrent.futures import Future
from concurrent.futures import TimeoutError as FutureTimeout
from dataclasses import dataclass
from typing import Callable, Dict, List, Optional, Tuple

from process_visualizer.bags.bag_index import BagIndex
from process_visualizer.bags.recording import Recording
from process_visualizer.messages.message_layout import Data
from process_visualizer.messages.stamps import with_stamps_moved
from process_visualizer.playback.clock import Clock
from process_visualizer.playback.course import Course
from process_visualizer.playback.message_loader import LoadedMessage, MessageLoader
from process_visualizer.playback.playback_event import EventMaker, PlaybackEvent
from process_visualizer.playback.playback_output import Output
from process_visualizer.playback.read_ahead import BACKWARD, FORWARD, ReadAhead
from process_visualizer.playback.schedule import Schedule, Scheduled
from process_visualizer.playback.stamp_mapping import StampMapping
from process_visualizer.playback.step_target import StepTarget, step_by_messages, step_by_time
from process_visualizer.playback.timeline import NS_PER_S, Basis, CommandRefused, Timeline

LEAD_NS = NS_PER_S // 10  # by which messages are given to the output before they are due
LEAD_BYTES = 32 << 20
LATE_NS = NS_PER_S // 5  # from here on, playback slows down instead of catching up
SETTLING_NS = NS_PER_S // 10  # without a message or command, until the scene is repeated
MOST_STEPPED = 200  # messages that a step publishes one by one; of more, only the scene counts
ANSWER_S = 10.0
AT_ONCE = 0  # a monotonic time [ns] that has passed


@dataclass(frozen=True)
class Step:
    """By how many messages, of which topic ('': all), or (count 0) by what time [ns]."""

    count: int
    topic: str
    duration_ns: int


class Playback:
    """Publishes what the timeline makes visible; ``run`` is the work of one thread.

    What was published is the scene at the position at any time: after a jump the scene is
    restored, forwards each message is published as its time comes, backwards each is replaced by
    the one before it. When the machine cannot keep up, the timeline slips: everything comes
    later, together.

    Messages are prepared and given to the output LEAD_NS before they are due, which sends them at
    their times whatever else the machine does; at a command those not sent yet are taken back.
    """

    def __init__(self, recording: Recording, timeline: Timeline, output: Output,
                 restamp: bool = True, clock: Optional[Clock] = None,
                 lead_bytes: int = LEAD_BYTES, course: Optional[Course] = None) -> None:
        """Take a recording, a timeline within it, and where the messages go to.

        With ``restamp`` the stamps in messages are moved to the present. About ``lead_bytes`` at
        most are given to the output before they are due. Without a ``course`` play goes on evenly.
        """
        self._index: BagIndex = recording.index
        self._timeline = timeline
        self.course = course or Course(timeline)
        self._output = output
        self._clock = clock or Clock()
        self._mapping = StampMapping(self._clock) if restamp else None
        self._loader = MessageLoader(recording)
        self._events = EventMaker(self._index, self._loader, recording.begin_ns)
        self._ahead = ReadAhead(self._events, len(self._index))
        self._steps: queue.SimpleQueue[Tuple[Step, Future[StepTarget]]] = queue.SimpleQueue()
        self._passed = 0  # how many messages of the recording are visible, or replaced
        self._scene = timeline.basis.scene
        self._schedule = Schedule()
        self._lead_bytes = lead_bytes
        self._version = -1  # of the basis for which that was made
        self._given = 0  # messages, withdrawn ones too, to the output
        self._published = 0
        self._repeat = False
        self._shown_ns: Optional[int] = None  # position of what was published; None: it moves
        self._settled_ns: Optional[int] = None  # monotonic, where it is quiet but not settled yet
        self._runs = self._closed = False

    @property
    def published(self) -> int:
        """How many messages were published, with those that will be within the next moment."""
        return self._published

    @property
    def passed(self) -> int:
        """How many messages of the recording make the scene that was published."""
        return self._passed

    @property
    def problems(self) -> Tuple[str, ...]:
        """What could not be played as it should be, so far."""
        return self._loader.problems

    @property
    def left_out(self) -> Dict[str, int]:
        """How many messages of each topic could not be played so far."""
        return self._loader.left_out

    def not_begun(self, bag_ns: int) -> List[str]:
        """Return the topics without a message up to a bag time [ns] that cannot be emptied.

        What is seen of them there, if anything, is from elsewhere.
        """
        return self._events.not_begun(bag_ns)

    def prepare(self) -> None:
        """Begin to read what comes first, before ``run``."""
        basis = self._timeline.basis
        count = self._index.count_before(basis.bag_ns)
        self._ahead.begin(*(count, FORWARD) if basis.forward else (count - 1, BACKWARD))

    def close(self) -> None:
        """End ``run``."""
        self._closed = True
        self._timeline.interrupt()

    def repeat_scene(self) -> None:
        """Publish the scene once more, for receivers that are new or have thrown it away."""
        self._repeat = True
        self._timeline.interrupt()

    def step(self, step: Step, answer_s: float = ANSWER_S) -> StepTarget:
        """Pause and move by a step; return where it led, or give it up after a time [s].

        Raises:
            CommandRefused: there is nothing to step to, or playback does not come to it.
        """
        if not self._runs:  # nothing is published yet: ``run`` will begin there
            return self._stepped(step)[1]
        answer = self.request(step)
        try:
            return answer.result(answer_s)
        except FutureTimeout:
            if answer.cancel():
                raise CommandRefused('the player is busy: nothing was changed; try again') from None
            return answer.result()

    def request(self, step: Step) -> Future[StepTarget]:
        """Ask for a step without waiting for it."""
        answer: Future[StepTarget] = Future()
        self._steps.put((step, answer))
        self._timeline.interrupt()
        return answer

    def run(self) -> None:
        """Publish until ``close``, or until the end where the output says so."""
        self._runs = True
        try:
            basis = self._timeline.basis
            self._jump(basis, begins=not basis.paused)
            basis = self._timeline.basis
            while not self._closed:  # asked after the basis was read: a later close ends its waits
                self._work(basis)
                basis = self._timeline.basis
        finally:
            self._ahead.close()
            while not self._steps.empty():
                self._steps.get()[1].set_exception(CommandRefused('the player ends'))

    def _jump(self, basis: Basis, begins: bool = False) -> None:
        """Publish the scene at the position from anywhere, or where playback only ``begins``."""
        self._scene = basis.scene
        self._output.jump(basis.bag_ns)
        self._restore(self._count_at(basis), basis, begins)
        self._shown_ns = basis.bag_ns if basis.paused else None
        if not basis.paused:  # restoring took its time; what follows comes at its pace, in no burst
            self._timeline.slip_to(basis.bag_ns, basis.version, begins=True)

    def _count_at(self, basis: Basis) -> int:
        """How many messages make the scene after a jump; those of just that time are played."""
        if basis.paused or not basis.forward:
            return self._index.count_until(basis.bag_ns)
        return self._index.count_before(basis.bag_ns)

    def _work(self, basis: Basis) -> None:
        if basis.version != self._version:
            self._version = basis.version
            self._take_back()
        if not self._steps.empty():
            self._answer(*self._steps.get())
        elif basis.scene != self._scene:
            self._jump(basis)
        elif self._repeat:
            self._publish_again(basis)
        elif basis.paused:
            self._rest(basis)
        else:
            self._play(basis)

    def _publish_again(self, basis: Basis) -> None:
        """Publish the scene once more, with new stamps."""
        self._repeat = False
        self._take_back()
        if self._mapping is not None:
            self._mapping.forget()
        if basis.paused:
            self._passed, self._shown_ns = self._visible(basis, basis.bag_ns), basis.bag_ns
        self._restore(self._passed, basis)
        self._settled_ns = None

    def _visible(self, basis: Basis, bag_ns: int) -> int:
        """How many messages are visible at a position [bag ns], whatever was published so far.

        Where it stands still after a step, these are the ones up to which that led: others may
        have the same time.
        """
        stands = basis.scene == self._scene and (basis.paused, bag_ns) == (True, self._shown_ns)
        return self._passed if stands else self._index.count_until(bag_ns)

    def _play(self, basis: Basis) -> None:
        """Publish the next message when it is due, unless a command comes before."""
        self._shown_ns = None
        position, step = (self._passed, FORWARD) if basis.forward else (self._passed - 1, BACKWARD)
        if not self._is_before_limit(position, basis):
            if self._timeline.wait_until_due(basis.limit_ns, basis.version):
                self._pass_limit(basis)
            return
        if not self.course.goes_on(self._index, position, basis):
            return
        event = self._ahead.take(position, step)
        due = self._timeline.wait_until_due(event.time_ns, basis.version, self._lead_ns())
        now = self._kept_up(event.time_ns, basis.version) if due else None
        if now is None:
            self._ahead.put_back(position, step, event)
        else:
            self._give(event, position, step, now)

    def _lead_ns(self) -> int:
        """How long before it is due the next message may be given to the output."""
        self._schedule.forget_due(self._clock.monotonic_ns())
        return LEAD_NS if self._schedule.bytes < self._lead_bytes else 0

    def _give(self, event: PlaybackEvent, position: int, step: int, basis: Basis) -> None:
        """Give an event to the output, to be sent when it is due."""
        stamps = 0 if self._mapping is None else self._mapping.remembered
        due_ns = basis.due_ns(event.time_ns)
        assert due_ns is not None, 'it plays'
        self._schedule.add(Scheduled(event, position, step, due_ns, self._given, stamps))
        self._passed = position + (step == FORWARD)
        self._show(event, basis, due_ns)

    def _take_back(self) -> None:
        """Take back what has not been sent yet, as a command may have changed when it is due.

        What stays may be ahead of the position, by some milliseconds.
        """
        count = self._output.revoke(self._clock.monotonic_ns())
        if count:
            self._settled_ns = self._clock.monotonic_ns() + SETTLING_NS
        self._given -= count
        for event, position, step, _, _, stamps in self._schedule.taken_back(self._given):
            self._published -= event.published
            self._passed = position + (step == BACKWARD)
            self._ahead.put_back(position, step, event)
            if self._mapping is not None:
                self._mapping.forget_since(stamps)

    def _rest(self, basis: Basis) -> None:
        """Wait for a command; once it has been quiet for a while, publish the scene once more.

        Receivers that match messages with similar stamps take a pair only when the next one has
        come: without that they would show what was before.
        """
        self._catch_up(basis)
        until_ns = None if basis.held else self._settled_ns
        if not self._timeline.wait_for_command(until_ns, basis.version):
            self._publish_again(basis)

    def _catch_up(self, basis: Basis) -> None:
        """Publish what had become visible already, and was not published yet, when paused."""
        if self._shown_ns != basis.bag_ns:
            self._shown_ns = basis.bag_ns
            count = self._index.count_until(basis.bag_ns)
            for position in range(self._passed, count):
                self._show(self._events.forward(position), basis)
            for position in reversed(range(count, self._passed)):
                self._show(self._events.backward(position), basis)
            self._passed = count

    def _pass_limit(self, basis: Basis) -> None:
        self._timeline.pass_limit(basis.version)
        if self._timeline.basis.paused and not basis.loop and self._output.finish():
            self._closed = True

    def _is_before_limit(self, position: int, basis: Basis) -> bool:
        if not 0 <= position < len(self._index):
            return False
        time_ns = int(self._index.time_ns[position])
        return time_ns <= basis.limit_ns if basis.forward else time_ns > basis.limit_ns

    def _kept_up(self, bag_ns: int, version: int) -> Optional[Basis]:
        """Slip if a message comes too late; return the basis then, None if a command came."""
        due_ns = self._timeline.basis.due_ns(bag_ns)
        if due_ns is not None and self._clock.monotonic_ns() - due_ns >= LATE_NS:
            self._timeline.slip_to(bag_ns, version)
        basis = self._timeline.basis
        return basis if basis.version == version else None

    def _answer(self, step: Step, answer: 'Future[StepTarget]') -> None:
        """Do a step for whoever waits for its target, or for the reason why there is none."""
        if not answer.set_running_or_notify_cancel():
            return  # nobody waits for it any more
        try:
            answer.set_result(self._step(step))
        except CommandRefused as error:
            answer.set_exception(error)
        except Exception as error:
            answer.set_exception(CommandRefused(f'playback has failed: {error!r}'))
            raise

    def _step(self, step: Step) -> StepTarget:
        """Go to the target of a step, from the scene at the position or what stays of another."""
        before, target, basis = self._stepped(step)
        self._take_back()
        passed, self._passed, self._shown_ns = self._passed, target.count, basis.bag_ns
        jumped, self._scene = before.scene != self._scene, basis.scene
        if jumped:  # a command came just before, and nothing is published for it alone
            self._output.jump(target.bag_ns)
        if not jumped and 0 <= target.count - passed <= MOST_STEPPED:
            for position in range(passed, target.count):
                self._show(self._events.forward(position), basis)
        else:
            self._restore(target.count, basis)
        return target

    def _stepped(self, step: Step) -> Tuple[Basis, StepTarget, Basis]:
        """Let the timeline step; return its basis before, the target, and its basis afterwards."""
        while True:
            before, now_ns = self._timeline.now()
            target = self._target(step, before, before.position_at(now_ns))
            basis = self._timeline.step_to(target.bag_ns, before.version)
            if basis is not None:
                return before, target, basis

    def _target(self, step: Step, basis: Basis, bag_ns: int) -> StepTarget:
        if step.count:
            return step_by_messages(self._index, basis.end_ns, self._visible(basis, bag_ns),
                                    step.count, step.topic)
        return step_by_time(self._index, basis, bag_ns + step.duration_ns)

    def _restore(self, count: int, basis: Basis, begins: bool = False) -> None:
        """Publish the scene after ``count`` messages, unless a newer one is asked for already."""
        self._passed = count
        event = self._events.scene(count, begins)
        if self._timeline.basis.scene == basis.scene:
            for message in event.messages:
                self._publish(message, basis, lambda stamp_ns: self._present(basis, stamp_ns))

    def _show(self, event: PlaybackEvent, basis: Basis, due_ns: int = AT_ONCE) -> None:
        for message in event.messages:
            stamper = self._stamper(basis, message.time_ns, event.time_ns, due_ns)
            self._publish(message, basis, stamper, due_ns)

    def _stamper(self, basis: Basis, message_ns: int, shown_ns: int,
                 due_ns: int) -> Callable[[int], int]:
        mapping = self._mapping
        if mapping is None:
            return lambda stamp_ns: stamp_ns
        return lambda stamp_ns: mapping.stamp(basis, stamp_ns, message_ns, shown_ns, due_ns)

    def _present(self, basis: Basis, stamp_ns: int) -> int:
        return stamp_ns if self._mapping is None else self._mapping.present(basis, stamp_ns)

    def _publish(self, message: LoadedMessage, basis: Basis, mapping: Callable[[int], int],
                 due_ns: int = AT_ONCE) -> None:
        self._given += 1
        if message.withdrawn:
            self._output.withdraw(message.connection, due_ns)
            return
        pieces: List[Data] = [message.data]
        if message.stamp_offsets and self._mapping is not None:
            pieces = with_stamps_moved(message.data, message.stamp_offsets, mapping)
        self._output.publish(message.connection, pieces, due_ns)
        self._published += 1
        self._settled_ns = max(self._clock.monotonic_ns(), due_ns) + SETTLING_NS
