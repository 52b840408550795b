# SPDX-License-Identifier: BSD-3-Clause
"""The player's messages as plain data."""
from __future__ import annotations

from process_visualizer.gui.ros.snapshots import PlayerSnapshot
from process_visualizer.msg import PlayerState


def player_snapshot(state: PlayerState) -> PlayerSnapshot:
    """Return a state of the player."""
    return PlayerSnapshot(
        stamp_s=state.stamp.to_sec(), begin_s=state.begin.to_sec(), duration_s=state.duration,
        position_s=state.position, rate=state.rate, achieved_rate=state.achieved_rate,
        paused=state.paused, loop=(state.loop_begin, state.loop_end) if state.loop else None,
        segment=state.segment, published=state.published, dropped=state.dropped,
        gaps=tuple(state.gaps), files=tuple(state.files), mark=state.mark,
        topics=tuple((topic.name, topic.published) for topic in state.topics),
        others=tuple(state.others), since_s=state.since.to_sec())
