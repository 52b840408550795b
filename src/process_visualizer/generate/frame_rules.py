# SPDX-License-Identifier: BSD-3-Clause
"""Checks of the frames of a cell, given the links of its models."""
from __future__ import annotations

from typing import Dict, Iterable, Iterator, List, Mapping, NamedTuple, Set, Tuple
from xml.etree import ElementTree

from process_visualizer.cell.errors import Location, Problem, nearest
from process_visualizer.cell.model import (
    Cell,
    Device,
    DeviceType,
    Display,
    TopicFunction,
)
from process_visualizer.generate.processor_nodes import fixed_frames
from process_visualizer.robot.description import RobotDescription
from process_visualizer.robot.tool_frame import tool_frame

_FRAME_PROPERTIES = ('Reference Frame', 'Target Frame')
_FIXED_FRAME = '<Fixed Frame>'


class _Use(NamedTuple):
    frame: str
    location: Location
    element: str


def frame_problems(devices: Iterable[Device],
                   descriptions: Mapping[str, RobotDescription]) -> List[Problem]:
    """Return a problem for each placed frame that is already a link of a model."""
    owners = {link: name for name, description in descriptions.items()
              for link in description.parents}
    return [Problem(place.location, place.element,
                    f'the frame "{place.frame}" is a link of the model of "{owners[place.frame]}", '
                    'which determines its place; choose another name')
            for place in _placed(devices) if place.frame in owners]


def frame_warnings(cell: Cell, descriptions: Mapping[str, RobotDescription],
                   published: Iterable[str]) -> List[Problem]:
    """Return a warning for each unknown frame in use; only a driver could publish it on tf.

    ``published`` are further known frames. Nothing is reported unless every model can be read.
    """
    if any(device.model is not None and device.name not in descriptions for device in cell.devices):
        return []
    known = _known_frames(cell, descriptions) | set(published)
    joints = _joints(descriptions.values())
    return [Problem(use.location, use.element, _advice(use.frame, known, joints))
            for device in cell.devices for use in _uses(device) if use.frame not in known]


def joint_warnings(devices: Iterable[Device],
                   descriptions: Mapping[str, RobotDescription]) -> List[Problem]:
    """Return a warning for each robot whose model has joints, but no topic that moves them."""
    return [Problem(device.location, 'device',
                    f'no topic of "{device.name}" has the type "joint_states", so its model does '
                    'not move; add a <topic name="…" type="joint_states" /> for the topic that '
                    'its driver publishes')
            for device in devices
            if device.type is DeviceType.ROBOT and device.name in descriptions
            and descriptions[device.name].joints
            and device.topic_for(TopicFunction.JOINT_STATES) is None]


def _placed(devices: Iterable[Device]) -> Iterator[_Use]:
    for device in devices:
        if device.base is not None:
            yield _Use(device.base.frame, device.base.location, 'base')
        if device.force is not None:
            yield _Use(device.force.frame, device.force.location, 'force')


def _known_frames(cell: Cell, descriptions: Mapping[str, RobotDescription]) -> Set[str]:
    placed = fixed_frames(cell, cell.devices)
    links = {link for description in descriptions.values() for link in description.links}
    bare = {tool_frame(device, None).frame for device in cell.devices  # a robot without a model
            if device.type is DeviceType.ROBOT and device.model is None and device.tool is None}
    in_tf = {topic.frame for device in cell.devices for topic in device.topics
             if topic.frame is not None}  # the driver publishes it with that topic
    return {cell.frame, *links, *bare, *in_tf, *(frame.child for frame in placed)}


def _uses(device: Device) -> Iterator[_Use]:
    """Yield the frames to which a device's elements refer, except those that they place."""
    if device.tool is not None:
        yield _Use(device.tool.frame, device.tool.location, 'tool')
    if device.force is not None:
        yield _Use(device.force.parent_frame, device.force.location, 'force')
    if device.roi is not None:
        yield _Use(device.roi.frame, device.roi.location, 'roi')
    if device.objects is not None:
        if device.objects.region is not None:
            yield _Use(device.objects.region.frame, device.objects.location, 'objects')
        for box in device.objects.expected:
            yield _Use(box.frame, box.location, 'expected')
    for topic in device.topics:
        for frame in (topic.frame, topic.parent_frame):
            if frame is not None:
                yield _Use(frame, topic.location, 'topic')
    for variable in device.variables:
        yield _Use(variable.frame, variable.location, 'variable')
    for display in device.displays:
        yield from _display_uses(display)


def _display_uses(display: Display) -> Iterator[_Use]:
    for item in display.properties:
        if item.name in _FRAME_PROPERTIES and item.value not in (None, '', _FIXED_FRAME):
            yield _Use((item.value or '').lstrip('/'), item.location or display.location,
                       'property')
    for child in display.children:
        yield from _display_uses(child)


def _joints(descriptions: Iterable[RobotDescription]) -> Dict[str, str]:
    """Return the link that each joint moves."""
    found: Dict[str, str] = {}
    for description in descriptions:
        for joint in ElementTree.fromstring(description.text).findall('joint'):
            child = joint.find('child')
            if child is not None:
                found[joint.get('name', '')] = child.get('link', '')
    return found


def _advice(frame: str, known: Set[str], joints: Mapping[str, str]) -> str:
    if frame in joints:
        return f'"{frame}" is a joint, not a frame; did you mean its link "{joints[frame]}"?'
    meant = _likely_name(frame, known)
    text = f'no model, <base>, <tool> or <force> has the frame "{frame}"'
    return f'{text}; ' + (f'did you mean "{meant}"?' if meant is not None else
                          'it is not shown unless a driver publishes the frame in tf')


def _likely_name(frame: str, known: Set[str]) -> 'str | None':
    """Return the same name with another prefix, or else the most similar name."""
    word = frame.split('/')[-1]
    same_ending = sorted(name for name in known if name.endswith(('/' + word, '_' + word)))
    return same_ending[0] if same_ending else nearest(frame, known)


def static_frames(words: Iterable[Tuple[str, str, str]]) -> Set[str]:
    """Return the frames of static_transform_publishers, given package, type and arguments."""
    found: Set[str] = set()
    for package, kind, arguments in words:
        if package in ('tf', 'tf2_ros') and kind == 'static_transform_publisher':
            found |= {word.lstrip('/') for word in arguments.split() if not _is_number(word)}
    return found


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True
