"""Rules that concern several elements of a configuration at once."""
from __future__ import annotations

from typing import Callable, Dict, Iterable, List, Sequence, Tuple

from process_visualizer.cell.displays import DISPLAY_TYPES
from process_visualizer.cell.element_reader import Parsed
from process_visualizer.cell.errors import Location, ProblemList
from process_visualizer.cell.language import MESSAGE_TYPES
from process_visualizer.cell.model import Device, DeviceType, Display, Topic
from process_visualizer.cell.suggestions import advice

_ROBOT_TOPICS = ('joint_states', 'tool_center_frame', 'force_sensor')
_GENERATED_NODES = {
    DeviceType.ROBOT: ('robot_proc', 'robot_state_publisher'),
    DeviceType.DEPTH_SENSOR: ('depth_proc',),
    DeviceType.OTHER: (),
}


def check_devices(parsed_devices: Sequence[Parsed], global_frame: str,
                  problems: ProblemList) -> None:
    """Names and frames that must be unique among all devices."""
    names = [(str(parsed.values['name']), parsed.location, 'device')
             for parsed in parsed_devices if parsed.values.get('name')]
    _report_duplicates(names, 'a device named "{}"', problems)
    frames = [(str(child.values['frame']), child.location, child.tag)
              for parsed in parsed_devices for child in parsed.children
              if child.tag in ('base', 'force') and child.values.get('frame')]
    _report_duplicates(frames, 'the frame "{}"', problems)
    for frame, location, tag in frames:
        if frame == global_frame:
            problems.add(location, tag, f'"{frame}" is the global frame; choose another name')


def check_device(device: Device, problems: ProblemList) -> None:
    """Everything that must fit together within one device."""
    rules: Tuple[Callable[[Device, ProblemList], None], ...] = (
        _check_elements_of_type, _check_model_file_name, _check_node_names, _check_topics,
        _check_arrows)
    for rule in rules:
        rule(device, problems)
    for display in device.displays:
        _check_display(display, problems)


def _report_duplicates(items: Iterable[Tuple[str, Location, str]], what: str,
                       problems: ProblemList) -> None:
    first: Dict[str, Location] = {}
    for name, location, element in items:
        if name in first:
            problems.add(location, element, what.format(name)
                         + f' exists already ({first[name]}); choose another name')
        first.setdefault(name, location)


def _check_elements_of_type(device: Device, problems: ProblemList) -> None:
    if device.type is not DeviceType.ROBOT:
        for element, found in (('force', device.force), ('arrow', next(iter(device.arrows), None))):
            if found is not None:
                problems.add(found.location, element, 'belongs to robots only; this device has '
                                                      f'the type "{device.type.value}"')
    if device.type is not DeviceType.DEPTH_SENSOR and device.roi is not None:
        problems.add(device.roi.location, 'roi', 'belongs to depth sensors only; this device has '
                                                 f'the type "{device.type.value}"')


def _check_model_file_name(device: Device, problems: ProblemList) -> None:
    model = device.model
    if model is not None and not model.path.endswith(('.urdf', '.xacro')):
        problems.add(model.location, 'model', f'"{model.path}" is neither URDF nor xacro; name a '
                                              'file that ends in .urdf or .xacro')


def _check_node_names(device: Device, problems: ProblemList) -> None:
    seen: Dict[Tuple[str, str], List[object]] = {}
    for node in device.nodes:
        key = (node.namespace, node.name)
        modes = seen.setdefault(key, [])
        if any(mode is None or node.mode is None or mode is node.mode for mode in modes):
            problems.add(node.location, 'node', f'a node named "{node.name}" exists already in '
                                                'this device; choose another name')
        if node.namespace == device.name and node.name in _GENERATED_NODES[device.type]:
            problems.add(node.location, 'node', f'the name "{node.name}" is used by the program '
                                                'itself; choose another name')
        modes.append(node.mode)


def _check_topics(device: Device, problems: ProblemList) -> None:
    _report_duplicates(((topic.name, topic.location, 'topic') for topic in device.topics),
                       'the topic "{}"', problems)
    with_function = [topic for topic in device.topics if topic.function is not None]
    _report_duplicates(((topic.function.value, topic.location, 'topic')
                        for topic in with_function if topic.function is not None),
                       'a topic of type "{}"', problems)
    for topic in with_function:
        _check_topic_function(topic, device, problems)


def _check_topic_function(topic: Topic, device: Device, problems: ProblemList) -> None:
    if topic.function is None:
        return
    function = topic.function.value
    wanted = DeviceType.ROBOT if function in _ROBOT_TOPICS else DeviceType.DEPTH_SENSOR
    if device.type is not wanted:
        problems.add(topic.location, 'topic', f'type "{function}" belongs to devices of type '
                     f'"{wanted.value}"; this one has the type "{device.type.value}"')
    possible = MESSAGE_TYPES[function]
    if topic.message_type is not None and topic.message_type not in possible:
        problems.add(topic.location, 'topic', f'"{topic.message_type}" cannot be read as '
                     f'{function}; ' + advice(topic.message_type, possible))


def _check_arrows(device: Device, problems: ProblemList) -> None:
    _report_duplicates(((arrow.quantity, arrow.location, 'arrow') for arrow in device.arrows),
                       'an arrow for "{}"', problems)
    for arrow in device.arrows:
        if arrow.minimum_m is not None and arrow.maximum_m is not None \
                and arrow.minimum_m > arrow.maximum_m:
            problems.add(arrow.location, 'arrow', f'min ({arrow.minimum_m}) is greater than max '
                                                  f'({arrow.maximum_m}); exchange them')


def _check_display(display: Display, problems: ProblemList) -> None:
    display_type = DISPLAY_TYPES[display.type]
    if display_type.needs_topic and display.topic is None:
        problems.add(display.location, 'rviz', f'a display of type "{display.type}" needs the '
                     f'attribute "topic" ({display_type.message_type})')
    if display_type.topic_key is None and display.topic is not None:
        problems.add(display.location, 'rviz', f'a display of type "{display.type}" shows no '
                                               'topic; remove the attribute "topic"')
    if display.children and display.type != 'Group':
        problems.add(display.location, 'rviz', 'only a display of type "Group" can hold others')
    for child in display.children:
        _check_display(child, problems)
