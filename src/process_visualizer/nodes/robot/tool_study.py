# SPDX-License-Identifier: BSD-3-Clause
"""Learns a robot's tool from samples that are taken while the robot is at rest."""
from __future__ import annotations

import math
from typing import Dict, Mapping, NamedTuple, Optional

from process_visualizer.motion.kinematics import Kinematics, Placement
from process_visualizer.motion.rotations import Quaternion, Vector
from process_visualizer.motion.tool_learning import Body, Finding, ToolLearner

PERIOD_S = 0.2  # between two looks, between which nothing may move
_LONGEST_S = 1.0
_STILL_M, _STILL_JOINT = 0.004, 0.01  # rad or m; else a pose is not that of the joint states


class _Look(NamedTuple):
    time_s: float
    joints: Mapping[str, float]
    position: Vector


class ToolStudy:
    """Learns the tool of one robot from received poses and joint positions."""

    def __init__(self, kinematics: Kinematics, base: str, chosen: str) -> None:
        """``chosen`` is the tool frame that was chosen in the model."""
        self._kinematics, self._base = kinematics, base
        self._bodies = _bodies(kinematics, base)
        self._learner = ToolLearner(chosen, self._bodies)
        self._last: Optional[_Look] = None
        self.finding: Optional[Finding] = None

    def look(self, now_s: float, joints: Mapping[str, float], position: Vector,
             quaternion: Optional[Quaternion]) -> None:
        """Look at the last data; it is a sample if nothing has moved since the previous look."""
        last = self._last
        if last is not None and 0.0 <= now_s - last.time_s < PERIOD_S:
            return
        look = self._last = _Look(now_s, dict(joints), position)
        if last is not None and now_s - last.time_s < _LONGEST_S and _is_still(last, look):
            self._learner.add(look.joints, self._frames(look.joints), position, quaternion)
            self.finding = self._learner.finding()

    def _frames(self, joints: Mapping[str, float]) -> Dict[str, Placement]:
        places = {frame: self._kinematics.placement(frame, self._base, joints)
                  for frame in self._bodies}
        return {frame: place for frame, place in places.items() if place is not None}


def describe(robot: str, topic: str, chosen: str, finding: Finding) -> str:
    """Return what was learned, in two sentences."""
    if finding.is_frame:
        return (f'the poses of {robot} on {topic} are those of the frame {finding.frame}, '
                f'{finding.distance_m:.3f} m from the frame {chosen} that is shown')
    place = f'at {_words(finding.xyz)} m' + (
        f', turned by yaw pitch roll {_words(finding.ypr)} rad,' if any(finding.ypr) else '')
    return (f'the poses of {robot} on {topic} are those of a tool {place} in the frame '
            f'{finding.frame}; the frame {chosen} is shown, {finding.distance_m:.3f} m from it')


def values(finding: Finding) -> Dict[str, str]:
    """Return it as texts, for the configuration."""
    return {'tool_frame': finding.frame, 'tool_xyz': _words(finding.xyz),
            'tool_ypr': _words(finding.ypr)}


def _words(numbers: Vector) -> str:
    return ' '.join(f'{number:g}' for number in numbers)


def _is_still(one: _Look, other: _Look) -> bool:
    return (math.dist(one.position, other.position) < _STILL_M
            and one.joints.keys() == other.joints.keys()
            and all(abs(value - other.joints[name]) < _STILL_JOINT
                    for name, value in one.joints.items()))


def _bodies(kinematics: Kinematics, base: str) -> Dict[str, Body]:
    """Return the bodies to which links are fixed; links only for collisions are not tools."""
    bodies = {}
    for link in kinematics.links:
        body = kinematics.fixed_to(link, base)
        carriers = kinematics.carriers(body, base)
        if carriers is not None and link not in kinematics.collision_only:
            bodies[link] = Body(body, carriers)
    return bodies
