# SPDX-License-Identifier: BSD-3-Clause
"""Builds the model of the cell from the elements of a file."""
from __future__ import annotations

import os
from typing import Any, Dict, Iterable, Optional, Tuple, cast

from process_visualizer.cell.element_reader import Parsed
from process_visualizer.cell.elements import CONDITIONS
from process_visualizer.cell.errors import nearest
from process_visualizer.cell.model import (
    Arrow,
    BaseFrame,
    ColorScale,
    Device,
    DeviceType,
    Display,
    ForceFrame,
    Fusion,
    LaunchFile,
    Mode,
    Model,
    Node,
    Pose,
    ProcessEvent,
    ProcessPhase,
    Property,
    RegionOfInterest,
    RoslaunchElement,
    RunSpan,
    SoughtObjects,
    Tool,
    Topic,
    TopicFunction,
    Variable,
    Vector3,
    WarningLimits,
)

_ROSLAUNCH_NODE_ATTRIBUTES = ('args', 'machine', 'respawn', 'respawn_delay', 'required',
                              'launch-prefix', 'clear_params', 'cwd')


def build_device(parsed: Parsed, global_frame: str) -> Device:
    """Return the device of a ``<device>`` element, guessing a wrong type or a missing name."""
    name = parsed.values['name'] or str(parsed.location)
    return Device(
        type=_device_type(parsed),
        name=name,
        location=parsed.location,
        base=_base(parsed.first('base')),
        model=_model(parsed.first('model')),
        tool=_tool(parsed.first('tool')),
        force=_force(parsed.first('force')),
        roi=_roi(parsed.first('roi'), global_frame),
        fusion=_fusion(parsed.first('fusion')),
        objects=_objects(parsed.first('objects'), global_frame),
        nodes=tuple(_node(child, name) for child in parsed.all('node')),
        launch_files=tuple(_launch_file(child) for child in parsed.all('launch')),
        topics=tuple(_topic(child) for child in parsed.all('topic')),
        displays=tuple(_display(child) for child in parsed.all('rviz')),
        arrows=tuple(_arrow(child) for child in parsed.all('arrow')),
        variables=tuple(_variable(child) for child in parsed.all('variable')),
        parameters=tuple(build_roslaunch_element(child) for child in parsed.children
                         if child.tag in ('param', 'rosparam')),
        machine=parsed.values['machine'] or '',
    )


def _device_type(parsed: Parsed) -> DeviceType:
    """Return the type of a device; if it is wrong, the type that was probably meant."""
    types = [one.value for one in DeviceType]
    found = parsed.values['type'] or nearest(parsed.given.get('type', ''), types)
    return DeviceType(found or DeviceType.OTHER.value)


def build_roslaunch_element(parsed: Parsed) -> RoslaunchElement:
    """Return an element for roslaunch, with its substitution arguments resolved."""
    attributes = {name: text for name, text in parsed.given.items() if name not in CONDITIONS}
    return RoslaunchElement(parsed.tag, attributes, parsed.text, parsed.location)


def _pose(values: Dict[str, Any]) -> Pose:
    return Pose(values['xyz'], values['ypr'] or values['rpy'])


def _base(parsed: Optional[Parsed]) -> Optional[BaseFrame]:
    if parsed is None:
        return None
    return BaseFrame(parsed.values['frame'], _pose(parsed.values), parsed.location)


def _model(parsed: Optional[Parsed]) -> Optional[Model]:
    if parsed is None:
        return None
    values = parsed.values
    package, path = values['pkg'] or '', values['path']
    if not package:
        folder = os.path.dirname(os.path.abspath(parsed.location.file))
        path = os.path.normpath(os.path.join(folder, path))
    return Model(package, path, parsed.location, _passed_arguments(parsed),
                 values['prefix'] or '')


def _tool(parsed: Optional[Parsed]) -> Optional[Tool]:
    if parsed is None:
        return None
    return Tool(parsed.values['frame'], _pose(parsed.values), parsed.location)


def _force(parsed: Optional[Parsed]) -> Optional[ForceFrame]:
    if parsed is None:
        return None
    values = parsed.values
    return ForceFrame(values['parentframe'], values['frame'], _pose(values), parsed.location)


def _roi(parsed: Optional[Parsed], global_frame: str) -> Optional[RegionOfInterest]:
    if parsed is None:
        return None
    values = parsed.values
    return RegionOfInterest(values['frame'] or global_frame, values['xyz'], values['size'],
                            parsed.location)


def _fusion(parsed: Optional[Parsed]) -> Optional[Fusion]:
    if parsed is None:
        return None
    values = parsed.values
    return Fusion(values['sensors'] or (), values['voxel'], values['timeout'], parsed.location)


def _objects(parsed: Optional[Parsed], global_frame: str) -> Optional[SoughtObjects]:
    if parsed is None:
        return None
    values = parsed.values
    expected = (_roi(child, global_frame) for child in parsed.all('expected'))
    return SoughtObjects(
        values['warn'], values['stop'], values['padding'], values['surface'],
        None if values['topic'] is None else absolute_topic('', values['topic']),
        None if values['size'] is None else _roi(parsed, global_frame),
        tuple(box for box in expected if box is not None), parsed.location, values['noise'])


def _mode(text: Optional[str]) -> Optional[Mode]:
    return None if text is None else Mode(text)


def _node(parsed: Parsed, device_name: str) -> Node:
    values = parsed.values
    attributes = {name: parsed.given[name] for name in _ROSLAUNCH_NODE_ATTRIBUTES
                  if name in parsed.given and name not in parsed.wrong}
    attributes.update({name: values[name] for name in ('args', 'launch-prefix', 'output')
                       if values[name] is not None})
    namespace = values['ns'] if values['ns'] is not None else device_name
    return Node(values['pkg'], values['type'], values['name'], namespace,
                _mode(values['ifstate']), attributes,
                tuple(build_roslaunch_element(child) for child in parsed.children if child.sound),
                parsed.location)


def _launch_file(parsed: Parsed) -> LaunchFile:
    values = parsed.values
    return LaunchFile(values['pkg'], values['type'], _mode(values['ifstate']),
                      _passed_arguments(parsed), parsed.location)


def _passed_arguments(parsed: Parsed) -> Tuple[Tuple[str, str], ...]:
    return tuple((child.values['name'], child.values['value']) for child in parsed.all('arg'))


def absolute_topic(namespace: str, name: str) -> str:
    """Return the absolute name of a topic in a namespace."""
    return '/' + '/'.join(part.strip('/') for part in (namespace, name) if part.strip('/'))


def _topic(parsed: Parsed) -> Topic:
    values = parsed.values
    function = None if values['type'] is None else TopicFunction(values['type'])
    return Topic(absolute_topic(values['ns'], values['name']), function, values['msg'],
                 values['record'], parsed.location, values['frame'], values['parentframe'],
                 values['latency'])


def _display(parsed: Parsed) -> Display:
    values = parsed.values
    topic = values['topic']
    return Display(values['type'], values['name'],
                   None if topic is None else absolute_topic('', topic), _properties(parsed),
                   tuple(_display(child) for child in parsed.all('rviz')), parsed.location)


def _properties(parsed: Parsed) -> Tuple[Property, ...]:
    return tuple(Property(child.values['name'], child.values['value'], _properties(child),
                          child.location)
                 for child in parsed.all('property'))


def _arrow(parsed: Parsed) -> Arrow:
    values = parsed.values
    return Arrow(values['quantity'], values['scale'], values['min'], values['max'],
                 values['color'], parsed.location, values['tolerance'], values['max_tolerance'])


def _variable(parsed: Parsed) -> Variable:
    values = parsed.values
    label = values['label']
    if label is None:
        label = values['topic'].split('/')[-1]
    return Variable(absolute_topic('', values['topic']), values['field'], values['frame'],
                    cast(Vector3, values['axis']), values['color'], values['unit'],
                    values['scale'], values['offset'], label, parsed.location,
                    values['offset_param'], _limits(values), _color_scale(values), values['max'],
                    values['shown'], values['tolerance'],
                    tuple((it.values['of'], it.values['name']) for it in parsed.all('value')
                          if it.complete), values['max_tolerance'])


def _limits(values: Dict[str, Any]) -> Optional[WarningLimits]:
    if values['low'] is None and values['high'] is None:
        return None
    return WarningLimits(values['low'], values['high'], values['warning_color'])


def _color_scale(values: Dict[str, Any]) -> Optional[ColorScale]:
    ends = values['color_begin'], values['color_end'], values['end_color']
    return None if None in ends else ColorScale(*ends)


def build_event(parsed: Parsed) -> ProcessEvent:
    """Return the event of an ``<event>`` element."""
    values = parsed.values
    is_above = values['above'] is not None
    return ProcessEvent(values['name'], absolute_topic('', values['topic']), values['field'],
                        values['above'] if is_above else values['below'], is_above,
                        values['hysteresis'], parsed.location, values['for'])


def build_run(parsed: Parsed) -> RunSpan:
    """Return the definition of a run in a ``<run>`` element."""
    values = parsed.values
    return RunSpan(values['begin'], values['end'], values['before'], values['after'],
                   parsed.location, values['shortest'], values['group'] or '',
                   values['place'] or '')


def build_phase(parsed: Parsed) -> ProcessPhase:
    """Return the phase of a ``<phase>`` element."""
    values = parsed.values
    return ProcessPhase(
        values['name'], values['from'], values['to'], values['wait'], parsed.location
    )


def build_machines(machines: Iterable[Parsed]) -> Tuple[RoslaunchElement, ...]:
    """Return the valid ``<machine>`` elements of a configuration."""
    return tuple(build_roslaunch_element(machine) for machine in machines if machine.sound)
