# SPDX-License-Identifier: BSD-3-Clause
"""The nodelet that finds what nobody modelled in the cloud of a depth sensor."""
from __future__ import annotations

from typing import Any, Dict, List, Mapping, Optional

from process_visualizer.cell.model import (
    Device,
    DeviceType,
    RegionOfInterest,
    SoughtObjects,
)
from process_visualizer.descriptions.robot_description import RobotDescription
from process_visualizer.generate.choice import Choice
from process_visualizer.generate.nodelet_managers import Manager
from process_visualizer.generate.processor_nodes import ProcessorNode, nodelet_arguments
from process_visualizer.ros_names import (
    OBJECT_FINDER,
    OBJECTS,
    OBJECTS_MARKERS,
    UNKNOWN_POINTS,
)

_OUTPUTS = {'~objects': OBJECTS, '~markers': OBJECTS_MARKERS, '~unknown': UNKNOWN_POINTS}


def object_finder_nodes(choice: Choice, device: Device,
                        descriptions: Mapping[str, RobotDescription],
                        manager: Optional[Manager] = None) -> List[ProcessorNode]:
    """The object finder of a device that has one.

    It takes the models of all devices that are started out of the clouds. ``manager`` is the
    nodelet manager in which the device's own nodelets run, if it is known.
    """
    if device.objects is None:
        return []
    outputs = {name: f'/{device.name}/{topic}' for name, topic in _OUTPUTS.items()}
    return [ProcessorNode(
        'nodelet', 'nodelet', OBJECT_FINDER,
        {'frame': choice.cell.frame, **_models(choice, descriptions),
         **_parameters(device.objects)},
        args=nodelet_arguments('ObjectFinder', manager),
        remaps={'~input': _cloud(device, device.objects), **outputs},
        respawn=manager is not None and manager.is_shared)]


def _cloud(device: Device, objects: SoughtObjects) -> str:
    """The cloud that is looked at: by default what the device shows, before it is stamped anew."""
    return objects.topic or device.cloud_topic or f'/{device.name}/roi_points'


def _models(choice: Choice, descriptions: Mapping[str, RobotDescription]) -> Dict[str, List[str]]:
    with_model = [device for device in choice.devices if device.name in descriptions]
    robots = [device.name for device in with_model if device.type is DeviceType.ROBOT]
    return {'robots': robots,
            'others': [device.name for device in with_model if device.name not in robots]}


def _parameters(objects: SoughtObjects) -> Dict[str, Any]:
    return {'warn': objects.warn_m, 'stop': objects.stop_m, 'padding': objects.padding_m,
            'surface': objects.surface_m2,
            'region': [] if objects.region is None else [_box(objects.region)],
            'expected': [_box(box) for box in objects.expected]}


def _box(box: RegionOfInterest) -> Dict[str, Any]:
    return {'frame': box.frame, 'center': list(box.center), 'size': list(box.size)}
