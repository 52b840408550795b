# SPDX-License-Identifier: BSD-3-Clause
"""The last messages of player, recorder and RViz as plain data, for models and views."""
from __future__ import annotations

from typing import NamedTuple, Optional, Tuple

from process_visualizer.health.near_objects import SeenObject
from process_visualizer.playback.playback_clock import ClockState


class PlayerSnapshot(NamedTuple):
    """The player's state; positions are in s from the beginning of the recording.

    ``stamp_s`` is the wall time (since the epoch) at which ``position_s`` is valid; ``begin_s`` is
    the bag time of the beginning. ``loop`` is (begin, end) or None. ``topics`` are names with their
    numbers of published messages; ``others`` name other publishers of these topics. ``since_s`` is
    the wall time since which the position changes evenly at the rate. See PlayerState.msg.
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
        """The player's position over wall time, at the rate that the machine reaches."""
        return ClockState(self.stamp_s, self.position_s, self.achieved_rate, self.paused,
                          self.segment, self.since_s)


class TopicSnapshot(NamedTuple):
    """A topic as seen by the recorder: rate in Hz, silence in s (None: no message so far).

    ``largest_gap_s`` is the longest time between two messages; 0 if unknown.
    """

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
    largest_gap_s: float = 0.0


class RecorderSnapshot(NamedTuple):
    """The recorder's state; ``phase`` is idle, starting, recording or stopping.

    ``rate`` is in bytes per s; ``time_left_s`` is None if unknown; ``stamp_s`` is the time of
    sending on the recorder's clock. See RecorderState.msg.
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
    remembered_s: float = 0.0
    problems: Tuple[str, ...] = ()
    topics: Tuple[TopicSnapshot, ...] = ()
    stamp_s: float = 0.0


class PhaseSnapshot(NamedTuple):
    """The moment of the reference run [s] at a time [s since the epoch]; None: no run.

    ``behind_s`` is the run's delay so far against the reference run; None if unknown. See
    GhostPhase.msg.
    """

    stamp_s: float
    reference_s: Optional[float]
    behind_s: Optional[float] = None


class ObjectsSnapshot(NamedTuple):
    """All objects that a depth sensor (``device``) sees; ``stamp_s`` is the stamp of the cloud.

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


class KeyPress(NamedTuple):
    """A key pressed in RViz (as written by QKeySequence), and when (wall time, s since the epoch).

    RViz may handle it seconds later.
    """

    key: str
    pressed_s: float

    @classmethod
    def from_text(cls, text: str, now_s: float) -> 'KeyPress':
        """Return what the text of ``RVIZ_KEY_TOPIC`` says; a press without a time is of now."""
        key, _, pressed = text.partition('\n')
        try:
            return cls(key, min(float(pressed), now_s))
        except ValueError:
            return cls(key, now_s)
