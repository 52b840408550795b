# SPDX-License-Identifier: BSD-3-Clause
"""Where in each type of message the values of a curve are stored, and when they were measured."""
from __future__ import annotations

import math
from typing import (
    Callable,
    Dict,
    List,
    NamedTuple,
    Optional,
    Protocol,
    Sequence,
    Tuple,
)

import numpy as np

from process_visualizer.bagio.bag_errors import BagDamaged
from process_visualizer.bagio.bag_index import BagIndex
from process_visualizer.bagio.message_definition import Connection, DefinitionError
from process_visualizer.bagio.number_places import (
    FieldLocator,
    FloatArrayLocator,
    JointLocator,
    Locator,
    TransformLocator,
    transforms_in,
)
from process_visualizer.bagio.recording import Recording
from process_visualizer.cell.model import Device, TopicFunction
from process_visualizer.cell.rosparams import given_parameters
from process_visualizer.curves.curve_sources import CurveSource, Quantity, tool_from_joints
from process_visualizer.curves.number_columns import Numbers
from process_visualizer.parameters.robot_parameters import JOINT_OFFSETS, usable_offsets
from process_visualizer.robot.description import RobotDescription, usable_description
from process_visualizer.robot.joints import JointMatching
from process_visualizer.robot.kinematics import Kinematics, Placement
from process_visualizer.robot.measuring_time import certain_rows, dated_rows, measuring_times
from process_visualizer.robot.placements import (
    FrameSources,
    MovingPart,
    SentTransform,
    ToolPath,
    interpolated,
)
from process_visualizer.robot.rotations import quaternion_from_ypr
from process_visualizer.robot.tool_frame import pose_frames, tool_frame
from process_visualizer.robot.velocity import GAP_S
from process_visualizer.ros_names import (
    FLOAT_ARRAY,
    NAMED_JOINTS,
    POSE_STAMPED,
    STATIC_TF_TOPIC,
    TF_MESSAGE,
    WRENCH_STAMPED,
)

# Tool poses in a recording's tf, including the frames that the cell itself adds.

_BLOCKS, _BLOCK = 5, 100
"""Number of parts of a recording, and number of messages read from each publisher in each part."""


class Messages(Protocol):
    """Available messages: those of a recording, or those in a recorder's memory."""

    @property
    def index(self) -> BagIndex:
        """The connections and times of the messages."""

    def message(self, position: int) -> memoryview:
        """Return the bytes of a message; raises BagDamaged if it cannot be read."""


Parts = Tuple[Dict[int, Locator], ...]


def tool_on_tf(messages: Messages, source: CurveSource, device: Device,
               connections: Sequence[int]) -> Optional[Tuple[ToolPath, Parts]]:
    """Return the path of transforms to a tool, and the locators of its moving parts.

    Frames that the recording lacks come from the device's model, as the cell's
    robot_state_publisher sends them, moved by the recorded joint states. The model is loaded only
    if needed. None if no moving part leads to the tool.
    """
    frames = _recorded_frames(messages, connections)
    _add_tool(frames, device)
    description = usable_description(device) if source.model else None
    base, tool = pose_frames(device, description) if source.model else source.frames
    path, matching = frames.path(base, tool), None
    if path is None:
        description = description or usable_description(device)
        if description is not None:
            matching = joint_matching(device, description)
            frames.add_model(Kinematics(description.text), matching.offset)
            path = frames.path(base, tool)
    if path is None or not path.moving:
        return None
    return path, tuple(_locators(messages, part, device, matching, connections)
                       for part in path.moving)


def _add_tool(frames: FrameSources, device: Device) -> None:
    """Add the frame of a configured tool, which cell_frames sends."""
    tool = tool_frame(device, None)
    if device.tool is not None and tool.frame != tool.parent:
        x, y, z, w = (float(it) for it in quaternion_from_ypr(tool.pose.ypr))
        frames.add_fixed(tool.parent, tool.frame, Placement(tool.pose.xyz, (x, y, z, w)))


def joint_matching(device: Device, description: RobotDescription) -> JointMatching:
    """Return the matching of joints that joint_proc uses, with the configured offsets."""
    prefix = '' if device.model is None else device.model.prefix
    return JointMatching(device.name, list(description.joints),
                         usable_offsets(given_parameters(device, JOINT_OFFSETS)), prefix)


def _recorded_frames(messages: Messages, connections: Sequence[int]) -> FrameSources:
    frames = FrameSources()
    for data in _some_messages(messages, connections):
        for transform in transforms_in(data):
            frames.add_sent(SentTransform(transform.parent, transform.child))
    index = messages.index
    for data in _some_messages(messages, index.connections_of(STATIC_TF_TOPIC)):
        for it in transforms_in(data):
            x, y, z, *turn = np.frombuffer(data, '<f8', 7, it.pose).tolist()
            frames.add_fixed(it.parent, it.child, Placement((x, y, z), tuple(turn)))
    return frames


def _some_messages(messages: Messages, connections: Sequence[int]) -> List[memoryview]:
    found = []
    for connection in connections:
        positions = messages.index.positions(connection)
        begins = np.linspace(0, max(len(positions) - _BLOCK, 0), _BLOCKS).astype(int).tolist()
        rows = sorted({row for begin in begins for row in range(begin, begin + _BLOCK)})
        for position in positions[rows[:len(positions)]].tolist():
            try:
                found.append(messages.message(position))
            except BagDamaged:
                continue
    return found


def _locators(messages: Messages, part: MovingPart, device: Device,
              matching: Optional[JointMatching],
              connections: Sequence[int]) -> Dict[int, Locator]:
    if isinstance(part, SentTransform):
        return {number: TransformLocator(*part) for number in connections}
    if matching is None:
        return {}
    found = {}
    for topic in device.topics_for(TopicFunction.JOINT_STATES):
        for number in messages.index.connections_of(topic.name):
            locator = joint_locator(messages.index.connections[number].type, part.name, matching)
            if locator is not None:
                found[number] = locator
    return found


def joint_locator(message_type: str, joint: str, matching: JointMatching) -> Optional[Locator]:
    """Return the locator of a joint's position, as in joint_proc: by name, or in model order."""
    if message_type in NAMED_JOINTS:
        return JointLocator(message_type, matching.names(joint))
    if message_type == FLOAT_ARRAY and joint in matching.joints:
        return FloatArrayLocator(matching.joints.index(joint) + 1, (len(matching.joints),))
    return None


_PATHS: Dict[Tuple[Quantity, str], str] = {
    (Quantity.SPEED, POSE_STAMPED): 'pose.position',
    (Quantity.FORCE, WRENCH_STAMPED): 'wrench.force',
    (Quantity.TORQUE, WRENCH_STAMPED): 'wrench.torque'}
_ARRAY_LENGTHS = {Quantity.SPEED: (3, 6, 7), Quantity.FORCE: (3, 6), Quantity.TORQUE: (6,)}
_PLAIN_TYPES = tuple(f'std_msgs/{name}' for name in (
    'Bool', 'Byte', 'Char', 'Float32', 'Float64', 'Int8', 'Int16', 'Int32', 'Int64', 'UInt8',
    'UInt16', 'UInt32', 'UInt64'))

MeasuringTimes = Callable[[Numbers], np.ndarray]
"""Function that returns when numbers (n, k) were measured: (n,) [s from a beginning]."""


class SourceLocators(NamedTuple):
    """Locators of a source's numbers: by connection, for each part that they are composed of.

    ``path`` computes the pose of a tool from the parts that move it; without a path there is one
    part.
    """

    parts: Tuple[Dict[int, Locator], ...]
    path: Optional[ToolPath] = None

    @property
    def connections(self) -> Tuple[int, ...]:
        """The connections of all parts; empty if any part has none."""
        found = {number for part in self.parts for number in part}
        return tuple(sorted(found)) if all(self.parts) else ()

    def joined(self, measured: MeasuringTimes, parts: Sequence[Numbers]) -> Numbers:
        """Return the source's numbers from those of its parts; ``measured`` gives their times.

        For a tool, these are its positions at the times of one moving part: the recorded transform
        nearest to the tool, if there is one, else the joint that is sent most often. A joint that
        is sent only when it moves keeps its position while others arrive.
        """
        path = self.path
        if path is None:
            return parts[0]
        counts = [len(part.positions) for part in parts]
        leader = next((row for row, moving in enumerate(path.moving)
                       if isinstance(moving, SentTransform)), counts.index(max(counts)))
        known_s = [measured(part) for part in parts]
        times_s = known_s[leader]
        joints_s = [part_s for part_s, moving in zip(known_s, path.moving)
                    if len(part_s) and not isinstance(moving, SentTransform)]
        latest_s = max((joint_s[-1] for joint_s in joints_s), default=math.inf)
        values = {moving: _at(times_s, part_s, part.values, moving, latest_s)
                  for moving, part_s, part in zip(path.moving, known_s, parts)}
        positions = path.places(values).positions
        known = np.isfinite(positions).all(axis=1)
        if joints_s:
            known &= np.any([_comes(times_s, joint_s) for joint_s in joints_s], axis=0)
        return Numbers(parts[leader].positions[known], positions[known],
                       parts[leader].stamps_ns[known])


def _comes(times_s: np.ndarray, known_s: np.ndarray) -> np.ndarray:
    """Return for each time (bool) whether there is a known value shortly before and after it."""
    nothing = np.zeros((len(known_s), 1))
    found: np.ndarray = np.isfinite(interpolated(times_s, known_s, nothing, GAP_S)[:, 0])
    return found


_EQUAL = 0.02
"""Distance [rad or m] up to which a joint counts as unmoved while it was not sent."""


def _at(times_s: np.ndarray, known_s: np.ndarray, values: np.ndarray, moving: MovingPart,
        latest_s: float) -> np.ndarray:
    """Return the numbers of a part at some times; ``latest_s`` is the last arrival of any joint."""
    if isinstance(moving, SentTransform):
        return interpolated(times_s, known_s, values, GAP_S, slice(3, 7))
    if moving.kind == 'continuous':
        values = np.unwrap(values, axis=0)
    ends_s = [*known_s[-2:], latest_s]
    if len(known_s) == 1 or (len(known_s) and np.diff(ends_s).max() > GAP_S):  # rarely sent
        known_s, values = np.append(known_s, latest_s), np.append(values, values[-1:], axis=0)
    return interpolated(times_s, known_s, values, GAP_S, equal=_EQUAL)


def measured_s(recording: Recording, numbers: Numbers,
               period_s: Optional[float] = None) -> np.ndarray:
    """Return when numbers were measured (n,) [s from the beginning]; see measuring_times."""
    return measuring_times(*_arrivals_and_stamps(recording, numbers), period_s)


def certain(recording: Recording, numbers: Numbers, period_s: Optional[float] = None,
            since_s: float = 0.0) -> Numbers:
    """Return the numbers whose measuring times are known; see certain_rows."""
    rows = certain_rows(*_arrivals_and_stamps(recording, numbers), period_s, since_s)
    return Numbers(*(column[rows] for column in numbers))


def dated(recording: Recording, numbers: Numbers) -> Tuple[Numbers, np.ndarray]:
    """Return the numbers whose time is known, and their times (n,) [s from the beginning].

    These are stamps, else arrival times: the period is not used, because the rate may change.
    """
    arrival_s, stamp_s = _arrivals_and_stamps(recording, numbers)
    if np.isfinite(stamp_s).any():
        return numbers, measuring_times(arrival_s, stamp_s)
    rows = dated_rows(arrival_s, stamp_s)
    return Numbers(*(column[rows] for column in numbers)), arrival_s[rows]


def _arrivals_and_stamps(recording: Recording,
                         numbers: Numbers) -> Tuple[np.ndarray, np.ndarray]:
    """Return both (n,) in seconds from the beginning; NaN without a stamp."""
    return ((recording.index.time_ns[numbers.positions] - recording.begin_ns) / 1e9,
            np.where(numbers.stamps_ns > 0, (numbers.stamps_ns - recording.begin_ns) / 1e9, np.nan))


def source_locators(messages: Messages, source: CurveSource,
                    devices: Sequence[Device]) -> SourceLocators:
    """Return the locators of a source's numbers in messages; may load the device's model."""
    connections = messages.index.connections
    numbers = messages.index.connections_of(source.topic)
    if source.quantity is Quantity.SPEED:
        on_tf = [number for number in numbers if connections[number].type == TF_MESSAGE
                 and source.message_type in ('', TF_MESSAGE)]
        device = next(it for it in devices if it.name == source.device)
        is_computed = tool_from_joints(device)
        is_on_tf = on_tf or source.message_type == TF_MESSAGE or is_computed
        found = tool_on_tf(messages, source, device, on_tf) if is_on_tf else None
        if found is not None:
            return SourceLocators(found[1], found[0])
        if is_computed:
            return SourceLocators(({},))
    located = {number: locator_for(source, connections[number]) for number in numbers}
    return SourceLocators(({number: locator for number, locator in located.items()
                            if locator is not None},))


def locator_for(source: CurveSource, connection: Connection) -> Optional[Locator]:
    """Return the locator of a source's numbers in a connection's messages; None without any."""
    kind = connection.type
    if source.message_type not in ('', kind) or source.plain and kind not in _PLAIN_TYPES:
        return None
    if source.quantity is not Quantity.NUMBER and kind == FLOAT_ARRAY:
        return FloatArrayLocator(3, _ARRAY_LENGTHS[source.quantity],
                                 3 if source.quantity is Quantity.TORQUE else 0)
    vector = _PATHS.get((source.quantity, kind), '')
    paths = [f'{vector}.{axis}' for axis in 'xyz'] if vector else [source.field]
    try:
        return FieldLocator(kind, connection.message_definition, paths)
    except (DefinitionError, ValueError):
        return None
