# SPDX-License-Identifier: BSD-3-Clause
"""The position of playback at any moment, from states that come a few times a second."""
from __future__ import annotations

from typing import Optional

from process_visualizer.gui.ros.snapshots import PlayerSnapshot

MOST_AHEAD_S = 0.5  # a player that has said nothing for so long may have ended


class PlaybackPosition:
    """Goes on evenly between two states, and never back while playing forward (or vice versa)."""

    def __init__(self) -> None:
        self._snapshot: Optional[PlayerSnapshot] = None
        self._shown_s = 0.0

    def take(self, snapshot: Optional[PlayerSnapshot]) -> None:
        """Take the newest state; None when there is no player any more."""
        before, self._snapshot = self._snapshot, snapshot
        if snapshot is not None and (before is None or not _continues(before, snapshot)):
            self._shown_s = snapshot.position_s

    def at(self, now_s: float) -> float:
        """Return the position [s] at a wall time [s], which does not decrease between calls."""
        snapshot = self._snapshot
        if snapshot is None:
            return 0.0
        expected_s = _position(snapshot, now_s)
        if snapshot.paused:
            self._shown_s = expected_s
        elif snapshot.rate > 0.0:
            self._shown_s = max(self._shown_s, expected_s)
        else:
            self._shown_s = min(self._shown_s, expected_s)
        return self._shown_s


def _continues(before: PlayerSnapshot, after: PlayerSnapshot) -> bool:
    """Return whether both belong to one uninterrupted movement."""
    return (before.segment == after.segment and before.files == after.files
            and before.paused == after.paused and (before.rate > 0.0) == (after.rate > 0.0))


def _position(snapshot: PlayerSnapshot, now_s: float) -> float:
    if snapshot.paused:
        return snapshot.position_s
    played_s = min(max(now_s - snapshot.stamp_s, 0.0), MOST_AHEAD_S) * snapshot.achieved_rate
    limit_s = _limit(snapshot)
    clamp = min if snapshot.rate > 0.0 else max
    return clamp(snapshot.position_s + played_s, limit_s)


def _limit(snapshot: PlayerSnapshot) -> float:
    """Return the end or jump of play; from outside of the loop, and not before it, the bounds."""
    loop = snapshot.loop
    if snapshot.rate > 0.0:
        return loop[1] if loop and snapshot.position_s <= loop[1] else snapshot.duration_s
    return loop[0] if loop and snapshot.position_s >= loop[0] else 0.0
