# SPDX-License-Identifier: BSD-3-Clause
"""A robot as a device of the configuration."""
from __future__ import annotations

import re
from typing import Dict, List, Optional

from process_visualizer.cell.model import Pose
from process_visualizer.discovery.cell_names import CellNames
from process_visualizer.discovery.draft import DraftDevice, DraftElement
from process_visualizer.discovery.evidence.frame_forest import FrameForest, pose_of
from process_visualizer.discovery.evidence.seen import SeenTopic
from process_visualizer.discovery.found_model import FoundModel
from process_visualizer.discovery.names import is_frame
from process_visualizer.discovery.place import Places, pose_attributes
from process_visualizer.discovery.robot_topics import RobotGroup
from process_visualizer.discovery.tool_transforms import ToolTransform, tool_link
from process_visualizer.ros_names import TF_MESSAGE, TF_TOPIC

_FORCE_NAME = re.compile(r'(^|[/_])(ft|force|wrench|sensor)([/_]|$)')


def robot_name(group: RobotGroup) -> str:
    """Return what a robot is called: after its namespace, else as in its model."""
    for namespace in (group.namespace, group.joint_topic.name.rpartition('/')[0]):
        if namespace.strip('/'):
            return namespace.strip('/').rpartition('/')[2]
    return group.model.name if group.model is not None else 'robot'


def robot_device(group: RobotGroup, name: str, prefix: str, names: CellNames, places: Places,
                 forest: FrameForest, tool: Optional[ToolTransform] = None) -> DraftDevice:
    """Return the device of a robot; the links of its model get the ``prefix``.

    The ``tool`` is what brings its pose if no topic does.
    """
    device = DraftDevice('robot', name)
    add_model(device, group.model, prefix)
    if group.model is not None:
        base = prefix + group.model.description.root_link
    else:
        base = names.frame(_base_of_poses(group, names, places) or f'{name}/base_link')
    attributes, comment = places.base_attributes(base)
    device.add('base', attributes, comment)
    for topic in (group.joint_topic, *group.other_joint_topics):
        add_topic(device, topic, 'joint_states')
    if group.pose_topic is not None:
        add_topic(device, group.pose_topic, 'tool_center_frame')
    elif tool is not None:
        _add_tool(device, tool)
    if group.wrench_topic is not None:
        add_topic(device, group.wrench_topic, 'force_sensor')
        _add_force(device, group, group.wrench_topic, prefix, names, forest)
    _say_what_is_missing(device, group, tool is not None and tool.is_sure)
    return device


def _base_of_poses(group: RobotGroup, names: CellNames, places: Places) -> str:
    """The frame in which a driver gives the poses of its tool, if it can be the base frame."""
    frames = group.pose_topic.frames if group.pose_topic is not None else ()
    return next((it for it in frames if is_frame(it) and names.is_free(it)
                 and it != places.frame), '')


def add_model(device: DraftDevice, model: Optional[FoundModel], prefix: str = '') -> None:
    """Add the model; without one a line to be completed."""
    if model is None:
        device.add('model', {'pkg': 'my_robot_description', 'path': 'urdf/my_robot.urdf.xacro'},
                   'no model was found: name its file here, and the root link of it in <base>',
                   active=False)
        return
    attributes = {'pkg': model.package} if model.package else {}
    attributes['path'] = model.path or f'{device.name}.urdf'
    if prefix:
        attributes['prefix'] = prefix
    arguments = tuple(DraftElement('arg', {'name': name, 'value': value})
                      for name, value in model.arguments)
    device.add('model', attributes, model.reason, children=arguments)


def add_topic(device: DraftDevice, topic: SeenTopic, function: str = '', comment: str = '',
              **more: str) -> None:
    """Add a topic, with what it is used for."""
    namespace, _, name = topic.name.rpartition('/')
    attributes: Dict[str, str] = {'ns': namespace.strip('/')} if namespace.strip('/') else {}
    attributes['name'] = name
    if function:
        attributes.update(type=function, msg=topic.type)
    device.add('topic', {**attributes, **more}, comment)


def _add_tool(device: DraftDevice, tool: ToolTransform) -> None:
    device.add('topic', {'name': TF_TOPIC.lstrip('/'), 'type': 'tool_center_frame',
                         'msg': TF_MESSAGE, 'frame': tool.frame}, tool.comment, tool.is_sure)


def _add_force(device: DraftDevice, group: RobotGroup, topic: SeenTopic, prefix: str,
               names: CellNames, forest: FrameForest) -> None:
    """Add the sensor's frame where tf or the messages name one that no model has."""
    if group.model is None:
        return
    links = group.model.description.links
    child = next((it for it in forest.frames if _FORCE_NAME.search(it) and is_frame(it)
                  and names.is_free(it) and (forest.parent(it) or '') in links), None)
    if child is not None:
        found = forest.transform(child)
        device.add('force', {'parentframe': prefix + found.parent, 'frame': names.frame(child),
                             **_whole_pose(pose_of(found.placement))})
        return
    unknown = [it for it in topic.frames if is_frame(it) and it not in links
               and it not in forest.frames and names.is_free(it)]
    if unknown:
        device.add('force', {'parentframe': prefix + tool_link(group.model),
                             'frame': names.frame(unknown[0]), **_whole_pose(Pose())},
                   'the messages name this frame, and nothing tells where it is: write its pose')


def _whole_pose(pose: Pose) -> Dict[str, str]:
    found = pose_attributes(pose)
    return {**found, 'ypr': found.get('ypr', '0 0 0')}


def _say_what_is_missing(device: DraftDevice, group: RobotGroup, has_tool: bool) -> None:
    missing: List[str] = []
    if group.wrench_topic is None:
        missing.append('no force (WrenchStamped)')
    if group.pose_topic is None and not has_tool:
        velocity = 'so no velocity' if group.model is None else \
            'so its velocity is that of the model and the joints'
        missing.append(f'no pose of its tool (PoseStamped, or a frame on tf), {velocity}')
    if missing:
        device.comments.append(f'Of {device.name} was seen {" and ".join(missing)}.')
