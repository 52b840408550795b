# SPDX-License-Identifier: BSD-3-Clause
"""The messages given to the output and withdrawn from it, after any sequence of both."""
from __future__ import annotations

from typing import Dict

from hypothesis import assume, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, rule
from playback_stage import MS, MemoryRecording, Message, ScriptedClock, Viewer

from process_visualizer.playback.message_loader import MessageLoader
from process_visualizer.playback.playback_event import FORWARD, EventMaker, PlaybackEvent
from process_visualizer.playback.scheduled_output import LEAD_NS, SETTLING_NS, ScheduledOutput
from process_visualizer.playback.stamp_mapping import StampMapping
from process_visualizer.playback.timeline import Timeline

COUNT = 200
RECORDING = MemoryRecording([Message(number % 2, 5 * number) for number in range(COUNT)])
EVENTS = EventMaker(RECORDING.index, MessageLoader(RECORDING), RECORDING.begin_ns)


class OutputMachine(RuleBasedStateMachine):
    """State machine that gives messages in recorded order, and withdrawn ones once more."""

    @initialize(begun_ms=st.sampled_from([0, 8]), lead=st.integers(1, 8), restamp=st.booleans())
    def begin(self, begun_ms: int, lead: int, restamp: bool) -> None:
        self.clock = ScriptedClock()
        self.viewer = Viewer(self.clock)
        self.viewer.begun_ns = begun_ms * MS
        mapping = StampMapping(self.clock) if restamp else None
        self.lead = lead  # maximum number of messages that may be ahead
        self.output = ScheduledOutput(self.viewer, self.clock, mapping,
                                      lead * EVENTS.forward(0).size, EVENTS.sensors)
        timeline = Timeline(RECORDING.begin_ns, RECORDING.end_ns, self.clock)
        timeline.play()
        self.state = timeline.state
        self.count = 0  # of messages given and not withdrawn
        self.ahead: Dict[int, int] = {}  # by position: due times of messages that are not shown yet
        self.quiet_since_ns = 0

    def next_event(self) -> PlaybackEvent:
        assume(self.count < COUNT)
        self.count += 1
        return EVENTS.forward(self.count - 1)

    @rule()
    def give(self) -> None:
        event = self.next_event()
        due_ns = self.state.due_ns(event.time_ns)
        self.output.give(event, self.count - 1, FORWARD, self.state)
        self.ahead[self.count - 1] = due_ns
        self.quiet_since_ns = max(self.clock.now_ns, due_ns)

    @rule()
    def show_at_once(self) -> None:
        self.output.show(self.next_event(), self.state)
        self.quiet_since_ns = self.clock.now_ns

    @rule(passed_ms=st.integers(0, 30))
    def time_passes(self, passed_ms: int) -> None:
        self.clock.now_ns += passed_ms * MS
        self.viewer.receive()

    @rule()
    def take_back(self) -> None:
        positions = [scheduled.position for scheduled in self.output.take_back()]
        left = self.count - len(positions)
        assert positions == list(reversed(range(left, self.count)))
        self.count = left
        for position in positions:
            assert self.ahead.pop(position) > self.clock.now_ns
            self.quiet_since_ns = self.clock.now_ns

    @rule()
    def what_is_over_is_settled(self) -> None:
        self.output.settle()
        assert self.output.settled_ns is None
        self.quiet_since_ns = 0

    @invariant()
    def what_is_not_taken_back_is_published(self) -> None:
        assert self.output.published == self.count
        assert [it.number for it in self.viewer.log] == list(range(self.count
                                                                   - self.viewer.waiting))

    @invariant()
    def what_is_ahead_is_bounded(self) -> None:
        ahead = sum(due_ns >= self.clock.now_ns for due_ns in self.ahead.values())
        assert self.output.lead_ns() == (LEAD_NS if ahead < self.lead else 0)

    @invariant()
    def it_settles_some_time_after_the_last(self) -> None:
        expected_ns = self.quiet_since_ns + SETTLING_NS if self.quiet_since_ns else None
        assert self.output.settled_ns == expected_ns


OutputMachine.TestCase.settings = settings(max_examples=80, stateful_step_count=40, deadline=None)
test_output_after_every_sequence = OutputMachine.TestCase
