# SPDX-License-Identifier: BSD-3-Clause
"""The reference as a ghost: its robots and arrows, in step with the runs compared with it."""
from __future__ import annotations

import math
from concurrent.futures import ThreadPoolExecutor
from typing import Dict, Iterator, List, Mapping, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from process_visualizer.cell.model import (
    Cell,
    Device,
    DeviceType,
    Pose,
    ProcessEvent,
    RunSpan,
    TopicFunction,
    Variable,
)
from process_visualizer.curves.source_locators import joint_matching
from process_visualizer.robot.arrows import (
    FOOT_DISTANCE_M,
    MAX_LENGTH_M,
    MIN_ARROW_M,
    ArrowStyle,
    arrow_feet,
    configured_arrow,
)
from process_visualizer.robot.description import RobotDescription, usable_description
from process_visualizer.robot.frames import meant_frame
from process_visualizer.robot.joints import JointTrack
from process_visualizer.robot.kinematics import Kinematics, Placement
from process_visualizer.robot.recorded_velocity import velocity_rows
from process_visualizer.robot.rotations import Triple, matrix_from_quaternion, quaternion_from_ypr
from process_visualizer.robot.tool_frame import base_frame, tool_frame
from process_visualizer.runs.comparison.comparison import Comparison
from process_visualizer.runs.run import Channel, Run, ToolForce, ToolMotion

Models = Mapping[str, RobotDescription]
"""Models of robots, by the names of their devices."""


def robot_models(cell: Cell) -> Models:
    """Return the models that can be used; the cell itself reports the others."""
    robots = [it for it in cell.devices if it.type is DeviceType.ROBOT]
    with ThreadPoolExecutor(2) as pool:  # most of the time is spent in xacro processes
        found: Dict[str, Optional[RobotDescription]] = dict(
            zip((it.name for it in robots), pool.map(usable_description, robots)))
    return {name: model for name, model in found.items() if model is not None}


# The robots of the reference, in step with the runs of a recording that were compared with it.

_HELD_S = 0.1
"""Time without joints at the beginning and end of a run in which the nearest ones hold [s]."""
_ENDED_S = 0.001
"""Time after the end of a run at which its ghost is gone [s]: a player may pause at the end."""
_MAX_TRACK_ROWS = 60_000
"""Maximum rows of a robot: eight minutes at 125 Hz; more are thinned to every second, third, …"""


class GhostTrack(NamedTuple):
    """A robot in the reference and in the runs themselves, over the time of the recording.

    ``tool`` is the link whose deviation counts.
    """

    device: str
    tool: str
    there: JointTrack
    here: np.ndarray  # (n, k), as ``there.positions``


def ghost_tracks(cell: Cell, reference: Run, comparisons: Sequence[Comparison],
                 models: Optional[Models] = None) -> Tuple[GhostTrack, ...]:
    """Return a track of each robot whose joints are in the reference; loads models if not given.

    Between two runs there is a row without positions.
    """
    if not comparisons:
        return ()
    return tuple(_track(it, comparisons) for it in _robots(cell, reference, models))


def reference_tracks(cell: Cell, reference: Run,
                     models: Optional[Models] = None) -> Tuple[GhostTrack, ...]:
    """Return the tracks over the time of the reference itself, without any other run."""
    return tuple(it.track(times_s, it.positions(times_s), np.empty((0, len(it.joints))))
                 for it in _robots(cell, reference, models)
                 for times_s in [_times_s(it.channels, 1)])


class _Robot(NamedTuple):
    """A robot's joints in the reference; adding ``offsets`` [rad or m] gives those of its model."""

    device: str
    tool: str
    joints: Tuple[str, ...]
    channels: Tuple[Channel, ...]
    offsets: np.ndarray

    def positions(self, times_s: np.ndarray) -> np.ndarray:
        """Return the joints (n, k) as recorded, at times [s] of the reference (n,)."""
        return np.stack([_at(channel, times_s) for channel in self.channels], axis=1)

    def track(self, times_s: np.ndarray, there: np.ndarray, here: np.ndarray) -> GhostTrack:
        """Return a track from joints as recorded."""
        return GhostTrack(self.device, self.tool,
                          JointTrack(self.joints, times_s, there + self.offsets),
                          here + self.offsets)


def _robots(cell: Cell, reference: Run, models: Optional[Models]) -> Tuple[_Robot, ...]:
    known = robot_models(cell) if models is None else models
    found = [_robot(device, reference, known[device.name]) for device in cell.devices
             if device.name in known]
    return tuple(it for it in found if it is not None)


def _robot(device: Device, reference: Run, description: RobotDescription) -> Optional[_Robot]:
    matching = joint_matching(device, description)
    channels = {joint: reference.by_key.get((device.name, f'joint {joint.rpartition("/")[2]}'))
                for joint in matching.joints}
    known = {joint: channel for joint, channel in channels.items()
             if channel is not None and len(channel.times_s)}
    if not known:
        return None
    offsets = np.array([matching.offset(joint) for joint in known])
    return _Robot(device.name, _tool(device, description), tuple(known), tuple(known.values()),
                  offsets)


def _track(robot: _Robot, comparisons: Sequence[Comparison]) -> GhostTrack:
    times_s = _times_s(robot.channels, len(comparisons))
    parts = [_part(robot, times_s, it) for it in _in_order(comparisons)]
    columns = [np.concatenate(column) for column in zip(*parts)]
    rising = columns[0] >= np.maximum.accumulate(columns[0])  # the first of overlapping runs
    times_s, there, here = (column[rising] for column in columns)
    return robot.track(times_s, there, here)


def _in_order(comparisons: Sequence[Comparison]) -> List[Comparison]:
    return sorted(comparisons, key=lambda it: it.run.begin_s)


def _times_s(channels: Sequence[Channel], runs: int) -> np.ndarray:
    """Return the times of the reference's messages, all of them unless there are too many."""
    times_s = max((it.times_s for it in channels), key=len)
    return times_s[::max(1, math.ceil(len(times_s) * runs / _MAX_TRACK_ROWS))]


def _part(robot: _Robot, reference_s: np.ndarray, comparison: Comparison
          ) -> Tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return times [s] of the recording (n,), and joints (n, k) of the reference and of the run.

    The last row ends the run. A run that was cut at the beginning or end of its recording begins
    before its first joints, and ends after its last ones: they hold there.
    """
    run = comparison.run
    run_s = comparison.alignment.time_map.to_run(reference_s)
    inside = (run_s >= 0.0) & (run_s <= run.duration_s)
    reference_s, run_s = reference_s[inside], run_s[inside]
    there = robot.positions(reference_s)
    here = np.stack([_at(run.by_key.get(channel.key), run_s) for channel in robot.channels], axis=1)
    gap = np.full((1, len(robot.channels)), np.nan)
    if not len(run_s):
        return np.array([run.begin_s]), gap, gap
    begin_s = 0.0 if run_s[0] <= _HELD_S else run_s[0]
    end_s = run.duration_s if run.duration_s - run_s[-1] <= _HELD_S else run_s[-1]
    return (run.begin_s + np.concatenate(([begin_s], run_s, [end_s, end_s + _ENDED_S])),
            *(np.concatenate((it[:1], it, it[-1:], gap)) for it in (there, here)))


def _at(channel: Optional[Channel], times_s: np.ndarray) -> np.ndarray:
    if channel is None or not len(channel.times_s):
        return np.full(len(times_s), np.nan)
    found: np.ndarray = np.interp(times_s, channel.times_s, channel.values)
    return found


def _tool(device: Device, description: RobotDescription) -> str:
    """Return the link of the model that carries the tool."""
    tool = tool_frame(device, description)
    return next((it for it in (tool.frame, tool.parent) if it in description.links), '')


# The robots of a cell with the frames that the configuration fixes to their links.

class GhostArm(NamedTuple):
    """A robot, its links and frames, its root link, and its tool frame."""

    device: Device
    kinematics: Kinematics
    root: str
    tool: str

    def fixed(self, frame: str) -> Optional[Tuple[str, Placement]]:
        """Return the link that a frame is fixed to, and its place in it; None for other frames."""
        if not self.kinematics.connects(frame, self.root):
            return None
        link = self.kinematics.fixed_to(frame, self.root)
        place = self.kinematics.connection(frame, link, {})
        return None if place is None else (link, place)


def arms(cell: Cell, models: Models) -> Tuple[GhostArm, ...]:
    """Return the robots that have a model."""
    return tuple(_arm(it, models[it.name]) for it in cell.devices if it.name in models)


def _arm(device: Device, description: RobotDescription) -> GhostArm:
    kinematics = Kinematics(description.text)
    roots: List[str] = [it for it in kinematics.links if kinematics.joint(it) is None]
    tool = tool_frame(device, description)
    if tool.frame != tool.parent:
        kinematics.fix(tool.parent, tool.frame, _placement(tool.pose))
    if device.force is not None:
        kinematics.fix(device.force.parent_frame, device.force.frame, _placement(device.force.pose))
    return GhostArm(device, kinematics, roots[0] if roots else '', tool.frame)


def _placement(pose: Pose) -> Placement:
    x, y, z, w = (float(it) for it in quaternion_from_ypr(pose.ypr))
    return Placement(pose.xyz, (x, y, z, w))


# The arrows of the reference, in step with the runs of a recording that were compared with it.

_MAX_ARROW_ROWS = 20_000
"""Maximum rows of an arrow; more are thinned to every second, third, …"""


class ReferenceArrow(NamedTuple):
    """A quantity of the reference as an arrow over the time of the recording.

    ``vectors`` (n, 3) [m] at ``times_s`` (n,) are in ``frame`` and as long as drawn, NaN without an
    arrow. The arrow begins at ``foot`` (3,) [m] in ``foot_frame``. Both frames are links of one
    robot's model, which the ghost moves, or they are the same other frame. ``is_variable``
    distinguishes a variable with the label "force" from the force at the tool.
    """

    name: str
    frame: str
    foot_frame: str
    foot: Triple
    times_s: np.ndarray
    vectors: np.ndarray
    is_variable: bool = False


def ghost_arrows(cell: Cell, reference: Run, comparisons: Sequence[Comparison],
                 models: Optional[Models] = None) -> Tuple[ReferenceArrow, ...]:
    """Return arrows of the reference's tool velocities, forces and variables.

    The models are loaded if not given. Only quantities that RViz shows for the run itself have an
    arrow. Between two runs there is a row without one.
    """
    if not comparisons:
        return ()
    found = run_arrows(cell, reference, models)
    return tuple(_over_recording(it, comparisons) for it in found)


def run_arrows(cell: Cell, run: Run, models: Optional[Models] = None) -> Tuple[ReferenceArrow, ...]:
    """Return the arrows of any run over its own time."""
    known = arms(cell, robot_models(cell) if models is None else models)
    return tuple(it for device in cell.devices for it in (
        *_robot_arrows(device, known, run), *_variable_arrows(device, known, run)))


def _robot_arrows(
    device: Device, known: Sequence[GhostArm], reference: Run
) -> Iterator[ReferenceArrow]:
    arm = next((it for it in known if it.device is device), None)
    if arm is None or device.type is not DeviceType.ROBOT:
        return
    for motion in reference.motions:
        if motion.device == device.name and len(motion.times_s) > 1:
            yield _velocity_arrow(arm, motion)
    for force in reference.forces:
        if force.device == device.name:
            yield _force_arrow(arm, force)


def _velocity_arrow(arm: GhostArm, motion: ToolMotion) -> ReferenceArrow:
    """Return the velocity arrow in the base frame, as the robot processor has it."""
    times_s, slopes = velocity_rows(motion.times_s, motion.positions)
    base = arm.device.base
    turn = np.eye(3) if base is None else matrix_from_quaternion(quaternion_from_ypr(base.pose.ypr))
    return _tool_arrow(arm, 'velocity', base_frame(arm.device), times_s, slopes @ turn)


def _force_arrow(arm: GhostArm, force: ToolForce) -> ReferenceArrow:
    device = arm.device
    topic = device.topic_for(TopicFunction.FORCE_SENSOR)
    given = force.frame or (topic.parent_frame if topic is not None else None)
    prefix = '' if device.model is None else device.model.prefix or ''
    if given:
        frame = meant_frame(given, arm.kinematics.links, device.name, prefix)
    else:
        frame = arm.tool if device.force is None else device.force.frame
    return _tool_arrow(arm, 'force', frame, force.times_s, force.vectors)


def _tool_arrow(arm: GhostArm, quantity: str, frame: str, times_s: np.ndarray,
                vectors: np.ndarray) -> ReferenceArrow:
    """Return the arrow: at the tool for a frame that the arm does not move, else in that frame."""
    link, place = arm.fixed(frame) or (frame, Placement())
    is_carried = not arm.kinematics.connects(frame, arm.root) or arm.kinematics.moves(
        frame, arm.root)
    foot_link, foot = (link, place) if is_carried else arm.fixed(arm.tool) or (link, place)
    with np.errstate(invalid='ignore'):  # a number may be infinite
        turned = vectors @ matrix_from_quaternion(place.quaternion).T
    return ReferenceArrow(f'{arm.device.name}/{quantity}', link, foot_link, foot.position, times_s,
                          _drawn(turned, configured_arrow(arm.device, quantity)))


def _drawn(vectors: np.ndarray, style: ArrowStyle) -> np.ndarray:
    """Return vectors (n, 3) as long as arrow_length makes them; NaN below the threshold."""
    size = np.linalg.norm(vectors, axis=1)
    is_shown = size > style.threshold  # not for NaN
    length_m = np.clip(size * style.scale_m, style.min_m, style.max_m)
    factor = np.divide(length_m, size, out=np.full(len(size), np.nan), where=is_shown)
    result: np.ndarray = vectors * factor[:, np.newaxis]
    return result


def _variable_arrows(device: Device, known: Sequence[GhostArm],
                     reference: Run) -> Iterator[ReferenceArrow]:
    shown = [it for it in device.variables if it.is_shown]
    feet = arrow_feet([(it.frame, _unit(it)) for it in shown], FOOT_DISTANCE_M)
    for variable, (x, y, z) in zip(shown, feet):
        label = variable.label or variable.topic.strip('/')
        channel = reference.by_key.get((device.name, label))
        if channel is None or not variable.scale:
            continue
        link, place = next((found for arm in known for found in [arm.fixed(variable.frame)]
                            if found is not None), (variable.frame, Placement()))
        limit_m = MAX_LENGTH_M if variable.maximum_m is None else variable.maximum_m
        length_m = np.clip((channel.values - variable.offset) * variable.scale, -limit_m, limit_m)
        length_m = np.where(np.abs(length_m) > MIN_ARROW_M, length_m, np.nan)
        axis = matrix_from_quaternion(place.quaternion) @ _unit(variable)
        foot = place.then(Placement((x, y, z))).position
        yield ReferenceArrow(f'{device.name}/{label}', link, link, foot, channel.times_s,
                             length_m[:, np.newaxis] * axis, is_variable=True)


def _unit(variable: Variable) -> np.ndarray:
    axis = np.asarray(variable.axis, float)
    result: np.ndarray = axis / np.linalg.norm(axis)
    return result


def _over_recording(arrow: ReferenceArrow, comparisons: Sequence[Comparison]) -> ReferenceArrow:
    """Return an arrow over the time of the recording, given it over that of the reference."""
    step = max(1, math.ceil(len(arrow.times_s) * len(comparisons) / _MAX_ARROW_ROWS))
    times_s, vectors = arrow.times_s[::step], arrow.vectors[::step]
    parts: List[Tuple[np.ndarray, np.ndarray]] = []
    for it in sorted(comparisons, key=lambda it: it.run.begin_s):
        run_s = it.alignment.time_map.to_run(times_s)
        inside = (run_s >= 0.0) & (run_s <= it.run.duration_s)
        end_s: Optional[float] = run_s[inside][-1] if inside.any() else 0.0
        parts.append((it.run.begin_s + np.append(run_s[inside], end_s),
                      np.vstack((vectors[inside], np.full(3, np.nan)))))
    recorded_s, drawn = (np.concatenate(column) for column in zip(*parts))
    rising = recorded_s >= np.maximum.accumulate(recorded_s)  # the first of overlapping runs
    return arrow._replace(times_s=recorded_s[rising], vectors=drawn[rising])


# A good run as the reference of a live one: its robots, and the times of its events.

class ReferenceEvent(NamedTuple):
    """An event that can be seen live, and its times in the reference [s]."""

    event: ProcessEvent
    times_s: Tuple[float, ...]


class LiveReference(NamedTuple):
    """A reference for live runs; ``tracks`` count from its start, and may be empty.

    Without tracks, there is nothing to follow.
    """

    tracks: Tuple[GhostTrack, ...]
    events: Tuple[ReferenceEvent, ...] = ()
    span: Optional[RunSpan] = None


def live_reference(cell: Cell, run: Run) -> LiveReference:
    """Return a run as the reference for live robots; loads the robots' models.

    Marks are not events here, because nobody has set them yet. A span between marks is left out.
    """
    events = tuple(ReferenceEvent(event, tuple(it.time_s for it in run.events
                                               if it.name == event.name))
                   for event in cell.events)
    names = {event.name for event in cell.events}
    span = cell.run
    if span is not None and not {span.begin, span.end} <= names:
        span = None
    return LiveReference(reference_tracks(cell, run), events, span)
