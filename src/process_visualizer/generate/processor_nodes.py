# SPDX-License-Identifier: BSD-3-Clause
"""The nodes that the program itself starts for a device, with their parameters."""
from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import Any, Dict, List, Optional, Sequence

from process_visualizer.cell.model import (
    IMAGE_FUNCTIONS,
    ROBOT_FUNCTIONS,
    Cell,
    Device,
    DeviceType,
    Fusion,
    Pose,
    RegionOfInterest,
    Topic,
    TopicFunction,
    Variable,
)
from process_visualizer.descriptions.robot_description import RobotDescription
from process_visualizer.descriptions.robot_frames import base_frame
from process_visualizer.descriptions.tool_frame import tool_frame
from process_visualizer.generate.nodelet_managers import Manager
from process_visualizer.motion.field_path import FieldPath
from process_visualizer.motion.frame_tree import Frame
from process_visualizer.motion.variables import MAX_LENGTH_M
from process_visualizer.parameters.configured_arrow import configured_arrow
from process_visualizer.parameters.reading import opaque
from process_visualizer.parameters.robot_parameters import RobotParameters, TopicParameters
from process_visualizer.parameters.variable_parameters import (
    VariableColors,
    VariableParameters,
    VariablesParameters,
)
from process_visualizer.ros_names import (
    DEPTH_PROC,
    FUSION,
    JOINT_PROC,
    PACKAGE,
    ROBOT_PROC,
    ROBOT_STATE_PUBLISHER,
    ROI_FILTER,
    VARIABLE_PROC,
)

PUBLISH_FREQUENCY_HZ = 100.0
"""Upper bound of robot_state_publisher: every second state of a 125 Hz driver, more than a screen
shows. It asks the master at each (for tf_prefix), which costs a tenth of a core at 125 Hz."""


@dataclass(frozen=True)
class ProcessorNode:
    """A node in the device's namespace; ``parameters`` are private to it.

    One that ``is_new`` finds no other ones, such as it has set itself in another run.
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
                    manager: Optional[Manager] = None) -> List[ProcessorNode]:
    """Robot or depth processor, state publisher and variables of a device.

    ``manager`` is the nodelet manager in which the device's own nodelets run, if it is known.
    """
    nodes: List[ProcessorNode] = []
    if description is not None and description.parents:
        nodes.append(ProcessorNode(ROBOT_STATE_PUBLISHER, ROBOT_STATE_PUBLISHER,
                                   ROBOT_STATE_PUBLISHER,
                                   {'publish_frequency': PUBLISH_FREQUENCY_HZ}))
    if device.type is DeviceType.ROBOT:
        nodes += _joint_nodes(device, description)
        nodes.append(ProcessorNode(PACKAGE, ROBOT_PROC, ROBOT_PROC,
                                   robot_parameters(device, description).to_parameters()))
    if device.type is DeviceType.DEPTH_SENSOR:
        nodes += _depth_nodes(device, manager)
    if device.variables:
        variables = VariablesParameters([_variable(variable) for variable in device.variables])
        nodes.append(ProcessorNode(PACKAGE, VARIABLE_PROC, VARIABLE_PROC,
                                   variables.to_parameters()))
    return nodes


def fixed_frames(cell: Cell, devices: Sequence[Device]) -> List[Frame]:
    """The base, tool and force frames of the devices, for the node cell_frames."""
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
    """The parameters of a robot processor."""
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
    return [ProcessorNode(PACKAGE, JOINT_PROC, JOINT_PROC, parameters)]


def _topic(topic: Optional[Topic]) -> TopicParameters:
    return TopicParameters() if topic is None else TopicParameters(
        topic.name, topic.message_type or '', topic.frame or '', topic.parent_frame or '')


def _depth_nodes(device: Device, manager: Optional[Manager]) -> List[ProcessorNode]:
    topic = device.cloud_topic
    if topic is None:
        return []
    processor = ProcessorNode(PACKAGE, DEPTH_PROC, DEPTH_PROC, {'topic': topic})
    if device.roi is None:
        return [processor]
    return [_crop_node(device, device.roi, topic, manager), processor]


def fusion_node(device: Device, fusion: Fusion, sensors: Sequence[Device], frame: str,
                manager: Optional[Manager]) -> ProcessorNode:
    """The node that joins the clouds of sensors, in the manager that all of them use, if any."""
    parameters = {'topics': [sensor.cloud_topic for sensor in sensors], 'frame': frame,
                  'voxel': fusion.voxel_m, 'timeout': fusion.timeout_s}
    return ProcessorNode(
        'nodelet', 'nodelet', FUSION, parameters, args=nodelet_arguments('CloudFusion', manager),
        remaps={'~output': str(device.cloud_topic)}, respawn=manager is not None)


def _crop_node(device: Device, roi: RegionOfInterest, cropped: str,
               manager: Optional[Manager]) -> ProcessorNode:
    """The crop, in the manager of the device's nodelets if that is known."""
    nodelet = 'RegisteredCrop' if device.has_images else 'RoiFilter'
    return ProcessorNode(
        'nodelet', 'nodelet', ROI_FILTER,
        {'frame': roi.frame, 'center': list(roi.center), 'size': list(roi.size)},
        args=nodelet_arguments(nodelet, manager),
        remaps={**_crop_inputs(device), '~output': cropped},
        respawn=manager is not None and manager.is_shared)


def nodelet_arguments(name: str, manager: Optional[Manager]) -> str:
    """Return the start of one of our nodelets: in a manager, or as a process of its own."""
    nodelet = f'{PACKAGE}/{name}'
    return f'load {nodelet} {manager.loading}' if manager else f'standalone {nodelet}'


def _crop_inputs(device: Device) -> Dict[str, str]:
    """Images if there are any: one pass over them costs a fraction of making the whole cloud."""
    names = dict(zip(IMAGE_FUNCTIONS, ('~depth', '~color', '~camera_info'))) \
        if device.has_images else {TopicFunction.POINTCLOUD: '~input'}
    topics = {name: device.topic_for(function) for function, name in names.items()}
    return {name: topic.name for name, topic in topics.items() if topic is not None}


def _variable(variable: Variable) -> VariableParameters:
    limits, scale = variable.limits, variable.color_scale
    colors = VariableColors(opaque(variable.color))
    if limits is not None:
        colors = replace(colors, warning_color=opaque(limits.color),
                         low=-math.inf if limits.low is None else limits.low,
                         high=math.inf if limits.high is None else limits.high)
    if scale is not None:
        colors = replace(colors, scale=(scale.begin, scale.end, opaque(scale.end_color)))
    return VariableParameters(
        variable.topic, FieldPath(variable.field), variable.frame, variable.axis, colors,
        variable.unit, variable.scale, variable.offset, variable.label,
        variable.offset_param or '',
        MAX_LENGTH_M if variable.maximum_m is None else variable.maximum_m, variable.is_shown)
