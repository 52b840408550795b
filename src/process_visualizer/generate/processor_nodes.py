# SPDX-License-Identifier: BSD-3-Clause
"""Decides which nodes the program itself starts for a device, and their parameters."""
from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Dict, List, Mapping, Optional, Sequence

import numpy as np

from process_visualizer.bagio.number_places import FieldPath
from process_visualizer.cell.elements import DISPLAY_TYPES
from process_visualizer.cell.model import (
    IMAGE_FUNCTIONS,
    ROBOT_FUNCTIONS,
    BaseFrame,
    Cell,
    Device,
    DeviceType,
    Fusion,
    Pose,
    RegionOfInterest,
    SoughtObjects,
    Topic,
    TopicFunction,
    Variable,
)
from process_visualizer.generate.choice import Choice
from process_visualizer.generate.drivers import Manager
from process_visualizer.parameters.cell_parameters import SceneParameters, WatchedDevice
from process_visualizer.parameters.robot_parameters import RobotParameters, TopicParameters
from process_visualizer.parameters.variable_colors import colors_of
from process_visualizer.parameters.variable_parameters import (
    VariableParameters,
    VariablesParameters,
)
from process_visualizer.robot.arrows import MAX_LENGTH_M, configured_arrow
from process_visualizer.robot.description import RobotDescription
from process_visualizer.robot.frames import Frame
from process_visualizer.robot.rotations import matrix_from_ypr
from process_visualizer.robot.tool_frame import base_frame, tool_frame
from process_visualizer.ros_names import (
    DEPTH_PROC,
    FUSION,
    JOINT_PROC,
    OBJECT_FINDER,
    OBJECTS,
    OBJECTS_MARKERS,
    PACKAGE,
    ROBOT_PROC,
    ROBOT_STATE_PUBLISHER,
    ROI_FILTER,
    SCENE_WATCH,
    UNKNOWN_POINTS,
    VARIABLE_PROC,
)
from process_visualizer.rviz.displays import DisplayConfig, device_displays

PUBLISH_FREQUENCY_HZ = 100.0
"""Maximum rate of robot_state_publisher: every second state of a 125 Hz driver, more than a screen
shows. The node asks the master for tf_prefix at each state; at 125 Hz this costs a tenth of a
core."""
_EACH_STATE_HZ = 1e6


@dataclass(frozen=True)
class ProcessorNode:
    """A node in the device's namespace; ``parameters`` are private to it.

    If ``is_new``, all its other parameters are cleared, such as those set in another run.
    """

    package: str
    type: str
    name: str
    parameters: Dict[str, Any] = field(default_factory=dict)
    args: str = ''
    remaps: Dict[str, str] = field(default_factory=dict)
    respawn: bool = False
    is_new: bool = False


def processor_nodes(device: Device, description: Optional[RobotDescription],
                    manager: Optional[Manager] = None, frame: str = '') -> List[ProcessorNode]:
    """Return robot or depth processor, state publisher and variable processor of a device.

    ``manager`` is the nodelet manager in which the device's own nodelets run, if it is known;
    ``frame`` is the global frame.
    """
    nodes: List[ProcessorNode] = []
    if description is not None and description.parents:
        nodes.append(_state_publisher(device))
    if device.type is DeviceType.ROBOT:
        nodes += _joint_nodes(device, description)
        nodes.append(ProcessorNode(PACKAGE, ROBOT_PROC, ROBOT_PROC,
                                   robot_parameters(device, description).to_parameters()))
    if device.type is DeviceType.DEPTH_SENSOR:
        nodes += _depth_nodes(device, manager, frame)
    if device.variables:
        variables = VariablesParameters([_variable(variable) for variable in device.variables])
        nodes.append(ProcessorNode(PACKAGE, VARIABLE_PROC, VARIABLE_PROC,
                                   variables.to_parameters()))
    return nodes


def _state_publisher(device: Device) -> ProcessorNode:
    """Return a publisher of every state of joint_proc; a lower rate could drop the last state.

    joint_proc already thins the states, and its last state may be stamped some microseconds after
    the previous one: without it, a robot at rest or paused would stay one message behind. States
    that are not newer are left out: after a jump in a recording, the robot would be shown between
    two poses.
    """
    frequency_hz = _EACH_STATE_HZ if device.type is DeviceType.ROBOT else PUBLISH_FREQUENCY_HZ
    return ProcessorNode(ROBOT_STATE_PUBLISHER, ROBOT_STATE_PUBLISHER, ROBOT_STATE_PUBLISHER,
                         {'publish_frequency': frequency_hz})


def fixed_frames(cell: Cell, devices: Sequence[Device]) -> List[Frame]:
    """Return the base, tool and force frames of the devices, for the node cell_frames."""
    frames = []
    for device in devices:
        if device.base is not None:
            frames.append(_frame(cell.frame, device.base.frame, device.base.pose))
        if device.tool is not None:
            tool = tool_frame(device, None)
            if tool.frame != tool.parent:
                frames.append(_frame(tool.parent, tool.frame, tool.pose))
        if device.force is not None:
            frames.append(_frame(device.force.parent_frame, device.force.frame,
                                 device.force.pose))
    return frames


def _frame(parent: str, child: str, pose: Pose) -> Frame:
    return Frame(parent, child, pose.xyz, pose.ypr)


def robot_parameters(device: Device, description: Optional[RobotDescription]) -> RobotParameters:
    """Return the parameters of a robot processor."""
    tool = tool_frame(device, description).frame
    topics: Dict[str, Any] = {function.value: _topic(device.topic_for(function))
                              for function in ROBOT_FUNCTIONS}
    arrows: Dict[str, Any] = {f'{arrow.quantity}_arrow': configured_arrow(device, arrow.quantity)
                              for arrow in device.arrows}
    return RobotParameters(
        device.name, base_frame(device), tool,
        tool if device.force is None else device.force.frame, **topics, **arrows,
        more_joint_states=tuple(
            it.name for it in device.topics_for(TopicFunction.JOINT_STATES)[1:]),
        foot_at_tool_frame=device.tool is not None,
        link_prefix='' if device.model is None else device.model.prefix or '')


def _joint_nodes(device: Device, description: Optional[RobotDescription]) -> List[ProcessorNode]:
    topics = device.topics_for(TopicFunction.JOINT_STATES)
    if not topics or description is None or not description.joints:
        return []
    parameters: Dict[str, Any] = {'topic': topics[0].name} if len(topics) == 1 else \
        {'topics': [topic.name for topic in topics]}
    parameters['joint_names'] = list(description.joints)
    if topics[0].message_type is not None:
        parameters['msg'] = topics[0].message_type
    if device.model is not None and device.model.prefix:
        parameters['prefix'] = device.model.prefix
    if any(topic.latency_s for topic in topics):
        parameters['latencies'] = [topic.latency_s for topic in topics]
    return [ProcessorNode(PACKAGE, JOINT_PROC, JOINT_PROC, parameters)]


def _topic(topic: Optional[Topic]) -> TopicParameters:
    return TopicParameters() if topic is None else TopicParameters(
        topic.name, topic.message_type or '', topic.frame or '', topic.parent_frame or '',
        topic.latency_s)


def _depth_nodes(device: Device, manager: Optional[Manager], frame: str) -> List[ProcessorNode]:
    topic = device.cloud_topic
    if topic is None:
        return []
    processor = ProcessorNode(PACKAGE, DEPTH_PROC, DEPTH_PROC,
                              {'topic': topic, **({'frame': frame} if frame else {})})
    if device.roi is None:
        return [processor]
    return [_crop_node(device, device.roi, topic, manager), processor]


def fusion_node(device: Device, fusion: Fusion, sensors: Sequence[Device], frame: str,
                manager: Optional[Manager]) -> ProcessorNode:
    """Return the node that joins the clouds of sensors, in their common manager, if any."""
    parameters = {'topics': [sensor.cloud_topic for sensor in sensors], 'frame': frame,
                  'voxel': fusion.voxel_m, 'timeout': fusion.timeout_s}
    return ProcessorNode(
        'nodelet', 'nodelet', FUSION, parameters, args=nodelet_arguments('CloudFusion', manager),
        remaps={'~output': str(device.cloud_topic)}, respawn=manager is not None)


def _crop_node(device: Device, roi: RegionOfInterest, cropped: str,
               manager: Optional[Manager]) -> ProcessorNode:
    """Return the crop node, in the manager of the device's nodelets if it is known."""
    nodelet = 'RegisteredCrop' if device.has_images else 'RoiFilter'
    return ProcessorNode(
        'nodelet', 'nodelet', ROI_FILTER,
        {'frame': roi.frame, 'center': list(roi.center), 'size': list(roi.size)},
        args=nodelet_arguments(nodelet, manager),
        remaps={**_crop_inputs(device), '~output': cropped},
        respawn=manager is not None and manager.is_shared)


def nodelet_arguments(name: str, manager: Optional[Manager]) -> str:
    """Return the arguments that start one of our nodelets: in a manager, or as its own process."""
    nodelet = f'{PACKAGE}/{name}'
    return f'load {nodelet} {manager.loading}' if manager else f'standalone {nodelet}'


def _crop_inputs(device: Device) -> Dict[str, str]:
    """Return images if there are any: a pass over them costs a fraction of computing the cloud."""
    names = dict(zip(IMAGE_FUNCTIONS, ('~depth', '~color', '~camera_info'))) \
        if device.has_images else {TopicFunction.POINTCLOUD: '~input'}
    topics = {name: device.topic_for(function) for function, name in names.items()}
    return {name: topic.name for name, topic in topics.items() if topic is not None}


def _variable(variable: Variable) -> VariableParameters:
    return VariableParameters(
        variable.topic, FieldPath(variable.field), variable.frame, variable.axis,
        colors_of(variable),
        variable.unit, variable.scale, variable.offset, variable.label,
        variable.offset_param or '',
        MAX_LENGTH_M if variable.maximum_m is None else variable.maximum_m, variable.is_shown)


_OUTPUTS = {'~objects': OBJECTS, '~markers': OBJECTS_MARKERS, '~unknown': UNKNOWN_POINTS}


def object_finder_nodes(choice: Choice, device: Device,
                        descriptions: Mapping[str, RobotDescription],
                        manager: Optional[Manager] = None) -> List[ProcessorNode]:
    """Return the object finder of a device that has one.

    The finder removes the models of all started devices from the clouds. ``manager`` is the
    nodelet manager in which the device's own nodelets run, if it is known.
    """
    if device.objects is None:
        return []
    # By default, the cloud is the one that the device shows, before it is restamped.
    cloud = device.objects.topic or device.cloud_topic or f'/{device.name}/roi_points'
    outputs = {name: f'/{device.name}/{topic}' for name, topic in _OUTPUTS.items()}
    return [ProcessorNode(
        'nodelet', 'nodelet', OBJECT_FINDER,
        {'frame': choice.cell.frame, **_models(choice, descriptions),
         **_parameters(device.objects)},
        args=nodelet_arguments('ObjectFinder', manager),
        remaps={'~input': cloud, **outputs},
        respawn=manager is not None and manager.is_shared)]


def _models(choice: Choice, descriptions: Mapping[str, RobotDescription]) -> Dict[str, List[str]]:
    with_model = [device for device in choice.devices if device.name in descriptions]
    robots = [device.name for device in with_model if device.type is DeviceType.ROBOT]
    return {'robots': robots,
            'others': [device.name for device in with_model if device.name not in robots]}


def _parameters(objects: SoughtObjects) -> Dict[str, Any]:
    return {'warn': objects.warn_m, 'stop': objects.stop_m, 'padding': objects.padding_m,
            'surface': objects.surface_m2,
            'region': [] if objects.region is None else [_box(objects.region)],
            'expected': [_box(box) for box in objects.expected],
            **({} if objects.noise_m is None else {'noise': objects.noise_m})}


def _box(box: RegionOfInterest) -> Dict[str, Any]:
    return {'frame': box.frame, 'center': list(box.center), 'size': list(box.size)}


WATCH_TOPIC = f'/{SCENE_WATCH}/marker_array'
_UP_M = 0.7
"""Height of a text above a device's base, clear of its foot."""
_APART_M = 0.14
"""Spacing of the texts of devices whose bases are at the same position."""
_MEANINGS = {
    ROBOT_PROC: 'no arrows or numbers', VARIABLE_PROC: 'no arrows or numbers',
    JOINT_PROC: 'the robot does not move', ROBOT_STATE_PUBLISHER: 'the robot does not move',
    DEPTH_PROC: 'the points are out of date', ROI_FILTER: 'the points are out of date'}


def watch_parameters(cell: Cell, devices: Sequence[Device]) -> SceneParameters:
    """Return the parameters of the node scene_watch, which tolerates nodes that never start."""
    drawn = [device for device in devices if _is_drawn(device)]
    bases = [_base_in_view(device, drawn) for device in drawn]
    places = [None if base is None else base.pose.xyz for base in bases]
    return SceneParameters(cell.frame, tuple(
        _device(cell, device, base, _UP_M + _APART_M * places[:number].count(place))
        for number, (device, base, place) in enumerate(zip(drawn, bases, places))))


def _base_in_view(device: Device, drawn: Sequence[Device]) -> Optional[BaseFrame]:
    """Return the base with a device's text; that of a depth sensor is often outside the view."""
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
    """Return, by node, the consequence for a device if the node has ended."""
    if device.variables and not any(it.is_shown for it in device.variables):
        return {**_MEANINGS, VARIABLE_PROC: 'limits are not watched'}
    fusion = {} if device.fusion is None else {FUSION: 'the points are out of date'}
    finder = {} if device.objects is None else {OBJECT_FINDER: 'no objects are found'}
    return {**_MEANINGS, **fusion, **finder}


def _is_drawn(device: Device) -> bool:
    """Return whether any process draws something for a device."""
    return device.model is not None or bool(_topics(device_displays(device)))


def _topics(displays: Sequence[DisplayConfig]) -> List[str]:
    """Return the topics that displays show, including displays in groups."""
    topics: List[str] = []
    for display in displays:
        display_type = DISPLAY_TYPES[display['Class'].split('/')[1]]
        if display_type.topic_key is not None and display_type.message_type:
            topics.append(str(display[display_type.topic_key]))
        topics += _topics(display.get('Displays', []))
    return topics
