# SPDX-License-Identifier: BSD-3-Clause
"""Playback ends whenever it is closed."""
from __future__ import annotations

import threading
from typing import Callable, Optional
from unittest import mock

import pytest
from playback_stage import MemoryRecording, Message

from process_visualizer.playback.engine import Playback
from process_visualizer.playback.scheduled_output import Output
from process_visualizer.playback.steps import Step
from process_visualizer.playback.timeline import CommandRefused, Timeline, TimelineState


class ClosedMeanwhile(Timeline):
    """Close playback just before its state is read, once the first wait without a limit is over."""

    close: Optional[Callable[[], None]] = None
    _waited = False

    @property
    def state(self) -> TimelineState:
        if self._waited and self.close is not None:
            close, self.close = self.close, None
            close()
        return super().state

    def wait_for_command(self, until_ns: Optional[int], version: int) -> bool:
        if self._waited or until_ns is not None:
            return super().wait_for_command(until_ns, version)
        self._waited = True
        return True


def test_close_is_heard_between_two_steps_of_the_work() -> None:
    recording = MemoryRecording([Message(0, 0), Message(0, 100)])
    timeline = ClosedMeanwhile(recording.begin_ns, recording.end_ns)
    output = mock.Mock(spec=Output, **{'revoke.return_value': 0})
    playback = Playback(recording, timeline, output)
    timeline.close = playback.close
    thread = threading.Thread(target=playback.run, daemon=True)
    thread.start()
    thread.join(30.0)
    assert not thread.is_alive()


def test_a_step_after_the_end_is_refused_at_once() -> None:
    recording = MemoryRecording([Message(0, 0), Message(0, 100)])
    output = mock.Mock(spec=Output, **{'revoke.return_value': 0})
    playback = Playback(recording, Timeline(recording.begin_ns, recording.end_ns), output)
    playback.close()
    playback.run()
    with pytest.raises(CommandRefused, match='the player ends'):
        playback.step(Step(1, '', 0), answer_s=0.0)
