# SPDX-License-Identifier: BSD-3-Clause
"""The published scene: the state of playback, as a value."""
from __future__ import annotations

from typing import NamedTuple, Optional, Tuple

from process_visualizer.bags.bag_index import BagIndex
from process_visualizer.playback.scene.read_ahead import BACKWARD, FORWARD
from process_visualizer.playback.timeline import Basis


class ShownScene(NamedTuple):
    """The scene that so many messages of the recording make, which are visible, or replaced.

    ``scene`` is that of the timeline (Basis.scene) to which it belongs. ``paused_ns`` is the
    position [bag ns] for which it was published; None where it moves.
    """

    passed: int
    scene: int
    paused_ns: Optional[int] = None

    def next_message(self, forward: bool) -> Tuple[int, int]:
        """Return the position of the message that play passes next, and FORWARD or BACKWARD."""
        return (self.passed, FORWARD) if forward else (self.passed - 1, BACKWARD)

    def moving(self) -> ShownScene:
        """Return it as it is while playing."""
        return self if self.paused_ns is None else self._replace(paused_ns=None)

    def with_passed(self, position: int, step: int) -> ShownScene:
        """Return the scene after passing the message at a position, FORWARD or BACKWARD."""
        return ShownScene(position + (step == FORWARD), self.scene)

    def without(self, position: int, step: int) -> ShownScene:
        """Return the scene before the message at a position was passed, as it is taken back."""
        return self._replace(passed=position + (step == BACKWARD))

    def standing(self, passed: int, bag_ns: int) -> ShownScene:
        """Return the one of so many messages at a position [bag ns] where play stands still."""
        return self._replace(passed=passed, paused_ns=bag_ns)

    def visible(self, index: BagIndex, basis: Basis, bag_ns: int) -> int:
        """Return how many messages are visible at a position [bag ns], whatever was published.

        Where it stands still after a step, these are the ones up to which that led: others may
        have the same time.
        """
        stands = basis.scene == self.scene and (basis.paused, bag_ns) == (True, self.paused_ns)
        return self.passed if stands else index.count_until(bag_ns)


def scene_after_jump(index: BagIndex, basis: Basis) -> ShownScene:
    """Return the scene at the position of a basis; messages of just that time are played then."""
    if basis.paused:
        return ShownScene(index.count_until(basis.bag_ns), basis.scene, basis.bag_ns)
    count = index.count_before if basis.forward else index.count_until
    return ShownScene(count(basis.bag_ns), basis.scene)
