# SPDX-License-Identifier: BSD-3-Clause
"""Frames of a cell: the tree of fixed frames, and the meaning of frame names from drivers."""
from __future__ import annotations

import math
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Collection, Dict, Iterable, List, Mapping, Optional, Tuple

Triple = Tuple[float, float, float]
MAX_M = 1e6
"""Maximum distance of a frame; computations with far greater numbers would overflow."""
_MAX_RAD = 1e3


@dataclass(frozen=True)
class Frame:
    """A fixed frame and its pose in its parent: xyz [m], ypr [rad] (intrinsic z-y'-x'')."""

    parent: str
    child: str
    xyz: Triple = (0.0, 0.0, 0.0)
    ypr: Triple = (0.0, 0.0, 0.0)


class FrameTree:
    """The fixed frames by name; changes that would make tf2 fail are refused."""

    def __init__(self, frames: Iterable[Frame]) -> None:
        """Initialize with the frames.

        Raises:
            ValueError: a frame is given twice, has no name or parent, or is its own ancestor.
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
        """Move a frame, to another parent unless that is ''; return the moved frame.

        ``links`` has the parent of each link of the models, which other nodes publish.

        Raises:
            ValueError: the frame is unknown, the numbers are not finite or out of range, or the
                frame would be its own ancestor. Nothing is changed then.
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
    """Return the base frame of a robot without a configured one."""
    return f'{robot}/link0'


def default_tool_frame(robot: str) -> str:
    """Return the tool frame of a robot without a model."""
    return f'{robot}/tool'


def meant_frame(name: str, links: Collection[str], robot: str, prefix: str = '') -> str:
    """Return the link of the model to which a driver's frame refers, or the name unchanged.

    A driver knows neither the prefix of links in the configuration nor the namespace of the model;
    a driver with a tf prefix puts it before links without a prefix.

    Args:
        name: the frame in a message; a leading slash is ignored.
        links: links of the robot's own model.
        robot: the device's name.
        prefix: prefix of the links' names, such as ``left_``.
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
    """Return advice if a name and a link differ only by a prefix of one of them, else ''."""
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
    """Return the prefix of a longer name before a shorter one, with its separator, or None."""
    prefix = longer[:len(longer) - len(shorter)]
    return prefix if longer.endswith(shorter) and prefix[-1:] in tuple('_/-') else None
