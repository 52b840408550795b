# SPDX-License-Identifier: BSD-3-Clause
"""Each requested step is answered once and in order, whatever else is requested."""
from __future__ import annotations

from typing import Callable, List, NoReturn

import pytest
from hypothesis import given
from hypothesis import strategies as st

from process_visualizer.playback.steps import Step, StepRequests, StepTarget, target_in_time
from process_visualizer.playback.timeline import Clock, CommandRefused


def stepped(step: Step) -> StepTarget:
    return StepTarget(step.count, 0)


def refuses(step: Step) -> NoReturn:
    raise CommandRefused(f'no step {step.count}')


def fails(_step: Step) -> NoReturn:
    raise ZeroDivisionError


@given(st.lists(st.sampled_from(['ask', 'give up', 'do', 'refuse', 'fail'])))
def test_every_sequence(actions: List[str]) -> None:
    requests = StepRequests()
    answers, expected, done = [], [], 0

    def answer(do: Callable[[Step], StepTarget], result: str) -> None:
        nonlocal done
        if not requests.is_empty:
            requests.answer(do)
            expected[done] = expected[done] or result
            done += 1

    for action in actions:
        if action == 'ask':
            answers.append(requests.add(Step(len(answers), '', 0)))
            expected.append('')
        elif action == 'give up' and answers and answers[-1].cancel():
            expected[-1] = 'given up'
        elif action == 'do':
            answer(stepped, 'done')
        elif action == 'refuse':
            answer(refuses, 'refused')
        elif action == 'fail' and done < len(answers) and not expected[done]:
            with pytest.raises(ZeroDivisionError):
                answer(fails, 'failed')
            expected[done] = 'refused'
            done += 1
    requests.refuse('the player ends')
    answers.append(requests.add(Step(len(answers), '', 0)))
    expected.append('')
    assert requests.is_empty
    for number, (future, result) in enumerate(zip(answers, expected)):
        assert future.done()
        assert future.cancelled() == (result == 'given up')
        if result == 'done':
            assert future.result(0).count == number
        elif result != 'given up':
            assert isinstance(future.exception(0), CommandRefused)


def test_who_waits_too_long_gives_the_step_up() -> None:
    requests = StepRequests()
    with pytest.raises(CommandRefused, match='the player is busy'):
        target_in_time(requests.add(Step(1, '', 0)), 0.0, Clock())
    requests.answer(fails)  # it is no longer performed


def test_a_step_that_has_begun_is_waited_for() -> None:
    requests = StepRequests()
    future = requests.add(Step(1, '', 0))

    def begun(step: Step) -> StepTarget:
        assert not future.cancel()
        return stepped(step)

    requests.answer(begun)
    assert target_in_time(future, 0.0, Clock()) == StepTarget(1, 0)
