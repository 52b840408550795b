# SPDX-License-Identifier: BSD-3-Clause
"""Decides what the roslaunch file contains: the nodes of devices, recorder, player and RViz."""
from __future__ import annotations

import os
import shlex
from functools import partial
from types import MappingProxyType
from typing import Callable, Dict, Mapping, Sequence

from process_visualizer.cell.model import (
    Device,
    DeviceType,
    LaunchFile,
    Mode,
    Node,
    RoslaunchElement,
)
from process_visualizer.cell.outputs import recorded_outputs
from process_visualizer.generate.choice import Choice, RvizStart
from process_visualizer.generate.drivers import Manager, shared_manager
from process_visualizer.generate.launch_writer import LaunchTag, write_document
from process_visualizer.generate.plan import (
    BAG_PART,
    CONFIGURATION_FILE,
    FRAMES_PART,
    RVIZ_FILE,
    RVIZ_PART,
    PlanError,
    generated_notice,
)
from process_visualizer.generate.processor_nodes import (
    ProcessorNode,
    fixed_frames,
    fusion_node,
    object_finder_nodes,
    processor_nodes,
    watch_parameters,
)
from process_visualizer.parameters.cell_parameters import written_frames
from process_visualizer.robot.description import RobotDescription
from process_visualizer.ros_names import (
    BAG_PLAYER,
    BAG_RECORDER,
    CELL_FRAMES,
    GHOST,
    PACKAGE,
    PLAYBACK_RATE,
    ROBOT_OUTPUTS,
    RVIZ,
    SCENE_WATCH,
    SENSOR_FIT,
    VIEW_RELAY,
)

_BOOLEAN = ('respawn', 'required', 'clear_params', 'subst_value')
_TRUTH = {'1': 'true', '0': 'false'}
_NOT_PASSED_ON = '$(', ':='
"""Characters in a path that roslaunch replaces, or that make it a remapping, even in quotes."""


class LaunchFileBuilder:
    """Builds the launch file; ``included`` maps a launch file to its path.

    A launch file without a path is left out, with a comment. ``managers`` are the known nodelet
    managers of the devices.
    """

    def __init__(self, choice: Choice, descriptions: Mapping[str, RobotDescription],
                 included: Mapping[LaunchFile, str],
                 managers: Mapping[str, Manager] = MappingProxyType({})) -> None:
        self._choice = choice
        self._descriptions = descriptions
        self._included = included
        self._managers = managers
        self._folder = '$(dirname)'

    def text(self) -> str:
        """Return the content of the single launch file for all parts.

        Raises:
            PlanError: a bag has a path that roslaunch cannot pass on.
        """
        self._folder = '$(dirname)'
        root = self._root()
        self._frames(root)
        for device in self._choice.devices:
            self._device(root, device)
        self._bag(root)
        self._rviz(root)
        return write_document(root)

    def parts(self) -> Dict[str, LaunchTag]:
        """Return a launch file for each part, for a folder below that of the other files.

        Raises:
            PlanError: a bag has a path that roslaunch cannot pass on.
        """
        self._folder = '$(dirname)/..'
        parts = {FRAMES_PART: self._part(self._frames)}
        for device in self._choice.devices:
            parts[device.name] = self._part(partial(self._device, device=device))
        for name, add in ((BAG_PART, self._bag), (RVIZ_PART, self._rviz_with_models)):
            part = self._part(add)
            if part.children:
                parts[name] = part
        return parts

    def _rviz_with_models(self, root: LaunchTag) -> None:
        """Add RViz, and the models before it: RViz reads a model only once, when it starts."""
        if self._choice.rviz is not RvizStart.NONE:
            for device in self._choice.devices:
                if device.name in self._descriptions:
                    self._model(root.add('group', {'ns': device.name}), device)
        self._rviz(root)

    def _part(self, add: Callable[[LaunchTag], None]) -> LaunchTag:
        """Return a root element filled by ``add``, without children if ``add`` adds no elements."""
        root = self._root()
        begin = len(root.children)
        add(root)
        if all(isinstance(child, str) for child in root.children[begin:]):
            root.children.clear()
        return root

    def _root(self) -> LaunchTag:
        root = LaunchTag('launch')
        cell = self._choice.cell
        root.comment(generated_notice(cell.file, self._choice.mode.value))
        for machine in cell.machines:
            self._roslaunch_element(root, machine)
        return root

    def _frames(self, root: LaunchTag) -> None:
        root.comment('base frames and force frames of all devices')
        self._processor(root, ProcessorNode(
            PACKAGE, CELL_FRAMES, CELL_FRAMES,
            {'frames': written_frames(fixed_frames(self._choice.cell,
                                                   self._choice.devices))}))
        root.comment('marks stale data in the scene')
        self._processor(root, ProcessorNode(
            PACKAGE, SCENE_WATCH, SCENE_WATCH,
            watch_parameters(self._choice.cell, self._choice.devices).to_parameters(),
            respawn=True, is_new=True))
        if has_sensor_fit(self._choice):
            root.comment('fits the pose of a depth sensor on request')
            self._processor(root, ProcessorNode(PACKAGE, SENSOR_FIT, SENSOR_FIT))
        if not self._choice.is_replay:
            root.comment('sends the view to other computers')
            self._processor(root, self._view_relay())
        if has_ghost(self._choice, self._descriptions):
            root.comment('draws the reference run beside the robots')
            self._processor(root, ProcessorNode(PACKAGE, GHOST, GHOST))

    def _view_relay(self) -> ProcessorNode:
        words = [*self._choice.viewers.options(), '--view', f'"{self._folder}/{RVIZ_FILE}"',
                 '--mode', self._choice.mode.value]
        states = [f'/{device.name}/{name}' for device in self._choice.devices
                  if device.type is DeviceType.ROBOT for name in ROBOT_OUTPUTS]
        return ProcessorNode(PACKAGE, VIEW_RELAY, VIEW_RELAY, {'topics': states} if states else {},
                             ' '.join(words), respawn=True, is_new=True)

    def _bag(self, root: LaunchTag) -> None:
        if has_recorder(self._choice):
            self._recorder(root)
        if self._choice.mode is Mode.PLAYBACK and self._choice.bag is not None:
            self._player(root, [self._choice.bag, *self._choice.further_bags])

    def _device(self, root: LaunchTag, device: Device) -> None:
        root.comment(f'{device.name} ({device.type.value}), from {device.location}')
        group = root.add('group', {'ns': device.name})
        self._model(group, device)
        machine = self._machine(device)
        for processor in processor_nodes(device, self._descriptions.get(device.name),
                                         self._managers.get(device.name),
                                         self._choice.cell.frame):
            self._processor(group, processor, machine)
        self._fusion(group, device)
        for finder in object_finder_nodes(self._choice, device, self._descriptions,
                                          self._managers.get(device.name)):
            self._processor(group, finder, machine)
        for parameter in device.parameters:  # last, so that the user's values win
            self._roslaunch_element(group, parameter)
        for node in self._choice.nodes(device):
            self._node(group, node, device)
        for launch_file in self._choice.launch_files(device):
            self._include(root, launch_file)
        if not group.children:
            root.children.remove(group)

    def _fusion(self, group: LaunchTag, device: Device) -> None:
        if device.fusion is None:
            return
        sensors = [it for it in self._choice.devices if it.name in device.fusion.sensors]
        if not sensors:
            group.comment('nothing to join: none of its sensors is selected')
            return
        self._processor(group, fusion_node(
            device, device.fusion, sensors, self._choice.cell.frame,
            shared_manager((it.name for it in sensors), self._managers)), self._machine(device))

    def _model(self, group: LaunchTag, device: Device) -> None:
        if device.name in self._descriptions:
            group.add('param', {
                'name': 'robot_description', 'textfile': f'{self._folder}/{urdf_file(device)}'})

    def _machine(self, device: Device) -> Dict[str, str]:
        """Return the machine attribute of a device whose nodes run on another computer.

        In playback and replay, all nodes run on this computer, because the other one may be off.
        """
        is_live = self._choice.mode is Mode.REALTIME and not self._choice.is_replay
        return {'machine': device.machine} if device.machine and is_live else {}

    def _processor(self, parent: LaunchTag, node: ProcessorNode,
                   machine: Mapping[str, str] = MappingProxyType({})) -> None:
        attributes = {'pkg': node.package, 'type': node.type, 'name': node.name, **machine}
        if node.args:
            attributes['args'] = node.args
        if node.respawn:
            attributes['respawn'] = 'true'
        if node.is_new:
            attributes['clear_params'] = 'true'
        element = parent.add('node', {**attributes, 'output': 'screen'})
        for name, target in node.remaps.items():
            element.add('remap', {'from': name, 'to': target})
        element.parameters(node.parameters)

    def _node(self, group: LaunchTag, node: Node, device: Device) -> None:
        attributes: Dict[str, str] = {'pkg': node.package, 'type': node.type, 'name': node.name}
        if node.namespace != device.name:
            attributes['ns'] = '/' + node.namespace.strip('/')
        element = group.add('node', {**attributes, **self._machine(device),
                                     **_in_words(node.attributes)})
        for child in node.children:
            self._roslaunch_element(element, child)

    def _include(self, root: LaunchTag, launch_file: LaunchFile) -> None:
        path = self._included.get(launch_file)
        if path is None:
            root.comment(f'left out, cannot be loaded: {launch_file.package} '
                         f'{launch_file.type} ({launch_file.location})')
            return
        root.include(path, launch_file.arguments)

    def _roslaunch_element(self, parent: LaunchTag, element: RoslaunchElement) -> None:
        parent.add(element.tag, _in_words(element.attributes), element.text)

    def _recorder(self, root: LaunchTag) -> None:
        root.comment("the recorder: keeps the last seconds of the devices' topics in memory")
        self._rate(root)
        node = root.add('node', {'pkg': PACKAGE, 'type': BAG_RECORDER, 'name': BAG_RECORDER,
                                 'output': 'screen'})
        node.add('param', {'name': 'configuration',
                           'textfile': f'{self._folder}/{CONFIGURATION_FILE}'})
        if self._choice.bag_folder:
            node.parameters({'folder': self._choice.bag_folder})
        node.parameters({'topics': recorded_topics(self._choice.devices)})

    def _player(self, root: LaunchTag, bags: Sequence[str]) -> None:
        for bag in bags:
            if any(it in bag for it in _NOT_PASSED_ON):
                raise PlanError(f'roslaunch cannot pass on the path {bag!a}; rename it')
        topics = played_topics(self._choice)
        if not topics:
            root.comment('nothing is played: no topic of a device is left')
            return
        root.comment("the recording, restricted to the devices' own topics")
        self._rate(root)
        root.add('node', {
            'pkg': PACKAGE, 'type': BAG_PLAYER, 'name': BAG_PLAYER,
            'output': 'screen',
            'args': ' '.join([*map(shlex.quote, bags), '--keep-alive', '--quiet', '--others',
                              'pause', *['--pause'] * self._choice.is_replay, '--topics',
                              *topics])})

    @staticmethod
    def _rate(root: LaunchTag) -> None:
        """Reset the playback rate, as the last player may have changed it."""
        root.add('param', {'name': PLAYBACK_RATE, 'type': 'double', 'value': '1.0'})

    def _rviz(self, root: LaunchTag) -> None:
        start = self._choice.rviz
        if start is RvizStart.NONE:
            return
        root.comment('the view')
        required = 'true' if start is RvizStart.REQUIRED else 'false'
        element = root.add('node', {
            'pkg': PACKAGE, 'type': RVIZ, 'name': RVIZ, 'output': 'log',
            'args': f'-d "{self._folder}/{RVIZ_FILE}" -s ""',  # no splash screen over other windows
            'required': required})
        element.add('env', {'name': 'DISABLE_ROS1_EOL_WARNINGS', 'value': '1'})


def _in_words(attributes: Mapping[str, str]) -> Dict[str, str]:
    """Return attributes with true for 1 and false for 0, which roslaunch accepts only in values."""
    return {name: _TRUTH.get(value, value) if name in _BOOLEAN else value
            for name, value in attributes.items()}


def urdf_file(device: Device) -> str:
    """Return the name of the generated URDF file of a device."""
    return f'{os.path.basename(device.name)}.urdf'


def has_ghost(choice: Choice, descriptions: Mapping[str, RobotDescription]) -> bool:
    """Return whether the robots of a reference run can be drawn beside those of the current run.

    This applies to both modes, so that RViz and the frames keep running when the mode changes.
    """
    return not choice.is_replay and any(
        it.type is DeviceType.ROBOT and it.name in descriptions for it in choice.devices)


def has_sensor_fit(choice: Choice) -> bool:
    """Return whether there is a depth sensor whose pose can be fitted."""
    return not choice.is_replay and any(
        it.type is DeviceType.DEPTH_SENSOR and it.base is not None for it in choice.devices)


def has_recorder(choice: Choice) -> bool:
    """Return whether a recorder is started: in real-time mode, if there is something to record."""
    return choice.mode is Mode.REALTIME and bool(recorded_topics(choice.devices))


def recorded_topics(devices: Sequence[Device]) -> 'list[str]':
    """Return the topics of the devices that are recorded, each once."""
    return list(dict.fromkeys([*_own_topics(devices), *(
        topic for device in devices for topic in recorded_outputs(device))]))


def played_topics(choice: Choice) -> 'list[str]':
    """Return the topics that are played in playback mode."""
    return [topic for topic in _own_topics(choice.devices) if topic not in choice.left_out]


def _own_topics(devices: Sequence[Device]) -> 'list[str]':
    return list(dict.fromkeys(topic.name for device in devices for topic in device.topics
                              if topic.record))
