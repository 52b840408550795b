# SPDX-License-Identifier: BSD-3-Clause
"""The last messages of player, recorder and RViz, as plain data for models and views."""
from __future__ import annotations

from typing import NamedTuple, Optional, Tuple

from process_visualizer.health.near_objects import SeenObject
from process_visualizer.playback.playback_clock import ClockState


class PlayerSnapshot(NamedTuple):
    """The player's state; positions in s from the beginning of the recording.

    ``stamp_s`` is the wall time (since the epoch) for which ``position_s`` holds, ``begin_s`` the
    bag time of the beginning. ``loop`` is (begin, end) or None; ``topics`` are names, each with
    how many of its messages were published; ``others`` say who else publishes them; ``since_s`` is
    the wall time since which position and rate run evenly. See PlayerState.msg.
    """

    stamp_s: float
    begin_s: float
    duration_s: float
    position_s: float
    rate: float
    achieved_rate: float
    paused: bool
    loop: Optional[Tuple[float, float]] = None
    segment: int = 0
    published: int = 0
    dropped: int = 0
    gaps: Tuple[str, ...] = ()
    files: Tuple[str, ...] = ()
    mark: str = ''
    topics: Tuple[Tuple[str, int], ...] = ()
    others: Tuple[str, ...] = ()
    since_s: float = 0.0

    @property
    def clock_state(self) -> ClockState:
        """Its position over the wall time, at the rate that the machine reaches."""
        return ClockState(self.stamp_s, self.position_s, self.achieved_rate, self.paused,
                          self.segment, self.since_s)


class TopicSnapshot(NamedTuple):
    """A topic as the recorder sees it: rate in Hz, silence in s (None: no message so far)."""

    name: str
    type: str
    publishers: int
    messages: int
    rate_hz: float
    bytes: int
    dropped: int
    lost: int
    silence_s: Optional[float]
    is_latched: bool = False


class RecorderSnapshot(NamedTuple):
    """The recorder's state; ``phase`` is idle, starting, recording or stopping.

    ``rate`` is in bytes per s, ``time_left_s`` is None if unknown, ``stamp_s`` is when it was sent,
    on the recorder's clock. See RecorderState.msg.
    """

    phase: str
    files: Tuple[str, ...] = ()
    duration_s: float = 0.0
    messages: int = 0
    dropped: int = 0
    lost: int = 0
    bytes: int = 0
    rate: float = 0.0
    free_bytes: int = 0
    time_left_s: Optional[float] = None
    recent_s: float = 0.0
    problems: Tuple[str, ...] = ()
    topics: Tuple[TopicSnapshot, ...] = ()
    stamp_s: float = 0.0


class PhaseSnapshot(NamedTuple):
    """The moment of the reference [s] at a time [s since the epoch]; None: there is none.

    ``behind_s`` is how much longer than the reference the run took until here, None if unknown.
    See GhostPhase.msg.
    """

    stamp_s: float
    reference_s: Optional[float]
    behind_s: Optional[float] = None


class ObjectsSnapshot(NamedTuple):
    """All objects that a depth sensor (its device) sees; ``stamp_s`` is that of its cloud.

    See DetectedObjects.msg.
    """

    device: str
    stamp_s: float
    objects: Tuple[SeenObject, ...]


class DisplaySnapshot(NamedTuple):
    """The status of a display in RViz: ``level`` 0 is good, 1 a warning, 2 an error."""

    name: str
    level: int
    message: str
