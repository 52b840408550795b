# SPDX-License-Identifier: BSD-3-Clause
"""The commands of ``cell`` for configurations: check, show, new, trust."""
from __future__ import annotations

import argparse
import os
import sys
from dataclasses import replace
from typing import Dict, Iterable, List, Mapping, NamedTuple, Sequence, Set, Tuple

import rospkg
import rospy

from process_visualizer.cell.environment import check_environment
from process_visualizer.cell.errors import Location, Problem, ProblemList
from process_visualizer.cell.model import Cell, Device, DeviceType, Mode, Topic, TopicFunction
from process_visualizer.cell.substitution import package_advice
from process_visualizer.cell.trust import set_trusted, trust_file, trusted_packages
from process_visualizer.cell.xml_parser import XmlParser
from process_visualizer.clients.running_system import from_system
from process_visualizer.discovery.new_configuration import from_bags, write_new
from process_visualizer.generate.cell_extent import cell_extent
from process_visualizer.generate.choice import Choice
from process_visualizer.generate.drivers import LaunchFiles, inspect_launch_files
from process_visualizer.generate.frame_rules import (
    frame_problems,
    frame_warnings,
    joint_warnings,
    static_frames,
)
from process_visualizer.launching.ros_master import RosMaster
from process_visualizer.robot.description import (
    RobotDescription,
    describe_devices,
    resource_problems,
)
from process_visualizer.robot.tool_frame import pose_frames, tool_frame
from process_visualizer.ros_names import TF_MESSAGE
from process_visualizer.rviz.views import SavedViewError, SavedViews, view_warnings
from process_visualizer.shown_text import say

# The command ``cell check``: reports all problems of a configuration at once.

class Findings(NamedTuple):
    """The cell as far as it could be read, its problems and its warnings."""

    cell: Cell
    problems: List[Problem]
    warnings: List[Problem]


def check(path: str, arguments: Mapping[str, str]) -> int:
    """Print all problems of a configuration; return 1 if it cannot be used, otherwise 0.

    Raises:
        ConfigurationError: the file is not a configuration at all.
    """
    cell, problems, warnings = find_problems(path, arguments)
    for line in [*map(str, problems), *map(_warning, warnings)]:
        say(line, file=sys.stderr)
    if not problems:
        say(f'{cell.file}: {_counted(len(cell.devices), "device")}, no problem'
            + (f', {_counted(len(warnings), "warning")}' if warnings else ''))
    return 1 if problems else 0


def find_problems(path: str, arguments: Mapping[str, str]) -> Findings:
    """Find all problems of the file, of this machine, and of the models.

    A problem is reported only once.

    Raises:
        ConfigurationError: the file is not a configuration at all.
    """
    cell, found = XmlParser(arguments).read(path)
    found.extend(check_environment(cell))
    descriptions, model_problems = describe_devices(cell.devices, cell.frame)
    _extend(found, model_problems)
    _extend(found, resource_problems(cell.devices, descriptions))
    _extend(found, frame_problems(cell.devices, descriptions))
    problems = list(dict.fromkeys(found.sorted()))
    return Findings(cell, problems, _warnings(cell, descriptions, _places(problems)))


def _warnings(cell: Cell, descriptions: Mapping[str, RobotDescription],
              known: Set[Tuple[Location, str]]) -> List[Problem]:
    """Return warnings for elements that have no problem."""
    inspected = [inspect_launch_files(Choice(cell, mode, cell.devices)) for mode in Mode]
    published = static_frames(_nodes(cell, inspected))
    warnings: Dict[Problem, None] = dict.fromkeys(
        warning for files in inspected for warning in files.warnings)
    warnings.update(dict.fromkeys(frame_warnings(cell, descriptions, published)))
    if not any(element == 'topic' for _, element in known):
        warnings.update(dict.fromkeys(joint_warnings(cell.devices, descriptions)))
    warnings.update(dict.fromkeys(_view_warnings(cell, descriptions)))
    result = ProblemList()
    for file in cell.files:
        result.begin_file(file)
    result.extend(warning for warning in warnings
                  if (warning.location, warning.element) not in known)
    return result.sorted()


def _view_warnings(cell: Cell, descriptions: Mapping[str, RobotDescription]) -> List[Problem]:
    views = SavedViews(cell.file, [device.name for device in cell.devices])
    name = views.chosen()
    if name is None:
        return []
    try:
        content = views.load(name)
    except SavedViewError as error:
        return [Problem(Location(cell.file, 1), '', str(error))]
    return view_warnings(cell, name, content, cell_extent(cell, cell.devices, descriptions))


def _nodes(cell: Cell, inspected: Iterable[LaunchFiles]) -> List[Tuple[str, str, str]]:
    """Return package, type and arguments of all nodes of the devices and their launch files."""
    own = [(node.package, node.type, str(node.attributes.get('args', '')))
           for device in cell.devices for node in device.nodes]
    return own + [(node.package, node.type, node.args or '') for files in inspected
                  for content in files.contents.values() for node in content.nodes]


def _extend(found: ProblemList, problems: Iterable[Problem]) -> None:
    known = _places(found.sorted())
    found.extend(problem for problem in problems
                 if (problem.location, problem.element) not in known)


def _places(problems: Iterable[Problem]) -> Set[Tuple[Location, str]]:
    return {(problem.location, problem.element) for problem in problems}


def _warning(problem: Problem) -> str:
    """Return the line of a warning, marked as one because the configuration can still be used."""
    return str(replace(problem, message=f'warning: {problem.message}'))


def _counted(count: int, noun: str) -> str:
    return f'{count} {noun}' + ('' if count == 1 else 's')


# The command ``cell new``: writes a configuration for the running system, or for bags.

DEFAULT_FILE = 'cell.xml'


def add_new_options(command: argparse.ArgumentParser) -> None:
    """Add the options of ``cell new``."""
    command.set_defaults(repeated='bags')
    command.add_argument('bags', metavar='BAG', nargs='*',
                         help='use this recording instead of what is running')
    command.add_argument('-o', '--output', metavar='FILE', default=DEFAULT_FILE,
                         help=f'the file to write ({DEFAULT_FILE})')
    command.add_argument('--force', action='store_true', help='overwrite an existing file')


def execute_new(options: argparse.Namespace) -> int:
    """Write the configuration; return the exit code.

    Raises:
        BagError: a bag cannot be read.
        ValueError: nothing was found, or there is no master.
        OSError: the file already exists, or cannot be written.
    """
    if options.bags:
        new = from_bags(options.bags)
    else:
        check_master()
        rospy.init_node('cell_new', anonymous=True, disable_signals=True)
        new = from_system()
    try:
        paths = write_new(new, options.output, None if options.force else ())
    except FileExistsError as error:
        raise FileExistsError(f'{error}; --force overwrites it') from error
    for path in paths:
        say(path)
    say(f'{new.summary}. Read the comments in the file: some values need your decision. Then: '
        f'rosrun process_visualizer cell check {options.output}')
    return 0


def check_master() -> None:
    """Raise ValueError if no ROS master answers."""
    master = RosMaster()
    if not master.is_online():
        raise ValueError(f'there is no ROS master at {master.uri}; start the drivers, or name a '
                         'bag')


# The command ``cell trust``: manages the packages whose nodes a recording may start.

def add_trust_options(command: argparse.ArgumentParser) -> None:
    """Add the options of ``cell trust``."""
    command.set_defaults(repeated='packages')
    command.add_argument('packages', metavar='PACKAGE', nargs='*',
                         help='an installed package; default: list those that are trusted')
    command.add_argument('--remove', action='store_true', help='no longer trust these packages')


def execute_trust(options: argparse.Namespace) -> int:
    """Change the list of trusted packages, and print it; return the exit code.

    Raises:
        OSError, ValueError: the list cannot be read or written.
    """
    known = rospkg.RosPack().list()
    for name in options.packages:
        if name not in known and not options.remove:
            say(f'cell: {package_advice(name)}', file=sys.stderr)
            return 1
    for name in options.packages:
        set_trusted(name, not options.remove)
    for name in sorted(trusted_packages()):
        say(name)
    if not options.packages and not trusted_packages():
        say(f'no package is trusted ({trust_file()})', file=sys.stderr)
    return 0


def overview(cell: Cell, devices: Sequence[Device],
             descriptions: Mapping[str, RobotDescription]) -> str:
    """Return a text that lists the devices with their frames, nodes and topics.

    ``descriptions`` are the usable models, by device.
    """
    blocks = [f'{cell.file}\nglobal frame: {cell.frame}']
    return '\n\n'.join(blocks + ['\n'.join(_device_lines(device, descriptions))
                                 for device in devices])


def _device_lines(device: Device, descriptions: Mapping[str, RobotDescription]) -> List[str]:
    lines = [f'{device.name} ({device.type.value})']
    if device.base is not None:
        pose = device.base.pose
        lines.append(f'  base frame  {device.base.frame}  xyz {_numbers(pose.xyz)} m  '
                     f'yaw pitch roll {_numbers(pose.ypr)} rad')
    if device.model is not None:
        lines.append(f'  model       {os.path.join(device.model.package, device.model.path)}')
    if device.type is DeviceType.ROBOT:
        lines.append(f'  tool frame  {_tool(device, descriptions)}')
    for node in device.nodes:
        lines.append(f'  node        {node.package}/{node.type}{_mode(node.mode)}')
    for file in device.launch_files:
        lines.append(f'  launch      {file.package}/{file.type}{_mode(file.mode)}')
    lines += [f'  topic       {_topic(topic, _frames(topic, device, descriptions))}'
              for topic in device.topics]
    return lines + [f'  variable    {variable.topic} {variable.field}, at {variable.frame}'
                    for variable in device.variables]


def _tool(device: Device, descriptions: Mapping[str, RobotDescription]) -> str:
    if device.tool is None and device.model is not None and device.name not in descriptions:
        return 'not known, as the model cannot be used (see cell check)'
    tool = tool_frame(device, descriptions.get(device.name))
    place = '' if tool.frame == tool.parent else (
        f'  in {tool.parent}  xyz {_numbers(tool.pose.xyz)} m  '
        f'yaw pitch roll {_numbers(tool.pose.ypr)} rad')
    return f'{tool.frame}{place}  ({tool.reason})'


def _numbers(values: Sequence[float]) -> str:
    return ' '.join(f'{value:g}' for value in values)


def _mode(mode: 'Mode | None') -> str:
    return '' if mode is None else f'  ({mode.value} only)'


def _frames(topic: Topic, device: Device,
            descriptions: Mapping[str, RobotDescription]) -> Tuple[str, ...]:
    """Return the frames of the values, if the configuration names them."""
    if topic.message_type == TF_MESSAGE and topic.function is TopicFunction.TOOL_CENTER_FRAME:
        base, frame = pose_frames(device, descriptions.get(device.name))
        return (f'{frame} in {base}',)
    return () if topic.parent_frame is None else (f'in {topic.parent_frame}',)


def _topic(topic: Topic, frames: Tuple[str, ...]) -> str:
    notes = [*([] if topic.function is None else [topic.function.value]), *frames]
    if not topic.record:
        notes.append('not recorded')
    return topic.name + (f'  ({", ".join(notes)})' if notes else '')
