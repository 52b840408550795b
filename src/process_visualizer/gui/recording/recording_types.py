# SPDX-License-Identifier: BSD-3-Clause
"""Types for recording: the recorder's commands, phases and bags, and clocks."""
from __future__ import annotations

import math
from enum import Enum
from typing import List, NamedTuple, Optional, Protocol, Tuple

from process_visualizer.clients.bag_recorder import RecordingOptions
from process_visualizer.gui.ros.snapshots import RecorderSnapshot


class RecorderClient(Protocol):
    """The used methods of ``clients.bag_recorder.BagRecorder``; each waits for an answer."""

    def start(self, options: RecordingOptions) -> str:
        """Start a recording; return its path."""

    def stop(self) -> List[str]:
        """Stop the recording; return its paths."""

    def mark(self, label: str, stamp_s: float) -> None:
        """Write a labeled moment; stamp 0 means the time of writing."""

    def save_recent(self, options: RecordingOptions) -> str:
        """Write the memory into a bag; return its path."""


class RecordingPhase(Enum):
    """The recorder's phase. OFF: not launched; WAITING: launched, no report yet; GONE: ended."""

    OFF = 'off'
    WAITING = 'waiting'
    IDLE = 'idle'
    STARTING = 'starting'
    RECORDING = 'recording'
    STOPPING = 'stopping'
    GONE = 'gone'


class RecordedMark(NamedTuple):
    """A labeled moment: its time since the recording's beginning, and on the recorder's clock.

    ``stamp_s`` is 0 if the recorder's clock is not known. ``is_written`` is true once the recorder
    has confirmed the mark.
    """

    time_s: float
    label: str
    stamp_s: float = 0.0
    is_written: bool = False


class Figures(NamedTuple):
    """The figures of one recording: its length, size and losses."""

    duration_s: float
    bytes: int
    messages: int
    dropped: int
    lost: int


def figures_of(snapshot: RecorderSnapshot) -> Figures:
    """Return the recorder's figures of the current or last recording."""
    return Figures(snapshot.duration_s, snapshot.bytes, snapshot.messages, snapshot.dropped,
                   snapshot.lost)


class FinishedBag(NamedTuple):
    """The bag recorded or saved last: its files, and problems that the recorder found meanwhile.

    ``figures`` is None if the recorder has ended without reporting the last figures. ``recovery``
    says how much of an unfinished recording is in it; '' for a bag finished by the recorder.
    """

    files: Tuple[str, ...]
    problems: Tuple[str, ...] = ()
    figures: Optional[Figures] = None
    recovery: str = ''


_MAX_S = 1.5
"""Maximum time for which the clock runs without a report [s]; reports arrive every half second."""


class RecordingClock(NamedTuple):
    """A clock that continues from the last report; within a recording it never goes back.

    ``duration_s`` was reported at the time ``taken_s`` of a monotonic clock; ``shown_s`` is the
    minimum that the clock may show while it runs.
    """

    duration_s: float = 0.0
    is_running: bool = False
    taken_s: float = 0.0
    shown_s: float = 0.0

    def updated(self, duration_s: float, is_running: bool, now_s: float) -> 'RecordingClock':
        """Return the clock after the recorder reported a duration, and whether it is recording."""
        shown_s = self.elapsed_s(now_s) if is_running else duration_s
        return RecordingClock(duration_s, is_running, now_s, shown_s)

    def elapsed_s(self, now_s: float) -> float:
        """Return the elapsed time to show [s]."""
        passed_s = min(now_s - self.taken_s, _MAX_S) if self.is_running else 0.0
        return max(self.shown_s, self.duration_s + passed_s)

    def moment_s(self, now_s: float) -> float:
        """Return the time since the recording began [s], even during a silence of the recorder."""
        passed_s = now_s - self.taken_s if self.is_running else 0.0
        return max(self.shown_s, self.duration_s + passed_s)


_MAX_AGE_S = 60.0
"""Maximum age of a message [s]; an older stamp comes from a clock that has been set back."""


class SenderClock:
    """Compares the stamps of a sender with the arrival times of its messages.

    The message with the shortest delay shows the difference between the clocks. So a message is
    known to be old if it waited because this program or its computer hung.
    """

    def __init__(self) -> None:
        self._offset_s = math.inf

    def sent_s(self, stamp_s: float, now_s: float) -> float:
        """Return the time at which a message with this stamp that arrives now was sent."""
        self._offset_s = min(self._offset_s, now_s - stamp_s)
        return max(stamp_s + self._offset_s, now_s - _MAX_AGE_S)

    def stamp_s(self, now_s: float) -> float:
        """Return the sender's time, never ahead of its clock; 0 before its first message."""
        return max(now_s - self._offset_s, 0.0)
