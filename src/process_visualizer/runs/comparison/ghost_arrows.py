# SPDX-License-Identifier: BSD-3-Clause
"""The arrows of the reference, in step with the runs of a recording that were held against it."""
from __future__ import annotations

import math
from typing import Iterator, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from process_visualizer.cell.model import Cell, Device, DeviceType, TopicFunction, Variable
from process_visualizer.descriptions.robot_frames import base_frame
from process_visualizer.motion.frame_names import meant_frame
from process_visualizer.motion.kinematics import Placement
from process_visualizer.motion.rotations import Triple, matrix_from_quaternion, quaternion_from_ypr
from process_visualizer.motion.variables import (
    FOOT_DISTANCE_M,
    MAX_LENGTH_M,
    SHORTEST_ARROW_M,
    arrow_feet,
)
from process_visualizer.motion.velocity.slope_windows import slope_windows
from process_visualizer.motion.velocity.speed_series import WINDOW_S
from process_visualizer.parameters.arrow_style import ArrowStyle
from process_visualizer.parameters.configured_arrow import configured_arrow
from process_visualizer.runs.comparison.comparison import Comparison
from process_visualizer.runs.comparison.ghost_arms import Arm, arms
from process_visualizer.runs.comparison.ghost_models import Models, robot_models
from process_visualizer.runs.run import Run, ToolForce, ToolMotion

_MOST_ROWS = 20_000
"""Of an arrow: of more, every second or third, ..."""


class GhostArrow(NamedTuple):
    """A quantity of the reference as an arrow over the time of the recording.

    ``vectors`` (n, 3) [m] at ``times_s`` (n,) are in ``frame`` and as long as drawn; NaN: there is
    none. The arrow begins at ``foot`` (3,) [m] in ``foot_frame``. Both frames are links of one
    robot's model, which the ghost moves, or one and the same other frame.
    """

    name: str
    frame: str
    foot_frame: str
    foot: Triple
    times_s: np.ndarray
    vectors: np.ndarray


def ghost_arrows(cell: Cell, reference: Run, comparisons: Sequence[Comparison],
                 models: Optional[Models] = None) -> Tuple[GhostArrow, ...]:
    """Return tool velocity, force and variables of the reference; without models loads them.

    Only what RViz shows of the run itself has an arrow. Between two runs there is a row without
    one.
    """
    if not comparisons:
        return ()
    found = run_arrows(cell, reference, models)
    return tuple(_over_recording(it, comparisons) for it in found)


def run_arrows(cell: Cell, run: Run, models: Optional[Models] = None) -> Tuple[GhostArrow, ...]:
    """Return the same of any run over its own time."""
    known = arms(cell, robot_models(cell) if models is None else models)
    return tuple(it for device in cell.devices for it in (
        *_robot_arrows(device, known, run), *_variable_arrows(device, known, run)))


def _robot_arrows(device: Device, known: Sequence[Arm], reference: Run) -> Iterator[GhostArrow]:
    arm = next((it for it in known if it.device is device), None)
    if arm is None or device.type is not DeviceType.ROBOT:
        return
    for motion in reference.motions:
        if motion.device == device.name and len(motion.times_s) > 1:
            yield _velocity_arrow(arm, motion)
    for force in reference.forces:
        if force.device == device.name:
            yield _force_arrow(arm, force)


def _velocity_arrow(arm: Arm, motion: ToolMotion) -> GhostArrow:
    """It is in the base frame, as the robot processor has it."""
    windows = slope_windows(motion.times_s, motion.positions, WINDOW_S)
    base = arm.device.base
    turn = np.eye(3) if base is None else matrix_from_quaternion(quaternion_from_ypr(base.pose.ypr))
    return _tool_arrow(arm, 'velocity', base_frame(arm.device), windows.middle_s,
                       windows.slope @ turn)


def _force_arrow(arm: Arm, force: ToolForce) -> GhostArrow:
    device = arm.device
    topic = device.topic_for(TopicFunction.FORCE_SENSOR)
    given = force.frame or (topic.parent_frame if topic is not None else None)
    prefix = '' if device.model is None else device.model.prefix or ''
    if given:
        frame = meant_frame(given, arm.kinematics.links, device.name, prefix)
    else:
        frame = arm.tool if device.force is None else device.force.frame
    return _tool_arrow(arm, 'force', frame, force.times_s, force.vectors)


def _tool_arrow(arm: Arm, quantity: str, frame: str, times_s: np.ndarray,
                vectors: np.ndarray) -> GhostArrow:
    """Return the arrow: at the tool for a frame that the arm does not move, else in its frame."""
    link, place = arm.fixed(frame) or (frame, Placement())
    is_carried = not arm.kinematics.connects(frame, arm.root) or arm.kinematics.moves(
        frame, arm.root)
    foot_link, foot = (link, place) if is_carried else arm.fixed(arm.tool) or (link, place)
    turned = vectors @ matrix_from_quaternion(place.quaternion).T
    return GhostArrow(f'{arm.device.name}/{quantity}', link, foot_link, foot.position, times_s,
                      _drawn(turned, configured_arrow(arm.device, quantity)))


def _drawn(vectors: np.ndarray, style: ArrowStyle) -> np.ndarray:
    """Vectors (n, 3) as long as motion.arrows.arrow_length makes them; NaN below the threshold."""
    size = np.linalg.norm(vectors, axis=1)
    is_shown = size > style.threshold  # not for NaN
    length_m = np.clip(size * style.scale_m, style.min_m, style.max_m)
    factor = np.divide(length_m, size, out=np.full(len(size), np.nan), where=is_shown)
    result: np.ndarray = vectors * factor[:, np.newaxis]
    return result


def _variable_arrows(device: Device, known: Sequence[Arm],
                     reference: Run) -> Iterator[GhostArrow]:
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
        length_m = np.where(np.abs(length_m) > SHORTEST_ARROW_M, length_m, np.nan)
        axis = matrix_from_quaternion(place.quaternion) @ _unit(variable)
        foot = place.then(Placement((x, y, z))).position
        yield GhostArrow(f'{device.name}/{label}', link, link, foot, channel.times_s,
                         length_m[:, np.newaxis] * axis)


def _unit(variable: Variable) -> np.ndarray:
    axis = np.asarray(variable.axis, float)
    result: np.ndarray = axis / np.linalg.norm(axis)
    return result


def _over_recording(arrow: GhostArrow, comparisons: Sequence[Comparison]) -> GhostArrow:
    """The arrow, so far over the time of the reference, over that of the recording."""
    step = max(1, math.ceil(len(arrow.times_s) * len(comparisons) / _MOST_ROWS))
    times_s, vectors = arrow.times_s[::step], arrow.vectors[::step]
    parts: List[Tuple[np.ndarray, np.ndarray]] = []
    for it in sorted(comparisons, key=lambda it: it.run.begin_s):
        run_s = it.alignment.time_map.to_run(times_s)
        inside = (run_s >= 0.0) & (run_s <= it.run.duration_s)
        end_s: Optional[float] = run_s[inside][-1] if inside.any() else 0.0
        parts.append((it.run.begin_s + np.append(run_s[inside], end_s),
                      np.vstack((vectors[inside], np.full(3, np.nan)))))
    recorded_s, drawn = (np.concatenate(column) for column in zip(*parts))
    rising = recorded_s >= np.maximum.accumulate(recorded_s)  # where runs overlap, the first one
    return arrow._replace(times_s=recorded_s[rising], vectors=drawn[rising])
