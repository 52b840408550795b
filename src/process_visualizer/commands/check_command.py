# SPDX-License-Identifier: BSD-3-Clause
"""The command ``cell check``: all problems of a configuration at once."""
from __future__ import annotations

import sys
from dataclasses import replace
from typing import Dict, Iterable, List, Mapping, NamedTuple, Set, Tuple

from process_visualizer.cell.environment import check_environment
from process_visualizer.cell.errors import Location, Problem, ProblemList
from process_visualizer.cell.model import Cell, Mode
from process_visualizer.cell.xml_parser import XmlParser
from process_visualizer.descriptions.robot_description import (
    RobotDescription,
    describe_devices,
    resource_problems,
)
from process_visualizer.generate.cell_extent import cell_extent
from process_visualizer.generate.choice import Choice
from process_visualizer.generate.drivers import LaunchFiles, inspect_launch_files
from process_visualizer.generate.frame_rules import (
    frame_problems,
    frame_warnings,
    joint_warnings,
    static_frames,
)
from process_visualizer.rviz.saved_views import SavedViewError, SavedViews
from process_visualizer.rviz.view_rules import view_warnings
from process_visualizer.shown_text import say


class Findings(NamedTuple):
    """The cell as far as it could be read, its errors and its warnings."""

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
    """Find all problems of the file, on this machine, and of the models.

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
    """Return what devices lack, if they have no problem already."""
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
    """Package, type and arguments of all nodes of the devices and of their launch files."""
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
    """Its line, which shows that the configuration can still be used."""
    return str(replace(problem, message=f'warning: {problem.message}'))


def _counted(count: int, noun: str) -> str:
    return f'{count} {noun}' + ('' if count == 1 else 's')
