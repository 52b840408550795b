# SPDX-License-Identifier: BSD-3-Clause
"""Playback time and stamps keep their guarantees after any sequence of commands."""
from bags_fake_clock import FakeClock
from hypothesis import assume, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule

from process_visualizer.playback.stamp_mapping import StampMapping, clamped_stamp
from process_visualizer.playback.timeline import MIN_LOOP_NS, NS_PER_S, Timeline

BEGIN = 1_600_000_000 * NS_PER_S
RATES = st.one_of(st.sampled_from([0.01, 0.1, 0.5, 1.0, 2.0, 16.0]), st.floats(0.01, 16.0))
SHARES = st.floats(-0.1, 1.1)


class TimelineMachine(RuleBasedStateMachine):
    @initialize(length=st.integers(0, 20 * NS_PER_S),
                head_start=st.sampled_from([0, NS_PER_S // 20]))
    def begin(self, length, head_start):
        self.clock = FakeClock()
        self.end = BEGIN + length
        self.head_start = head_start
        self.timeline = Timeline(BEGIN, self.end, self.clock, head_start)
        self.mapping = StampMapping(self.clock)
        self.in_scene = {}  # bag stamp -> wall stamp, since the scene began
        self.in_command = []  # (bag stamp, wall stamp) first seen since the command, while playing
        self.latest_before = self.latest = 0  # wall stamps before the command, and until now
        self.seen = self.timeline.state

    def at(self, share):
        return BEGIN + round(share * (self.end - BEGIN))

    def continuous(self, command):
        """Run a command that must neither move the position nor begin a segment."""
        before, segment = self.timeline.position_ns(), self.timeline.state.segment
        command()
        assert self.timeline.position_ns() == before
        assert self.timeline.state.segment == segment

    def jumping(self, command, target):
        segment, scene = self.timeline.state.segment, self.timeline.state.scene
        command()
        assert self.timeline.position_ns() == target
        assert self.timeline.state.segment == segment + 1
        assert self.timeline.state.scene == scene + 1

    @rule(passed=st.one_of(st.integers(0, 100), st.integers(0, 3 * NS_PER_S)))
    def time_passes(self, passed):
        state, before = self.timeline.state, self.timeline.position_ns()
        waits = min(max(state.monotonic_ns - self.clock.now_ns, 0), passed)  # for the head start
        self.clock.now_ns += passed
        change = self.timeline.position_ns() - before
        if state.paused:
            assert change == 0
        elif self.timeline.position_ns() == state.limit_ns:
            assert change * state.rate >= 0
        else:
            assert abs(change - (passed - waits) * state.rate) <= 1.001
            assert change * state.rate >= 0

    @rule()
    def play(self):
        state = self.timeline.state
        if state.paused and not state.loop and state.bag_ns == state.limit_ns:
            self.jumping(self.timeline.play, BEGIN if state.forward else self.end)
        else:
            self.continuous(self.timeline.play)

    @rule()
    def pause(self):
        self.continuous(self.timeline.pause)

    @rule(rate=RATES, backwards=st.booleans())
    def set_rate(self, rate, backwards):
        self.continuous(lambda: self.timeline.set_rate(-rate if backwards else rate))

    @rule(begin=st.floats(0, 1), end=st.floats(0, 1))
    def set_loop(self, begin, end):
        assume(self.at(end) - self.at(begin) >= MIN_LOOP_NS)
        self.continuous(lambda: self.timeline.set_loop(self.at(begin), self.at(end)))

    @rule()
    def clear_loop(self):
        self.continuous(self.timeline.clear_loop)

    @rule()
    def interrupt(self):
        self.continuous(self.timeline.interrupt)

    @rule()
    def stop(self):
        self.jumping(self.timeline.stop, BEGIN)

    @rule(share=SHARES)
    def seek(self, share):
        inside = min(max(self.at(share), BEGIN), self.end)
        self.jumping(lambda: self.timeline.seek(self.at(share)), inside)

    @rule(share=SHARES)
    def step(self, share):
        segment = self.timeline.state.segment
        self.timeline.step_to(self.at(share))
        assert self.timeline.position_ns() == min(max(self.at(share), BEGIN), self.end)
        assert self.timeline.state.segment == segment

    @rule()
    def pass_limit(self):
        state, position = self.timeline.state, self.timeline.position_ns()
        if state.paused or position != state.limit_ns or not state.loop:
            self.continuous(lambda: self.timeline.pass_limit(state.version))
        else:
            self.jumping(lambda: self.timeline.pass_limit(state.version),
                         state.loop[0 if state.forward else 1])

    @precondition(lambda self: not self.timeline.state.paused)
    @rule(back=st.integers(0, NS_PER_S))
    def slip(self, back):
        state, before = self.timeline.state, self.timeline.position_ns()
        message = before - back if state.forward else before + back
        assume(BEGIN <= message <= self.end)
        self.timeline.slip_to(message, state.version)
        after = self.timeline.position_ns()
        assert (after - before) * state.rate <= 0
        assert (before - message) * state.rate > 0 or after == before
        if after != before:
            assert after == message
            assert self.timeline.state.due_ns(message) == self.clock.now_ns

    @rule(latency=st.one_of(st.integers(-3, 3).map(lambda it: it * 50_000_000),
                            st.integers(-3 * NS_PER_S, 3 * NS_PER_S)),
          grid=st.sampled_from([1, 100_000_000]), restored=st.booleans())
    def publish(self, latency, grid, restored):
        state, message = self.timeline.state, self.timeline.position_ns()
        stamp = (message - latency) // grid * grid
        if restored:
            wall = self.mapping.present(state, stamp)
        else:
            wall = self.mapping.stamp(state, stamp, message)
        self.check_stamp(state, stamp, message, wall, restored)

    def check_stamp(self, state, stamp, message, wall, restored):
        if state.scene != self.seen.scene:
            self.in_scene.clear()
        if state.command != self.seen.command:
            self.in_command, self.latest_before = [], self.latest
        self.seen = state
        assert wall <= self.clock.wall_ns(), 'in the future'
        if stamp in self.in_scene:
            assert wall == self.in_scene[stamp], 'equal stamps stay equal'
            return
        assert wall >= self.latest_before, 'before what was stamped until the command'
        self.in_scene[stamp] = wall
        self.latest = max(wall, self.latest)
        if state.paused or restored:
            assert wall == self.clock.wall_ns()
            self.in_command = []
            return
        near = clamped_stamp(state, stamp, message)
        sign = 1 if state.forward else -1
        for other, other_wall in self.in_command:
            assert (near - other) * (wall - other_wall) * sign >= 0, 'order'
        self.in_command.append((near, wall))

    @invariant()
    def position_lies_within_the_recording(self):
        assert BEGIN <= self.timeline.position_ns() <= self.end

    @invariant()
    def position_is_due(self):
        state, position = self.timeline.state, self.timeline.position_ns()
        due = state.due_ns(position)
        if due is None:
            assert state.paused
        else:
            assert state.monotonic_ns <= self.clock.now_ns + self.head_start
            assert due <= max(self.clock.now_ns, state.monotonic_ns)
            if position not in (state.limit_ns, state.bag_ns):
                assert self.clock.now_ns - due <= 1 / abs(state.rate) + 1

    @invariant()
    def reached_exactly_when_due(self):
        state = self.timeline.state
        ahead = (state.bag_ns + state.limit_ns) // 2
        if state.paused or ahead in (state.bag_ns, state.limit_ns):
            return
        due = state.due_ns(ahead)
        assert (state.position_at(due) - ahead) * state.rate >= 0
        assert (state.position_at(due - 1) - ahead) * state.rate < 0


TimelineMachine.TestCase.settings = settings(max_examples=80, stateful_step_count=40,
                                             deadline=None)
test_timeline_after_every_sequence_of_commands = TimelineMachine.TestCase
