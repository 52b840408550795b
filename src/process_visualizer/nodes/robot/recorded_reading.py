# SPDX-License-Identifier: BSD-3-Clause
"""Reads the poses of a tool from a part of the recording, with the player's service ~read."""
from __future__ import annotations

import math
from functools import partial
from operator import itemgetter
from typing import Callable, Dict, Iterator, List, NamedTuple, Optional, Sequence, Tuple

import genpy

from process_visualizer.motion.velocity.recorded_poses import Part, RecordedPose, RecordedPoses
from process_visualizer.nodes.common.node_handle import NodeHandle
from process_visualizer.nodes.robot.pose_decoder import FramesNotConnected, PoseDecoder
from process_visualizer.nodes.robot.recorded_joints import RecordedJoints
from process_visualizer.nodes.robot.robot_messages import ToolPose
from process_visualizer.ros_names import BAG_PLAYER
from process_visualizer.srv import ReadTopic

SERVICE = f'/{BAG_PLAYER}/read'
JOINTS_HZ = 100.0
"""At most this rate of joint states is used, as by robot_state_publisher."""
_ANSWER_S = 5.0
_NS = 1e-9
_SHORTEST = 0.9  # of a period: joint states come unevenly
Decoders = Callable[[str], Optional[PoseDecoder]]


class Reading(NamedTuple):
    """The poses, their period [s], and the reason if frames up to the base are missing."""

    poses: RecordedPoses
    period_s: float
    problem: str = ''


class _Messages(NamedTuple):
    """The messages of a topic with the positions [s] at which they were recorded."""

    type: str
    begin_s: float  # of the recording: bag time of position 0
    period_s: float
    messages: List[Tuple[float, bytes]]


class _Event(NamedTuple):
    """A message: when it was recorded [s], what finds its pose, and the period of its topic [s]."""

    recorded_s: float
    pose: Callable[[], Optional[ToolPose]]
    period_s: float


class RecordedReader:
    """Reads one tool's poses, and the robot's joints if the poses need them."""

    def __init__(self, node: NodeHandle, topic: str, decoders: Decoders,
                 joints: Optional[RecordedJoints], preroll_s: float) -> None:
        """Read the poses of one topic.

        Args:
            node: its connection to ROS.
            topic: the topic of the poses; '' if joints and model give them.
            decoders: returns a new decoder of messages of a type, None for an unsupported one.
            joints: those of the robot, if they have a topic.
            preroll_s: how much a decoder receives before the wanted poses [s].
        """
        self._node, self._has_poses = node, bool(topic)
        self.topic = node.resolve(topic or (joints.topics[0] if joints else topic))
        self._decoders, self._joints, self._preroll_s = decoders, joints, preroll_s
        self._needs_joints = False
        self._service = node.connect(SERVICE, ReadTopic, _ANSWER_S)

    def read(self, part: Part) -> Optional[Reading]:
        """Return the poses of a part of the recording; None if they are not played.

        Raises:
            ServiceUnreachable: the player does not answer.
        """
        reach = Part(max(part.begin_s - self._preroll_s, 0.0), part.end_s)
        tool = self._messages(self.topic, reach) if self._has_poses else None
        reading = None if self._needs_joints or not self._has_poses \
            else self._decoded(part, tool, [])
        if self._joints is None or (reading is not None and not reading.problem):
            return reading
        topics = [self._node.resolve(it) for it in self._joints.topics]
        joints = [it for it in (self._messages(topic, reach) for topic in topics) if it]
        self._needs_joints = bool(joints)
        if not joints and reading is not None:
            return reading._replace(problem=f'{reading.problem}; record {" and ".join(topics)} too,'
                                    ' from which it can be computed')
        return self._decoded(part, tool, joints)

    def _messages(self, topic: str, part: Part) -> Optional[_Messages]:
        """Return the messages of a topic; None if it is not played."""
        messages: List[Tuple[float, bytes]] = []
        begin_s = part.begin_s
        while True:
            answer = self._service.call(topic, begin_s, part.end_s)
            if not answer.success:
                return None
            end = 0
            for recorded_s, size in zip(answer.positions, answer.sizes):
                end += size
                messages.append((recorded_s, answer.data[end - size:end]))
            if answer.end >= part.end_s:
                return _Messages(answer.type, answer.recording_begin.to_sec(), answer.period,
                                 messages)
            begin_s = answer.end + _NS

    def _decoded(self, part: Part, tool: Optional[_Messages],
                 joints: Sequence[_Messages]) -> Optional[Reading]:
        decoder = self._decoders('' if tool is None else tool.type)
        if decoder is None:
            return None
        events = [event for it in joints for event in self._joint_events(decoder, it)]
        if tool is None and not events:
            return None
        if tool is not None:
            events += [_Event(recorded_s, partial(decoder.pose, message), tool.period_s)
                       for recorded_s, message in tool.messages]
        played = [*joints, *([tool] if tool else [])]
        found = _collected(events, played[-1].begin_s, is_in_parts=tool is None)
        poses = [it for it in found.poses if it.recorded_s >= part.begin_s]
        return Reading(RecordedPoses(part, poses), tool.period_s if tool else found.period_s,
                       '' if found.poses else found.problem)

    def _joint_events(self, decoder: PoseDecoder, joints: _Messages) -> Iterator[_Event]:
        assert self._joints is not None
        new: Dict[str, float] = {}
        next_s = -math.inf
        for recorded_s, message in joints.messages:
            try:
                found = self._joints.decode(joints.type, message, joints.begin_s + recorded_s)
            except ValueError:
                continue  # joint_proc reports it when it is played
            new.update(found.positions)
            if new and recorded_s >= next_s:
                next_s = recorded_s + _SHORTEST / JOINTS_HZ
                yield _Event(recorded_s, partial(decoder.take_joints, new, found.stamp),
                             joints.period_s)
                new = {}


class _Collected(NamedTuple):
    """Poses, why one was not there, and the period of the messages that have the first [s]."""

    poses: List[RecordedPose]
    problem: str
    period_s: float


def _collected(events: List[_Event], recording_s: float, is_in_parts: bool) -> _Collected:
    """Return the poses in some events, in their order.

    Of joints that come in parts, the last pose with one stamp counts: it has all of them.
    Messages that cannot be used are left out: they are reported when they are played.
    """
    poses: List[RecordedPose] = []
    problem, period_s = '', 0.0
    for recorded_s, take, topic_period_s in sorted(events, key=itemgetter(0)):
        try:
            pose = take()
        except FramesNotConnected as error:
            problem = str(error)
            continue
        except (ValueError, genpy.DeserializationError):
            continue
        if pose is not None:
            period_s = period_s or topic_period_s
            stamp_s = pose.stamp_s - recording_s if pose.stamp_s else math.nan
            if is_in_parts and poses and poses[-1].stamp_s == stamp_s:
                poses.pop()
            poses.append(RecordedPose(recorded_s, stamp_s, pose.position, pose.quaternion))
    return _Collected(poses, problem, period_s)
