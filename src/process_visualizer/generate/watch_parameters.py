# SPDX-License-Identifier: BSD-3-Clause
"""Parameters of the node scene_watch: who draws what of each device, and where its words stand."""
from __future__ import annotations

from typing import Dict, List, Optional, Sequence

import numpy as np

from process_visualizer.cell.displays import DISPLAY_TYPES
from process_visualizer.cell.model import (
    BaseFrame,
    Cell,
    Device,
    DeviceType,
    Pose,
)
from process_visualizer.motion.rotations import matrix_from_ypr
from process_visualizer.parameters.scene_parameters import SceneParameters, WatchedDevice
from process_visualizer.ros_names import (
    DEPTH_PROC,
    FUSION,
    JOINT_PROC,
    OBJECT_FINDER,
    ROBOT_PROC,
    ROBOT_STATE_PUBLISHER,
    ROI_FILTER,
    SCENE_WATCH,
    VARIABLE_PROC,
)
from process_visualizer.rviz.displays import DisplayConfig, device_displays

WATCH_TOPIC = f'/{SCENE_WATCH}/marker_array'
_UP_M = 0.7
"""Of the words above a device's base, past its foot."""
_APART_M = 0.14
"""From device to device, as several may have their base at one place."""
_MEANINGS = {
    ROBOT_PROC: 'no arrows and numbers', VARIABLE_PROC: 'no arrows and numbers',
    JOINT_PROC: 'the robot does not move', ROBOT_STATE_PUBLISHER: 'the robot does not move',
    DEPTH_PROC: 'the points are old', ROI_FILTER: 'the points are old'}


def watch_parameters(cell: Cell, devices: Sequence[Device]) -> SceneParameters:
    """The parameters of the node scene_watch; a node that never starts is no harm to it."""
    drawn = [device for device in devices if _is_drawn(device)]
    bases = [_base_in_view(device, drawn) for device in drawn]
    places = [None if base is None else base.pose.xyz for base in bases]
    return SceneParameters(cell.frame, tuple(
        _device(cell, device, base, _UP_M + _APART_M * places[:number].count(place))
        for number, (device, base, place) in enumerate(zip(drawn, bases, places))))


def _base_in_view(device: Device, drawn: Sequence[Device]) -> Optional[BaseFrame]:
    """Return where a device's words stand; a depth sensor is far from what the camera looks at."""
    if device.type is DeviceType.DEPTH_SENSOR:
        others = [other.base for other in drawn
                  if other.base is not None and other.type is not DeviceType.DEPTH_SENSOR]
        return others[0] if others else device.base
    return device.base


def _device(cell: Cell, device: Device, base: Optional[BaseFrame],
            up_m: float) -> WatchedDevice:
    pose = Pose() if base is None else base.pose
    x, y, z = (round(float(part), 6) + 0.0
               for part in matrix_from_ypr(pose.ypr).T @ np.array([0.0, 0.0, up_m]))
    return WatchedDevice(
        device.name, cell.frame if base is None else base.frame, (x, y, z),
        {f'/{device.name}/{name}': meaning for name, meaning in _meanings(device).items()},
        tuple(sorted(set(_topics(device_displays(device))))),
        f'/{device.name}/points_age' if device.has_cloud else '')


def _meanings(device: Device) -> Dict[str, str]:
    """Return what it means for a device that a node has ended."""
    if device.variables and not any(it.is_shown for it in device.variables):
        return {**_MEANINGS, VARIABLE_PROC: 'limits are not watched'}
    fusion = {} if device.fusion is None else {FUSION: 'the points are old'}
    finder = {} if device.objects is None else {OBJECT_FINDER: 'no objects are found'}
    return {**_MEANINGS, **fusion, **finder}


def _is_drawn(device: Device) -> bool:
    """Return whether a process draws something of a device."""
    return device.model is not None or bool(_topics(device_displays(device)))


def _topics(displays: Sequence[DisplayConfig]) -> List[str]:
    """The topics that displays show, those in groups too."""
    topics: List[str] = []
    for display in displays:
        display_type = DISPLAY_TYPES[display['Class'].split('/')[1]]
        if display_type.topic_key is not None and display_type.message_type:
            topics.append(str(display[display_type.topic_key]))
        topics += _topics(display.get('Displays', []))
    return topics
