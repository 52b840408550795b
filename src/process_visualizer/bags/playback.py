"""The playback engine: publishes a recording along a timeline, at any rate, in both directions."""
from __future__ import annotations

import queue
from concurrent.futures import Future
from dataclasses import dataclass
from functools import partial
from typing import Callable, List, Optional, Protocol, Tuple

from process_visualizer.bags.bag_index import BagIndex
from process_visualizer.bags.clock import Clock
from process_visualizer.bags.message_layout import Data
from process_visualizer.bags.message_loader import LoadedMessage, MessageLoader
from process_visualizer.bags.playback_event import EventMaker, PlaybackEvent
from process_visualizer.bags.read_ahead import BACKWARD, FORWARD, ReadAhead
from process_visualizer.bags.recording import Recording
from process_visualizer.bags.schedule import Schedule, Scheduled
from process_visualizer.bags.stamp_mapping import StampMapping
from process_visualizer.bags.stamps import with_stamps_moved
from process_visualizer.bags.step_target import StepTarget, step_by_messages, step_by_time
from process_visualizer.bags.timeline import NS_PER_S, Basis, Timeline

LEAD_NS = NS_PER_S // 10  # by which messages are given to the output before they are due
LEAD_BYTES = 32 << 20
LATE_NS = NS_PER_S // 5  # from here on, playback slows down instead of catching up
SETTLING_NS = NS_PER_S // 10  # without a message or command, until the scene is repeated
MOST_STEPPED = 200  # messages that a step publishes one by one; of more, only the scene counts
ANSWER_S = 10.0
AT_ONCE = 0  # a monotonic time [ns] that has passed


class Output(Protocol):
    """Where messages go to; called by one thread."""

    def announce(self, connection: int, data: Data, bag_ns: int, basis: Basis) -> None:
        """Tell when a message without a stamp of its own was recorded [bag ns]: it comes next."""

    def publish(self, connection: int, pieces: List[Data], due_ns: int) -> None:
        """Send a message of a connection, given in pieces, when a monotonic time [ns] has come.

        Messages are given in the order of their times. This must not wait for receivers.
        """

    def revoke(self, after_ns: int) -> int:
        """Take back what is due after a monotonic time [ns] and not sent; return how many."""

    def jump(self, bag_ns: int) -> None:
        """Take note that the position has jumped to a bag time [ns]; its scene follows."""

    def finish(self) -> None:
        """Take note that the end has been reached, in the direction of play."""


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
                 lead_bytes: int = LEAD_BYTES) -> None:
        """Take a recording, a timeline within it, and where the messages go to.

        With ``restamp`` the stamps in messages are moved to the present. About ``lead_bytes`` at
        most are given to the output before they are due.
        """
        self._index: BagIndex = recording.index
        self._timeline = timeline
        self._output = output
        self._clock = clock or Clock()
        self._mapping = StampMapping(self._clock) if restamp else None
        self._loader = MessageLoader(recording)
        self._events = EventMaker(self._index, self._loader)
        self._ahead = ReadAhead(self._events, len(self._index))
        self._steps: queue.SimpleQueue[Tuple[Step, Future[StepTarget]]] = queue.SimpleQueue()
        self._passed = 0  # how many messages of the recording are visible, or replaced
        self._scene = timeline.basis.scene
        self._schedule = Schedule()
        self._lead_bytes = lead_bytes
        self._version = -1  # of the basis for which that was made
        self._published = 0
        self._repeat = False
        self._playing = False  # published lately as time went on
        self._settled_ns: Optional[int] = None  # monotonic, where it is quiet but not settled yet
        self._closed = False

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

    def step(self, step: Step) -> StepTarget:
        """Pause and move by a step, in the thread of ``run``; return where it led.

        Raises:
            CommandRefused: there is nothing to step to.
        """
        return self.request(step).result(ANSWER_S)

    def request(self, step: Step) -> Future[StepTarget]:
        """Ask for a step without waiting for it."""
        answer: Future[StepTarget] = Future()
        self._steps.put((step, answer))
        self._timeline.interrupt()
        return answer

    def run(self) -> None:
        """Publish until ``close``."""
        try:
            self._begin()
            while not self._closed:
                self._work()
        finally:
            self._ahead.close()

    def _begin(self) -> None:
        basis = self._timeline.basis
        self._scene = basis.scene
        self._output.jump(basis.bag_ns)
        self._restore(self._count_at(basis), basis)

    def _count_at(self, basis: Basis) -> int:
        """How many messages make the scene after a jump; those of just that time are played."""
        if basis.paused or not basis.forward:
            return self._index.count_until(basis.bag_ns)
        return self._index.count_before(basis.bag_ns)

    def _work(self) -> None:
        while not self._steps.empty():
            step, answer = self._steps.get()
            _answer(answer, partial(self._step, step))
        basis = self._timeline.basis
        if basis.version != self._version:
            self._version = basis.version
            self._take_back()
        if basis.scene != self._scene:
            self._scene = basis.scene
            self._output.jump(basis.bag_ns)
            self._restore(self._count_at(basis), basis)
        elif self._repeat:
            self._repeat = False
            if self._mapping is not None:
                self._mapping.forget()
            self._restore(self._passed, basis)
            self._settled_ns = None
        elif basis.paused:
            self._rest(basis)
        else:
            self._play(basis)

    def _play(self, basis: Basis) -> None:
        """Publish the next message when it is due, unless a command comes before."""
        self._playing = True
        position, step = (self._passed, FORWARD) if basis.forward else (self._passed - 1, BACKWARD)
        if not self._is_before_limit(position, basis):
            if self._timeline.wait_until_due(basis.limit_ns, basis.version):
                self._pass_limit(basis)
            return
        event = self._ahead.take(position, step)
        if (self._timeline.wait_until_due(event.time_ns, basis.version, self._lead_ns())
                and self._keeps_up(event.time_ns, basis.version)):
            self._give(event, position, step)
        else:
            self._ahead.put_back(position, step, event)

    def _lead_ns(self) -> int:
        """How long before it is due the next message may be given to the output."""
        self._schedule.forget_due(self._clock.monotonic_ns())
        return LEAD_NS if self._schedule.bytes < self._lead_bytes else 0

    def _give(self, event: PlaybackEvent, position: int, step: int) -> None:
        """Give an event to the output, to be sent when it is due."""
        stamps = 0 if self._mapping is None else self._mapping.remembered
        basis = self._timeline.basis
        due_ns = basis.due_ns(event.time_ns) or self._clock.monotonic_ns()
        self._schedule.add(Scheduled(event, position, step, due_ns, stamps))
        self._passed = position + (step == FORWARD)
        self._show(event, basis, due_ns)

    def _take_back(self) -> None:
        """Take back what has not been sent yet, as a command may have changed when it is due."""
        count = self._output.revoke(self._clock.monotonic_ns())
        self._published -= count
        if count:
            self._settled_ns = self._clock.monotonic_ns() + SETTLING_NS
        while count > 0:
            event, position, step, _, stamps = self._schedule.pop()
            count -= len(event.messages)
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
        if not self._timeline.wait_for_command(self._settled_ns, basis.version):
            self._settled_ns = None
            self._repeat = True

    def _catch_up(self, basis: Basis) -> None:
        """Publish what had become visible already, and was not published yet, when paused."""
        if self._playing:
            self._playing = False
            count = self._index.count_until(basis.bag_ns)
            for position in range(self._passed, count):
                self._show(self._events.forward(position), basis)
            for position in reversed(range(count, self._passed)):
                self._show(self._events.backward(position), basis)
            self._passed = count

    def _pass_limit(self, basis: Basis) -> None:
        self._timeline.pass_limit(basis.version)
        if self._timeline.basis.paused and not basis.loop:
            self._output.finish()

    def _is_before_limit(self, position: int, basis: Basis) -> bool:
        if not 0 <= position < len(self._index):
            return False
        time_ns = int(self._index.time_ns[position])
        return time_ns <= basis.limit_ns if basis.forward else time_ns > basis.limit_ns

    def _keeps_up(self, bag_ns: int, version: int) -> bool:
        """Slip if a message comes too late; tell whether no command came meanwhile."""
        due_ns = self._timeline.basis.due_ns(bag_ns)
        if due_ns is not None and self._clock.monotonic_ns() - due_ns >= LATE_NS:
            self._timeline.slip_to(bag_ns, version)
        return self._timeline.basis.version == version

    def _step(self, step: Step) -> StepTarget:
        self._take_back()
        target = self._target(step)
        passed, self._passed, self._playing = self._passed, target.count, False
        self._timeline.step_to(target.bag_ns)
        basis = self._timeline.basis
        self._scene = basis.scene
        if 0 <= target.count - passed <= MOST_STEPPED:
            for position in range(passed, target.count):
                self._show(self._events.forward(position), basis)
        else:
            self._restore(target.count, basis)
        return target

    def _target(self, step: Step) -> StepTarget:
        if step.count:
            return step_by_messages(self._index, self._passed, step.count, step.topic)
        basis = self._timeline.basis
        bag_ns = self._timeline.position_ns() + step.duration_ns
        return step_by_time(self._index, min(max(bag_ns, basis.begin_ns), basis.end_ns))

    def _restore(self, count: int, basis: Basis) -> None:
        """Publish the scene after ``count`` messages, unless a newer one is asked for already."""
        self._passed = count
        self._playing = False
        event = self._events.scene(count)
        if self._timeline.basis.scene == basis.scene:
            for message in event.messages:
                self._publish(message, basis, lambda stamp_ns: self._present(basis, stamp_ns))
        if not basis.paused:  # restoring took its time; what follows comes at its pace, in no burst
            self._timeline.slip_to(basis.bag_ns, basis.version, begins=True)

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
        pieces: List[Data] = [message.data]
        if not message.stamp_offsets:
            self._output.announce(message.connection, message.data, message.time_ns, basis)
        elif self._mapping is not None:
            pieces = with_stamps_moved(message.data, message.stamp_offsets, mapping)
        self._output.publish(message.connection, pieces, due_ns)
        self._published += 1
        self._settled_ns = max(self._clock.monotonic_ns(), due_ns) + SETTLING_NS


def _answer(future: 'Future[StepTarget]', work: Callable[[], StepTarget]) -> None:
    """Do the work for whoever waits for the result, or for the reason why there is none."""
    try:
        future.set_result(work())
    except Exception as error:  # whatever it is belongs to the caller
        future.set_exception(error)
