# SPDX-License-Identifier: BSD-3-Clause
"""Draft of a configuration from observations, without questions to the user or reading files."""
from __future__ import annotations

from typing import Dict, List, NamedTuple, Optional, Sequence, Set, Tuple
from xml.etree import ElementTree

from process_visualizer.discovery.devices import (
    ROOT_DEVICE,
    BasePlaces,
    Machines,
    add_model,
    by_namespace,
    camera_device,
    global_frame,
    robot_device,
    robot_name,
)
from process_visualizer.discovery.draft import CellNames, Draft, DraftDevice, is_frame, is_topic
from process_visualizer.discovery.process import Process
from process_visualizer.discovery.robot_topics import (
    FoundModel,
    RobotGroup,
    ToolTransforms,
    robot_groups,
)
from process_visualizer.discovery.seen import FrameForest, Seen, SeenTopic
from process_visualizer.discovery.topic_groups import CameraGroup, camera_groups, device_topics


class MadeConfiguration(NamedTuple):
    """A draft, and the texts of the models to be written beside its file, by file name."""

    draft: Draft
    models: Dict[str, str]


def make_draft(seen: Seen, models: Sequence[FoundModel],
               process: Optional[Process] = None) -> MadeConfiguration:
    """Return the configuration for the observations, with the models and the process found."""
    usable = [it for it in models if all(map(is_frame, it.description.links))]
    return _Making(seen, usable, process).made()


class _Making:
    """One draft."""

    def __init__(self, seen: Seen, models: Sequence[FoundModel],
                 process: Optional[Process]) -> None:
        self._topics = [it for it in device_topics(seen.topics) if is_topic(it.name)]
        self._is_moment = seen.is_moment
        self._draft = Draft(seen.where, remarks=[*seen.remarks, *_left_out(seen)])
        self._draft.process += process.elements if process is not None else ()
        self._states = process.states if process is not None else ()
        self._models = models
        self._forest = FrameForest(it for it in seen.transforms
                                   if is_frame(it.parent) and is_frame(it.child))
        self._prefixes = _prefixes(models, self._forest.frames)
        self._links: Set[str] = {self._prefixes[i] + link for i, model in enumerate(models)
                                 for link in model.description.links}
        bases = [model.description.root_link for model in models]
        self._draft.frame = global_frame(self._forest, self._links, bases)
        descriptions = [f'{it.namespace}/robot_description' for it in seen.descriptions]
        self._names = CellNames([*descriptions, *(it.name for it in self._topics)],
                                {*self._links, self._draft.frame})
        self._places = BasePlaces(self._forest, self._draft.frame)
        self._tools = ToolTransforms(self._forest, models, self._prefixes, seen.topics)
        self._texts: Dict[str, str] = {}

    def made(self) -> MadeConfiguration:
        groups = robot_groups(self._topics, self._models)
        robots = [self._robot(group, groups) for group in groups]
        self._add_still_models(groups)
        taken = {topic.name for group in groups for topic in group.topics}
        cameras = camera_groups([topic for topic in self._topics if topic.name not in taken])
        taken |= {topic.name for group in cameras for topic in group.topics}
        owners = self._owners(groups, robots, cameras)
        self._add_rest([topic for topic in self._topics if topic.name not in taken], owners)
        self._draft.devices = [it for it in self._draft.devices if it.elements]
        self._draft.remarks += self._places.remarks
        return MadeConfiguration(self._draft, self._texts)

    def _robot(self, group: RobotGroup, groups: Sequence[RobotGroup]) -> DraftDevice:
        name = self._names.device('robot', robot_name(group))
        tool = self._tools.of(group.model) if group.pose_topic is None else None
        device = robot_device(group, name, self._prefix(group.model), self._names, self._places,
                              self._forest, tool)
        _add_joint_comments(device, group, groups)
        if tool is not None and tool.is_sure:
            self._links.update(map(self._names.frame, tool.chain))  # also on tf in playback
        self._add(device, group.model)
        return device

    def _prefix(self, model: Optional[FoundModel]) -> str:
        return next((self._prefixes[i] for i, it in enumerate(self._models) if it is model), '')

    def _add(self, device: DraftDevice, model: Optional[FoundModel] = None) -> None:
        self._draft.devices.append(device)
        if model is not None and not model.package:
            self._texts[f'{device.name}.urdf'] = model.description.text

    def _add_still_models(self, groups: Sequence[RobotGroup]) -> None:
        """Add the models whose joints no node publishes."""
        for model in self._models:
            if any(group.model is model for group in groups):
                continue
            wanted = model.namespace.strip('/').rpartition('/')[2] or model.name
            device = DraftDevice('other', self._names.device('other', wanted))
            add_model(device, model, self._prefix(model))
            attributes, comment = self._places.base_attributes(
                self._prefix(model) + model.description.root_link)
            device.add('base', attributes, comment)
            if model.joints:
                device.comments.append(f'No node was seen that publishes joints of {device.name}.')
            self._add(device, model)

    def _owners(self, groups: Sequence[RobotGroup], robots: Sequence[DraftDevice],
                cameras: Sequence[CameraGroup]) -> Dict[str, DraftDevice]:
        """Add the cameras; return the owners of other topics by the first part of a namespace."""
        owners: Dict[str, DraftDevice] = {}
        for group in cameras:
            kind = 'depth_sensor' if group.is_depth_sensor else 'other'
            name = self._names.device(kind, group.namespace.rpartition('/')[2] or 'camera')
            device = camera_device(group, name, self._names, self._places, self._forest,
                                   self._links)
            self._add(device)
            owners.setdefault(_first(group.namespace), device)
        for robot, device in zip(groups, robots):
            for topic in robot.topics:
                if topic.name.count('/') > 1:
                    owners.setdefault(_first(topic.name), device)
        return owners

    def _add_rest(self, topics: Sequence[SeenTopic], owners: Dict[str, DraftDevice]) -> None:
        bases = [base.attributes['frame'] for device in self._draft.devices
                 for base in [device.first('base')] if base is not None]
        machines = Machines(self._names, self._places, self._forest, {*self._links, *bases},
                            self._is_moment, self._states)
        by_name = {it.name: it for it in self._draft.devices}
        for first, inside in by_namespace(topics).items():
            device = (owners.get(first) if first else None) or by_name.get(first)
            if device is None:
                device = DraftDevice('other', self._names.device('other', first or ROOT_DEVICE))
                self._add(device)
            machines.add_topics(device, inside)


def _add_joint_comments(device: DraftDevice, group: RobotGroup,
                        groups: Sequence[RobotGroup]) -> None:
    """Add comments on joints that are only on the robot's topic, or only in its model."""
    topic, model = group.joint_topic, group.model
    if model is None or not topic.joints:
        return
    models = [other.model for other in groups
              if other.joint_topic is topic and other.model is not None]
    drawn = {f'{shown.joint_prefix}{joint.get("name")}' for shown in models
             for joint in ElementTree.fromstring(shown.description.text).findall('joint')}
    left = [joint for joint in topic.joints if joint not in drawn]
    if left:
        device.comments.append(f'{topic.name} has joints that the model lacks, and that are not '
                               f'drawn: {", ".join(left)}.')
    others = {joint for other in group.other_joint_topics for joint in other.joints}
    silent = sorted(model.joints - set(topic.joints) - others)
    if silent:
        device.comments.append(f'The model of {device.name} has joints that are not on '
                               f'{topic.name}, and stay where they are: {", ".join(silent)}.')


def _first(name: str) -> str:
    return name.strip('/').partition('/')[0]


def _prefixes(models: Sequence[FoundModel], frames: Set[str]) -> List[str]:
    """Return a prefix for each model that makes all link names unique, as on tf if possible."""
    taken: Set[str] = set()
    prefixes = []
    for number, model in enumerate(models):
        links = model.description.links
        own = model.namespace.strip('/').rpartition('/')[2] or model.name
        root = model.description.root_link
        names = sorted(('', *_prefix_names(own, number)), key=lambda it: it + root not in frames)
        for prefix in (model.prefix or names[0], *names):
            if is_frame(prefix or 'a') and not taken & {prefix + link for link in links}:
                break
        prefixes.append(prefix)
        taken |= {prefix + link for link in links}
    return prefixes


def _prefix_names(own: str, number: int) -> Tuple[str, ...]:
    return f'{own}/', f'{own}_{number + 1}/', f'robot_{number + 1}/', f'model_{number + 1}_/'


def _left_out(seen: Seen) -> List[str]:
    names = [it.name for it in device_topics(seen.topics) if not is_topic(it.name)]
    return [f'Left out, as a configuration cannot name them: {", ".join(names)}.'] if names else []
