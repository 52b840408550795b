# SPDX-License-Identifier: BSD-3-Clause
"""The time on /clock: the position, which goes back only where playback jumps or turns."""
from __future__ import annotations

from typing import Tuple

from process_visualizer.playback.timeline import Basis


def next_tick_s(due_s: float, now_s: float, period_s: float) -> float:
    """Return when the clock is told next, after a time [s] that was due and is told now.

    By what is due and not by what has passed, so that a late wake-up costs no time; what is late by
    whole periods is left out.
    """
    return due_s + period_s * max(1.0, (now_s - due_s) // period_s)


class SimulatedTime:
    """A clock that waits where the position slips back, as the machine cannot keep up."""

    def __init__(self) -> None:
        self._scene = -1
        self._last_ns = 0

    def at(self, basis: Basis, bag_ns: int) -> Tuple[int, bool]:
        """Return the bag time [ns] to be told at a position, and whether it goes back."""
        last_ns = self._last_ns
        if basis.scene == self._scene:
            bag_ns = max(bag_ns, last_ns) if basis.forward else min(bag_ns, last_ns)
        self._scene, self._last_ns = basis.scene, bag_ns
        return bag_ns, bag_ns < last_ns
