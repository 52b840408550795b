# SPDX-License-Identifier: BSD-3-Clause
"""Follows the player, so that nodes know the time in the recording."""
from __future__ import annotations

from process_visualizer.motion.playback_clock import PlaybackClock, PlaybackState
from process_visualizer.msg import PlayerState
from process_visualizer.nodes.common.node_handle import NodeHandle
from process_visualizer.ros_names import PLAYER_STATE_TOPIC


class PlaybackFollower:
    """Keeps a clock of playback up to date; costs nothing in real-time mode."""

    def __init__(self, node: NodeHandle) -> None:
        """Subscribe to the player's state."""
        self._node = node
        self.clock = PlaybackClock()
        node.subscribe(PLAYER_STATE_TOPIC, PlayerState, self._receive)

    def data_time_s(self) -> float:
        """Return the present time [s] of the clock for the age of data (see PlaybackClock)."""
        return self.clock.data_time_s(self._node.ros_s())

    def _receive(self, state: PlayerState) -> None:
        self.clock.add(PlaybackState(state.stamp.to_sec(), state.position, state.rate,
                                     state.paused, state.segment, state.since.to_sec()))
