# SPDX-License-Identifier: BSD-3-Clause
"""Steps: their targets, and the exchange of requests and answers with the publishing thread."""
from __future__ import annotations

import contextlib
import queue
from concurrent.futures import Future
from concurrent.futures import TimeoutError as FutureTimeout
from dataclasses import dataclass, replace
from typing import Callable, Optional, Tuple

import numpy as np

from process_visualizer.bagio.bag_index import BagIndex
from process_visualizer.playback.timeline import Clock, CommandRefused, TimelineState, within


@dataclass(frozen=True)
class Step:
    """A step by messages, of one topic or ('') of all, or (count 0) by a time [ns]."""

    count: int
    topic: str
    duration_ns: int


@dataclass(frozen=True)
class StepTarget:
    """A number of passed messages, and a position [bag ns] at which exactly these are passed.

    ``changed`` is a text on what differs from the request; it is empty if nothing does.
    """

    count: int
    bag_ns: int
    changed: str = ''


def step_by_messages(index: BagIndex, end_ns: int, passed: int, count: int,
                     topic: str = '') -> StepTarget:
    """Return the target of a step by messages, of one topic or ('') of all; below 0 backward.

    A step forward ends at a message, at or before ``end_ns`` [bag ns]; a step backward ends just
    before one, with the scene of that time. If fewer messages are left, the step ends with the last
    one.

    Raises:
        CommandRefused: the topic is not in the recording, or no message is left in that direction.
    """
    positions = _positions(index, topic)
    done = passed if positions is None else int(np.searchsorted(positions, passed))
    total = index.count_until(end_ns)
    total = total if positions is None else int(np.searchsorted(positions, total))
    reached = min(max(done + count, 0), total)
    of_topic = f' on {topic}' if topic else ''
    if reached == done:
        raise CommandRefused(f'there is no message {"after" if count > 0 else "before"} this '
                             f'position{of_topic}')
    before = reached
    if positions is not None:
        before = int(positions[reached - 1]) + 1 if count > 0 else int(positions[reached])
    target = StepTarget(before, int(index.time_ns[before - 1]) if before else index.begin_ns)
    stepped = abs(reached - done)
    if stepped == abs(count):
        return target
    return replace(target, changed=f'only {stepped} of {abs(count)} messages are left{of_topic}')


def step_by_time(index: BagIndex, state: TimelineState, bag_ns: int) -> StepTarget:
    """Return the target of a step to a bag time [ns], limited to the ends of the recording."""
    target_ns, changed = within(state, bag_ns)
    return StepTarget(index.count_until(target_ns), target_ns, changed)


def _positions(index: BagIndex, topic: str) -> Optional[np.ndarray]:
    if not topic:
        return None
    connections = index.connections_of(topic)
    if not connections:
        raise CommandRefused(f'the topic {topic} is not in the recording, or not chosen')
    return index.positions_of(connections)


class StepRequests:
    """Steps requested by any thread and done by one thread, in their order."""

    def __init__(self) -> None:
        self._waiting: queue.SimpleQueue[Tuple[Step, Future[StepTarget]]] = queue.SimpleQueue()
        self._refusal = ''

    @property
    def is_empty(self) -> bool:
        """Return whether no step is waiting."""
        return self._waiting.empty()

    def add(self, step: Step) -> Future[StepTarget]:
        """Request a step; the answer will be its target, or CommandRefused."""
        answer: Future[StepTarget] = Future()
        self._waiting.put((step, answer))
        if self._refusal:  # read after the step was put: either thread then refuses it
            self._refuse_waiting()
        return answer

    def answer(self, do: Callable[[Step], StepTarget]) -> None:
        """Let a function do the step that has waited longest, unless the step was canceled.

        CommandRefused from the function is an answer; any other exception is raised here too.
        """
        step, answer = self._waiting.get()
        if not answer.set_running_or_notify_cancel():
            return
        try:
            answer.set_result(do(step))
        except CommandRefused as error:
            answer.set_exception(error)
        except Exception as error:
            answer.set_exception(CommandRefused(f'playback has failed: {error!r}'))
            raise

    def refuse(self, reason: str) -> None:
        """Refuse all waiting steps, and all later ones."""
        self._refusal = reason
        self._refuse_waiting()

    def _refuse_waiting(self) -> None:
        with contextlib.suppress(queue.Empty):
            while True:
                _, answer = self._waiting.get_nowait()
                if answer.set_running_or_notify_cancel():
                    answer.set_exception(CommandRefused(self._refusal))


def target_in_time(answer: Future[StepTarget], timeout_s: float, clock: Clock) -> StepTarget:
    """Wait for the target of a step; give up the step if it has not begun within a time [s].

    Raises:
        CommandRefused: the step was refused, or given up.
    """
    try:
        return clock.result(answer, timeout_s)
    except FutureTimeout:
        if answer.cancel():
            raise CommandRefused('the player is busy: nothing was changed; try again') from None
        return answer.result()
