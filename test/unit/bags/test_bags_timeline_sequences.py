# SPDX-License-Identifier: BSD-3-Clause
"""Playback time and stamps hold their promises after every sequence of commands."""
from bags_fake_clock import FakeClock
from hypothesis import assume, settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, initialize, invariant, precondition, rule

from process_visualizer.playback.stamp_mapping import StampMapping, nearby
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
        self.in_command = []  # (bag stamp, wall stamp) first seen since the command, playing
        self.latest_before = self.latest = 0  # wall stamps before the command, and until now
        self.seen = self.timeline.basis

    def at(self, share):
        return BEGIN + round(share * (self.end - BEGIN))

    def continuous(self, command):
        """Carry out a command that must not move the position, nor begin a segment."""
        before, segment = self.timeline.position_ns(), self.timeline.basis.segment
        command()
        assert self.timeline.position_ns() == before
        assert self.timeline.basis.segment == segment

    def jumping(self, command, target):
        segment, scene = self.timeline.basis.segment, self.timeline.basis.scene
        command()
        assert self.timeline.position_ns() == target
        assert self.timeline.basis.segment == segment + 1
        assert self.timeline.basis.scene == scene + 1

    @rule(passed=st.one_of(st.integers(0, 100), st.integers(0, 3 * NS_PER_S)))
    def time_passes(self, passed):
        basis, before = self.timeline.basis, self.timeline.position_ns()
        waits = min(max(basis.monotonic_ns - self.clock.now_ns, 0), passed)  # for the head start
        self.clock.now_ns += passed
        change = self.timeline.position_ns() - before
        if basis.paused:
            assert change == 0
        elif self.timeline.position_ns() == basis.limit_ns:
            assert change * basis.rate >= 0
        else:
            assert abs(change - (passed - waits) * basis.rate) <= 1.001
            assert change * basis.rate >= 0

    @rule()
    def play(self):
        basis = self.timeline.basis
        if basis.paused and not basis.loop and basis.bag_ns == basis.limit_ns:
            self.jumping(self.timeline.play, BEGIN if basis.forward else self.end)
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
        segment = self.timeline.basis.segment
        self.timeline.step_to(self.at(share))
        assert self.timeline.position_ns() == min(max(self.at(share), BEGIN), self.end)
        assert self.timeline.basis.segment == segment

    @rule()
    def pass_limit(self):
        basis, position = self.timeline.basis, self.timeline.position_ns()
        if basis.paused or position != basis.limit_ns or not basis.loop:
            self.continuous(lambda: self.timeline.pass_limit(basis.version))
        else:
            self.jumping(lambda: self.timeline.pass_limit(basis.version),
                         basis.loop[0 if basis.forward else 1])

    @precondition(lambda self: not self.timeline.basis.paused)
    @rule(back=st.integers(0, NS_PER_S))
    def slip(self, back):
        basis, before = self.timeline.basis, self.timeline.position_ns()
        message = before - back if basis.forward else before + back
        assume(BEGIN <= message <= self.end)
        self.timeline.slip_to(message, basis.version)
        after = self.timeline.position_ns()
        assert (after - before) * basis.rate <= 0
        assert (before - message) * basis.rate > 0 or after == before
        if after != before:
            assert after == message
            assert self.timeline.basis.due_ns(message) == self.clock.now_ns

    @rule(latency=st.one_of(st.integers(-3, 3).map(lambda it: it * 50_000_000),
                            st.integers(-3 * NS_PER_S, 3 * NS_PER_S)),
          grid=st.sampled_from([1, 100_000_000]), restored=st.booleans())
    def publish(self, latency, grid, restored):
        basis, message = self.timeline.basis, self.timeline.position_ns()
        stamp = (message - latency) // grid * grid
        if restored:
            wall = self.mapping.present(basis, stamp)
        else:
            wall = self.mapping.stamp(basis, stamp, message)
        self.check_stamp(basis, stamp, message, wall, restored)

    def check_stamp(self, basis, stamp, message, wall, restored):
        if basis.scene != self.seen.scene:
            self.in_scene.clear()
        if basis.command != self.seen.command:
            self.in_command, self.latest_before = [], self.latest
        self.seen = basis
        assert wall <= self.clock.wall_ns(), 'in the future'
        if stamp in self.in_scene:
            assert wall == self.in_scene[stamp], 'equal stamps stay equal'
            return
        assert wall >= self.latest_before, 'before what was stamped until the command'
        self.in_scene[stamp] = wall
        self.latest = max(wall, self.latest)
        if basis.paused or restored:
            assert wall == self.clock.wall_ns()
            self.in_command = []
            return
        near = nearby(basis, stamp, message)
        sign = 1 if basis.forward else -1
        for other, other_wall in self.in_command:
            assert (near - other) * (wall - other_wall) * sign >= 0, 'order'
        self.in_command.append((near, wall))

    @invariant()
    def position_lies_within_the_recording(self):
        assert BEGIN <= self.timeline.position_ns() <= self.end

    @invariant()
    def position_is_due(self):
        basis, position = self.timeline.basis, self.timeline.position_ns()
        due = basis.due_ns(position)
        if due is None:
            assert basis.paused
        else:
            assert basis.monotonic_ns <= self.clock.now_ns + self.head_start
            assert due <= max(self.clock.now_ns, basis.monotonic_ns)
            if position not in (basis.limit_ns, basis.bag_ns):
                assert self.clock.now_ns - due <= 1 / abs(basis.rate) + 1

    @invariant()
    def reached_exactly_when_due(self):
        basis = self.timeline.basis
        ahead = (basis.bag_ns + basis.limit_ns) // 2
        if basis.paused or ahead in (basis.bag_ns, basis.limit_ns):
            return
        due = basis.due_ns(ahead)
        assert (basis.position_at(due) - ahead) * basis.rate >= 0
        assert (basis.position_at(due - 1) - ahead) * basis.rate < 0


TimelineMachine.TestCase.settings = settings(max_examples=80, stateful_step_count=40,
                                             deadline=None)
test_timeline_after_every_sequence_of_commands = TimelineMachine.TestCase
