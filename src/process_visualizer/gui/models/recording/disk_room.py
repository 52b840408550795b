# SPDX-License-Identifier: BSD-3-Clause
"""Recording time left on the disk."""
from __future__ import annotations

from typing import NamedTuple, Optional

from process_visualizer.gui.models.recording.bag_target import LEAST_FREE_BYTES
from process_visualizer.gui.models.recording.recording_types import Phase
from process_visualizer.gui.ros.snapshots import RecorderSnapshot

_LOW_S = 300.0


class DiskRoom(NamedTuple):
    """The room on the disk, and how long can be recorded there; None where it is not known."""

    free_bytes: Optional[int]
    time_left_s: Optional[float]

    @property
    def is_low(self) -> bool:
        """Return whether the disk is full in less than five minutes."""
        return self.time_left_s is not None and self.time_left_s < _LOW_S


def disk_room(phase: Phase, snapshot: RecorderSnapshot, seen_bytes: Optional[int]) -> DiskRoom:
    """Return what the recorder tells while it records, else what follows from its present rate.

    ``seen_bytes`` is the room that the window has seen itself, if it has.
    """
    if phase is Phase.RECORDING:
        return DiskRoom(snapshot.free_bytes or seen_bytes, snapshot.time_left_s)
    if seen_bytes is None or snapshot.rate <= 0:
        return DiskRoom(seen_bytes, None)
    return DiskRoom(seen_bytes, max(0, seen_bytes - LEAST_FREE_BYTES) / snapshot.rate)
