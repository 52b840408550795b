# SPDX-License-Identifier: BSD-3-Clause
"""Shared helpers of the playback tests: recordings, steps and the expected scene."""
from __future__ import annotations

from hypothesis import strategies as st
from playback_stage import CONNECTIONS, MS, PICTURE, Message, Stage
from scanned_scene import check_seen

from process_visualizer.playback.steps import Step

SECOND = [Message(number % 2, 10 * number) for number in range(101)]


def _picture(time_ms: int, age_ms: int) -> Message:
    return Message(PICTURE, time_ms, max(time_ms - age_ms, 0))


messages_of_a_recording = st.lists(st.one_of(
    st.builds(Message, st.integers(0, len(CONNECTIONS) - 1), st.integers(0, 500), st.just(-1)),
    st.builds(_picture, st.integers(0, 500), st.integers(-20, 250))), min_size=1, max_size=40)
steps = st.lists(st.builds(Step, st.integers(-3, 3), st.sampled_from(['', '/a', '/latched']),
                           st.sampled_from([-50 * MS, 1, 20 * MS])), max_size=4)


def check_scene(stage: Stage) -> None:
    """Compare the viewer's scene with a scan up to the position."""
    position_ns = stage.timeline.position_ns()
    check_seen(stage, sum(message.time_ns <= position_ns for message in stage.messages))


def check_scene_passed(stage: Stage) -> None:
    """Compare the viewer's scene with a scan; some of the messages at the position's time count."""
    position_ns = stage.timeline.position_ns()
    before = sum(message.time_ns < position_ns for message in stage.messages)
    until = sum(message.time_ns <= position_ns for message in stage.messages)
    assert before <= stage.playback.passed <= until
    check_seen(stage, stage.playback.passed)


def queued(stage: Stage, step: Step) -> None:
    """Request a step from the thread that performs it, which must not wait for the answer."""
    stage.playback.request(step)
