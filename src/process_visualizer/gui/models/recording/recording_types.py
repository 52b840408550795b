# SPDX-License-Identifier: BSD-3-Clause
"""Types of a recording: the recorder's commands, its phases, its bags."""
from __future__ import annotations

from enum import Enum
from typing import List, NamedTuple, Optional, Protocol, Tuple

from process_visualizer.clients.recording_options import RecordingOptions
from process_visualizer.gui.ros.snapshots import RecorderSnapshot


class RecorderClient(Protocol):
    """The methods of ``nodes.bag_recorder.BagRecorder`` that are used; each waits for an answer."""

    def start(self, options: RecordingOptions) -> str:
        """Start; return the path."""

    def stop(self) -> List[str]:
        """Stop; return the paths."""

    def mark(self, label: str) -> None:
        """Write a labelled moment."""

    def save_recent(self, options: RecordingOptions) -> str:
        """Write the memory; return the path."""


class Phase(Enum):
    """The recorder's phase. OFF: none was launched; WAITING: it was; GONE: it has ended."""

    OFF = 'off'
    WAITING = 'waiting'
    IDLE = 'idle'
    STARTING = 'starting'
    RECORDING = 'recording'
    STOPPING = 'stopping'
    GONE = 'gone'


class Mark(NamedTuple):
    """A labelled moment of a recording: the time since its beginning."""

    time_s: float
    label: str


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
