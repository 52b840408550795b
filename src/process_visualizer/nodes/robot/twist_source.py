# SPDX-License-Identifier: BSD-3-Clause
"""The source of the tool's velocity: received poses, or the recording that is played."""
from __future__ import annotations

import math
import struct
import threading
from functools import partial
from operator import itemgetter
from typing import Callable, Dict, Iterator, List, NamedTuple, Optional, Tuple

import genpy
import rospy

from process_visualizer.bagio.message_layout import MessageDamaged
from process_visualizer.bagio.number_places import joint_places
from process_visualizer.clients.service_connection import ServiceConnection, ServiceUnreachable
from process_visualizer.msg import PlayerState
from process_visualizer.nodes.common.markers import RefreshRate
from process_visualizer.nodes.common.node_handle import NodeHandle
from process_visualizer.nodes.common.node_parameters import LiveNumber
from process_visualizer.nodes.robot.message_reader import ToolPose, float32_values
from process_visualizer.nodes.robot.tool_input import FramesNotConnected, PoseDecoder
from process_visualizer.playback.playback_clock import PlaybackClock
from process_visualizer.playback.timeline import MAX_RATE
from process_visualizer.robot.joints import JointMatching
from process_visualizer.robot.measuring_time import USABLE_WITHIN_S, MeasuringTime
from process_visualizer.robot.recorded_velocity import (
    PosePart,
    RecordedPose,
    RecordedPoses,
    RecordedVelocity,
    kept_part,
    needed_part,
    next_part,
)
from process_visualizer.robot.rotations import Triple
from process_visualizer.robot.velocity import ToolVelocity
from process_visualizer.ros_names import (
    BAG_PLAYER,
    FLOAT_ARRAY,
    NAMED_JOINTS,
    PLAYBACK_RATE,
    PLAYER_STATE_TOPIC,
)
from process_visualizer.srv import ReadTopic


class JointsAt(NamedTuple):
    """Positions [rad or m] of joints by name, and when they were measured."""

    positions: Dict[str, float]
    stamp: rospy.Time


_STAMP, _STAMP_OFFSET = struct.Struct('<II'), 4  # of a std_msgs/Header
_POSITION = struct.Struct('<d')


class RecordedJoints(NamedTuple):
    """The topics on which drivers send the joints, and the meaning of their messages.

    Joints were measured a latency [s] before their stamp, or without a stamp before their arrival.
    """

    latencies_s: Dict[str, float]  # by topic
    matching: JointMatching

    def read(self, node: NodeHandle, service: ServiceConnection, part: PosePart
             ) -> Dict[str, TopicPart]:
        """Return the recorded messages of the topics that are played, by topic.

        Raises:
            ServiceUnreachable: the player does not answer.
        """
        parts = {topic: read_messages(service, node.resolve(topic), part)
                 for topic in self.latencies_s}
        return {topic: it for topic, it in parts.items() if it is not None}

    def decoded(self, topic: str, part: TopicPart) -> Iterator[Tuple[float, JointsAt]]:
        """Yield the time [s] of each usable message of a topic, and the robot's joints in it."""
        for recorded_s, message in part.messages:
            try:
                yield recorded_s, self._decode(topic, part.type, message, part.begin_s + recorded_s)
            except ValueError:
                continue  # joint_proc reports it when it is played

    def _decode(self, topic: str, kind: str, message: bytes, recorded_s: float) -> JointsAt:
        """Return the robot's joints in a message that was recorded at a time [s].

        Raises:
            ValueError: the message cannot be used.
        """
        latency = rospy.Duration.from_sec(self.latencies_s[topic])
        if kind == FLOAT_ARRAY:
            return JointsAt(self.matching.match((), float32_values(message)),
                            rospy.Time.from_sec(recorded_s) - latency)
        if kind not in NAMED_JOINTS:
            raise ValueError(f'{kind} carries no joints')
        try:
            names, offsets, _ = joint_places(kind, message)
        except MessageDamaged as error:
            raise ValueError(f'its bytes are not those of {kind}: {error}') from error
        stamp = rospy.Time(*_STAMP.unpack_from(message, _STAMP_OFFSET))
        if abs(stamp.to_sec() - recorded_s) > USABLE_WITHIN_S:  # none, or of another computer
            stamp = rospy.Time.from_sec(recorded_s)
        positions = [_POSITION.unpack_from(message, offset)[0] for offset in offsets]
        return JointsAt(self.matching.match(names, positions), stamp - latency)


# Reads the poses of a tool from a part of the recording, with the player's service ~read.

SERVICE = f'/{BAG_PLAYER}/read'
JOINTS_HZ = 100.0
"""Maximum rate at which joint states are used in addition to poses, as in robot_state_publisher.

For a tool located from joints alone, every state is used, as for its curve.
"""
ANSWER_S = 5.0
_NS = 1e-9
_MIN_PERIOD_SHARE = 0.9  # of a period, as joint states arrive unevenly
Decoders = Callable[[str], Optional[PoseDecoder]]


class Reading(NamedTuple):
    """The poses, their period [s], and the reason if frames up to the base are missing."""

    poses: RecordedPoses
    period_s: float
    problem: str = ''


class TopicPart(NamedTuple):
    """The messages of a topic with the positions [s] at which they were recorded."""

    type: str
    begin_s: float  # of the recording: bag time of position 0
    period_s: float
    messages: List[Tuple[float, bytes]]


def read_messages(service: ServiceConnection, topic: str, part: PosePart) -> Optional[TopicPart]:
    """Return a topic's messages from the player's service; None if the topic is not played.

    Raises:
        ServiceUnreachable: the player does not answer.
    """
    messages: List[Tuple[float, bytes]] = []
    begin_s, end_s = round(part.begin_s, 9), round(part.end_s, 9)  # as the player counts, in ns
    while True:
        answer = service.call(topic, begin_s, end_s)
        if not answer.success:
            return None
        end = 0
        for recorded_s, size in zip(answer.positions, answer.sizes):
            end += size
            messages.append((recorded_s, answer.data[end - size:end]))
        if answer.end >= end_s:
            return TopicPart(answer.type, answer.recording_begin.to_sec(), answer.period, messages)
        begin_s = answer.end + _NS


class _Event(NamedTuple):
    """A message: its recording time [s], the function to find its pose, its topic's period [s]."""

    recorded_s: float
    pose: Callable[[], Optional[ToolPose]]
    period_s: float


class RecordedReader:
    """Reads one tool's poses, and the robot's joints if the poses need them."""

    def __init__(self, node: NodeHandle, topic: str, decoders: Decoders,
                 joints: Optional[RecordedJoints], preroll_s: float) -> None:
        """Read the poses of one topic.

        Args:
            node: the connection to ROS.
            topic: the topic of the poses; '' if joints and model give them.
            decoders: returns a new decoder for a message type; None for an unsupported one.
            joints: those of the robot, if they have a topic.
            preroll_s: the time before the wanted poses from which a decoder also gets messages [s].
        """
        self._node, self._has_poses = node, bool(topic)
        self.topic = node.resolve(topic or (next(iter(joints.latencies_s)) if joints else topic))
        self._decoders, self._joints, self._preroll_s = decoders, joints, preroll_s
        self._needs_joints = False
        self._service = node.connect(SERVICE, ReadTopic, ANSWER_S)

    def read(self, part: PosePart) -> Optional[Reading]:
        """Return the poses of a part of the recording; None if they are not played.

        Raises:
            ServiceUnreachable: the player does not answer.
        """
        reach = PosePart(max(part.begin_s - self._preroll_s, 0.0), part.end_s)
        tool = read_messages(self._service, self.topic, reach) if self._has_poses else None
        reading = None if self._needs_joints or not self._has_poses \
            else self._decoded(part, tool, {})
        if self._joints is None or (reading is not None and not reading.problem):
            return reading
        # Joints from before the part are used if others are in it: some are sent only when they
        # move.
        joints = self._joints.read(self._node, self._service, reach)
        self._needs_joints = bool(joints)
        if not joints and reading is not None:
            topics = ' and '.join(map(self._node.resolve, self._joints.latencies_s))
            return reading._replace(problem=f'{reading.problem}; record {topics} too, from which '
                                    'it can be computed')
        come = any(it.messages and it.messages[-1][0] >= reach.begin_s for it in joints.values())
        return self._decoded(part, tool, joints if come else {})

    def _decoded(self, part: PosePart, tool: Optional[TopicPart],
                 joints: Dict[str, TopicPart]) -> Optional[Reading]:
        decoder = self._decoders('' if tool is None else tool.type)
        if decoder is None:
            return None
        events = [event for topic, sent in joints.items()
                  for event in self._joint_events(decoder, topic, sent)]
        if tool is None and not events:
            return None
        if tool is not None:
            events += [_Event(recorded_s, partial(decoder.pose, message), tool.period_s)
                       for recorded_s, message in tool.messages]
        played = [*joints.values(), *([tool] if tool else [])]
        collected = _collected(events, played[-1].begin_s, is_in_parts=tool is None)
        poses = [pose for pose in collected.poses if pose.recorded_s >= part.begin_s]
        return Reading(RecordedPoses(part, poses), tool.period_s if tool else collected.period_s,
                       '' if collected.poses else collected.problem)

    def _joint_events(self, decoder: PoseDecoder, topic: str, joints: TopicPart
                      ) -> Iterator[_Event]:
        assert self._joints is not None
        shortest_s = _MIN_PERIOD_SHARE / JOINTS_HZ if self._has_poses else 0.0
        new: Dict[str, float] = {}
        next_s = -math.inf
        for recorded_s, found in self._joints.decoded(topic, joints):
            new.update(found.positions)
            if new and recorded_s >= next_s:
                next_s = recorded_s + shortest_s
                yield _Event(recorded_s, partial(decoder.take_joints, new, found.stamp),
                             joints.period_s)
                new = {}


class _Collected(NamedTuple):
    """Poses, why one was missing, and the period [s] of the messages that gave the first pose."""

    poses: List[RecordedPose]
    problem: str
    period_s: float


def _collected(events: List[_Event], recording_s: float, is_in_parts: bool) -> _Collected:
    """Return the poses of events, in order of time.

    If joints arrive in parts, the last pose with the same stamp is used, as it has all of them.
    Unusable messages are skipped: they are reported when they are played.
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


MOMENT_S = 0.05  # an operator does not notice this delay of a number
_RETRY_S, _WARNING_S = 1.0, 10.0


class RecordedMoment(NamedTuple):
    """A position of playback, its wall time [s], and the velocities around it."""

    position_s: float
    wall_s: float
    around: RecordedVelocity

    def velocity(self) -> Optional[Triple]:
        """Return the velocity (3,) [m/s] in the base frame; None if the tool has none."""
        return self.around.velocity(self.position_s)

    def angular_velocity(self) -> Optional[Triple]:
        """Return the angular velocity (3,) [rad/s] in the base frame; None as above."""
        return self.around.angular_velocity(self.position_s)

    def age_s(self) -> Optional[float]:
        """Return the age of the last pose [s of the recording]; None before the first."""
        return self.around.age_s(self.position_s)


class _Known(NamedTuple):
    poses: RecordedPoses
    velocity: RecordedVelocity


class RecordedMotion:
    """Keeps the poses around the position of playback.

    A worker reads them with the player's service ~read: first the poses needed for the position,
    then those ahead. Thus a velocity depends only on the recording and the position, not on earlier
    messages or arrival times.
    """

    def __init__(self, node: NodeHandle, reader: RecordedReader, clock: PlaybackClock,
                 window_s: float, on_change: Callable[[], None],
                 latency_s: float = 0.0) -> None:
        """Prepare; `start` begins to follow the player.

        Args:
            node: the connection to ROS.
            reader: reads the poses.
            clock: the clock of the player's states.
            window_s: the window of the slopes [s].
            on_change: called, in various threads, after each state of the player, and when more is
                known.
            latency_s: the time from the measurement of a pose to its stamp, or its arrival [s].
        """
        self._node, self._reader = node, reader
        self._clock = clock
        self._window_s, self._latency_s = window_s, latency_s
        self._on_change = on_change
        self._lock = threading.Lock()
        self._recording: Tuple[object, ...] = ()  # begin, duration, files, topics
        self._duration_s = 0.0
        self._is_played: Optional[bool] = None  # not known yet
        self._known: Optional[_Known] = None
        self._problem = ''
        self._retry_s = 0.0
        self._awaited_s = math.inf
        self._warnings = RefreshRate(_WARNING_S)
        self._worker = node.worker(self._read, 'recorded poses')

    def start(self) -> None:
        """Begin to follow the player."""
        self._node.subscribe(PLAYER_STATE_TOPIC, PlayerState, self._take_state)

    def is_in_charge(self) -> bool:
        """Return whether a player plays the poses, or may do so."""
        return self._is_played is not False and self._clock.follows_player(self._node.wall_s())

    @property
    def problem(self) -> str:
        """Return why the recording cannot give a velocity; '' if it can."""
        return self._problem if self.is_in_charge() else ''

    def is_awaited(self) -> bool:
        """Return whether the velocity at the position will soon be known."""
        if not self.is_in_charge() or self.moment() is not None:
            self._awaited_s = math.inf
            return False
        self._awaited_s = min(self._awaited_s, self._node.monotonic_s())
        return self._node.monotonic_s() < self._awaited_s + MOMENT_S

    def moment(self) -> Optional[RecordedMoment]:
        """Return the moment at the present position; None while it is not known."""
        wall_s = self._node.wall_s()
        bag, known = self._clock.present(wall_s), self._known
        if bag is None or known is None:
            return None
        position_s = self._within(bag.time_s)
        if not known.poses.part.holds(needed_part(position_s, self._duration_s)):
            return None
        return RecordedMoment(position_s, wall_s, known.velocity)

    def forget(self) -> None:
        """Read everything again, as the meaning of messages has changed."""
        with self._lock:
            self._recording = ()

    def _take_state(self, state: PlayerState) -> None:
        recording = (state.begin, state.duration, *state.files,
                     *(topic.name for topic in state.topics))
        with self._lock:
            if recording != self._recording:
                self._recording, self._duration_s = recording, state.duration
                self._is_played = self._known = None
        self._worker.wake()
        self._on_change()

    def _within(self, position_s: float) -> float:
        """Return the position of the stamp, or the arrival, of data measured at a position."""
        return min(max(position_s + self._latency_s, 0.0), self._duration_s)

    def _read(self) -> Optional[float]:
        """Read the part needed next; return 0 s to continue at once, None if nothing is needed."""
        with self._lock:
            recording, part = self._recording, self._next_part()
        if part is None:
            return None
        self._extend(recording, part)
        return 0.0

    def _next_part(self) -> Optional[PosePart]:
        bag = self._clock.present(self._node.wall_s())
        if (bag is None or not self._recording or self._node.monotonic_s() < self._retry_s
                or not self.is_in_charge()):
            return None
        known = None if self._known is None else self._known.poses.part
        return next_part(known, self._within(bag.time_s), _bounded(bag.rate), self._duration_s)

    def _extend(self, recording: Tuple[object, ...], part: PosePart) -> None:
        try:
            reading = self._reader.read(PosePart(round(part.begin_s, 9), round(part.end_s, 9)))
        except ServiceUnreachable as error:
            now_s = self._node.monotonic_s()
            # not at the first failure: the player may just have ended
            if self._retry_s and self._warnings.is_due(now_s):
                self._node.warn(f'{self._reader.topic}: its recorded velocities are not known: '
                                f'{error}')
            self._retry_s = now_s + _RETRY_S
            return
        self._retry_s = 0.0
        known = None if reading is None else self._joined(reading)
        with self._lock:
            if self._recording is recording:
                self._is_played, self._known = reading is not None, known
                self._problem = '' if reading is None else reading.problem
        self._on_change()

    def _joined(self, reading: Reading) -> _Known:
        poses, before = reading.poses, self._known
        if before is not None and (before.poses.part.end_s == poses.part.begin_s
                                   or before.poses.part.begin_s == poses.part.end_s):
            poses = before.poses.joined(poses)
        bag = self._clock.present(self._node.wall_s())
        if bag is not None:
            poses = poses.only(kept_part(self._within(bag.time_s), _bounded(bag.rate)))
        return _Known(poses, poses.velocity(self._window_s, reading.period_s))


def _bounded(rate: float) -> float:
    """Return the rate for which poses are read ahead; at higher rates velocities may be missing."""
    return min(max(rate, -MAX_RATE), MAX_RATE)


_STANDING: Triple = (0.0, 0.0, 0.0)


class Twist(NamedTuple):
    """Velocity (3,) [m/s] and angular velocity (3,) [rad/s], in the base frame, and their time."""

    linear: Triple
    angular: Triple
    stamp: rospy.Time


class ShownVelocity(NamedTuple):
    """The velocity (3,) [m/s] to show (None: none), and the age of its last pose [s]."""

    velocity: Optional[Triple]
    age_s: float = 0.0


class TwistSource:
    """The tool's velocity: live from received poses, in playback from the recording.

    In playback only the position matters, not the received poses. If the recording has no velocity
    at the position because poses are missing there, none is shown; after ``stale_after_s`` the
    display shows for how long.
    """

    def __init__(self, node: NodeHandle, recorded: Optional[RecordedMotion], window_s: float,
                 stale_after_s: float, latency_s: float = 0.0) -> None:
        """``recorded`` reads the recording, if there is a topic.

        Received poses were measured ``latency_s`` before their stamps, or before their arrival.
        """
        self._node, self._recorded = node, recorded
        self._live = ToolVelocity(window_s)
        self._times = MeasuringTime()
        self._rate = LiveNumber(node, PLAYBACK_RATE, 1.0)
        self._stale_after_s, self._latency_s = stale_after_s, latency_s
        self._last_recorded: Optional[Triple] = None

    @property
    def is_recorded(self) -> bool:
        """Return whether the recording is the source."""
        return self._recorded is not None and self._recorded.is_in_charge()

    @property
    def is_known(self) -> bool:
        """Return whether the recording is known at the position, with or without a velocity."""
        return self._recorded is not None and self._recorded.moment() is not None

    @property
    def doubts_stamps(self) -> bool:
        """Return whether the last pose's stamp did not advance, although it is used."""
        return self._times.stamp_did_not_advance and not self.is_recorded

    def add(self, pose: ToolPose, now_s: float) -> None:
        """Add a received pose."""
        wall_s = self._times.wall_s(pose.stamp_s, now_s)
        if not self.is_recorded:
            self._last_recorded = None
            self._live.add(now_s - self._latency_s, wall_s - self._latency_s, pose.position,
                           pose.quaternion, self._rate.value())

    def settle(self, now_s: float) -> None:
        """Use the poses that have waited long enough."""
        self._live.settle(now_s - self._latency_s)

    def is_awaited(self) -> bool:
        """Return whether the velocity will soon be known, so that drawing should wait."""
        return self._recorded is not None and self._recorded.is_awaited()

    def twist(self) -> Optional[Twist]:
        """Return the present velocities; None if they are unknown."""
        if self._recorded is not None and self._recorded.is_in_charge():
            moment = self._recorded.moment()
            return None if moment is None else _twist(
                moment.velocity(), moment.angular_velocity(), self._stamp_s(moment.wall_s))
        return _twist(self._live.velocity(), self._live.angular_velocity(), self._live.wall_s())

    def shown(self) -> ShownVelocity:
        """Return the velocity to show now."""
        if self._recorded is None or not self._recorded.is_in_charge():
            return ShownVelocity(self._live.velocity() or self._last_recorded)
        moment = self._recorded.moment()
        if moment is None:
            return ShownVelocity(None)
        self._last_recorded, age_s = moment.velocity(), moment.age_s() or 0.0
        if self._last_recorded is None and age_s > self._stale_after_s:
            return ShownVelocity(_STANDING, age_s)
        return ShownVelocity(self._last_recorded, age_s)

    def _stamp_s(self, wall_s: float) -> float:
        """Return a wall time [s] that has just been read, as ROS time.

        Without simulated time both are the same. Reading the clock again would add the time that
        the thread had to wait in between, at 4x four times that time.
        """
        return wall_s if self._node.is_wall_clock() else self._node.ros_s()


def _twist(linear: Optional[Triple], angular: Optional[Triple],
           stamp_s: float) -> Optional[Twist]:
    if linear is None or angular is None:
        return None
    return Twist(linear, angular, rospy.Time.from_sec(stamp_s))
