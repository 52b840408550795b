# SPDX-License-Identifier: BSD-3-Clause
"""The playback engine: publishes a recording along a timeline, at any rate, in both directions.

Uneven playback skips empty parts, pauses at some messages, or waits for a listener.
"""
from __future__ import annotations

from concurrent.futures import Future
from typing import Dict, Iterable, List, NamedTuple, Optional, Tuple

from process_visualizer.bagio.bag_index import BagIndex
from process_visualizer.bagio.recording import Recording
from process_visualizer.playback.message_loader import MessageLoader
from process_visualizer.playback.playback_event import BACKWARD, FORWARD, EventMaker, ReadAhead
from process_visualizer.playback.scheduled_output import Output, ScheduledOutput
from process_visualizer.playback.stamp_mapping import StampMapping
from process_visualizer.playback.steps import (
    Step,
    StepRequests,
    StepTarget,
    step_by_messages,
    step_by_time,
    target_in_time,
)
from process_visualizer.playback.timeline import (
    NS_PER_S,
    Clock,
    CommandRefused,
    Timeline,
    TimelineState,
)


class ShownScene(NamedTuple):
    """The scene after a number of messages of the recording, each visible or replaced since.

    ``scene`` is the number of the timeline's scene (TimelineState.scene). ``paused_ns`` is the
    position [bag ns] for which the scene was published; None while the position moves.
    """

    passed: int
    scene: int
    paused_ns: Optional[int] = None

    def next_message(self, forward: bool) -> Tuple[int, int]:
        """Return the row of the message to pass next, and FORWARD or BACKWARD."""
        return (self.passed, FORWARD) if forward else (self.passed - 1, BACKWARD)

    def moving(self) -> ShownScene:
        """Return the scene as it is while playing."""
        return self if self.paused_ns is None else self._replace(paused_ns=None)

    def with_passed(self, row: int, direction: int) -> ShownScene:
        """Return the scene after passing the message in a row of the index, FORWARD or BACKWARD."""
        return ShownScene(row + (direction == FORWARD), self.scene)

    def without(self, row: int, direction: int) -> ShownScene:
        """Return the scene before the message in a row was passed, as the message is taken back."""
        return self._replace(passed=row + (direction == BACKWARD))

    def standing(self, passed: int, bag_ns: int) -> ShownScene:
        """Return the scene after a number of messages, paused at a position [bag ns]."""
        return self._replace(passed=passed, paused_ns=bag_ns)

    def visible(self, index: BagIndex, state: TimelineState, bag_ns: int) -> int:
        """Return the number of messages visible at a position [bag ns], whatever was published.

        While paused after a step, these are the messages up to the target of the step: later ones
        may have the same time.
        """
        stands = state.scene == self.scene and (state.paused, bag_ns) == (True, self.paused_ns)
        return self.passed if stands else index.count_until(bag_ns)


def scene_after_jump(index: BagIndex, state: TimelineState) -> ShownScene:
    """Return the scene at the position of a state; messages at exactly that time follow in play."""
    if state.paused:
        return ShownScene(index.count_until(state.bag_ns), state.scene, state.bag_ns)
    count = index.count_before if state.forward else index.count_until
    return ShownScene(count(state.bag_ns), state.scene)


LEAD_BYTES = 32 << 20
LATENESS_LIMIT_NS = NS_PER_S // 5  # above this, playback slows down instead of catching up
MAX_STEPPED = 200  # messages that a step publishes one by one; a longer step restores the scene
ANSWER_S = 10.0


class Playback:
    """Publishes the messages that the timeline makes visible; ``run`` is the work of one thread.

    At any time, the published messages are the scene at the position: after a jump, the scene is
    restored; forward, each message is published when its time is reached; backward, each is
    replaced by the one before it. When the machine cannot keep up, the timeline slips: all messages
    are delayed by the same time.

    Messages are prepared and given to the output LEAD_NS before they are due. The output sends them
    on time whatever else the machine does; after a command, messages not sent yet are taken back.
    """

    def __init__(self, recording: Recording, timeline: Timeline, output: Output,
                 restamp: bool = True, clock: Optional[Clock] = None,
                 lead_bytes: int = LEAD_BYTES, uneven_parts: Optional[UnevenParts] = None) -> None:
        """Initialize with a recording, a timeline within it, and the output for its messages.

        With ``restamp`` the stamps in messages are moved to the present. At most about
        ``lead_bytes`` are given to the output before they are due. Without ``uneven_parts`` play is
        even.
        """
        self._index: BagIndex = recording.index
        self._timeline = timeline
        self.uneven_parts = uneven_parts or UnevenParts(timeline)
        self._clock = clock or Clock()
        mapping = StampMapping(self._clock) if restamp else None
        self._loader = MessageLoader(recording)
        self._events = EventMaker(self._index, self._loader, recording.begin_ns)
        self._output = ScheduledOutput(output, self._clock, mapping, lead_bytes,
                                       self._events.sensors)
        self._ahead = ReadAhead(self._events, len(self._index))
        self._steps = StepRequests()
        self._shown = ShownScene(0, timeline.state.scene)
        self._version = -1  # of the state that determined the due times in the output
        self._repeat, self._settles = False, True
        self._runs = self._closed = False

    @property
    def published(self) -> int:
        """Number of published messages, including those of the next moment."""
        return self._output.published

    @property
    def passed(self) -> int:
        """Return the number of messages of the recording up to the published scene."""
        return self._shown.passed

    @property
    def problems(self) -> Tuple[str, ...]:
        """Return the problems of playback so far."""
        return self._loader.problems

    @property
    def left_out(self) -> Dict[str, int]:
        """Return the number of messages of each topic that could not be played so far."""
        return self._loader.left_out

    def not_begun(self, bag_ns: int) -> List[str]:
        """Return the topics without a message up to a bag time [ns] that cannot be emptied.

        Anything visible on them at that time comes from another position.
        """
        return self._events.not_begun(bag_ns)

    def held(self, topic: str, bag_ns: int) -> List[int]:
        """Return the rows of each joint's newest messages before a bag time (EventMaker)."""
        return self._events.held(topic, bag_ns)

    def prepare(self) -> None:
        """Begin to read the first messages, before ``run``."""
        state = self._timeline.state
        first = ShownScene(self._index.count_before(state.bag_ns), state.scene)
        self._ahead.begin(*first.next_message(state.forward))

    def close(self) -> None:
        """End ``run``."""
        self._closed = True
        self._timeline.interrupt()

    def repeat_scene(self) -> None:
        """Publish the scene again, for receivers that are new or have discarded it."""
        self._repeat = True
        self._timeline.interrupt()

    def show_again(self) -> None:
        """Publish the scene again, and once more after a quiet time.

        A change at the receivers, such as a frame, may take effect only after the first time.
        """
        self._settles = False
        self.repeat_scene()

    def step(self, step: Step, answer_s: float = ANSWER_S) -> StepTarget:
        """Pause and move by a step; return its target, or give up after a time [s].

        Raises:
            CommandRefused: there is nothing to step to, or playback did not begin the step in time.
        """
        if not self._runs:  # nothing has been published yet: ``run`` will begin at the target
            return self._stepped(step)[1]
        return target_in_time(self.request(step), answer_s, self._clock)

    def request(self, step: Step) -> Future[StepTarget]:
        """Request a step without waiting for it."""
        answer = self._steps.add(step)
        self._timeline.interrupt()
        return answer

    def run(self) -> None:
        """Publish until ``close``, or until the end if the output then finishes."""
        self._runs = True
        try:
            state = self._timeline.state
            self._jump(state, begins=not state.paused)
            state = self._timeline.state
            while not self._closed:  # checked after reading the state: a later close ends the waits
                self._work(state)
                state = self._timeline.state
        finally:
            self._ahead.close()
            self._steps.refuse('the player ends')

    def _jump(self, state: TimelineState, begins: bool = False) -> None:
        """Publish the scene at the position, after a jump or when playback ``begins``."""
        self._shown = scene_after_jump(self._index, state)
        self._output.jump(state.bag_ns)
        self._restore(state, begins)
        if not state.paused:  # restoring took time: the next messages must not be a burst
            self._timeline.slip_to(state.bag_ns, state.version, begins=True)

    def _work(self, state: TimelineState) -> None:
        if state.version != self._version:
            self._version = state.version
            self._take_back()
        if not self._steps.is_empty:
            self._steps.answer(self._step)
        elif state.scene != self._shown.scene:
            self._jump(state)
        elif self._repeat:
            self._publish_again(state)
        elif state.paused:
            self._rest(state)
        else:
            self._play(state)

    def _publish_again(self, state: TimelineState) -> None:
        """Publish the scene once more, with new stamps."""
        self._repeat = False
        self._take_back()
        self._output.forget_stamps()
        if state.paused:
            visible = self._shown.visible(self._index, state, state.bag_ns)
            self._shown = self._shown.standing(visible, state.bag_ns)
        self._restore(state)
        if self._settles:
            self._output.settle()
        self._settles = True

    def _play(self, state: TimelineState) -> None:
        """Publish the next message when it is due, unless a command comes first."""
        self._shown = self._shown.moving()
        position, step = self._shown.next_message(state.forward)
        if not self._is_before_limit(position, state):
            if self._timeline.wait_until_due(state.limit_ns, state.version):
                self._pass_limit(state)
            return
        if not self.uneven_parts.goes_on(self._index, position, state):
            return
        event = self._ahead.take(position, step)
        due = self._timeline.wait_until_due(event.time_ns, state.version, self._output.lead_ns())
        now = self._kept_up(event.time_ns, state.version) if due else None
        if now is None:
            self._ahead.put_back(position, step, event)
        else:
            self._shown = self._shown.with_passed(position, step)
            self._output.give(event, position, step, now)

    def _take_back(self) -> None:
        """Take back messages not sent yet, as a command may have changed their due times.

        Messages already sent may be ahead of the position, by some milliseconds.
        """
        for event, position, step, *_ in self._output.take_back():
            self._shown = self._shown.without(position, step)
            self._ahead.put_back(position, step, event)

    def _rest(self, state: TimelineState) -> None:
        """Wait for a command; after a quiet time, publish the scene once more.

        Receivers that match messages with similar stamps accept a pair only when the next one
        arrives; otherwise they would show the previous pair.
        """
        self._catch_up(state)
        until_ns = None if state.held else self._output.settled_ns
        if not self._timeline.wait_for_command(until_ns, state.version):
            self._publish_again(state)

    def _catch_up(self, state: TimelineState) -> None:
        """Publish the messages that were visible at the pause but have not been published yet."""
        if self._shown.paused_ns != state.bag_ns:
            passed, count = self._shown.passed, self._index.count_until(state.bag_ns)
            self._shown = self._shown.standing(count, state.bag_ns)
            self._show_from(passed, state)

    def _show_from(self, passed: int, state: TimelineState) -> None:
        """Publish, one by one, the events from the scene after ``passed`` to the present one."""
        for position in range(passed, self._shown.passed):
            self._output.show(self._events.forward(position), state)
        for position in reversed(range(self._shown.passed, passed)):
            self._output.show(self._events.backward(position), state)

    def _pass_limit(self, state: TimelineState) -> None:
        self._timeline.pass_limit(state.version)
        if self._timeline.state.paused and not state.loop and self._output.finish():
            self._closed = True

    def _is_before_limit(self, position: int, state: TimelineState) -> bool:
        if not 0 <= position < len(self._index):
            return False
        time_ns = int(self._index.time_ns[position])
        return time_ns <= state.limit_ns if state.forward else time_ns > state.limit_ns

    def _kept_up(self, bag_ns: int, version: int) -> Optional[TimelineState]:
        """Slip if a message is too late; return the new state, or None if a command came."""
        due_ns = self._timeline.state.due_ns(bag_ns)
        if due_ns is not None and self._clock.monotonic_ns() - due_ns >= LATENESS_LIMIT_NS:
            self._timeline.slip_to(bag_ns, version)
        state = self._timeline.state
        return state if state.version == version else None

    def _step(self, step: Step) -> StepTarget:
        """Go to the target of a step, from the scene at the position or from an outdated scene."""
        before, target, state = self._stepped(step)
        self._take_back()
        shown, self._shown = self._shown, ShownScene(target.count, state.scene, state.bag_ns)
        jumped = before.scene != shown.scene
        if jumped:  # a command came just before; its scene is not published separately
            self._output.jump(target.bag_ns)
        if not jumped and 0 <= target.count - shown.passed <= MAX_STEPPED:
            self._show_from(shown.passed, state)
        else:
            self._restore(state)
        return target

    def _stepped(self, step: Step) -> Tuple[TimelineState, StepTarget, TimelineState]:
        """Let the timeline step; return its state before, the target, and its state after."""
        while True:
            before, now_ns = self._timeline.now()
            target = self._target(step, before, before.position_at(now_ns))
            state = self._timeline.step_to(target.bag_ns, before.version)
            if state is not None:
                return before, target, state

    def _target(self, step: Step, state: TimelineState, bag_ns: int) -> StepTarget:
        if step.count:
            visible = self._shown.visible(self._index, state, bag_ns)
            return step_by_messages(self._index, state.end_ns, visible, step.count, step.topic)
        return step_by_time(self._index, state, bag_ns + step.duration_ns)

    def _restore(self, state: TimelineState, begins: bool = False) -> None:
        """Publish the scene, unless a newer one has been requested already."""
        event = self._events.scene(self._shown.passed, begins)
        if self._timeline.state.scene == state.scene:
            self._output.restore(event, state)


class UnevenParts:
    """The options of `rosbag play` for uneven playback, which apply only forward.

    All methods but ``heard`` and ``toggle_pauses`` are for the publishing thread only.
    """

    def __init__(self, timeline: Timeline, skip_empty_ns: Optional[int] = None,
                 pause_topics: Iterable[str] = (), max_delay_ns: Optional[int] = None) -> None:
        """Initialize with the timeline and the options.

        Args:
            timeline: of the recording that is played.
            skip_empty_ns: longer parts without a message are skipped.
            pause_topics: topics (global names); play pauses before each of their messages.
            max_delay_ns: play waits for a listener that is further behind (see ``heard``).
        """
        self._timeline = timeline
        self._skip_empty_ns = skip_empty_ns
        self._pause_topics = frozenset(pause_topics)
        self._pauses = True
        self._paused_before = -1, -1  # scene, position
        self._max_delay_ns = max_delay_ns
        self._heard_scene = -1
        self._heard_ns = 0

    def toggle_pauses(self) -> bool:
        """Turn pausing before messages off or on; return whether it is on.

        Raises:
            CommandRefused: there are no topics to pause at.
        """
        if not self._pause_topics:
            raise CommandRefused('there are no topics to pause at: name them by --pause-topics')
        self._pauses = not self._pauses
        return self._pauses

    def heard(self, bag_ns: int) -> None:
        """Note that a listener for which play waits has reached a bag time [ns]."""
        self._heard_ns = bag_ns
        self._release()

    def goes_on(self, index: BagIndex, position: int, state: TimelineState) -> bool:
        """Skip, pause or hold before the message at a position, if an option demands it.

        Return False if that was done or a command came, True if play simply continues.
        """
        if not state.forward:
            return True
        if self._is_far(index, position, state):
            self._skip(index, position, state)
            return False
        if self._is_to_pause(index, position, state):
            self._pause(index, position, state)
            return False
        if self._is_behind(_before(index, position, state), state):
            self._hold(index, position, state)
            return False
        return True

    def _is_far(self, index: BagIndex, position: int, state: TimelineState) -> bool:
        if self._skip_empty_ns is None:
            return False
        return int(index.time_ns[position]) - _before(index, position, state) > self._skip_empty_ns

    def _skip(self, index: BagIndex, position: int, state: TimelineState) -> None:
        """Skip to the next message once the last one is due."""
        if self._timeline.wait_until_due(_before(index, position, state), state.version):
            self._timeline.skip_to(int(index.time_ns[position]), state.version)

    def _is_to_pause(self, index: BagIndex, position: int, state: TimelineState) -> bool:
        connection = index.connections[int(index.connection[position])]
        return (self._pauses and f'/{connection.topic.strip("/")}' in self._pause_topics
                and self._paused_before != (state.scene, position))

    def _pause(self, index: BagIndex, position: int, state: TimelineState) -> None:
        """Pause at the last moment before the message becomes visible."""
        bag_ns = max(int(index.time_ns[position]) - 1, state.bag_ns)
        if self._timeline.wait_until_due(bag_ns, state.version):
            self._timeline.pause_at(bag_ns, state.version)
            self._paused_before = state.scene, position

    def _is_behind(self, bag_ns: int, state: TimelineState) -> bool:
        if self._heard_scene != state.scene:
            self._heard_scene, self._heard_ns = state.scene, state.bag_ns
        return self._max_delay_ns is not None and bag_ns - self._heard_ns > self._max_delay_ns

    def _hold(self, index: BagIndex, position: int, state: TimelineState) -> None:
        """Hold after the last message, unless the listener has caught up meanwhile."""
        before_ns = _before(index, position, state)
        if (self._timeline.wait_until_due(before_ns, state.version)
                and self._is_behind(before_ns, state)):
            self._timeline.hold(state.version)
            self._release()

    def _release(self) -> None:
        state = self._timeline.state
        if state.held and not self._is_behind(state.bag_ns, state):
            self._timeline.release()


def _before(index: BagIndex, position: int, state: TimelineState) -> int:
    """Return the bag time [ns] after which there is nothing more before a message."""
    last_ns = int(index.time_ns[position - 1]) if position else state.begin_ns
    return max(last_ns, state.bag_ns)
