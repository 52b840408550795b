# SPDX-License-Identifier: BSD-3-Clause
"""Places of devices: the global frame, and each base frame in it."""
from __future__ import annotations

import math
from typing import Collection, Dict, Iterable, List, Optional, Tuple

from process_visualizer.cell.elements import DEFAULT_FRAME
from process_visualizer.cell.model import Pose
from process_visualizer.discovery.draft import is_frame
from process_visualizer.discovery.seen import FrameForest

_USUAL = (DEFAULT_FRAME, 'map', 'odom')
_OTHER_FRAMES = ('cell', 'cell_world')
_APART_M = 1.5
_LOOKING_AHEAD = (-math.pi / 2, 0.0, -math.pi / 2)
"""Rotation of an optical frame (REP 103) that looks along x."""


def global_frame(forest: FrameForest, links: Collection[str], bases: Collection[str]) -> str:
    """Return the global frame: a root on tf that carries robots or has a usual name, or a new one.

    Args:
        forest: the transforms seen on tf.
        links: frames that belong to models.
        bases: the root links of models.
    """
    roots: Dict[str, int] = {}
    for frame in forest.frames:
        root = forest.path(frame)[-1]
        roots[root] = roots.get(root, 0) + (frame in bases)
    usual = [root for root, count in roots.items() if root not in links and is_frame(root)
             and (count or root in _USUAL or len(forest.children(root)) > 1)]
    if usual:
        return max(sorted(usual), key=lambda root: (root == DEFAULT_FRAME, roots[root],
                                                    root in _USUAL))
    taken = {*links, *forest.frames}
    return next(name for name in _names() if name not in taken)


def _names() -> Iterable[str]:
    yield from (DEFAULT_FRAME, *_OTHER_FRAMES)
    number = 2
    while True:
        yield f'cell_{number}'
        number += 1


class BasePlaces:
    """Places of base frames in the global frame; frames without a known place stand in a row."""

    def __init__(self, forest: FrameForest, frame: str) -> None:
        self.frame = frame
        self._forest = forest
        self._unknown = 0

    @property
    def remarks(self) -> List[str]:
        """Return advice about unknown places."""
        if not self._unknown:
            return []
        return ['Devices whose place is not known stand in a row: write xyz in m and ypr (yaw '
                'pitch roll) in rad in their <base>, or use the tab Calibration of the launcher.']

    def of(self, frame: str) -> Tuple[Pose, bool]:
        """Return a frame's pose in the global frame, and whether the pose is known."""
        pose = self._forest.pose(frame, self.frame)
        if pose is not None:
            return pose, True
        self._unknown += 1
        ypr = _LOOKING_AHEAD if 'optical' in frame else (0.0, 0.0, 0.0)
        return Pose((0.0, (self._unknown - 1) * _APART_M, 0.0), ypr), False

    def base_attributes(self, frame: str) -> Tuple[Dict[str, str], str]:
        """Return the attributes of a <base>, and a comment if its place is unknown."""
        pose, is_known = self.of(frame)
        return {'frame': frame, **pose_attributes(pose)}, '' if is_known else 'place not known'


def pose_attributes(pose: Pose) -> Dict[str, str]:
    """Return xyz and, unless it is zero, ypr as attributes."""
    found = {'xyz': numbers(pose.xyz)}
    if any(pose.ypr):
        found['ypr'] = numbers(pose.ypr)
    return found


def numbers(values: Iterable[float]) -> str:
    """Return numbers as the text of an attribute."""
    return ' '.join(f'{value:.6f}'.rstrip('0').rstrip('.') for value in values)


def top_frame(forest: FrameForest, frame: str, above: Collection[str]) -> Tuple[str, Optional[str]]:
    """Return a frame's highest ancestor below the frames ``above``, and that ancestor's parent.

    The ancestor may be the frame itself. The parent is None at the root of a tree.
    """
    path: List[str] = forest.path(frame)
    for found, carrier in zip(path, path[1:]):
        if carrier in above:
            return found, carrier
    return path[-1], None
