# SPDX-License-Identifier: BSD-3-Clause
"""The published scene after any sequence of passed messages, withdrawn messages and seeks."""
from __future__ import annotations

from dataclasses import replace
from typing import List, Tuple

import pytest
from hypothesis import given
from hypothesis import strategies as st
from playback_stage import BEGIN_NS, MS, MemoryRecording, Message

from process_visualizer.playback.engine import ShownScene, scene_after_jump
from process_visualizer.playback.playback_event import BACKWARD, FORWARD
from process_visualizer.playback.timeline import TimelineState

TIMES_MS = (0, 10, 10, 10, 20)
INDEX = MemoryRecording([Message(0, time_ms) for time_ms in TIMES_MS]).index
COUNT = len(TIMES_MS)
AT_10 = TimelineState(BEGIN_NS + 10 * MS, 0, BEGIN_NS, BEGIN_NS + 20 * MS, scene=3)
PLAYING = replace(AT_10, paused=False)


@pytest.mark.parametrize('state, expected', [
    (AT_10, ShownScene(4, 3, AT_10.bag_ns)),
    (PLAYING, ShownScene(1, 3)),  # messages at exactly this time are played afterward
    (replace(PLAYING, rate=-1.0), ShownScene(4, 3)),
])
def test_after_a_jump(state: TimelineState, expected: ShownScene) -> None:
    assert scene_after_jump(INDEX, state) == expected


@pytest.mark.parametrize('state, bag_ns, expected', [
    (AT_10, AT_10.bag_ns, 2),
    (AT_10, AT_10.bag_ns + 1, 4),
    (PLAYING, AT_10.bag_ns, 4),
    (replace(AT_10, scene=4), AT_10.bag_ns, 4),
])
def test_where_it_stands_after_a_step_the_messages_of_the_step_are_visible(
        state: TimelineState, bag_ns: int, expected: int) -> None:
    shown = ShownScene(1, 3).standing(2, AT_10.bag_ns)
    assert shown.visible(INDEX, state, bag_ns) == expected


def test_what_moves_stands_nowhere() -> None:
    shown = ShownScene(2, 3, AT_10.bag_ns)
    assert shown.moving() == shown.with_passed(1, FORWARD) == ShownScene(2, 3)
    assert shown.without(2, FORWARD).paused_ns == shown.paused_ns


@given(st.integers(0, COUNT), st.lists(st.tuples(st.booleans(), st.integers(0, 3))))
def test_what_is_passed_and_taken_back_leads_to_where_it_was(
        passed: int, plays: List[Tuple[bool, int]]) -> None:
    """Each play has a direction; afterward a number of the passed messages is withdrawn."""
    shown = ShownScene(passed, 3)
    trail: List[Tuple[ShownScene, int, int]] = []
    for forward, taken_back in plays:
        position, step = shown.next_message(forward)
        if 0 <= position < COUNT:
            trail.append((shown, position, step))
            shown = shown.with_passed(position, step)
            assert shown.next_message(not forward) == (position, -step)
        for _ in range(min(taken_back, len(trail))):
            before, position, step = trail.pop()
            shown = shown.without(position, step)
            assert shown == before
        assert 0 <= shown.passed <= COUNT and shown.scene == 3
    steps = [step for _, _, step in trail]
    assert shown.passed == passed + steps.count(FORWARD) - steps.count(BACKWARD)
