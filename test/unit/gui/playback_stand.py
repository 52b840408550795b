# SPDX-License-Identifier: BSD-3-Clause
"""A playback model with a player that the test controls."""
from __future__ import annotations

from typing import Any, List

from held_tasks import HeldTasks, RecordingClient, Refused

from process_visualizer.gui.playback.playback_model import PlaybackModel
from process_visualizer.gui.ros.snapshots import PlayerSnapshot

PAUSED = PlayerSnapshot(stamp_s=1000.0, begin_s=500.0, duration_s=20.0, position_s=0.0, rate=1.0,
                        achieved_rate=0.0, paused=True, segment=1, files=('/bags/a.bag',))


class PlaybackStand:
    """The model, its clock, and all its requests to the player and messages to the operator."""

    def __init__(self) -> None:
        self.now_s = 1000.0
        self.tasks = HeldTasks()
        self.client = RecordingClient()
        self.model = PlaybackModel(self.tasks, self.client, Refused, lambda: self.now_s)
        self.failures: List[str] = []
        self.model.failed.connect(self.failures.append)
        self.snapshot = PAUSED

    def state(self, **changes: Any) -> PlayerSnapshot:
        """Send a player state, stamped now, with these changes from the previous one."""
        changes.setdefault('stamp_s', self.now_s)
        self.snapshot = self.snapshot._replace(**changes)
        self.model.take_state(self.snapshot)
        return self.snapshot

    def play(self, rate: float = 1.0, **changes: Any) -> PlayerSnapshot:
        """Send the state of a player that plays."""
        return self.state(paused=False, rate=rate, achieved_rate=rate, **changes)

    def commands(self) -> List[Any]:
        """End all tasks and return the commands to the player since the last call."""
        self.tasks.end_all()
        return self.client.taken()
