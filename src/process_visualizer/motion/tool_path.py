# SPDX-License-Identifier: BSD-3-Clause
"""The frames between a robot's base and its tool, whatever places each of them."""
from __future__ import annotations

from typing import Callable, Dict, Iterator, List, Mapping, NamedTuple, Optional, Tuple, Union

import numpy as np

from process_visualizer.motion.kinematics import MOVABLE, Joint, Kinematics, Placement
from process_visualizer.motion.placements import Placements, constant, of_joint


class SentTransform(NamedTuple):
    """A transform that messages bring: seven numbers, the position and x y z w."""

    parent: str
    child: str


MovingPart = Union[SentTransform, Joint]
"""What has numbers that change with the time: (n, 7), or those of a joint in the last column."""
Source = Union[MovingPart, Placement]


class ToolPath(NamedTuple):
    """The chains from a tool, and from its base, to the first frame that carries both."""

    from_tool: Tuple[Source, ...]
    from_base: Tuple[Source, ...]

    @property
    def moving(self) -> Tuple[MovingPart, ...]:
        """Return what is needed to know where the tool is, the nearest to it first."""
        return tuple(it for it in self.from_tool + self.from_base if not isinstance(it, Placement))

    def places(self, values: Mapping[MovingPart, np.ndarray]) -> Placements:
        """Return where the tool is in the base, given the numbers of the moving parts."""
        return _carried(self.from_base, values).inverse().then(_carried(self.from_tool, values))


def _carried(sources: Tuple[Source, ...], values: Mapping[MovingPart, np.ndarray]) -> Placements:
    found = constant(Placement())
    for source in sources:
        if isinstance(source, Placement):
            place = constant(source)
        elif isinstance(source, SentTransform):
            place = Placements(values[source][:, :3], values[source][:, 3:])
        else:
            place = of_joint(source, values[source][:, -1])
        found = place.then(found)
    return found


class FrameSources:
    """Sources of each frame's pose in its parent; the first source of a frame holds."""

    def __init__(self) -> None:
        """Begin without frames."""
        self._above: Dict[str, Tuple[str, Source]] = {}

    def add_sent(self, transform: SentTransform) -> None:
        """Add a frame that messages place."""
        self._above.setdefault(transform.child, (transform.parent, transform))

    def add_fixed(self, parent: str, child: str, placement: Placement) -> None:
        """Add a frame that rests in its parent."""
        self._above.setdefault(child, (parent, placement))

    def add_model(self, model: Kinematics, offset: Callable[[str], float]) -> None:
        """Add the links of a model, which a robot_state_publisher sends.

        Args:
            model: of which the links are.
            offset: returns what has to be added to the measured positions of a joint [rad or m].
        """
        for link in model.links:
            joint = model.joint(link)
            if joint is not None:
                self._above.setdefault(link, (joint.parent, joint.origin if joint.kind == 'fixed'
                                              else joint.measured_with(offset(joint.name))))

    def path(self, base: str, tool: str) -> Optional[ToolPath]:
        """Return what leads from a base to a tool; None if nothing does that can be computed."""
        carriers = [base, *(parent for parent, _ in self._up(base))]
        candidates = [tool, *(parent for parent, _ in self._up(tool))]
        common = next((frame for frame in candidates if frame in carriers), None)
        if common is None:
            return None
        path = ToolPath(self._sources(tool, common), self._sources(base, common))
        is_known = all(isinstance(it, SentTransform) or it.kind in MOVABLE for it in path.moving)
        return path if is_known else None

    def _sources(self, frame: str, carrier: str) -> Tuple[Source, ...]:
        found: List[Source] = []
        for parent, source in self._up(frame):
            if frame == carrier:
                break
            found.append(source)
            frame = parent
        return tuple(found)

    def _up(self, frame: str) -> Iterator[Tuple[str, Source]]:
        """Yield the parent of a frame, the parent of that …, each with what places it there."""
        for _ in range(len(self._above)):  # recorded frames may be a ring
            if frame not in self._above:
                return
            parent, source = self._above[frame]
            yield parent, source
            frame = parent
