# SPDX-License-Identifier: BSD-3-Clause
"""Pictures of the scene for the page of ``cell compare``: good beside poor, as RViz shows them."""
from __future__ import annotations

import os
from typing import Any, Dict, List, Mapping, Optional, Sequence, Tuple

import numpy as np
import rospkg
from roslib.packages import find_node

from process_visualizer.bags.recording import Recording
from process_visualizer.cell.environment import check_environment
from process_visualizer.cell.model import Cell, Device, Mode
from process_visualizer.commands.scene_camera import SIZE, SceneCamera, SceneError, scene_camera
from process_visualizer.generate.choice import Choice
from process_visualizer.generate.generator import default_rviz_file
from process_visualizer.ros_names import RVIZ
from process_visualizer.runs.comparison.comparison import Comparison, GoodRuns
from process_visualizer.runs.comparison.ghost_arrows import ghost_arrows
from process_visualizer.runs.comparison.ghost_models import robot_models
from process_visualizer.runs.comparison.ghost_tracks import ghost_tracks
from process_visualizer.runs.comparison.scene_pair import ScenePair, shown_s
from process_visualizer.runs.run import Run
from process_visualizer.rviz.camera import camera_pose
from process_visualizer.rviz.view_file import read_view
from process_visualizer.rviz.window_geometry import scene_aspect

MOST_SCENES = 4
"""So many poor runs at most, as each takes some seconds."""
_AROUND_M = 0.35
"""So much around each tool is in the picture: the arrows, and the robot's hand."""


def scene_pictures(cell: Cell, good: GoodRuns,
                   comparisons: Sequence[Comparison]) -> Tuple[Optional[ScenePair], ...]:
    """Return for each run a pair of pictures; None for good runs, and for those after the first 4.

    Raises:
        SceneError: there is no RViz or no screen, or they do not do what they should; says why.
    """
    poor = [it for it in comparisons
            if it.departures and good.of(it.run) is good][:MOST_SCENES]
    if not poor:
        return (None,) * len(comparisons)
    _check_rviz()
    devices = _recorded(cell, good.reference)
    problems = check_environment(cell, Mode.PLAYBACK, [device.name for device in devices])
    if problems:
        raise SceneError(str(problems[0]))
    choice = Choice(cell, Mode.PLAYBACK, devices, view=_view(good.reference, poor))
    with scene_camera(choice) as camera:
        good_ones = [_good_picture(camera, good.reference, it) for it in poor]
        poor_ones = [_poor_picture(camera, cell, good.reference, it) for it in poor]
    pairs = [ScenePair(_shown_s(it), *pictures)
             for it, *pictures in zip(poor, good_ones, poor_ones)]
    return tuple(pairs[poor.index(it)] if it in poor else None for it in comparisons)


def _check_rviz() -> None:
    try:
        found = find_node(RVIZ, RVIZ)
    except rospkg.ResourceNotFound:
        found = []
    if not found:
        raise SceneError('there is no RViz; install the package rviz')


def _good_picture(camera: SceneCamera, reference: Run, poor: Comparison) -> bytes:
    return camera.picture(_paths(reference), reference.begin_s + _shown_s(poor))


def _poor_picture(camera: SceneCamera, cell: Cell, reference: Run, poor: Comparison) -> bytes:
    wanted = cell, reference, [poor], robot_models(cell)
    return camera.picture(_paths(poor.run), poor.run.begin_s + poor.run_s(_shown_s(poor)),
                          ghost_tracks(*wanted), ghost_arrows(*wanted))


def _shown_s(poor: Comparison) -> float:
    """The moment of the pictures, in the time of the reference."""
    return shown_s(poor.departures[0])


def _paths(run: Run) -> List[str]:
    """The player is a process in another folder."""
    return [os.path.abspath(path) for path in run.recording]


def _recorded(cell: Cell, run: Run) -> Tuple[Device, ...]:
    """The devices of which there is something to be seen: the others would be waited for."""
    with Recording(run.recording) as recording:
        index = recording.index
        return tuple(device for device in cell.devices if not device.topics or any(
            len(index.positions_of(index.connections_of(topic.name))) for topic in device.topics))


def _view(reference: Run, poor: Sequence[Comparison]) -> Optional[Mapping[str, Any]]:
    """An RViz file's content with a camera that sees the tools at all moments."""
    places = [place for it in poor for place in _tools(reference, _shown_s(it))]
    if not places:
        return None  # that of the whole cell
    offsets = _AROUND_M * np.stack(np.meshgrid(*3 * [(-1.0, 1.0)]), axis=-1).reshape(-1, 3)
    points = np.concatenate([place + offsets for place in places])
    views: Dict[str, Any] = read_view(default_rviz_file())['Visualization Manager']['Views']
    current = {**views['Current'], **camera_pose(points, views['Current'], scene_aspect(*SIZE))}
    return {'Visualization Manager': {'Views': {**views, 'Current': current}}}


def _tools(reference: Run, time_s: float) -> List[np.ndarray]:
    """Return where the tools are [m] (3,), in the global frame."""
    found = [np.array([np.interp(time_s, it.times_s, column) for column in it.positions.T])
             for it in reference.motions if len(it.times_s)]
    return [place for place in found if np.isfinite(place).all()]
