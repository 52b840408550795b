# SPDX-License-Identifier: BSD-3-Clause
"""The player's commands for users, in seconds, with answers as texts."""
from __future__ import annotations

import math
from typing import NamedTuple, Optional, Tuple

from process_visualizer.playback.engine import Playback
from process_visualizer.playback.steps import Step
from process_visualizer.playback.timeline import (
    NS_PER_S,
    CommandRefused,
    Timeline,
    TimelineState,
    duration_s,
)

_MAX_S = 1e9
"""Maximum duration of a recording [s]; much longer times in nanoseconds would overflow."""


class PlayerStatus(NamedTuple):
    """The player's activity; positions are seconds from the beginning.

    ``dropped`` and ``mark`` are filled in by the player, not by its control.
    """

    position_s: float
    duration_s: float
    rate: float
    achieved_rate: float
    paused: bool
    loop: Optional[Tuple[float, float]] = None
    dropped: int = 0  # messages
    mark: str = ''  # label of the last mark
    segment: int = 0
    since_ns: int = 0  # monotonic time since which the position moves (or is paused) as now
    monotonic_ns: int = 0  # the time for which the position holds


class PlayerControl:
    """Commands, for use by any thread. Each returns a text that says what was done.

    A command that cannot be carried out changes nothing and raises CommandRefused, with the reason.
    """

    def __init__(self, timeline: Timeline, playback: Playback) -> None:
        """Initialize with the timeline and the playback to control."""
        self._timeline = timeline
        self._playback = playback
        self._pause_requested = False

    @property
    def pause_requested(self) -> bool:
        """Return whether the last command that plays or pauses was a pause."""
        return self._pause_requested

    def status(self) -> PlayerStatus:
        """Return the player's current activity."""
        state, now_ns = self._timeline.now()
        loop = state.loop and (self._seconds(state.loop[0]), self._seconds(state.loop[1]))
        return PlayerStatus(self._seconds(state.position_at(now_ns)), duration_s(state),
                            state.rate, self._timeline.achieved_rate(), state.paused, loop,
                            segment=state.segment, since_ns=state.monotonic_ns,
                            monotonic_ns=now_ns)

    def play(self) -> str:
        """Continue to play; start over if nothing is left to play."""
        self._pause_requested = False
        self._timeline.play()
        return self._where('playing')

    def pause(self) -> str:
        """Pause."""
        self._pause_requested = True
        self._timeline.pause()
        return self._where('paused')

    def toggle_paused(self) -> str:
        """Play if paused, pause if playing."""
        self._timeline.toggle_paused()
        self._pause_requested = self._timeline.state.paused
        return self._where('paused' if self._pause_requested else 'playing')

    def stop(self) -> str:
        """Pause at the beginning."""
        self._pause_requested = True
        self._timeline.stop()
        return self._arrived('stopped at')

    def seek(self, position_s: float) -> str:
        """Go to a position [s], limited to the ends of the recording."""
        return self._timeline.seek(self._bag_ns('the position', position_s)) or self._arrived('at')

    def repeat(self) -> str:
        """Publish the scene again while paused, for receivers that changed how they show it."""
        if not self._timeline.state.paused:
            return self._where('still playing')
        self._playback.show_again()
        return self._where('shown again')

    def seek_by(self, duration_s_: float) -> str:
        """Go forward or (below 0) back by a time [s], limited to the ends of the recording."""
        return self.seek(self._seconds(self._timeline.position_ns()) + duration_s_)

    def set_rate(self, rate: float) -> str:
        """Change the rate; a negative rate plays backward."""
        self._timeline.set_rate(rate)
        return f'rate {rate:g}'

    def step(self, count: int, topic: str = '', duration_s_: float = 0.0) -> str:
        """Pause and move by messages, of one topic or ('') of all, or (count 0) by a time [s]."""
        step = Step(count, topic, _nanoseconds('the duration', duration_s_))
        if not count and not step.duration_ns:
            raise CommandRefused('a step needs a count of messages or a duration other than 0')
        self._pause_requested = True
        changed = self._playback.step(step).changed
        return self._arrived(f'{changed}: at' if changed else 'at')

    def toggle_pause_topics(self) -> str:
        """Stop pausing before the messages of some topics, or pause again."""
        pauses = self._playback.uneven_parts.toggle_pauses()
        return 'pausing at topics' if pauses else 'not pausing at topics'

    def set_loop(self, loop: bool, begin_s: float = 0.0, end_s: float = 0.0) -> str:
        """Loop between two positions [s], over all if both are 0; or end the loop."""
        if not loop:
            self._timeline.clear_loop()
            return 'no loop'
        state = self._timeline.state
        if not (begin_s or end_s):
            begin_ns, end_ns = state.begin_ns, state.end_ns
        else:
            begin_ns = self._bag_ns('the beginning of the loop', begin_s)
            end_ns = self._bag_ns('the end of the loop', end_s)
        inner_ns = max(begin_ns, state.begin_ns), min(end_ns, state.end_ns)
        self._timeline.set_loop(*inner_ns)
        changed = '' if inner_ns == (begin_ns, end_ns) else (
            f' instead of {begin_s:.3f} to {end_s:.3f} s, which is more than there is')
        return f'loop from {self._seconds(inner_ns[0]):.3f} to {self._seconds(inner_ns[1]):.3f} s' \
            + changed

    def _arrived(self, verb: str) -> str:
        """Return the position, and the topics that have nothing to show there."""
        absent = self._playback.not_begun(self._timeline.position_ns())
        return self._where(verb) + (f'; nothing yet on {", ".join(absent)}' if absent else '')

    def _where(self, verb: str) -> str:
        return f'{verb} {self._seconds(self._timeline.position_ns()):.3f} s'

    def _seconds(self, bag_ns: int) -> float:
        return (bag_ns - self._timeline.state.begin_ns) / NS_PER_S

    def _bag_ns(self, what: str, position_s: float) -> int:
        state: TimelineState = self._timeline.state
        return state.begin_ns + _nanoseconds(what, position_s)


def _nanoseconds(what: str, seconds: float) -> int:
    if not math.isfinite(seconds):
        raise CommandRefused(f'{what} must be a number, not {seconds}')
    if abs(seconds) > _MAX_S:
        raise CommandRefused(f'{what} is out of range: {seconds:g} s; no recording is longer than '
                             f'{_MAX_S:g} s')
    return round(seconds * NS_PER_S)
