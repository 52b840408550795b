# SPDX-License-Identifier: BSD-3-Clause
"""Playback time: the current position in the recording, after any sequence of commands."""
from __future__ import annotations

import math
import threading
import time
from collections import deque
from concurrent.futures import Future
from dataclasses import dataclass, replace
from typing import Any, Deque, Optional, Tuple, TypeVar

WINDOW_NS = 1_000_000_000
_KEPT_SHARE = 0.95
"""Minimum share of the rate for it to count as achieved."""


def is_too_slow(rate: float, achieved_rate: float) -> bool:
    """Return whether the computer is too slow for a rate, so that the achieved rate is shown."""
    return abs(achieved_rate) < _KEPT_SHARE * abs(rate)


class AchievedRate:
    """The share of the rate that was achieved within a short window up to now."""

    def __init__(self, now_ns: int) -> None:
        """Begin at a monotonic time [ns]."""
        self.restart(now_ns)

    def restart(self, now_ns: int) -> None:
        """Clear all losses, after a command."""
        self._begin_ns = now_ns
        self._losses: Deque[Tuple[int, int]] = deque()  # time of a loss [ns], its duration [ns]

    def lose(self, now_ns: int, late_ns: int) -> None:
        """Record that play has just slipped by a time [ns]."""
        self._losses.append((now_ns, late_ns))
        self._forget(now_ns)

    def share(self, now_ns: int) -> float:
        """Return the share (0 to 1) of the window that was not lost."""
        self._forget(now_ns)
        begin_ns = max(self._begin_ns, now_ns - WINDOW_NS)
        if now_ns <= begin_ns:
            return 1.0
        lost_ns = sum(min(late_ns, lost_at_ns - begin_ns) for lost_at_ns, late_ns in self._losses)
        return max(0.0, 1.0 - lost_ns / (now_ns - begin_ns))

    def _forget(self, now_ns: int) -> None:
        while self._losses and self._losses[0][0] <= now_ns - WINDOW_NS:
            self._losses.popleft()


Result = TypeVar('Result')

MAX_WAIT_S = 3600.0  # threading refuses times that overflow its own type


class Clock:
    """The computer's clocks."""

    def monotonic_ns(self) -> int:
        """Return the monotonic time [ns], which is never set."""
        return time.monotonic_ns()

    def wall_ns(self) -> int:
        """Return the time of day [ns since 1970], which may be set."""
        return time.time_ns()

    def wait(self, condition: threading.Condition, timeout_ns: int) -> None:
        """Wait for a notification, at most for a time [ns]; the caller holds the lock."""
        condition.wait(min(timeout_ns * 1e-9, MAX_WAIT_S))

    def result(self, answer: Future[Result], timeout_s: float) -> Result:
        """Wait for the answer of another thread, at most for a time [s]; return or raise it.

        Raises:
            concurrent.futures.TimeoutError: the answer did not arrive in time.
        """
        return answer.result(timeout_s)


NS_PER_S = 1_000_000_000
MIN_RATE = 0.01  # of the rates offered to the user; other rates may be requested
MAX_RATE = 16.0
MIN_REQUESTED_RATE = 1e-6
MAX_REQUESTED_RATE = 1e6  # as fast as messages can be sent
MIN_LOOP_NS = NS_PER_S // 10
FOREVER_NS = 1 << 62


class CommandRefused(Exception):
    """A command that cannot be carried out and changed nothing; the text says why."""


@dataclass(frozen=True)
class TimelineState:
    """Playback time as a function of the monotonic clock, from one command to the next.

    Times of the recording are bag times [ns since 1970]. Arithmetic is exact: the rate is taken as
    the integer ratio that a float represents. A bag time is therefore reached exactly when it is
    due: in the direction of play, position_at(t) is at or past b if and only if t >= due_ns(b).
    """

    bag_ns: int  # the position at monotonic_ns
    monotonic_ns: int
    begin_ns: int  # of the recording
    end_ns: int
    rate: float = 1.0
    paused: bool = True
    held: bool = False  # paused until a listener has caught up
    loop: Optional[Tuple[int, int]] = None  # [bag ns]
    segment: int = 0  # grows when the position jumps: no velocity is computed across a jump
    scene: int = 0  # grows when published messages may be published again
    command: int = 0  # grows at each command: times before and after are not comparable
    version: int = 0  # grows whenever waits are interrupted, by a command or for another reason

    @property
    def forward(self) -> bool:
        """Return whether play runs forward."""
        return self.rate > 0.0

    @property
    def limit_ns(self) -> int:
        """Return the bag time at which play ends or jumps back to the other end of the loop.

        From a position past the loop, in the direction of play, play continues to the end of the
        recording.
        """
        if self.forward:
            return self.loop[1] if self.loop and self.bag_ns <= self.loop[1] else self.end_ns
        return self.loop[0] if self.loop and self.bag_ns >= self.loop[0] else self.begin_ns

    def position_at(self, monotonic_ns: int) -> int:
        """Return the bag time [ns] at a monotonic time [ns]; the position stops at the limit."""
        if self.paused:
            return self.bag_ns
        numerator, denominator = abs(self.rate).as_integer_ratio()
        played_ns = max(monotonic_ns - self.monotonic_ns, 0) * numerator // denominator
        if self.forward:
            return min(self.bag_ns + played_ns, self.limit_ns)
        return max(self.bag_ns - played_ns, self.limit_ns)

    def due_ns(self, bag_ns: int) -> Optional[int]:
        """Return the monotonic time [ns] at which a bag time is reached; None while paused.

        For a bag time already passed, the result is in the past.
        """
        if self.paused:
            return None
        numerator, denominator = abs(self.rate).as_integer_ratio()
        ahead_ns = bag_ns - self.bag_ns if self.forward else self.bag_ns - bag_ns
        return self.monotonic_ns - (-ahead_ns * denominator) // numerator


class Timeline:
    """The state of playback, changed by commands from any thread, and waits that these interrupt.

    Reaching the limit (TimelineState.limit_ns) has no effect by itself: the publisher calls
    pass_limit() once all messages up to the limit are published, so that none is lost.
    """

    def __init__(self, begin_ns: int, end_ns: int, clock: Optional[Clock] = None,
                 head_start_ns: int = 0, segment: int = 0) -> None:
        """Begin paused at the beginning of a recording, given its bounds [bag ns].

        Play begins a head start [ns] after the command, so that the first messages can be
        prepared by the time they are due. ``segment`` is the number of the first segment.

        Raises:
            ValueError: the recording ends before it begins.
        """
        if end_ns < begin_ns:
            raise ValueError(f'the end {end_ns} lies before the beginning {begin_ns}')
        self._clock = clock or Clock()
        self._head_start_ns = head_start_ns
        self._changed = threading.Condition()
        now_ns = self._clock.monotonic_ns()
        self._state = TimelineState(begin_ns, now_ns, begin_ns, end_ns, segment=segment)
        self._achieved = AchievedRate(now_ns)

    @property
    def state(self) -> TimelineState:
        """Return the present state; it is immutable."""
        return self._state

    def now(self) -> Tuple[TimelineState, int]:
        """Return the present state and the present monotonic time [ns]."""
        with self._changed:
            return self._state, self._clock.monotonic_ns()

    def position_ns(self) -> int:
        """Return the present position [bag ns]."""
        with self._changed:
            return self._state.position_at(self._clock.monotonic_ns())

    def achieved_rate(self) -> float:
        """Return the rate recently achieved: after slips, it is closer to zero than the set rate.

        The result is 0 while paused.
        """
        with self._changed:
            if self._state.paused:
                return 0.0
            return self._state.rate * self._achieved.share(self._clock.monotonic_ns())

    # Commands: each rebases the state at the present position and interrupts waits.

    def play(self) -> None:
        """Continue to play from the position; from the limit, start over."""
        with self._changed:
            if self._state.paused:
                self._start()

    def begin(self) -> None:
        """Play from the position, even from the limit."""
        with self._changed:
            self._play_on()

    def pause(self) -> None:
        """Pause at the position."""
        with self._changed:
            self._rebase(paused=True)

    def toggle_paused(self) -> None:
        """Play if paused, pause if playing."""
        with self._changed:
            if self._state.paused:
                self._start()
            else:
                self._rebase(paused=True)

    def stop(self) -> None:
        """Pause at the beginning of the recording, whatever the direction."""
        with self._changed:
            self._jump(self._state.begin_ns, paused=True)

    def set_rate(self, rate: float) -> None:
        """Change the rate (negative: backward); the position does not jump.

        A change of direction begins no new segment, as the position does not jump, but a new scene.

        Raises:
            CommandRefused: the rate is 0, not a number, or too small or large.
        """
        checked_rate(rate)
        with self._changed:
            state = self._state
            turned = (rate > 0.0) != state.forward
            self._rebase(rate=float(rate), scene=state.scene + turned,
                         paused=state.paused and not state.held)

    def seek(self, bag_ns: int) -> str:
        """Seek to a bag time [ns] and keep playing or pausing; return what had to be changed.

        A time outside the recording is moved to its nearer end, and the text says so. The text is
        empty if nothing was changed.
        """
        with self._changed:
            target_ns, changed = within(self._state, bag_ns)
            self._jump(target_ns)
        return changed

    def step_to(self, bag_ns: int, version: Optional[int] = None) -> Optional[TimelineState]:
        """Pause at a bag time [ns] within the recording: a step, which begins no new segment.

        A step back begins a new scene: published messages are published again. Return the new
        state. With a version, do nothing and return None if a command came in between (see
        wait_until_due).
        """
        with self._changed:
            state = self._state
            if version not in (None, state.version):
                return None
            target_ns = min(max(bag_ns, state.begin_ns), state.end_ns)
            back = target_ns < state.position_at(self._clock.monotonic_ns())
            self._rebase(bag_ns=target_ns, paused=True, scene=state.scene + back)
            return self._state

    def set_loop(self, begin_ns: int, end_ns: int) -> None:
        """Loop between two bag times [ns]; the position does not jump yet.

        Raises:
            CommandRefused: the times are in the wrong order, too close, or outside the recording.
        """
        with self._changed:
            self._check_loop(begin_ns, end_ns)
            self._rebase(loop=(begin_ns, end_ns))

    def clear_loop(self) -> None:
        """End the loop: play to the end of the recording."""
        with self._changed:
            self._rebase(loop=None)

    def interrupt(self) -> None:
        """End all waits, for a reason other than a command."""
        with self._changed:
            self._state = replace(self._state, version=self._state.version + 1)
            self._changed.notify_all()

    # For the publisher.

    def wait_until_due(self, bag_ns: Optional[int], version: int, lead_ns: int = 0) -> bool:
        """Wait until a bag time [ns] is due (None: forever); return False if a command came first.

        The wait ends earlier by ``lead_ns``. ``version`` is that of the state on which the caller
        based the bag time: a command since then ends the wait at once.
        """
        with self._changed:
            while self._state.version == version:
                remaining_ns = self._remaining_ns(bag_ns) - lead_ns
                if remaining_ns <= 0:
                    return True
                self._clock.wait(self._changed, remaining_ns)
            return False

    def wait_for_command(self, until_ns: Optional[int], version: int) -> bool:
        """Wait for a command, at most until a monotonic time [ns]; return False if none came.

        ``version`` is as in wait_until_due.
        """
        with self._changed:
            while self._state.version == version:
                remaining_ns = (FOREVER_NS if until_ns is None
                                else until_ns - self._clock.monotonic_ns())
                if remaining_ns <= 0:
                    return False
                self._clock.wait(self._changed, remaining_ns)
            return True

    def slip_to(self, bag_ns: int, version: int, begins: bool = False) -> None:
        """Make an overdue bag time [ns] due now: the machine could not keep up.

        If play ``begins`` there, the bag time becomes due after the head start. All later messages
        are delayed by the same time, to avoid a burst. The position goes back to the bag time,
        which must lie within the recording. Nothing happens if the bag time is not overdue, or if a
        command came in between (see wait_until_due).
        """
        with self._changed:
            due_ns, now_ns = self._state.due_ns(bag_ns), self._clock.monotonic_ns()
            if self._state.version != version or due_ns is None or due_ns >= now_ns:
                return
            later_ns = now_ns + (self._head_start_ns if begins else 0)
            self._state = replace(self._state, bag_ns=bag_ns, monotonic_ns=later_ns)
            if begins:
                self._achieved.restart(later_ns)  # a new scene takes time on any computer
            else:
                self._achieved.lose(now_ns, later_ns - due_ns)

    def skip_to(self, bag_ns: int, version: int) -> None:
        """Skip to a later bag time [ns] with no messages before it; no new scene begins.

        Nothing happens if a command came in between (see wait_until_due).
        """
        with self._changed:
            if self._state.version == version:
                self._rebase(bag_ns=bag_ns, segment=self._state.segment + 1,
                             monotonic_ns=self._clock.monotonic_ns() + self._head_start_ns)

    def pause_at(self, bag_ns: int, version: int) -> None:
        """Pause at a bag time [ns] that has just been reached, unless a command came in between."""
        with self._changed:
            if self._state.version == version:
                self._rebase(bag_ns=bag_ns, paused=True)

    def hold(self, version: int) -> None:
        """Pause until ``release`` or a command, unless a command came in between."""
        with self._changed:
            if self._state.version == version:
                self._rebase(paused=True, held=True)

    def release(self) -> None:
        """Continue to play, if held."""
        with self._changed:
            if self._state.held:
                self._rebase(paused=False)

    def pass_limit(self, version: int) -> None:
        """Jump from the limit to the other end of the loop; pause without a loop.

        Nothing happens away from the limit, or if a command came in between (see wait_until_due).
        """
        with self._changed:
            state = self._state
            position_ns = state.position_at(self._clock.monotonic_ns())
            if state.version != version or state.paused or position_ns != state.limit_ns:
                return
            if state.loop:
                self._jump(state.loop[0] if state.forward else state.loop[1])
            else:
                self._rebase(paused=True)

    def _remaining_ns(self, bag_ns: Optional[int]) -> int:
        due_ns = None if bag_ns is None else self._state.due_ns(bag_ns)
        now_ns = self._clock.monotonic_ns()
        return FOREVER_NS if due_ns is None else due_ns - now_ns

    def _start(self) -> None:
        state = self._state
        if state.loop or state.bag_ns != state.limit_ns:
            self._play_on()
        else:
            self._jump(state.begin_ns if state.forward else state.end_ns, paused=False)

    def _play_on(self) -> None:
        self._rebase(paused=False, monotonic_ns=self._clock.monotonic_ns() + self._head_start_ns)

    def _jump(self, bag_ns: int, **changes: Any) -> None:
        state = self._state
        changes.setdefault('paused', state.paused and not state.held)
        self._rebase(bag_ns=bag_ns, segment=state.segment + 1, scene=state.scene + 1, **changes)

    def _rebase(self, **changes: Any) -> None:
        state, now_ns = self._state, self._clock.monotonic_ns()
        changes.setdefault('bag_ns', state.position_at(now_ns))
        changes.setdefault('monotonic_ns', now_ns)
        if 'paused' in changes:
            changes.setdefault('held', False)
        self._state = replace(state, command=state.command + 1, version=state.version + 1,
                              **changes)
        self._achieved.restart(now_ns)
        self._changed.notify_all()

    def _check_loop(self, begin_ns: int, end_ns: int) -> None:
        state = self._state
        begin_s = (begin_ns - state.begin_ns) / NS_PER_S
        end_s = (end_ns - state.begin_ns) / NS_PER_S
        if end_ns - begin_ns < MIN_LOOP_NS:
            raise CommandRefused(f'a loop from {begin_s:.3f} to {end_s:.3f} s: its end must be '
                                 f'at least {MIN_LOOP_NS / NS_PER_S} s after its beginning')
        if begin_ns < state.begin_ns or end_ns > state.end_ns:
            raise CommandRefused(f'a loop from {begin_s:.3f} to {end_s:.3f} s is outside of the '
                                 f'recording (0 to {duration_s(state):.3f} s)')


def within(state: TimelineState, bag_ns: int) -> Tuple[int, str]:
    """Return the nearest bag time [ns] within the recording, and what had to be changed."""
    target_ns = min(max(bag_ns, state.begin_ns), state.end_ns)
    if target_ns == bag_ns:
        return target_ns, ''
    asked_s, length_s = (bag_ns - state.begin_ns) / NS_PER_S, duration_s(state)
    where = 'the beginning' if bag_ns < target_ns else 'the end'
    return target_ns, (f'{asked_s:.3f} s is outside of the recording (0 to {length_s:.3f} s): '
                       f'moved to {where}')


def duration_s(state: TimelineState) -> float:
    """Return the duration of the recording [s]."""
    return (state.end_ns - state.begin_ns) / NS_PER_S


def checked_rate(rate: float) -> None:
    """Check a rate.

    Raises:
        CommandRefused: the rate is 0, not a number, or too small or large.
    """
    if not math.isfinite(rate):
        raise CommandRefused(f'the rate must be a number, not {rate}')
    if rate == 0.0:
        raise CommandRefused('the rate must not be 0: pause instead')
    if not MIN_REQUESTED_RATE <= abs(rate) <= MAX_REQUESTED_RATE:
        low, high = MIN_REQUESTED_RATE, MAX_REQUESTED_RATE
        raise CommandRefused(f'the rate must be from {low:g} to {high:g}, or from -{high:g} to '
                             f'-{low:g} backwards, not {rate:g}')


RATES = (0.01, 0.02, 0.05, 0.1, 0.25, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0)


def faster(rate: float) -> float:
    """Return the next faster rate of ``RATES``, in the same direction; if none is, the same."""
    return math.copysign(next((it for it in RATES if it > abs(rate)), abs(rate)), rate)


def slower(rate: float) -> float:
    """Return the next slower rate of ``RATES``, in the same direction; if none is, the same."""
    return math.copysign(next((it for it in reversed(RATES) if it < abs(rate)), abs(rate)), rate)
