# SPDX-License-Identifier: BSD-3-Clause
"""The robots of the reference, in step with the runs of a recording that were held against it."""
from __future__ import annotations

import math
from typing import List, NamedTuple, Optional, Sequence, Tuple

import numpy as np

from process_visualizer.cell.model import Cell, Device
from process_visualizer.curves.tool_on_tf import joint_matching
from process_visualizer.descriptions.robot_description import RobotDescription
from process_visualizer.descriptions.tool_frame import tool_frame
from process_visualizer.motion.joint_track import JointTrack
from process_visualizer.runs.comparison.comparison import Comparison
from process_visualizer.runs.comparison.ghost_models import Models, robot_models
from process_visualizer.runs.run import Channel, Run

_MOST_ROWS = 60_000
"""Of a robot: eight minutes of each message at 125 Hz; of more, every second or third, ..."""


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
    """Return a track of each robot whose joints are in the reference; without models loads them.

    Between two runs there is a row without positions.
    """
    if not comparisons:
        return ()
    return tuple(_track(it, comparisons) for it in _robots(cell, reference, models))


def reference_tracks(cell: Cell, reference: Run,
                     models: Optional[Models] = None) -> Tuple[GhostTrack, ...]:
    """Return the same over the time of the reference itself, without any other run."""
    return tuple(it.track(times_s, it.positions(times_s), np.empty((0, len(it.joints))))
                 for it in _robots(cell, reference, models)
                 for times_s in [_times_s(it.channels, 1)])


class _Robot(NamedTuple):
    """A robot's joints in the reference; ``offsets`` [rad or m] lead to those of its model."""

    device: str
    tool: str
    joints: Tuple[str, ...]
    channels: Tuple[Channel, ...]
    offsets: np.ndarray

    def positions(self, times_s: np.ndarray) -> np.ndarray:
        """The joints (n, k) as recorded, at times [s] of the reference (n,)."""
        return np.stack([_at(channel, times_s) for channel in self.channels], axis=1)

    def track(self, times_s: np.ndarray, there: np.ndarray, here: np.ndarray) -> GhostTrack:
        """Return a track out of joints as recorded."""
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
    rising = columns[0] >= np.maximum.accumulate(columns[0])  # where runs overlap, the first one
    times_s, there, here = (column[rising] for column in columns)
    return robot.track(times_s, there, here)


def _in_order(comparisons: Sequence[Comparison]) -> List[Comparison]:
    return sorted(comparisons, key=lambda it: it.run.begin_s)


def _times_s(channels: Sequence[Channel], runs: int) -> np.ndarray:
    """The times of the reference's messages, all of them if there are not too many."""
    times_s = max((it.times_s for it in channels), key=len)
    return times_s[::max(1, math.ceil(len(times_s) * runs / _MOST_ROWS))]


def _part(robot: _Robot, reference_s: np.ndarray, comparison: Comparison
          ) -> Tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Times [s] of the recording (n,), and joints (n, k) of the reference and of the run.

    The last row ends the run.
    """
    run = comparison.run
    run_s = comparison.alignment.time_map.to_run(reference_s)
    inside = (run_s >= 0.0) & (run_s <= run.duration_s)
    reference_s, run_s = reference_s[inside], run_s[inside]
    there = robot.positions(reference_s)
    here = np.stack([_at(run.by_key.get(channel.key), run_s) for channel in robot.channels], axis=1)
    gap = np.full((1, len(robot.channels)), np.nan)
    end_s = np.append(run_s, run_s[-1] if len(run_s) else 0.0)
    return run.begin_s + end_s, np.concatenate((there, gap)), np.concatenate((here, gap))


def _at(channel: Optional[Channel], times_s: np.ndarray) -> np.ndarray:
    if channel is None or not len(channel.times_s):
        return np.full(len(times_s), np.nan)
    found: np.ndarray = np.interp(times_s, channel.times_s, channel.values)
    return found


def _tool(device: Device, description: RobotDescription) -> str:
    """The link of the model that carries the tool."""
    tool = tool_frame(device, description)
    return next((it for it in (tool.frame, tool.parent) if it in description.links), '')
