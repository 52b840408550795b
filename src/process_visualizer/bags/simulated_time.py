"""What /clock says: the position, which never goes back but where playback jumps or turns."""
from __future__ import annotations

from typing import Tuple

from process_visualizer.bags.timeline import Basis


class SimulatedTime:
    """Where the position slips back, as the machine cannot keep up, the clock waits for it."""

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
