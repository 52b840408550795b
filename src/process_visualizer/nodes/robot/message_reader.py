# SPDX-License-Identifier: BSD-3-Clause
"""Reads poses, wrenches and static transforms from topics, whatever types their drivers send."""
from __future__ import annotations

import math
import struct
import threading
from dataclasses import dataclass, replace
from typing import (
    Any,
    Callable,
    Dict,
    Generic,
    List,
    Mapping,
    NamedTuple,
    Optional,
    Sequence,
    Tuple,
    Type,
    TypeVar,
)

import genpy
import rospy
from geometry_msgs.msg import PoseStamped, TransformStamped, WrenchStamped
from tf2_msgs.msg import TFMessage

from process_visualizer.bagio.message_layout import MessageDamaged
from process_visualizer.bagio.number_places import float_array
from process_visualizer.nodes.common.complaints import Complaints
from process_visualizer.nodes.common.node_handle import NodeHandle
from process_visualizer.robot.kinematics import Placement
from process_visualizer.robot.rotations import (
    NO_ROTATION,
    Quaternion,
    quaternion_from_rotation_vector,
)
from process_visualizer.ros_names import (
    CONFLICT_KEY,
    FLOAT_ARRAY,
    POSE_STAMPED,
    STATIC_TF_TOPIC,
    TF_MESSAGE,
    WRENCH_STAMPED,
)

_BESIDE_S = 1.0
"""Maximum time between messages [s] of two nodes to count as publishing at the same time."""
_MIN_IN_A_ROW = 5
_LATE_STEPS = 20.0
"""Maximum lag, in steps between its values, of a node that republishes another's values."""


class _Report(NamedTuple):
    values: Sequence[float]
    time_s: float
    step: float  # distance from the previous values


class SourceConflict:
    """Detects contradicting values of several nodes, as JointBoard does in C++.

    A forgotten simulator is drawn alternately with the driver, although each message by itself is
    valid. A node that only republishes another's values, some steps late, does not contradict it.
    """

    def __init__(self, equal: float) -> None:
        """``equal`` is the maximum distance, in their unit, between values that count as equal."""
        self._equal = equal
        self._reports: Dict[str, _Report] = {}
        self._in_a_row = 0

    def add(self, source: str, values: Sequence[float], now_s: float) -> str:
        """Add the values published by a node; return the problem, '' if there is none.

        Args:
            source: the node's name.
            values: (n,), of the same n each time.
            now_s: the present time [s] of a monotonic clock.
        """
        before = self._reports.get(source)
        step = 0.0 if before is None else math.dist(before.values, values)
        report = _Report(tuple(values), now_s, step)
        self._reports = {name: other for name, other in self._reports.items()
                      if now_s - other.time_s < _BESIDE_S and len(other.values) == len(values)}
        self._reports[source] = report
        others = {name: math.dist(other.values, values) for name, other in self._reports.items()
                  if name != source}
        apart = max((distance for name, distance in others.items() if distance > self._equal
                     + _LATE_STEPS * max(step, self._reports[name].step)), default=0.0)
        if others:
            self._in_a_row = self._in_a_row + 1 if apart else 0
        if not others or self._in_a_row < _MIN_IN_A_ROW:
            return ''
        return (f'{len(self._reports)} nodes publish on this topic, '
                f'{", ".join(sorted(self._reports))}, and their values are {apart:.3g} apart; what '
                'is shown jumps between them. Stop all but one')


MAX_STEP_S = 1.0  # longest step of a simulated clock
MEMORY_S = 6.0  # longer than warnings are delayed


class TimeWatch:
    """Compares ROS time with a clock that never stops, as the class TimeWatch in C++ does."""

    def __init__(self) -> None:
        self._last_s: Optional[float] = None
        self._advanced_s = 0.0
        self._stepped_back_s = -math.inf

    def problem(self, ros_s: float, steady_s: float) -> str:
        """Return what is wrong with ROS time, or was some seconds ago; '' if nothing.

        Args:
            ros_s: the present ROS time [s].
            steady_s: the present time [s] of a clock that never stops.
        """
        if self._last_s is not None and ros_s < self._last_s:
            self._stepped_back_s = steady_s
        if ros_s != self._last_s:
            self._advanced_s = steady_s
        self._last_s = ros_s
        if steady_s - self._stepped_back_s < MEMORY_S:
            return ("ROS time has gone back: this computer's clock was set back, or what publishes "
                    '/clock was restarted')
        if steady_s - self._advanced_s > MAX_STEP_S:
            return ('ROS time is not advancing; check the publisher of /clock, or set '
                    '/use_sim_time to false')
        return ''


Quantity = TypeVar('Quantity')
Decoder = Callable[[bytes], Quantity]


class DoubtfulMessage(Exception):
    """Raised for a message that was used although it has a problem, which the text names."""

    def __init__(self, problem: str, values: Optional[Mapping[str, str]] = None) -> None:
        """``values`` are for programs."""
        super().__init__(problem)
        self.values: Mapping[str, str] = values or {}


class TopicReader(Generic[Quantity]):
    """Subscribes to a topic and passes its decoded content to a callback, one message at a time.

    The type is taken from the publisher's connection, so that one node reads the thesis' arrays
    and standard messages alike. An unusable message is skipped with a complaint that names the
    topic; the last good one stays. A message that arrives while ROS time is stopped or has gone
    back is used, but also with a complaint.
    """

    def __init__(self, node: NodeHandle, complaints: Complaints, topic: str, message_type: str,
                 decoders: Dict[str, Decoder[Quantity]],
                 callback: Callable[[Quantity], None],
                 numbers: Optional[Callable[[Quantity], Sequence[float]]] = None,
                 equal: float = 0.0) -> None:
        """Subscribe.

        Args:
            node: the connection to ROS.
            complaints: those of the node.
            topic: the topic's name.
            message_type: the only accepted type ('package/Type'), or '' for all types of
                ``decoders``.
            decoders: for each type, a function of the serialized message; it raises ValueError
            (with the problem) for content that cannot be used.
            callback: called in the thread of the subscription; may raise ValueError too, or
                DoubtfulMessage if it has used the content nevertheless.
            numbers: returns the values in which publishers may contradict each other.
            equal: see SourceConflict.
        """
        self._node, self._complaints = node, complaints
        self._topic = node.resolve(topic)
        self._decoders = decoders
        self._message_type = message_type
        self._callback = callback
        self._lock = threading.Lock()  # two publishers of a topic are two threads
        self._time_watch = TimeWatch()
        self._numbers, self._conflict = numbers, SourceConflict(equal)
        node.subscribe(topic, rospy.AnyMsg, self._receive)

    def _receive(self, message: rospy.AnyMsg) -> None:
        with self._lock:
            try:
                quantity = self._decode(message)
                self._callback(quantity)
                time_problem = self._time_watch.problem(self._node.ros_s(),
                                                        self._node.monotonic_s())
                if time_problem:
                    raise DoubtfulMessage(time_problem)
                self._watch_publishers(quantity, message._connection_header.get('callerid', ''))
                self._complaints.note_good(self._topic)
            except ValueError as error:
                self._warn(f'is left out: {error}')
            except DoubtfulMessage as doubt:
                self._warn(f'is shown, but {doubt}', doubt.values)

    def _watch_publishers(self, quantity: Quantity, publisher: str) -> None:
        if self._numbers is not None:
            problem = self._conflict.add(publisher, self._numbers(quantity),
                                         self._node.monotonic_s())
            if problem:
                raise DoubtfulMessage(problem, {CONFLICT_KEY: f'{self._topic}: {problem}'})

    def _decode(self, message: Any) -> Quantity:
        carried: str = message._connection_header['type']
        decoder: Optional[Decoder[Quantity]] = self._decoders.get(carried)
        if decoder is None or (self._message_type and carried != self._message_type):
            expected = self._message_type or ' or '.join(self._decoders)
            raise ValueError(f'it carries {carried}, and {expected} is expected')
        try:
            return decoder(message._buff)
        except genpy.DeserializationError as error:
            raise ValueError(f'its bytes are not those of {carried}: {error}') from error

    def _warn(self, problem: str, values: Optional[Mapping[str, str]] = None) -> None:
        self._complaints.add(self._topic, f'a message on {self._topic} {problem}', values=values)


def float32_values(message: bytes) -> Tuple[float, ...]:
    """Return the numbers of a serialized Float32MultiArray without the layout's padding.

    A driver sends a few numbers at 125 Hz or more; building the message object would take several
    times as long.

    Raises:
        ValueError: the bytes are not those of such a message.
    """
    try:
        begin, count, padding = float_array(message)
    except MessageDamaged:
        raise ValueError('the message is cut off in its layout') from None
    if len(message) != begin + 4 * count:
        raise ValueError('the message has another size than its layout says')
    if padding > count:
        raise ValueError('data_offset of the layout lies behind the end of the data')
    return struct.unpack_from(f'<{count}f', message, begin)[padding:]


def tf_transforms(message: bytes) -> List[TransformStamped]:
    """Return the transforms of a serialized tf2_msgs/TFMessage."""
    transforms: List[TransformStamped] = deserialize(TFMessage, message).transforms
    return transforms


def placement_of(transform: TransformStamped) -> Placement:
    """Return the pose of a transform's frame in its parent."""
    place, turn = transform.transform.translation, transform.transform.rotation
    return Placement((place.x, place.y, place.z), (turn.x, turn.y, turn.z, turn.w))


class StaticFrames:
    """The static transforms of the cell, with one subscription for all parts of a node.

    The subscription begins when the first part asks, because most robots need none; later parts get
    the transforms known so far.
    """

    def __init__(self, node: NodeHandle, complaints: Complaints) -> None:
        """``node`` and ``complaints`` are those of the robot processor."""
        self._node, self._complaints = node, complaints
        self._lock = threading.RLock()
        self._known: Dict[str, TransformStamped] = {}  # by child
        self._callbacks: List[Callable[[List[TransformStamped]], None]] = []

    def known(self) -> List[TransformStamped]:
        """Return the transforms so far."""
        return list(self._known.values())

    def follow(self, callback: Callable[[List[TransformStamped]], None]) -> None:
        """Call a function with the transforms so far, and with those that change from now on."""
        with self._lock:
            self._callbacks.append(callback)
            if len(self._callbacks) == 1:
                TopicReader(self._node, self._complaints, STATIC_TF_TOPIC, TF_MESSAGE,
                            {TF_MESSAGE: tf_transforms}, self._take)
            elif self._known:
                callback(self.known())

    def _take(self, transforms: List[TransformStamped]) -> None:
        with self._lock:
            changed = [it for it in transforms if it.child_frame_id not in self._known
                       or not _is_equal(it, self._known[it.child_frame_id])]
            self._known = {**self._known, **{it.child_frame_id: it for it in changed}}
            if changed:
                for callback in self._callbacks:
                    callback(changed)


def _is_equal(one: TransformStamped, other: TransformStamped) -> bool:
    """Return whether two transforms to the same frame are equal, ignoring their stamps."""
    return (one.header.frame_id == other.header.frame_id
            and bool(one.transform == other.transform))


# The quantities that a robot's driver sends, and the message types for them.

_MAX_M, _MAX_FORCE_N, _MAX_TORQUE_NM = 1e5, 1e7, 1e7
"""Limits of plausible values, far beyond what any robot can reach or withstand."""


@dataclass(frozen=True)
class ToolPose:
    """Pose of the tool in a frame ('' is the robot's base frame)."""

    position: Sequence[float]  # (3,) [m]
    quaternion: Quaternion = NO_ROTATION  # x y z w, not zero, of any length
    frame: str = ''
    stamp_s: float = 0.0  # when it was measured; 0: the message does not say
    has_rotation: bool = True  # False: the message holds a position only
    child_frame: str = ''  # the frame of tf that has this pose


@dataclass(frozen=True)
class Wrench:
    """Force (3,) [N] and torque (3,) [Nm] in a frame ('' is the robot's force frame)."""

    force: Sequence[float]
    torque: Sequence[float]
    frame: str = ''
    stamp_s: float = 0.0  # when it was measured; 0: the message does not say


def _pose_from_array(message: bytes) -> ToolPose:
    """Read x y z [m], and a rotation vector [rad] (Universal Robots) or a quaternion x y z w."""
    values = _finite(float32_values(message))
    _in_range(values[:3], 'position', _MAX_M, 'm')
    if len(values) == 3:
        return ToolPose(values, has_rotation=False)
    if len(values) == 6:
        return ToolPose(values[:3], quaternion_from_rotation_vector(values[3:]))
    if len(values) == 7:
        return _with_rotation(ToolPose(values[:3]), values[3:])
    raise ValueError('3 values (x y z), 6 (with a rotation vector) or 7 (with a quaternion '
                     f'x y z w) are expected, not {len(values)}')


def _pose_from_pose_stamped(message: bytes) -> ToolPose:
    stamped = deserialize(PoseStamped, message)
    position, rotation = stamped.pose.position, stamped.pose.orientation
    quaternion = _finite((rotation.x, rotation.y, rotation.z, rotation.w))
    return _with_rotation(ToolPose(
        _in_range(_finite(_numbers(position)), 'position', _MAX_M, 'm'),
        frame=stamped.header.frame_id.lstrip('/'),
        stamp_s=stamped.header.stamp.to_sec()), quaternion)


def _wrench_from_array(message: bytes) -> Wrench:
    """Read fx fy fz [N], and tx ty tz [Nm] if present."""
    values = _finite(float32_values(message))
    if len(values) not in (3, 6):
        raise ValueError('3 values (a force) or 6 (a force and a torque) are expected, '
                         f'not {len(values)}')
    return _wrench(values[:3], values[3:] if len(values) == 6 else (0.0, 0.0, 0.0))


def _wrench_from_wrench_stamped(message: bytes) -> Wrench:
    stamped = deserialize(WrenchStamped, message)
    return _wrench(_finite(_numbers(stamped.wrench.force)),
                   _finite(_numbers(stamped.wrench.torque)),
                   stamped.header.frame_id.lstrip('/'), stamped.header.stamp.to_sec())


def _wrench(force: Sequence[float], torque: Sequence[float], frame: str = '',
            stamp_s: float = 0.0) -> Wrench:
    return Wrench(_in_range(force, 'force', _MAX_FORCE_N, 'N'),
                  _in_range(torque, 'torque', _MAX_TORQUE_NM, 'Nm'), frame, stamp_s)


POSE_DECODERS: Dict[str, Decoder[ToolPose]] = {
    FLOAT_ARRAY: _pose_from_array,
    POSE_STAMPED: _pose_from_pose_stamped,
}
WRENCH_DECODERS: Dict[str, Decoder[Wrench]] = {
    FLOAT_ARRAY: _wrench_from_array,
    WRENCH_STAMPED: _wrench_from_wrench_stamped,
}


def deserialize(message_class: Type[genpy.Message], message: bytes) -> Any:
    """Return a message from its bytes; raises genpy.DeserializationError."""
    return message_class().deserialize(message)


def _numbers(vector: Any) -> Sequence[float]:
    return vector.x, vector.y, vector.z


def _finite(values: Sequence[float]) -> Sequence[float]:
    if not all(map(math.isfinite, values)):
        raise ValueError('it holds NaN or infinity')
    return values


def _in_range(values: Sequence[float], what: str, largest: float, unit: str) -> Sequence[float]:
    """Return values that are plausible for a robot; raise ValueError for others."""
    if max(map(abs, values), default=0.0) > largest:
        raise ValueError(f'a {what} of {max(values, key=abs):.3g} {unit} is out of any physical '
                         f'range (up to {largest:g} {unit})')
    return values


def _with_rotation(pose: ToolPose, quaternion: Sequence[float]) -> ToolPose:
    """Return a pose with its rotation; drivers that know only the position send zeros."""
    if max(map(abs, quaternion)) < 1e-6:
        return replace(pose, has_rotation=False)
    x, y, z, w = quaternion
    return replace(pose, quaternion=(x, y, z, w))
