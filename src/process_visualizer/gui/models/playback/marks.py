# SPDX-License-Identifier: BSD-3-Clause
"""The marks of a recording, and which of them is next to a position."""
from __future__ import annotations

import bisect
from typing import Iterable, NamedTuple, Optional, Tuple

_JUST_PASSED_S = 0.7  # while playing, "previous mark" leads farther than to one just passed
_HERE_S = 0.0005


class PlacedMark(NamedTuple):
    """A mark, in s from the beginning of the recording."""

    position_s: float
    label: str


class Marks(NamedTuple):
    """Marks in the order of time."""

    all: Tuple[PlacedMark, ...] = ()

    @staticmethod
    def of(marks: Iterable[PlacedMark]) -> Marks:
        """Return marks that come in any order."""
        return Marks(tuple(sorted(marks)))

    def after(self, position_s: float) -> Optional[float]:
        """Return where the next mark is [s]; None if there is none."""
        row = bisect.bisect_right(self._positions(), position_s + _HERE_S)
        return self.all[row].position_s if row < len(self.all) else None

    def before(self, position_s: float, playing: bool) -> float:
        """Return where the mark before is [s], before the first one the beginning."""
        before_s = position_s - (_JUST_PASSED_S if playing else _HERE_S)
        row = bisect.bisect_left(self._positions(), before_s)
        return self.all[row - 1].position_s if row else 0.0

    def _positions(self) -> Tuple[float, ...]:
        return tuple(mark.position_s for mark in self.all)
