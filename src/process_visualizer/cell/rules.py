# SPDX-License-Identifier: BSD-3-Clause
"""Checks rules that involve several elements of a configuration, such as unique names."""
from __future__ import annotations

from typing import Callable, Dict, Iterable, List, Optional, Sequence, Set, Tuple

import yaml

from process_visualizer.cell.arguments import passed_arguments
from process_visualizer.cell.builder import absolute_topic
from process_visualizer.cell.element_reader import Parsed
from process_visualizer.cell.elements import DISPLAY_TYPES, MESSAGE_TYPES
from process_visualizer.cell.errors import (
    Location,
    ProblemList,
    advice,
    nearest,
    quoted,
    root_as_global_frame,
    shortened,
)
from process_visualizer.cell.model import (
    IMAGE_FUNCTIONS,
    ROBOT_FUNCTIONS,
    Device,
    DeviceType,
    Display,
    Fusion,
    Node,
    Property,
    RoslaunchElement,
    Topic,
    TopicFunction,
)
from process_visualizer.cell.outputs import outputs
from process_visualizer.cell.stored_configuration import MODEL_ENDINGS
from process_visualizer.cell.values import boolean, number, path_below, plain_yaml
from process_visualizer.ros_names import (
    BAG_PLAYER,
    BAG_RECORDER,
    CELL_FRAMES,
    DEPTH_PROC,
    FUSION,
    GHOST,
    JOINT_PROC,
    NAMED_JOINTS,
    OBJECT_FINDER,
    PACKAGE,
    ROBOT_PROC,
    ROBOT_STATE_PUBLISHER,
    ROI_FILTER,
    RVIZ,
    SCENE_WATCH,
    TF_MESSAGE,
    VARIABLE_PROC,
    VIEW_RELAY,
)

MAX_LATENCY_S = 0.5  # a corrected stamp stays within the maximum age of 1 s


def check_display(display: Display, problems: ProblemList) -> None:
    """Check that type, topic, properties and children of a display are consistent."""
    display_type = DISPLAY_TYPES[display.type]
    what = f'a display of type "{display.type}"'
    if display_type.needs_topic and display.topic is None:
        problems.add(display.location, 'rviz', f'{what} needs the attribute "topic" '
                                               f'({display_type.message_type})')
    if display_type.topic_key is None and display.topic is not None:
        problems.add(display.location, 'rviz', f'{what} shows no topic; remove the attribute '
                                               '"topic"')
    if display.children and display.type != 'Group':
        problems.add(display.location, 'rviz', f'{what} cannot hold others; only "Group" can')
    _check_properties(display, display.properties, problems)
    for child in display.children:
        check_display(child, problems)


def _check_properties(display: Display, properties: Sequence[Property],
                      problems: ProblemList) -> None:
    names: Set[str] = set()
    for item in properties:
        where = item.location or display.location
        if item.name in names:
            problems.add(where, 'property', f'the property "{item.name}" is given twice; keep one')
        if item.value is None and not item.children:
            problems.add(where, 'property', 'has neither a value nor properties below it; give '
                                            'the attribute "value"')
        names.add(item.name)
        _check_properties(display, item.children, problems)


# Rules for elements passed on to roslaunch, which would reject them only at the launch.

_VALUE_TYPES: Dict[str, Tuple[Callable[[str], object], str]] = {
    'int': (int, 'a whole number'),
    'double': (number, 'a number'),
    'bool': (boolean, 'True or False'),
    'boolean': (boolean, 'True or False'),
}


def check_machines(machines: Iterable[Parsed], devices: Iterable[Parsed],
                   problems: ProblemList) -> None:
    """Check that machine names are unique, and that every machine used is declared.

    A password is refused, as it would appear in launch files, parameters and recordings.
    """
    names: List[str] = []
    for machine in machines:
        name = machine.values['name']
        if 'password' in machine.given:
            problems.add(machine.location, 'machine', _no_password(machine))
        if name in names:
            problems.add(machine.location, 'machine', f'a machine named {quoted(name)} already '
                                                      'exists; choose another name')
        names += [name] if name else []
    for user in (element for device in devices for element in (device, *device.all('node'))):
        name = user.values['machine']
        if name and name not in names:
            problems.add(user.location, user.tag, f'there is no machine {quoted(name)}; '
                         + (advice(name, names) if names else 'no <machine> is declared'))


def _no_password(machine: Parsed) -> str:
    user, address = machine.values['user'], machine.values['address']
    whom = f'{user}@{address}' if user and address else 'USER@ADDRESS'
    return ('the attribute "password" is not accepted: it would be visible in launch files, '
            f'parameters and recordings; remove it, and let SSH use a key ("ssh-copy-id {whom}", '
            'with an agent: "ssh-add")')


def check_node(node: Node, problems: ProblemList) -> None:
    """Check that the attributes of a node are consistent, and check its parameters."""
    if all(boolean(node.attributes.get(name, 'False')) for name in ('respawn', 'required')):
        problems.add(node.location, 'node', '"respawn" and "required" cannot both be True; '
                                            'keep one')
    for child in node.children:
        check_parameter(child, problems)


def check_parameter(element: RoslaunchElement, problems: ProblemList) -> None:
    """Check that the value of a ``<param>`` fits its type, and that a ``<rosparam>`` is YAML."""
    if element.tag == 'param':
        _check_param(element, problems)
    elif element.tag == 'rosparam':
        _check_rosparam(element, problems)


def _check_param(element: RoslaunchElement, problems: ProblemList) -> None:
    value, value_type = (element.attributes.get(name) for name in ('value', 'type'))
    if value is None or value_type not in (*_VALUE_TYPES, 'yaml'):
        return
    if value_type == 'yaml':
        _check_yaml(value, element, problems)
        return
    convert, what = _VALUE_TYPES[value_type]
    try:
        convert(value)
    except ValueError:
        problems.add(element.location, 'param', f'{quoted(value)} is not {what}, which the type '
                                                f'"{value_type}" requires')


def _check_rosparam(element: RoslaunchElement, problems: ProblemList) -> None:
    command = element.attributes.get('command', 'load')
    file = element.attributes.get('file')
    if command == 'dump' and file is None:
        problems.add(element.location, 'rosparam', 'the attribute "file" is missing; dump writes '
                                                   'to a file')
    if command == 'delete' and file is not None:
        problems.add(element.location, 'rosparam', 'delete needs no file; remove the attribute '
                                                   '"file"')
    if command == 'load' and file is None:
        value = _check_yaml(element.text, element, problems)
        if not isinstance(value, (dict, type(None))) and 'param' not in element.attributes:
            problems.add(element.location, 'rosparam', 'the YAML is a single value; give the '
                                                       'attribute "param" to name it')


def _check_yaml(text: str, element: RoslaunchElement, problems: ProblemList) -> object:
    try:
        return plain_yaml(text)
    except yaml.MarkedYAMLError as error:
        reason = error.problem or 'not understood'
    except (yaml.YAMLError, ValueError) as error:
        reason = str(error)
    except RecursionError:
        reason = 'it is nested too deeply'
    problems.add(element.location, element.tag, f'not valid YAML: {shortened(reason)}')
    return None


_IMAGE_TYPES = ', '.join(f'"{function.value}"' for function in IMAGE_FUNCTIONS)
_PROGRAM_NODES = (PACKAGE, CELL_FRAMES, SCENE_WATCH, GHOST, BAG_PLAYER, BAG_RECORDER, RVIZ,
                  VIEW_RELAY, 'rosout')


def check_devices(parsed_devices: Sequence[Parsed], global_frame: str,
                  problems: ProblemList) -> None:
    """Check that names and frames are unique in the cell, and arguments in each ``<launch>``."""
    names = [(str(parsed.values['name']), parsed.location, 'device')
             for parsed in parsed_devices if parsed.values.get('name')]
    _report_duplicates(names, 'a device named "{}"', problems)
    frames = [(str(child.values['frame']), child.location, child.tag)
              for parsed in parsed_devices for child in parsed.children
              if child.tag in ('base', 'force') and child.values.get('frame')]
    _report_duplicates(frames, 'the frame "{}"', problems)
    for variable in (child for parsed in parsed_devices for child in parsed.all('variable')):
        _check_variable(variable, problems)
    for topic in (child for parsed in parsed_devices for child in parsed.all('topic')):
        _check_message_of_wrong_type(topic, problems)
    for launch in (child for parsed in parsed_devices for child in parsed.all('launch')):
        passed_arguments(launch, problems)
    for parsed in parsed_devices:
        for child in parsed.children:
            if child.tag in ('base', 'force') and child.values.get('frame') == global_frame:
                problems.add(child.location, child.tag, f'"{global_frame}" is the global frame; '
                             + _other_than_global(parsed, child))


def _other_than_global(device: Parsed, child: Parsed) -> str:
    name = device.values.get('name')
    if child.tag != 'base' or device.first('model') is None or not name:
        return 'choose another name'
    return ('choose another name; if it is the root link of the model, '
            + root_as_global_frame(str(name), str(child.values['frame'])))


def check_node_names(devices: Sequence[Device], problems: ProblemList) -> None:
    """Check that node names are unique in the whole system, for any choice of devices."""
    seen: Dict[str, List[Node]] = {}
    for device in devices:
        reserved = _reserved_names(device)
        for node in device.nodes:
            name = absolute_topic(node.namespace, node.name)
            if name in reserved:
                problems.add(node.location, 'node', f'the name "{name}" is used by the program '
                                                    'itself; choose another name')
            for other in seen.setdefault(name, []):
                if node.mode is None or other.mode is None or node.mode is other.mode:
                    problems.add(node.location, 'node', f'a node named "{name}" already exists '
                                                        f'({other.location}); choose another name')
                    break
            seen[name].append(node)


def _reserved_names(device: Device) -> List[str]:
    names = {
        ROBOT_STATE_PUBLISHER: device.model is not None,
        ROBOT_PROC: device.type is DeviceType.ROBOT,
        JOINT_PROC: device.type is DeviceType.ROBOT,
        DEPTH_PROC: device.type is DeviceType.DEPTH_SENSOR,
        ROI_FILTER: device.roi is not None,
        FUSION: device.fusion is not None,
        OBJECT_FINDER: device.objects is not None,
        VARIABLE_PROC: bool(device.variables),
    }
    own = [absolute_topic(device.name, name) for name, used in names.items() if used]
    return own + [f'/{name}' for name in _PROGRAM_NODES]


def check_device(device: Device, parsed: Parsed, problems: ProblemList) -> None:
    """Check that the elements of one device are consistent.

    Elements that could not be read have been reported already.
    """
    rules: List[Callable[[Device, ProblemList], None]] = [
        _check_model_path, _check_force, _check_topics, _check_arrows]
    if parsed.values['type'] is not None:
        rules += [_check_elements_of_type, _check_topics_of_type]
    if parsed.sound:
        rules += [_check_region, _check_objects]
    for rule in rules:
        rule(device, problems)
    for display in device.displays:
        check_display(display, problems)
    for node in device.nodes:
        check_node(node, problems)
    for element in device.parameters:
        check_parameter(element, problems)


def _report_duplicates(items: Iterable[Tuple[str, Location, str]], what: str,
                       problems: ProblemList) -> None:
    first: Dict[str, Location] = {}
    for name, location, element in items:
        if name in first:
            problems.add(location, element, what.format(name)
                         + f' already exists ({first[name]}); choose another name')
        first.setdefault(name, location)


def _check_elements_of_type(device: Device, problems: ProblemList) -> None:
    if device.type is not DeviceType.ROBOT:
        for element, found in (('tool', device.tool), ('force', device.force),
                               ('arrow', next(iter(device.arrows), None))):
            if found is not None:
                problems.add(found.location, element, 'belongs to robots only; this device has '
                                                      f'the type "{device.type.value}"')
    if device.type is not DeviceType.DEPTH_SENSOR:
        for element, region in (('roi', device.roi), ('objects', device.objects)):
            if region is not None:
                problems.add(region.location, element, 'belongs to depth sensors only; this device '
                                                       f'has the type "{device.type.value}"')


def _check_model_path(device: Device, problems: ProblemList) -> None:
    """Check that a package's model is inside the package, and that its file name is valid."""
    model = device.model
    if model is None:
        return
    if model.package:
        try:
            path_below(model.path)
        except ValueError as error:
            problems.add(model.location, 'model', f'attribute "path": {error}, or leave "pkg" out')
    if not model.path.endswith(MODEL_ENDINGS):
        problems.add(model.location, 'model', f'"{model.path}" is neither URDF nor xacro; name a '
                                              'file that ends in .urdf or .xacro')


def _check_force(device: Device, problems: ProblemList) -> None:
    force = device.force
    if force is not None and force.frame == force.parent_frame:
        problems.add(force.location, 'force', f'the frame "{force.frame}" is its own parent; '
                                              'choose another name')


def _check_region(device: Device, problems: ProblemList) -> None:
    if device.type is not DeviceType.DEPTH_SENSOR or device.has_images:
        return
    if device.roi is not None and not device.has_cloud:
        problems.add(device.roi.location, 'roi',
                     'there is no cloud to crop; give one <topic> the type "pointcloud", or give '
                     f'three the types {_IMAGE_TYPES}')
    for topic in device.topics:
        if topic.function in IMAGE_FUNCTIONS:
            problems.add(topic.location, 'topic',
                         'a cloud is made from images only with a <roi> and with topics of all '
                         f'three types {_IMAGE_TYPES}; add what is missing, or remove "type"')


def _check_objects(device: Device, problems: ProblemList) -> None:
    objects = device.objects
    if objects is None or device.type is not DeviceType.DEPTH_SENSOR:
        return
    if objects.topic is None and not device.has_cloud:
        problems.add(objects.location, 'objects',
                     'there is no cloud to look at; give one <topic> the type "pointcloud", or '
                     'name a cloud with "topic"')
    if objects.stop_m > objects.warn_m:
        problems.add(objects.location, 'objects', f'stop ({objects.stop_m}) is greater than warn '
                                                  f'({objects.warn_m}); swap them')


def _check_topics(device: Device, problems: ProblemList) -> None:
    _report_duplicates(((topic.name, topic.location, 'topic') for topic in device.topics),
                       'the topic "{}"', problems)
    with_function = [topic for topic in device.topics if topic.function is not None]
    _report_duplicates(((topic.function.value, topic.location, 'topic')
                        for topic in with_function if topic.function is not None
                        and topic not in _parts_of_joints(device)),
                       'a topic of type "{}"', problems)
    for topic in with_function:
        _check_topic_function(topic, problems)
    for topic in device.topics:
        _check_parent_frame(topic, problems)
        _check_latency(topic, problems)


def _parts_of_joints(device: Device) -> Tuple[Topic, ...]:
    """Return the topics with joints if there are several and their messages name the joints."""
    topics = device.topics_for(TopicFunction.JOINT_STATES)
    named = all(topic.message_type in (None, *NAMED_JOINTS) for topic in topics)
    return topics if named and len(topics) > 1 else ()


def _check_topics_of_type(device: Device, problems: ProblemList) -> None:
    for topic in device.topics:
        function = '' if topic.function is None else topic.function.value
        wanted = (DeviceType.ROBOT if topic.function in ROBOT_FUNCTIONS
                  else DeviceType.DEPTH_SENSOR)
        if function and device.type is not wanted:
            problems.add(topic.location, 'topic', f'type "{function}" belongs to devices of type '
                         f'"{wanted.value}"; this one has the type "{device.type.value}"')


def _check_message_of_wrong_type(topic: Parsed, problems: ProblemList) -> None:
    """Check that the message type suits the function that was probably meant."""
    given, message = topic.given.get('type'), topic.values['msg']
    meant = nearest(given or '', MESSAGE_TYPES)
    if topic.values['type'] is None and meant is not None and message is not None \
            and message not in MESSAGE_TYPES[meant]:
        problems.add(topic.location, 'topic', f'"{message}" cannot be read as {meant}; '
                     + advice(message, MESSAGE_TYPES[meant]))


def _check_parent_frame(topic: Topic, problems: ProblemList) -> None:
    functions = TopicFunction.TOOL_CENTER_FRAME, TopicFunction.FORCE_SENSOR
    if topic.parent_frame is not None \
            and (topic.function not in functions or topic.message_type == TF_MESSAGE):
        problems.add(topic.location, 'topic', 'attribute "parentframe" belongs to poses and forces '
                     f'(type "tool_center_frame" or "force_sensor") that are not {TF_MESSAGE}; '
                     'remove it')


def _check_latency(topic: Topic, problems: ProblemList) -> None:
    if topic.latency_s and topic.function not in ROBOT_FUNCTIONS:
        kinds = ', '.join(f'"{it.value}"' for it in ROBOT_FUNCTIONS)
        problems.add(topic.location, 'topic', f'attribute "latency" belongs to topics with one of '
                                              f'the types {kinds}; remove it')
    elif topic.latency_s > MAX_LATENCY_S:
        problems.add(topic.location, 'topic', f'a latency of {topic.latency_s:g} s is too long; '
                     f'give at most {MAX_LATENCY_S:g} s')


def _check_topic_function(topic: Topic, problems: ProblemList) -> None:
    if topic.function is None:
        return
    function = topic.function.value
    possible = MESSAGE_TYPES[function]
    if topic.message_type is not None and topic.message_type not in possible:
        problems.add(topic.location, 'topic', f'"{topic.message_type}" cannot be read as '
                     f'{function}; ' + advice(topic.message_type, possible))
    if topic.frame is not None and topic.message_type != TF_MESSAGE:
        problems.add(topic.location, 'topic', f'attribute "frame" belongs to msg="{TF_MESSAGE}"; '
                                              'remove it, or say what the topic carries')


def _check_arrows(device: Device, problems: ProblemList) -> None:
    _report_duplicates(((arrow.quantity, arrow.location, 'arrow') for arrow in device.arrows),
                       'an arrow for "{}"', problems)
    for arrow in device.arrows:
        if arrow.minimum_m is not None and arrow.maximum_m is not None \
                and arrow.minimum_m > arrow.maximum_m:
            problems.add(arrow.location, 'arrow', f'min ({arrow.minimum_m}) is greater than max '
                                                  f'({arrow.maximum_m}); swap them')
        _check_tolerances(arrow.tolerance, arrow.max_tolerance, arrow.location, 'arrow', problems)


def _check_variable(parsed: Parsed, problems: ProblemList) -> None:
    """Check attributes of a ``<variable>`` that depend on each other."""
    values = parsed.values
    scale = {name: values.get(name) for name in ('color_begin', 'color_end', 'end_color')}
    missing = [name for name in scale if name not in parsed.given]
    if 0 < len(missing) < len(scale):
        problems.add(parsed.location, 'variable', 'a color scale needs color_begin, color_end '
                     f'and end_color; {" and ".join(missing)} is missing')
    if scale['color_begin'] is not None and scale['color_begin'] == scale['color_end']:
        problems.add(parsed.location, 'variable', 'color_begin and color_end are the same value; '
                                                  'write two different ones')
    low, high = values.get('low'), values.get('high')
    if low is not None and high is not None and low > high:
        problems.add(parsed.location, 'variable', f'low ({low}) is greater than high ({high}); '
                                                  'swap them')
    _check_tolerances(values.get('tolerance'), values.get('max_tolerance'), parsed.location,
                      'variable', problems)


def _check_tolerances(least: Optional[float], most: Optional[float], location: Location,
                      element: str, problems: ProblemList) -> None:
    if least is not None and most is not None and least > most:
        problems.add(location, element, f'tolerance ({least}) is greater than max_tolerance '
                                        f'({most}); swap them')


# Rules for the events of the process and the definition of a run.

def check_run(events: Sequence[Parsed], runs: Sequence[Parsed], phases: Sequence[Parsed],
              problems: ProblemList) -> None:
    """Report events with the same name, a second run, and misspelled events in runs and phases.

    An unknown name is not a problem in itself: a run may begin or end at a mark, and only a
    recording knows the labels of marks.
    """
    first: Dict[str, Location] = {}
    for event in events:
        name = event.values.get('name')
        if name in first:
            problems.add(event.location, 'event', f'an event named "{name}" already exists '
                                                  f'({first[name]}); choose another name')
        elif name:
            first[name] = event.location
    for run in runs[1:]:
        if run.location.file != runs[0].location.file:  # otherwise it has been reported
            problems.add(run.location, 'run', f'occurs more than once ({runs[0].location}); '
                                              'keep one')
    for run in runs:
        for end in ('begin', 'end'):
            _check_name(run, end, first, problems)
    for phase in phases:
        for end in ('from', 'to'):
            _check_name(phase, end, first, problems)


def check_event_topics(events: Sequence[Parsed], devices: Sequence[Device],
                       problems: ProblemList) -> None:
    """Report events on topics that are not recorded."""
    recorded = {topic.name for device in devices for topic in device.topics if topic.record}
    for event in events:
        topic = event.values.get('topic')
        if topic and absolute_topic('', topic) not in recorded:
            problems.add(event.location, 'event', f'the topic "{topic}" is not recorded; add it to '
                                                  'its device with <topic>')


def _check_name(run: Parsed, end: str, names: Dict[str, Location], problems: ProblemList) -> None:
    given = run.values.get(end)
    if given and given not in names:
        meant = nearest(given, names)
        if meant is not None:
            problems.add(run.location, run.tag, f'attribute "{end}": there is no event "{given}"; '
                                              f'did you mean "{meant}"?')


_DATA = (TopicFunction.POINTCLOUD, TopicFunction.DEPTH_IMAGE)


def check_sensors(devices: Sequence[Device], problems: ProblemList) -> None:
    """Check that each depth sensor has its own topics, and that fusions join only clouds."""
    _check_own_data(devices, problems)
    for device in devices:
        if device.fusion is not None:
            _check_fusion(device, device.fusion, devices, problems)


def _check_own_data(devices: Sequence[Device], problems: ProblemList) -> None:
    """Report sensors that share a topic: the data of both would be mixed in each display."""
    owners: Dict[str, Device] = {}
    for device in devices:
        for topic in device.topics:
            owner = owners.setdefault(topic.name, device) if topic.function in _DATA else device
            if owner is not device:
                problems.add(topic.location, 'topic',
                             f'"{topic.name}" belongs to the depth sensor "{owner.name}" already '
                             f'({owner.location}); start each driver in a namespace of its own, '
                             'and name the topic there')


def _check_fusion(device: Device, fusion: Fusion, devices: Sequence[Device],
                  problems: ProblemList) -> None:
    if device.type is not DeviceType.DEPTH_SENSOR:
        problems.add(fusion.location, 'fusion', 'belongs to depth sensors only; this device has '
                                                f'the type "{device.type.value}"')
    if device.roi is not None or any(topic.function is not None for topic in device.topics):
        problems.add(fusion.location, 'fusion', 'the device has a cloud of its own; give the '
                                                'joined cloud a device of its own')
    clouds = [other.name for other in devices if other.fusion is None and other.has_cloud]
    for name in fusion.sensors:
        if name not in clouds:
            expected = advice(name, clouds) if clouds else 'describe the sensors as devices'
            problems.add(fusion.location, 'fusion', f'there is no depth sensor "{name}" with a '
                                                    f'cloud; {expected}')


def check_outputs(devices: Sequence[Device], problems: ProblemList) -> None:
    """Report topics that the program publishes: nodes would take their own messages for a driver's.

    Such topics are not recorded either: in playback the nodes compute them again.
    """
    owners = outputs(devices)
    for device in devices:
        for topic in device.topics:
            owner = owners.get(topic.name)
            if owner is not None:
                problems.add(topic.location, 'topic', f'"{topic.name}" is published by the '
                                                      f'program itself for the device "{owner}"; '
                                                      'name the topic of its driver, or rename '
                                                      'the device if that topic has this name')
