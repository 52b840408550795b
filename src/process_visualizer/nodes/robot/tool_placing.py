# SPDX-License-Identifier: BSD-3-Clause
"""Finds the frame in which a robot's arrows are drawn, and reports contradictions."""
from __future__ import annotations

import math
from collections import deque
from contextlib import suppress
from typing import Deque, Dict, List, Mapping, NamedTuple, Optional, Sequence

import numpy as np
from geometry_msgs.msg import TransformStamped

from process_visualizer.nodes.common.complaints import Complaints
from process_visualizer.nodes.common.node_handle import NodeHandle
from process_visualizer.nodes.robot.message_reader import StaticFrames, ToolPose, placement_of
from process_visualizer.nodes.robot.tool_input import FramesNotConnected, pose_by_model
from process_visualizer.parameters.robot_parameters import RobotParameters
from process_visualizer.robot.kinematics import Kinematics, Placement
from process_visualizer.robot.rotations import (
    NO_ROTATION,
    Quaternion,
    Triple,
    Vector,
    conjugate,
    rotated,
    rotation_vector_between,
)
from process_visualizer.robot.tool_learning import Body, Finding, ToolLearner

PERIOD_S = 0.2  # between two checks; nothing may move in between
_MAX_S = 1.0
_STILL_M, _STILL_JOINT = 0.004, 0.01  # rad or m; beyond it, pose and joint states do not match


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
        """Examine the last data; they are a sample if nothing has moved since the last check."""
        last = self._last
        if last is not None and 0.0 <= now_s - last.time_s < PERIOD_S:
            return
        look = self._last = _Look(now_s, dict(joints), position)
        if last is not None and now_s - last.time_s < _MAX_S and _is_still(last, look):
            self._learner.add(look.joints, self._frames(look.joints), position, quaternion)
            self.finding = self._learner.finding()

    def _frames(self, joints: Mapping[str, float]) -> Dict[str, Placement]:
        places = {frame: self._kinematics.placement(frame, self._base, joints)
                  for frame in self._bodies}
        return {frame: place for frame, place in places.items() if place is not None}


def describe(robot: str, topic: str, chosen: str, finding: Finding) -> str:
    """Return a text that describes a finding."""
    if finding.is_frame:
        return (f'the poses of {robot} on {topic} are those of the frame {finding.frame}, '
                f'{finding.distance_m:.3f} m from the frame {chosen} that is shown')
    place = f'at {_words(finding.xyz)} m' + (
        f', turned by yaw pitch roll {_words(finding.ypr)} rad,' if any(finding.ypr) else '')
    return (f'the poses of {robot} on {topic} are those of a tool {place} in the frame '
            f'{finding.frame}; the frame {chosen} is shown, {finding.distance_m:.3f} m from it')


def values(finding: Finding) -> Dict[str, str]:
    """Return a finding as texts, for the configuration."""
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
    """Return the body to which each link is fixed; collision-only links cannot be tools."""
    bodies = {}
    for link in kinematics.links:
        body = kinematics.fixed_to(link, base)
        carriers = kinematics.carriers(body, base)
        if carriers is not None and link not in kinematics.collision_only:
            bodies[link] = Body(body, carriers)
    return bodies


MOTION_S = 0.1
"""Maximum delay [s] between a pose and joint states of one moment; the tool may move meanwhile."""
_SAMPLES = 15
_NOTHING: Triple = (0.0, 0.0, 0.0)


class ToolPlace(NamedTuple):
    """A frame to draw in, its rotation in the base frame, and the tool's position in both."""

    frame: str
    quaternion: Quaternion  # x y z w
    foot: Vector  # (3,) [m] in the frame: where arrows begin
    position: Vector  # (3,) [m] in the base frame

    def in_frame(self, vector: Vector) -> Triple:
        """Return a vector (3,) of the base frame, expressed in this frame."""
        return rotated(conjugate(self.quaternion), vector)


class Difference(NamedTuple):
    """The reported pose of a tool relative to the model's, in the tool frame."""

    offset: Triple  # (3,) [m]
    angle: float  # rad; NaN without a reported orientation

    def distance_m(self) -> float:
        """Return the distance of the two positions [m]."""
        return math.hypot(*self.offset)


class ToolDifference:
    """Compares the reported poses of a tool with those of its model.

    A pose and the joint states of the same moment arrive one after the other, and after a jump of
    playback one of them is still from before it; so the median of some samples is used.
    """

    def __init__(self) -> None:
        """Begin without samples."""
        self._samples: Deque[Sequence[float]] = deque(maxlen=_SAMPLES)
        self.is_new = False  # samples have been added since this was set to False

    def add(self, model: Placement, position: Vector, quaternion: Optional[Quaternion]) -> None:
        """Compare a reported position (3,) [m], and the orientation if known, with the model."""
        offset = rotated(conjugate(model.quaternion),
                         [a - b for a, b in zip(position, model.position)])
        angle = math.nan if quaternion is None else math.hypot(
            *rotation_vector_between(model.quaternion, quaternion))
        self._samples.append((*offset, angle))
        self.is_new = True

    def is_settled(self) -> bool:
        """Return whether there are enough samples for a decision."""
        return len(self._samples) == _SAMPLES

    def median(self) -> Difference:
        """Return the median difference of the last samples."""
        if not self._samples:
            return Difference(_NOTHING, math.nan)
        x, y, z, angle = np.median(np.array(self._samples), axis=0).tolist()
        return Difference((x, y, z), angle)


def base_place(base_frame: str, position: Vector) -> ToolPlace:
    """Return the place for arrows at a reported position in the base frame."""
    return ToolPlace(base_frame, NO_ROTATION, position, position)


PATIENCE_S = 5.0  # before missing data is reported, as other nodes are still starting
LOOK_PERIOD_S = 1.0
LASTING_LOOKS = 10
"""Number of consecutive checks that must find a difference before it is reported. On a busy
computer, poses and joints arrive further apart, but not in so many consecutive checks."""
LOG_PERIOD_S = 30.0
ABOUT = 'tool frame'


class ToolPlacer:
    """Finds the pose of the tool in the robot's model, which RViz draws.

    The model's joints give the orientation of the tool frame in the base frame; so an arrow that
    is drawn in the tool frame has the right direction whatever orientation the driver reports, and
    moves with the drawn robot. Without a model, or if the tool frame is not fixed to it, arrows
    are drawn in the base frame, at the reported position.
    """

    def __init__(self, node: NodeHandle, parameters: RobotParameters, kinematics: Kinematics,
                 complaints: Complaints, static: StaticFrames) -> None:
        """``parameters`` has frames and limits; static frames are followed if they are needed."""
        self._node, self._complaints = node, complaints
        self._parameters = parameters
        self._kinematics = kinematics
        self._positions: Dict[str, float] = {}
        self._difference = ToolDifference()
        self._speed_m_per_s = self._turning_rad_per_s = 0.0
        self._study = ToolStudy(kinematics, parameters.base_frame, parameters.tool_frame)
        self._is_placed = True
        self._looks_apart = 0
        self._next_look_s = self._node.monotonic_s() + PATIENCE_S
        if kinematics.links and parameters.tool_frame not in kinematics.links:
            static.follow(self._on_static)

    def take_joints(self, positions: Mapping[str, float]) -> None:
        """Note positions [rad or m] of some joints."""
        self._positions.update(positions)

    def pose_of_joints(self, positions: Mapping[str, float], stamp_s: float) -> Optional[ToolPose]:
        """Return the tool's pose in the model; None if these joints do not move it.

        Args:
            positions: those that have just arrived; the other joints have not moved.
            stamp_s: when they were measured.
        """
        with suppress(FramesNotConnected):
            return pose_by_model(self._kinematics, self._parameters.tool_frame,
                                 self._parameters.base_frame, positions, self._positions, stamp_s)
        return None

    def place(self, pose: ToolPose, is_stale: bool) -> ToolPlace:
        """Return where to draw the arrows of a tool.

        Args:
            pose: the last reported one.
            is_stale: whether pose or joint states are too old to be compared.
        """
        frame, model = self._parameters.tool_frame, self._model_placement()
        self._is_placed = model is not None
        if model is None:
            if pose.child_frame == frame:  # tf itself has the orientation of that frame
                return ToolPlace(frame, pose.quaternion, (0.0, 0.0, 0.0), pose.position)
            return base_place(self._parameters.base_frame, pose.position)
        if not is_stale:
            quaternion = pose.quaternion if pose.has_rotation else None
            self._difference.add(model, pose.position, quaternion)
            if self._may_learn():
                self._study.look(self._node.monotonic_s(), self._positions, pose.position,
                                 quaternion)
        return ToolPlace(frame, model.quaternion, self._foot(), model.position)

    def note_motion(self, speed_m_per_s: float, turning_rad_per_s: float) -> None:
        """Note how fast the tool moves and turns, which limits what can be compared."""
        self._speed_m_per_s, self._turning_rad_per_s = speed_m_per_s, turning_rad_per_s

    def look(self) -> None:
        """Complain about a tool frame that is unusable, or not where the tool is reported."""
        now_s = self._node.monotonic_s()
        if now_s < self._next_look_s:
            return
        self._next_look_s = now_s + LOOK_PERIOD_S
        problem = self._problem()
        finding = self._study.finding
        if problem and finding is not None and self._may_learn():
            parameters = self._parameters
            topic = self._node.resolve(parameters.tool_center_frame.name)
            text = describe(parameters.robot_name, topic, parameters.tool_frame, finding)
            self._complaints.state(ABOUT, text, values(finding), LOG_PERIOD_S)
        elif problem:
            self._complaints.state(ABOUT, problem, log_period_s=LOG_PERIOD_S)
        else:
            self._complaints.end(ABOUT)

    def _foot(self) -> 'tuple[float, float, float]':
        """Return where arrows begin in the tool frame: at its origin if the tool is there."""
        difference = self._difference.median()
        if self._parameters.foot_at_tool_frame or self._is_near(difference):
            return 0.0, 0.0, 0.0
        return difference.offset

    def _may_learn(self) -> bool:
        """Return whether the tool frame was chosen here and differs from the reported tool."""
        return (not self._parameters.foot_at_tool_frame and self._difference.is_settled()
                and not self._is_near(self._difference.median()))

    def _is_near(self, difference: Difference) -> bool:
        limit_m = self._parameters.tool_limit_m + MOTION_S * self._speed_m_per_s
        return difference.distance_m() <= limit_m

    def _is_turned(self, difference: Difference) -> bool:
        limit_rad = self._parameters.tool_limit_rad + MOTION_S * self._turning_rad_per_s
        return difference.angle > limit_rad  # never for NaN

    def _count_apart(self, difference: Difference) -> None:
        """Count consecutive checks that found a difference, also across motion that hides it."""
        if not self._difference.is_new:
            return
        self._difference.is_new = False
        if not self._is_near(difference) or self._is_turned(difference):
            self._looks_apart += 1
        elif difference.distance_m() <= self._parameters.tool_limit_m \
                and not difference.angle > self._parameters.tool_limit_rad:
            self._looks_apart = 0

    def _problem(self) -> str:
        parameters = self._parameters
        if not self._is_placed:
            if not self._kinematics.links:
                return ''
            return (f'the place of the tool frame {parameters.tool_frame} in '
                    f'{parameters.base_frame} is not known, as it is not fixed to the model, or '
                    'the positions of joints '
                    'before it are not known; arrows begin at the reported position')
        difference = self._difference.median()
        if self._difference.is_settled():
            self._count_apart(difference)
        if self._looks_apart < LASTING_LOOKS:
            return ''
        turn = '' if math.isnan(difference.angle) else f' and {math.degrees(difference.angle):.0f}°'
        foot = 'of the tool frame' if parameters.foot_at_tool_frame \
            or self._is_near(difference) else 'that is reported'
        return (f'the tool pose on {self._node.resolve(parameters.tool_center_frame.name)} and '
                f'the tool frame {parameters.tool_frame} of the model are '
                f'{difference.distance_m():.3f} m{turn} apart; arrows begin at the position '
                f'{foot}. If another frame is meant, name it in <tool>')

    def _model_placement(self) -> Optional[Placement]:
        return self._kinematics.placement(self._parameters.tool_frame,
                                          self._parameters.base_frame, self._positions)

    def _on_static(self, transforms: List[TransformStamped]) -> None:
        for it in transforms:
            self._kinematics.fix(it.header.frame_id.lstrip('/'), it.child_frame_id.lstrip('/'),
                                 placement_of(it))
