# SPDX-License-Identifier: BSD-3-Clause
"""Mapping of recorded stamps to current stamps, so that no receiver sees old data."""
from __future__ import annotations

from bisect import bisect_left
from collections import OrderedDict
from typing import List, Optional

from process_visualizer.playback.timeline import NS_PER_S, Clock, TimelineState

MAX_DISTANCE_NS = NS_PER_S  # of a stamp from the time of its message
MAX_AGE_NS = 3 * NS_PER_S  # of a wall stamp: tf2 forgets after 10 s
CLOCK_SET_NS = NS_PER_S // 100
SLEW_NS = 1_000
MEMORY = 8192


class StampMapping:
    """Maps the stamps inside messages to wall time, for the one thread that publishes.

    While playing, a stamp is mapped like the time of its message: bag intervals become wall
    intervals divided by the rate. Stamps that would lie in the future (those after the time of
    their message, and when playing backward all before it) move the whole mapping back by a common
    lag. A stamp far from the time of its message (from another computer's clock) is moved closer,
    so that it neither delays the others nor becomes too old for tf2. A message that is shown
    backward only when its stamp has been reached needs no lag: its stamp is mapped directly.

    While paused, and for messages restored after a jump, a stamp becomes the present time. Equal
    stamps of the recording stay equal, until a new scene (a seek, a step back, a change of
    direction) publishes the same messages again. The order is kept between two commands. After a
    command, no new stamp is earlier than the stamps before it; stamps equal to earlier ones stay
    equal. If the wall clock is set back, stamps follow it, because they must not be in the future.
    """

    def __init__(self, clock: Optional[Clock] = None) -> None:
        """Initialize with the clock of the timeline."""
        self._clock = clock or Clock()
        self._command = self._scene = -1
        self._known: OrderedDict[int, int] = OrderedDict()  # bag stamp -> wall stamp
        self._remembered = 0
        self._order = OrderKeeper()
        self._floor_ns = self._lag_ns = self._offset_ns = self._wall_ns = 0

    @property
    def remembered(self) -> int:
        """Return the number of different stamps mapped so far, a mark for ``forget_since``."""
        return self._remembered

    def stamp(self, state: TimelineState, stamp_ns: int, message_ns: int,
              shown_ns: Optional[int] = None, sent_ns: int = 0) -> int:
        """Return the wall stamp [ns] of a bag stamp in a message recorded at a bag time [ns].

        The message is sent at the monotonic time ``sent_ns``, or now if that has passed. If it is
        not shown at the time of recording, as when playing backward, ``shown_ns`` is the bag time
        at which it is shown; its stamps move with it.
        """
        if state.paused:
            return self.present(state, stamp_ns)
        now_ns = self._follow(state)
        if stamp_ns not in self._known:
            clamped_ns = clamped_stamp(state, stamp_ns, message_ns)
            sent_wall_ns = max(now_ns, sent_ns + self._offset_ns)
            if shown_ns is not None and shown_ns <= clamped_ns <= message_ns and not state.forward:
                wall_ns = self._map_without_lag(state, clamped_ns, sent_wall_ns)
            else:
                clamped_ns += 0 if shown_ns is None else shown_ns - message_ns
                wall_ns = self._map_with_lag(state, clamped_ns, sent_wall_ns)
            self._remember(stamp_ns, wall_ns)
        return self._known[stamp_ns]

    def present(self, state: TimelineState, stamp_ns: int) -> int:
        """Return the wall stamp [ns] of a bag stamp in a restored message: the present time."""
        now_ns = self._follow(state)
        if stamp_ns not in self._known:
            self._remember(stamp_ns, now_ns)
            self._floor_ns = now_ns
            self._order = OrderKeeper()
        return self._known[stamp_ns]

    def forget(self) -> None:
        """Give new stamps to messages published again, for new subscribers."""
        self._known.clear()

    def forget_since(self, remembered: int) -> None:
        """Forget the stamps mapped since a mark, as their messages were not sent after all."""
        for _ in range(min(self._remembered - remembered, len(self._known))):
            self._known.popitem()
        self._remembered = remembered

    def _map_without_lag(self, state: TimelineState, clamped_ns: int, sent_ns: int) -> int:
        """Map, without a lag, a stamp that has been reached."""
        return max(min(self._due_wall(state, clamped_ns), sent_ns), self._floor_ns)

    def _map_with_lag(self, state: TimelineState, clamped_ns: int, sent_ns: int) -> int:
        wall_ns = self._due_wall(state, clamped_ns)
        self._lag_ns = max(self._lag_ns, wall_ns - sent_ns)
        return self._order.fit(clamped_ns if state.forward else -clamped_ns,
                               max(wall_ns - self._lag_ns, self._floor_ns))

    def _due_wall(self, state: TimelineState, clamped_ns: int) -> int:
        due_ns = state.due_ns(clamped_ns)
        assert due_ns is not None, 'the state is not paused'
        return due_ns + self._offset_ns

    def _follow(self, state: TimelineState) -> int:
        """Follow commands and the wall clock; return the wall time [ns]."""
        monotonic_ns, now_ns = self._clock.monotonic_ns(), self._clock.wall_ns()
        error_ns = now_ns - monotonic_ns - self._offset_ns
        set_back = now_ns < self._wall_ns
        if state.scene != self._scene or set_back:
            self._known.clear()
        if state.command != self._command or set_back or abs(error_ns) > CLOCK_SET_NS:
            self._floor_ns, self._lag_ns, self._order = now_ns, 0, OrderKeeper()
            self._offset_ns += error_ns
        else:  # the wall clock may be slewed
            self._offset_ns += min(max(error_ns, -SLEW_NS), SLEW_NS)
        self._scene, self._command, self._wall_ns = state.scene, state.command, now_ns
        return now_ns

    def _remember(self, stamp_ns: int, wall_ns: int) -> None:
        if len(self._known) >= MEMORY:
            self._known.popitem(last=False)
        self._known[stamp_ns] = wall_ns
        self._remembered += 1


class OrderKeeper:
    """Keeps wall stamps in the order of their keys, with the smallest possible changes."""

    def __init__(self) -> None:
        self._keys: List[int] = []
        self._walls: List[int] = []

    def fit(self, key: int, wall_ns: int) -> int:
        """Return the wall stamp [ns], limited by those of neighboring keys, and remember it."""
        index = bisect_left(self._keys, key)
        if index < len(self._keys):
            wall_ns = min(wall_ns, self._walls[index])
        if index > 0:
            wall_ns = max(wall_ns, self._walls[index - 1])
        self._keys.insert(index, key)
        self._walls.insert(index, wall_ns)
        if len(self._keys) > MEMORY:
            del self._keys[:MEMORY // 2], self._walls[:MEMORY // 2]
        return wall_ns


def clamped_stamp(state: TimelineState, stamp_ns: int, message_ns: int) -> int:
    """Return the stamp [bag ns], moved closer to the time of its message if it is far from it."""
    reach_ns = min(MAX_DISTANCE_NS, int(MAX_AGE_NS * abs(state.rate)))
    return min(max(stamp_ns, message_ns - reach_ns), message_ns + reach_ns)
