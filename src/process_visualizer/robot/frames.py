# SPDX-License-Identifier: BSD-3-Clause
"""Frames of a cell: the tree of the fixed ones, and what drivers mean by their names."""
from __future__ import annotations

import math
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Collection, Dict, Iterable, List, Mapping, Optional, Tuple

Triple = Tuple[float, float, float]
MAX_M = 1e6
"""No frame of a cell is farther; numbers far beyond overflow where they are used."""
_MAX_RAD = 1e3


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
        if max(map(abs, xyz)) > MAX_M or max(map(abs, ypr)) > _MAX_RAD:
            raise ValueError(f'the pose of {child} is out of range: at most {MAX_M:g} m and '
                             f'{_MAX_RAD:g} rad')
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


def default_base_frame(robot: str) -> str:
    """Return the base frame of a robot that names none."""
    return f'{robot}/link0'


def default_tool_frame(robot: str) -> str:
    """Return the tool frame of a robot that has no model to choose it from."""
    return f'{robot}/tool'


def meant_frame(name: str, links: Collection[str], robot: str, prefix: str = '') -> str:
    """Return the link of the model that a driver means, or the name as it is.

    A driver knows neither the prefix that the configuration has put before the links, nor that
    the model has a namespace; and one with a tf prefix puts that before links that have none.

    Args:
        name: from a message; a leading slash does not count.
        links: of the robot's own model.
        robot: the device's name.
        prefix: of the links' names, such as ``left_``.
    """
    name = name.lstrip('/')
    own = {robot, prefix.strip('/_-')}
    words: List[str] = [name]
    namespace, _, rest = name.partition('/')
    if rest and namespace in own:
        words.append(rest)
    for word in words:
        for candidate in (word, prefix + word, f'{robot}/{word}'):
            if candidate in links:
                return candidate
    return name


def prefix_advice(name: str, links: Collection[str]) -> str:
    """Return what to change where a name is a link's but for a prefix of one of them; '' if not."""
    for link in sorted(links, key=len, reverse=True):
        longer, shorter = (name, link) if len(name) > len(link) else (link, name)
        prefix = _prefix(longer, shorter)
        if prefix and longer is name:
            return (f'the model calls {name} {link}: write prefix="{prefix}" in its <model>, and '
                    'the same before the frames in <base>, <tool>, <force>')
        if prefix:
            return (f'the model calls {name} {link}: write prefix="{prefix}" in its <model>, '
                    'instead of an <arg> that makes it, or let the driver send the frame so')
    return ''


def _prefix(longer: str, shorter: str) -> Optional[str]:
    """Return what one name has before another one, with the mark that ends it."""
    prefix = longer[:len(longer) - len(shorter)]
    return prefix if longer.endswith(shorter) and prefix[-1:] in tuple('_/-') else None
