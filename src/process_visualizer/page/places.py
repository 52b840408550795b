# SPDX-License-Identifier: BSD-3-Clause
"""Poses of frames in the cell's, over the time of a recording."""
from __future__ import annotations

from typing import Any, Dict, List, NamedTuple, Optional, Tuple, Union

import numpy as np

from process_visualizer.motion.kinematics import Placement
from process_visualizer.motion.placements import Placements
from process_visualizer.page.packed import Packed

_TURN_STEPS = 32_767


class Span(NamedTuple):
    """A part of a recording [s from its begin]."""

    begin_s: float
    end_s: float

    def rows(self, times_s: np.ndarray) -> slice:
        """Return the rows of rising times that are in it, with one more on either side."""
        first, behind = np.searchsorted(times_s, (self.begin_s, np.nextafter(self.end_s, np.inf)))
        return slice(max(int(first) - 1, 0), int(behind) + 1)


class Moving(NamedTuple):
    """A place at ``times_s`` (n,), rising; between two of them it is on the straight line."""

    times_s: np.ndarray
    places: Placements


Place = Union[Placement, Moving]


class Places:
    """Frames by name; those that something refers to come into the page."""

    def __init__(self, packed: Packed, span: Span) -> None:
        """Take where columns go, and the part of the recording that is shown."""
        self._packed, self._span = packed, span
        self._frames: Dict[str, Place] = {}
        self._numbers: Dict[str, int] = {}
        self.entries: List[Dict[str, Any]] = []

    def add(self, frame: str, place: Place) -> None:
        """Add a frame; what was said first of it holds."""
        self._frames.setdefault(frame, place)

    def find(self, frame: str) -> Optional[Place]:
        """Return where a frame is; None if that is not known."""
        return self._frames.get(frame)

    def number(self, frame: str) -> Optional[int]:
        """Return the number of a frame in ``entries``; None if it is not known where it is."""
        place = self._frames.get(frame)
        if place is None:
            return None
        if frame not in self._numbers:
            self._numbers[frame] = len(self.entries)
            self.entries.append(self.entry(place))
        return self._numbers[frame]

    def entry(self, place: Place) -> Dict[str, Any]:
        """Return a place as the page has it."""
        if isinstance(place, Placement):
            return {'at': [*place.position, *place.quaternion]}
        rows = self._span.rows(place.times_s)
        positions, turns = (column[rows] for column in _whole(place))
        return {'times': self._packed.times(place.times_s[rows]),
                'positions': self._packed.scaled(positions),
                'turns': self._packed.plain(np.rint(
                    _TURN_STEPS * _continuous(turns)).astype(np.int16))}


def _whole(place: Moving) -> Tuple[np.ndarray, np.ndarray]:
    """The columns with a row for each time, though they may all be the same."""
    count = len(place.times_s)
    return (np.broadcast_to(place.places.positions, (count, 3)),
            np.broadcast_to(place.places.quaternions, (count, 4)))


def _continuous(turns: np.ndarray) -> np.ndarray:
    """Unit quaternions, each with the sign that is nearest to the one before."""
    units: np.ndarray = turns / np.maximum(np.linalg.norm(turns, axis=1, keepdims=True), 1e-12)
    flips = np.cumprod(np.where((units[1:] * units[:-1]).sum(axis=1) < 0.0, -1.0, 1.0))
    units[1:] *= flips[:, np.newaxis]
    return units
