# SPDX-License-Identifier: BSD-3-Clause
"""The nodes that the program itself starts for a device, with their parameters."""
from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Dict, List, Optional, Sequence

from process_visualizer.cell.model import (
    Arrow,
    Cell,
    Device,
    DeviceType,
    Pose,
    Topic,
    TopicFunction,
    Variable,
)
from process_visualizer.descriptions.robot_description import RobotDescription
from process_visualizer.descriptions.tool_frame import tool_frame

_PACKAGE = 'process_visualizer'
PUBLISH_FREQUENCY_HZ = 100.0
"""Upper bound of robot_state_publisher: every second state of a 125 Hz driver, more than a screen
shows. It asks the master at each (for tf_prefix), which costs a tenth of a core at 125 Hz."""


@dataclass(frozen=True)
class ProcessorNode:
    """A node in the device's namespace; ``parameters`` are private to it."""

    package: str
    type: str
    name: str
    parameters: Dict[str, Any] = field(default_factory=dict)
    args: str = ''
    remaps: Dict[str, str] = field(default_factory=dict)


def processor_nodes(device: Device, description: Optional[RobotDescription]
                    ) -> List[ProcessorNode]:
    """Robot or depth processor, state publisher and variables of a device."""
    nodes: List[ProcessorNode] = []
    if description is not None and description.parents:
        nodes.append(ProcessorNode('robot_state_publisher', 'robot_state_publisher',
                                   'robot_state_publisher',
                                   {'publish_frequency': PUBLISH_FREQUENCY_HZ}))
    if device.type is DeviceType.ROBOT:
        nodes += _joint_nodes(device, description)
        nodes.append(ProcessorNode(_PACKAGE, 'robot_proc', 'robot_proc',
                                   robot_parameters(device, description)))
    if device.type is DeviceType.DEPTH_SENSOR:
        nodes += _depth_nodes(device)
    if device.variables:
        nodes.append(ProcessorNode(_PACKAGE, 'variable_proc', 'variable_proc', {
            'variables': [_variable(variable) for variable in device.variables]}))
    return nodes


def frame_parameters(cell: Cell, devices: Sequence[Device]) -> Dict[str, Any]:
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
    return {'frames': frames}


def _frame(parent: str, child: str, pose: Pose) -> Dict[str, Any]:
    return {'parent': parent, 'child': child, 'xyz': list(pose.xyz), 'ypr': list(pose.ypr)}


def robot_parameters(device: Device, description: Optional[RobotDescription]) -> Dict[str, Any]:
    """The parameters of a robot processor."""
    parameters: Dict[str, Any] = {}
    if device.base is not None:
        parameters['base_frame'] = device.base.frame
    parameters['tool_frame'] = tool_frame(device, description).frame
    if device.tool is not None:
        parameters['arrow_foot'] = 'tool_frame'
    if device.model is not None and device.model.prefix:
        parameters['link_prefix'] = device.model.prefix
    if device.force is not None:
        parameters['force_frame'] = device.force.frame
    functions = (TopicFunction.JOINT_STATES, TopicFunction.TOOL_CENTER_FRAME,
                 TopicFunction.FORCE_SENSOR)
    topics = {function.value: device.topic_for(function) for function in functions}
    parameters['topics'] = {name: _topic(topic) for name, topic in topics.items()
                            if topic is not None}
    if device.arrows:
        parameters['arrows'] = {arrow.quantity: _arrow(arrow) for arrow in device.arrows}
    return parameters


def _joint_nodes(device: Device, description: Optional[RobotDescription]) -> List[ProcessorNode]:
    topic = device.topic_for(TopicFunction.JOINT_STATES)
    if topic is None or description is None or not description.joints:
        return []
    parameters: Dict[str, Any] = {'topic': topic.name, 'joint_names': list(description.joints)}
    if topic.message_type is not None:
        parameters['msg'] = topic.message_type
    if device.model is not None and device.model.prefix:
        parameters['prefix'] = device.model.prefix
    return [ProcessorNode(_PACKAGE, 'joint_proc', 'joint_proc', parameters)]


def _topic(topic: Topic) -> Dict[str, str]:
    values = {'name': topic.name}
    if topic.message_type is not None:
        values['msg'] = topic.message_type
    if topic.frame is not None:
        values['frame'] = topic.frame
    if topic.parent_frame is not None:
        values['parent_frame'] = topic.parent_frame
    return values


def _arrow(arrow: Arrow) -> Dict[str, Any]:
    color = None if arrow.color is None else list(arrow.color)
    values = {'scale': arrow.scale, 'min': arrow.minimum_m, 'max': arrow.maximum_m,
              'color': color}
    return {name: value for name, value in values.items() if value is not None}


def _depth_nodes(device: Device) -> List[ProcessorNode]:
    topic = device.topic_for(TopicFunction.POINTCLOUD)
    if topic is None:
        return []
    if device.roi is None:
        return [ProcessorNode(_PACKAGE, 'depth_proc', 'depth_proc', {'topic': topic.name})]
    cropped = f'/{device.name}/roi_points'
    roi = ProcessorNode('nodelet', 'nodelet', 'roi_filter', {
        'frame': device.roi.frame, 'center': list(device.roi.center),
        'size': list(device.roi.size)}, args='standalone process_visualizer/RoiFilter',
        remaps={'~input': topic.name, '~output': cropped})
    return [roi, ProcessorNode(_PACKAGE, 'depth_proc', 'depth_proc', {'topic': cropped})]


def _variable(variable: Variable) -> Dict[str, Any]:
    values: Dict[str, Any] = {
        'topic': variable.topic, 'field': variable.field, 'frame': variable.frame,
        'axis': list(variable.axis), 'color': list(variable.color), 'unit': variable.unit,
        'scale': variable.scale, 'offset': variable.offset, 'label': variable.label}
    if variable.offset_param is not None:
        values['offset_param'] = variable.offset_param
    if variable.maximum_m is not None:
        values['max'] = variable.maximum_m
    if variable.limits is not None:
        limits = variable.limits
        values['limits'] = {'color': list(limits.color)}
        values['limits'].update({name: value for name, value in
                                 (('low', limits.low), ('high', limits.high))
                                 if value is not None})
    if variable.color_scale is not None:
        scale = variable.color_scale
        values['color_scale'] = {'begin': scale.begin, 'end': scale.end,
                                 'color': list(scale.end_color)}
    return values
