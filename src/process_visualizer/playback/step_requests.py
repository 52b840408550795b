# SPDX-License-Identifier: BSD-3-Clause
"""Steps on their way from those who ask for them to the thread that publishes, and back."""
from __future__ import annotations

import queue
from concurrent.futures import Future
from concurrent.futures import TimeoutError as FutureTimeout
from typing import Callable, NoReturn, Tuple

from process_visualizer.playback.clock import Clock
from process_visualizer.playback.step_target import Step, StepTarget
from process_visualizer.playback.timeline import CommandRefused


class StepRequests:
    """Steps that any threads ask for and one thread does, in their order."""

    def __init__(self) -> None:
        self._waiting: queue.SimpleQueue[Tuple[Step, Future[StepTarget]]] = queue.SimpleQueue()

    @property
    def is_empty(self) -> bool:
        """Return whether no step waits."""
        return self._waiting.empty()

    def add(self, step: Step) -> Future[StepTarget]:
        """Ask for a step; the answer will be its target, or CommandRefused."""
        answer: Future[StepTarget] = Future()
        self._waiting.put((step, answer))
        return answer

    def answer(self, do: Callable[[Step], StepTarget]) -> None:
        """Let a function do the step that has waited longest, unless nobody waits for it any more.

        It may raise CommandRefused, which is an answer; what else it raises is raised here too.
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
        """Do none of the steps that wait."""
        def refused(_step: Step) -> NoReturn:
            raise CommandRefused(reason)

        while not self.is_empty:
            self.answer(refused)


def target_in_time(answer: Future[StepTarget], timeout_s: float, clock: Clock) -> StepTarget:
    """Wait for the target of a step; give the step up if it is not begun within a time [s].

    Raises:
        CommandRefused: the step was refused, or given up.
    """
    try:
        return clock.result(answer, timeout_s)
    except FutureTimeout:
        if answer.cancel():
            raise CommandRefused('the player is busy: nothing was changed; try again') from None
        return answer.result()
