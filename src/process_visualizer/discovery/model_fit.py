# SPDX-License-Identifier: BSD-3-Clause
"""The fit of a model to observations: lengths between its links, places of its tool."""
from __future__ import annotations

from typing import Dict, List, Optional, Sequence

import numpy as np

from process_visualizer.discovery.evidence.moving_frames import Motion
from process_visualizer.discovery.evidence.seen import SeenTransform
from process_visualizer.discovery.found_model import FoundModel
from process_visualizer.motion.kinematics import Kinematics, Placement
from process_visualizer.motion.tool_learning import rigid_residuals

_LEAST_LENGTHS = 3  # a base and a flange alone are those of many
_KEEP_DISTANCE = ('revolute', 'continuous')


class ModelFit:
    """A model beside what was seen; distances are root mean squares in m, None: not comparable."""

    def __init__(self, model: FoundModel) -> None:
        self._description, self._prefix = model.description, model.joint_prefix
        self._kinematics = Kinematics(model.description.text)

    def lengths_m(self, transforms: Sequence[SeenTransform]) -> Optional[float]:
        """Return how far the links on tf are from where the model has them in their parents."""
        zeros = {name: 0.0 for name, kind in self._description.joints.items()
                 if kind in _KEEP_DISTANCE}
        away = []
        for it in transforms:
            child, parent = self._own(it.child), self._own(it.parent)
            if self._description.parents.get(child) == parent:
                place = self._kinematics.placement(child, parent, zeros)
                if place is not None:
                    away.append(np.subtract(place.position, it.placement.position))
        return _rms(np.array(away)) if len(away) >= _LEAST_LENGTHS else None

    def tool_m(self, motion: Motion) -> Optional[float]:
        """Return how far a moving frame is from the link that is nearest to it all the time."""
        bases = self._places(motion.parent, motion)
        if not bases:
            return None
        reported = np.array([base.then(it.place).position
                             for base, it in zip(bases, motion.samples)])
        return min((_rms(np.array([it.position for it in places]) - reported)
                    for places in self._moving(motion).values()), default=None)

    def free_tool_m(self, motion: Motion) -> Optional[float]:
        """Return the same if the base may be elsewhere, or the tool has an offset to the link."""
        found = [rigid_residuals(np.array([it.position for it in places]),
                                 np.array([it.place.position for it in motion.samples]))
                 for places in self._moving(motion).values()]
        bases = self._places(motion.parent, motion)
        if bases:
            found += [_offset_residuals(places, [base.then(it.place) for base, it
                                                 in zip(bases, motion.samples)])
                      for places in self._moving(motion).values()]
        return min(map(_rms, found), default=None)

    def _moving(self, motion: Motion) -> Dict[str, List[Placement]]:
        """The places of the links that move in the root link."""
        found = {link: self._places(link, motion) for link in self._description.links
                 if self._kinematics.moves(link, self._description.root_link)}
        return {link: places for link, places in found.items() if places}

    def _places(self, frame: str, motion: Motion) -> List[Placement]:
        """Return where a frame is in the root link at each sample; nothing if it is not known."""
        found = [self._kinematics.connection(
            self._own(frame), self._description.root_link,
            {self._own(name): position for name, position in it.positions.items()})
            for it in motion.samples]
        return [it for it in found if it is not None] if None not in found else []


    def _own(self, name: str) -> str:
        """Return what the model calls a link or joint that its driver gives a prefix."""
        return name[len(self._prefix):] if name.startswith(self._prefix) else name


def _offset_residuals(places: Sequence[Placement], reported: Sequence[Placement]) -> np.ndarray:
    """Return what the best constant offset in a moving link leaves of reported positions."""
    offsets = np.array([place.inverse().then(it).position
                        for place, it in zip(places, reported)])
    residuals: np.ndarray = offsets - offsets.mean(axis=0)
    return residuals


def _rms(vectors: np.ndarray) -> float:
    return float(np.sqrt(np.mean(np.sum(np.square(vectors), axis=1))))
