# SPDX-License-Identifier: BSD-3-Clause
"""Uneven parts of playback: empty ones are skipped, and some messages are waited for."""
from __future__ import annotations

from typing import Iterable, Optional

from process_visualizer.bagio.bag_index import BagIndex
from process_visualizer.playback.timeline import CommandRefused, Timeline, TimelineState


class UnevenParts:
    """The options of `rosbag play` for uneven playback, all only forwards.

    It is for the one thread that publishes, but for ``heard`` and ``toggle_pauses``.
    """

    def __init__(self, timeline: Timeline, skip_empty_ns: Optional[int] = None,
                 pause_topics: Iterable[str] = (), max_delay_ns: Optional[int] = None) -> None:
        """Take what it changes.

        Args:
            timeline: of the recording that is played.
            skip_empty_ns: without a message for longer, play goes on with the next one.
            pause_topics: before each message of these (global names) play pauses.
            max_delay_ns: play waits for a listener that is farther behind (see ``heard``).
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
        """Pause no more before messages, or again; return which.

        Raises:
            CommandRefused: there are no topics for that.
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
        """Wait, skip, pause or hold before the message at a position, where that is wanted.

        Returns False if something of that was done, or a command came.
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
        """Go on at the next message once the last one has been seen."""
        if self._timeline.wait_until_due(_before(index, position, state), state.version):
            self._timeline.skip_to(int(index.time_ns[position]), state.version)

    def _is_to_pause(self, index: BagIndex, position: int, state: TimelineState) -> bool:
        connection = index.connections[int(index.connection[position])]
        return (self._pauses and f'/{connection.topic.strip("/")}' in self._pause_topics
                and self._paused_before != (state.scene, position))

    def _pause(self, index: BagIndex, position: int, state: TimelineState) -> None:
        """Pause at the last moment at which the message is not seen yet."""
        bag_ns = max(int(index.time_ns[position]) - 1, state.bag_ns)
        if self._timeline.wait_until_due(bag_ns, state.version):
            self._timeline.pause_at(bag_ns, state.version)
            self._paused_before = state.scene, position

    def _is_behind(self, bag_ns: int, state: TimelineState) -> bool:
        if self._heard_scene != state.scene:
            self._heard_scene, self._heard_ns = state.scene, state.bag_ns
        return self._max_delay_ns is not None and bag_ns - self._heard_ns > self._max_delay_ns

    def _hold(self, index: BagIndex, position: int, state: TimelineState) -> None:
        """Hold where nothing is missing yet, unless the listener has caught up meanwhile."""
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
    """Return when nothing more comes before a message [bag ns]."""
    last_ns = int(index.time_ns[position - 1]) if position else state.begin_ns
    return max(last_ns, state.bag_ns)
