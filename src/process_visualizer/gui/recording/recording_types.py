# SPDX-License-Identifier: BSD-3-Clause
"""Types of a recording: the recorder's commands, its phases, its bags."""
from __future__ import annotations

import math
from enum import Enum
from typing import List, NamedTuple, Optional, Protocol, Tuple

from PyQt5.QtCore import QObject, QTimer, pyqtSignal

from process_visualizer.clients.bag_recorder import RecordingOptions
from process_visualizer.gui.ros.snapshots import RecorderSnapshot


class RecorderClient(Protocol):
    """The methods of ``nodes.bag_recorder.BagRecorder`` that are used; each waits for an answer."""

    def start(self, options: RecordingOptions) -> str:
        """Start; return the path."""

    def stop(self) -> List[str]:
        """Stop; return the paths."""

    def mark(self, label: str, stamp_s: float) -> None:
        """Write a labeled moment; 0: when it is taken."""

    def save_recent(self, options: RecordingOptions) -> str:
        """Write the memory; return the path."""


class RecordingPhase(Enum):
    """The recorder's phase. OFF: none was launched; WAITING: it was; GONE: it has ended."""

    OFF = 'off'
    WAITING = 'waiting'
    IDLE = 'idle'
    STARTING = 'starting'
    RECORDING = 'recording'
    STOPPING = 'stopping'
    GONE = 'gone'


class RecordedMark(NamedTuple):
    """A labeled moment of a recording: the time since its beginning, and on the recorder's clock.

    ``stamp_s`` is 0 where that clock is not known. Until ``is_written`` the recorder has not said
    that it has taken it.
    """

    time_s: float
    label: str
    stamp_s: float = 0.0
    is_written: bool = False


class Figures(NamedTuple):
    """Figures of one recording: its size and its losses; `duration_s` in s."""

    duration_s: float
    bytes: int
    messages: int
    dropped: int
    lost: int


def figures_of(snapshot: RecorderSnapshot) -> Figures:
    """Return what the recorder says of the recording that it makes, or has made last."""
    return Figures(snapshot.duration_s, snapshot.bytes, snapshot.messages, snapshot.dropped,
                   snapshot.lost)


class FinishedBag(NamedTuple):
    """The bag recorded or saved last: its files, and what the recorder found wrong meanwhile.

    ``figures`` are None where the recorder has ended without telling the last ones.
    """

    files: Tuple[str, ...]
    problems: Tuple[str, ...] = ()
    figures: Optional[Figures] = None


_MAX_S = 1.5
"""The recorder reports its state every half second; a clock that runs on without it would lie."""


class RecordingClock(NamedTuple):
    """Goes on from the last state; within a recording it never goes back.

    ``duration_s`` was reported at the time ``taken_s`` of a monotonic clock; while the clock runs,
    ``shown_s`` is the least that it may show.
    """

    duration_s: float = 0.0
    is_running: bool = False
    taken_s: float = 0.0
    shown_s: float = 0.0

    def updated(self, duration_s: float, is_running: bool, now_s: float) -> 'RecordingClock':
        """Return the clock after the recorder reported a duration, and whether it grows."""
        shown_s = self.elapsed_s(now_s) if is_running else duration_s
        return RecordingClock(duration_s, is_running, now_s, shown_s)

    def elapsed_s(self, now_s: float) -> float:
        """Return the elapsed time."""
        passed_s = min(now_s - self.taken_s, _MAX_S) if self.is_running else 0.0
        return max(self.shown_s, self.duration_s + passed_s)

    def moment_s(self, now_s: float) -> float:
        """Return how long the recording has gone on, though the recorder may not say so."""
        passed_s = now_s - self.taken_s if self.is_running else 0.0
        return max(self.shown_s, self.duration_s + passed_s)


_OLDEST_S = 60.0
"""Older states were stamped by a clock that has been set back."""


class SenderClock:
    """Compares the stamps of one sender with the times at which its messages arrive.

    The clocks may differ: the message that needed least time shows by how much. So a message that
    waited, because this program or its computer stood still, is known to be old.
    """

    def __init__(self) -> None:
        self._offset_s = math.inf

    def sent_s(self, stamp_s: float, now_s: float) -> float:
        """Return when a message with this stamp, which arrives now, was sent."""
        self._offset_s = min(self._offset_s, now_s - stamp_s)
        return max(stamp_s + self._offset_s, now_s - _OLDEST_S)

    def stamp_s(self, now_s: float) -> float:
        """Return the sender's time, at most as late as it is; 0 before its first message."""
        return max(now_s - self._offset_s, 0.0)


_SILENCE_MS, _SILENCES = 1000, 3


class SilenceWatch(QObject):
    """Counts the times without a word, instead of measuring one long one.

    So a window that was held up itself does not take what waits for it for silence.
    """

    silent = pyqtSignal()
    """Nobody has spoken for long; the next ``hear`` ends it."""

    def __init__(self, parent: Optional[QObject] = None) -> None:
        super().__init__(parent)
        self._count = 0
        self._timer = QTimer(self, interval=_SILENCE_MS)
        self._timer.timeout.connect(self._wait)

    def hear(self) -> None:
        """Begin to wait for the next word."""
        self._count = 0
        self._timer.start()

    def stop(self) -> None:
        """Wait for nothing."""
        self._timer.stop()

    def _wait(self) -> None:
        self._count += 1
        if self._count >= _SILENCES:
            self.stop()
            self.silent.emit()
