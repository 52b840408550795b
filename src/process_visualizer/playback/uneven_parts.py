# SPDX-License-Identifier: BSD-3-Clause
"""Uneven playback: skips empty parts, pauses at some messages, and waits for a listener."""
from __future__ import annotations

from typing import Iterable, Optional

from process_visualizer.bagio.bag_index import BagIndex
from process_visualizer.playback.timeline import CommandRefused, Timeline, TimelineState


class UnevenParts:
    """The options of `rosbag play` for uneven playback, which apply only forward.

    All but ``heard`` and ``toggle_pauses`` is for the publishing thread only.
    """

    def __init__(self, timeline: Timeline, skip_empty_ns: Optional[int] = None,
                 pause_topics: Iterable[str] = (), max_delay_ns: Optional[int] = None) -> None:
        """Take the timeline and the options.

        Args:
            timeline: of the recording that is played.
            skip_empty_ns: longer parts without a message are skipped.
            pause_topics: topics (global names); play pauses before each of their messages.
            max_delay_ns: play waits for a listener that is further behind (see ``heard``).
        """
        self._timeline = timeline
        self._skip_empty_ns = skip_empty_ns
        self._pause_topics = frozenset(pause_topics)
        self._pauses = True
        self._paused_before = -1, -1  # scene, position
        self._max_delay_ns = max_delay_ns
        self._heard_scene = -1
        self._heard_ns = 0

    def toggle_pauses(self) -> bool:
        """Turn pausing before messages off or on; return whether it is on.

        Raises:
            CommandRefused: there are no topics to pause at.
        """
        if not self._pause_topics:
            raise CommandRefused('there are no topics to pause at: name them by --pause-topics')
        self._pauses = not self._pauses
        return self._pauses

    def heard(self, bag_ns: int) -> None:
        """Note that a listener for which play waits has reached a bag time [ns]."""
        self._heard_ns = bag_ns
        self._release()

    def goes_on(self, index: BagIndex, position: int, state: TimelineState) -> bool:
        """Skip, pause or hold before the message at a position, if an option demands it.

        Return False if that was done or a command came, True if play simply goes on.
        """
        if not state.forward:
            return True
        if self._is_far(index, position, state):
            self._skip(index, position, state)
            return False
        if self._is_to_pause(index, position, state):
            self._pause(index, position, state)
            return False
        if self._is_behind(_before(index, position, state), state):
            self._hold(index, position, state)
            return False
        return True

    def _is_far(self, index: BagIndex, position: int, state: TimelineState) -> bool:
        if self._skip_empty_ns is None:
            return False
        return int(index.time_ns[position]) - _before(index, position, state) > self._skip_empty_ns

    def _skip(self, index: BagIndex, position: int, state: TimelineState) -> None:
        """Skip to the next message once the last one is due."""
        if self._timeline.wait_until_due(_before(index, position, state), state.version):
            self._timeline.skip_to(int(index.time_ns[position]), state.version)

    def _is_to_pause(self, index: BagIndex, position: int, state: TimelineState) -> bool:
        connection = index.connections[int(index.connection[position])]
        return (self._pauses and f'/{connection.topic.strip("/")}' in self._pause_topics
                and self._paused_before != (state.scene, position))

    def _pause(self, index: BagIndex, position: int, state: TimelineState) -> None:
        """Pause at the last moment before the message becomes visible."""
        bag_ns = max(int(index.time_ns[position]) - 1, state.bag_ns)
        if self._timeline.wait_until_due(bag_ns, state.version):
            self._timeline.pause_at(bag_ns, state.version)
            self._paused_before = state.scene, position

    def _is_behind(self, bag_ns: int, state: TimelineState) -> bool:
        if self._heard_scene != state.scene:
            self._heard_scene, self._heard_ns = state.scene, state.bag_ns
        return self._max_delay_ns is not None and bag_ns - self._heard_ns > self._max_delay_ns

    def _hold(self, index: BagIndex, position: int, state: TimelineState) -> None:
        """Hold after the last message, unless the listener has caught up meanwhile."""
        before_ns = _before(index, position, state)
        if (self._timeline.wait_until_due(before_ns, state.version)
                and self._is_behind(before_ns, state)):
            self._timeline.hold(state.version)
            self._release()

    def _release(self) -> None:
        state = self._timeline.state
        if state.held and not self._is_behind(state.bag_ns, state):
            self._timeline.release()


def _before(index: BagIndex, position: int, state: TimelineState) -> int:
    """Return the bag time [ns] from which nothing more comes before a message."""
    last_ns = int(index.time_ns[position - 1]) if position else state.begin_ns
    return max(last_ns, state.bag_ns)
