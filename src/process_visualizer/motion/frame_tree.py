# SPDX-License-Identifier: BSD-3-Clause
"""The fixed frames of a cell: a tree in which frames are moved."""
from __future__ import annotations

import math
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Dict, Iterable, List, Mapping, Tuple

Triple = Tuple[float, float, float]
FARTHEST_M = 1e6
"""No frame of a cell is farther; numbers far beyond overflow where they are used."""
_LARGEST_RAD = 1e3


@dataclass(frozen=True)
class Frame:
    """A fixed frame and its pose in its parent: xyz [m], ypr [rad] (intrinsic z-y'-x'')."""

    parent: str
    child: str
    xyz: Triple = (0.0, 0.0, 0.0)
    ypr: Triple = (0.0, 0.0, 0.0)


class FrameTree:
    """The frames by name; every change that would make tf2 fail is refused."""

    def __init__(self, frames: Iterable[Frame]) -> None:
        """Take the frames.

        Raises:
            ValueError: a frame is there twice, has no name or parent, or is its own ancestor.
        """
        self._frames: Dict[str, Frame] = {}
        for frame in frames:
            if frame.child in self._frames:
                raise ValueError(f'the frame {frame.child} is there twice')
            self._put(frame)

    def frames(self) -> List[Frame]:
        """Return all frames."""
        return list(self._frames.values())

    def move(self, parent: str, child: str, xyz: Triple, ypr: Triple,
             links: Mapping[str, str] = MappingProxyType({})) -> Frame:
        """Move a frame, to another parent unless that is ''; return the frame as it is now.

        ``links`` has the parent of each link of the models, which others publish.

        Raises:
            ValueError: the frame is not known, the numbers are not finite or out of any range, or
                it would be its own ancestor. Nothing is changed then.
        """
        known = self._frames.get(child)
        if known is None:
            raise ValueError(f"the frame '{child}' is not known; known are: "
                             f'{", ".join(sorted(self._frames)) or "none"}')
        if not all(map(math.isfinite, (*xyz, *ypr))):
            raise ValueError(f'the pose of {child} holds NaN or infinity')
        if max(map(abs, xyz)) > FARTHEST_M or max(map(abs, ypr)) > _LARGEST_RAD:
            raise ValueError(f'the pose of {child} is out of range: at most {FARTHEST_M:g} m and '
                             f'{_LARGEST_RAD:g} rad')
        moved = replace(known, parent=parent or known.parent, xyz=xyz, ypr=ypr)
        self._put(moved, links)
        return moved

    def _put(self, frame: Frame, links: Mapping[str, str] = MappingProxyType({})) -> None:
        if not frame.parent or not frame.child:
            raise ValueError('a frame needs a parent and a child, '
                             f"not parent '{frame.parent}' and child '{frame.child}'")
        parents = {**links, **{name: it.parent for name, it in self._frames.items()}}
        ancestor, seen = frame.parent, {''}
        while ancestor != frame.child and ancestor in parents and ancestor not in seen:
            seen.add(ancestor)
            ancestor = parents[ancestor]
        if ancestor == frame.child:
            raise ValueError(f'the frame {frame.child} would be its own ancestor '
                             f'with the parent {frame.parent}')
        self._frames[frame.child] = frame
