# SPDX-License-Identifier: BSD-3-Clause
"""Generation: turns a choice of devices into the plan of all files."""
from __future__ import annotations

import hashlib
import os
import re
from pathlib import Path
from typing import Dict, Iterable, List, Mapping, Sequence
from xml.etree import ElementTree

import numpy as np
import rospkg

from process_visualizer.cell.builder import absolute_topic
from process_visualizer.cell.errors import ConfigurationError, Location, Problem
from process_visualizer.cell.model import Cell
from process_visualizer.cell.stored_configuration import configuration_text
from process_visualizer.generate.cell_extent import cell_extent
from process_visualizer.generate.choice import Choice
from process_visualizer.generate.drivers import (
    LaunchContent,
    LaunchFiles,
    inspect_launch_files,
    nodelet_managers,
)
from process_visualizer.generate.frame_rules import frame_problems
from process_visualizer.generate.launch_file import (
    LaunchFileBuilder,
    has_ghost,
    has_recorder,
    urdf_file,
)
from process_visualizer.generate.launch_writer import LaunchTag, write_document
from process_visualizer.generate.plan import (
    CONFIGURATION_FILE,
    LAUNCH_FILE,
    RVIZ_FILE,
    RVIZ_PART,
    Part,
    Plan,
)
from process_visualizer.generate.rviz_config import RVizConfig
from process_visualizer.robot.description import (
    RobotDescription,
    describe_devices,
    marked_description,
    resource_problems,
)

# The parts of a plan: each is started and stopped as a unit, with its own launch file.

_ANONYMOUS = re.compile(r'_\d+_\d{9,}$')
"""The ending that roslaunch gives to ``$(anon name)``: process id and random number."""


def add_parts(plan: Plan, roots: Mapping[str, LaunchTag], choice: Choice, found: LaunchFiles,
              displays: str) -> None:
    """Add the parts to a plan, and their launch files to its files.

    ``roots`` are the root elements by the names of the parts, ``found`` the inspected launch files
    of the devices, ``displays`` RViz's displays as a text for comparison.
    """
    devices = {device.name: device for device in choice.devices}
    for name, root in roots.items():
        device = devices.get(name)
        files = [] if device is None else choice.launch_files(device)
        contents = [found.contents[file] for file in files if file in found.contents]
        launch_file = part_file(name) if root.children else None
        if launch_file is not None:
            plan.files[launch_file] = write_document(root)
        texts = [_without_comments(root), *_texts_of(contents)]
        shown = choice.devices if name == RVIZ_PART else [device] if device else []
        texts += [plan.files.get(urdf_file(it), '') for it in shown]
        if name == RVIZ_PART:
            texts.append(displays)
        plan.parts[name] = Part(launch_file, _nodes(root, contents), _digest(texts))


def part_file(name: str) -> str:
    """Return the name of a part's launch file among the generated files."""
    return f'parts/{name.replace("/", "_")}.launch'


def _nodes(root: LaunchTag, contents: Sequence[LaunchContent]) -> Dict[str, str]:
    """Return the nodes on this computer, of the elements and of included launch files."""
    names = _own_nodes(root, '/')
    for node in (node for content in contents for node in content.nodes):
        if not node.machine_name and not _ANONYMOUS.search(node.name):
            names[node.namespace + node.name] = f'{node.package}/{node.type}'
    return names


def _own_nodes(tag: LaunchTag, namespace: str) -> Dict[str, str]:
    names: Dict[str, str] = {}
    for child in tag.children:
        if not isinstance(child, LaunchTag) or 'machine' in child.attributes:
            continue
        values = child.attributes
        own = values.get('ns', '')
        inner = own if own.startswith('/') else absolute_topic(namespace, own)
        if child.name == 'node':
            names[absolute_topic(inner, values['name'])] = f'{values["pkg"]}/{values["type"]}'
        elif child.name == 'group':
            names.update(_own_nodes(child, inner))
    return names


def _without_comments(root: LaunchTag) -> str:
    """Return the file without comments, which only locate the devices in the configuration."""
    return ElementTree.canonicalize(write_document(root), strip_text=True)


def _texts_of(contents: Iterable[LaunchContent]) -> List[str]:
    paths = dict.fromkeys(path for content in contents for path in content.files)
    return [Path(path).read_text(encoding='utf-8', errors='replace') for path in paths]


def _digest(texts: Iterable[str]) -> str:
    digest = hashlib.sha256()
    for text in texts:
        digest.update(text.encode('utf-8', 'surrogatepass') + b'\0')
    return digest.hexdigest()


def generate(choice: Choice) -> Plan:
    """Return the plan: launch file, RViz file, expanded models, and the recorder's configuration.

    Raises:
        ConfigurationError: a model is missing or broken, or a file can no longer be read.
        PlanError: a bag has a path that roslaunch cannot pass on.
    """
    return _Generation(choice).plan()


def generate_parts(choice: Choice) -> Plan:
    """Return a plan with a launch file for each part, so that each can be started by itself."""
    generation = _Generation(choice)
    plan = generation.plan()
    add_parts(plan, generation.builder.parts(), choice, generation.launch_files,
              generation.view.displays_text())
    return plan


class _Generation:
    """The inputs for the generated files of a choice.

    Raises:
        ConfigurationError: a model is missing or broken.
    """

    def __init__(self, choice: Choice) -> None:
        self._choice = choice
        self._descriptions, problems = describe_devices(choice.devices, choice.cell.frame)
        problems += frame_problems(choice.devices, self._descriptions)
        if problems:
            raise ConfigurationError(problems)
        self.launch_files = inspect_launch_files(choice)
        self.builder = LaunchFileBuilder(choice, self._descriptions, self.launch_files.paths,
                                         nodelet_managers(choice, self.launch_files.contents))
        self.view = _view(choice, self._descriptions)

    def plan(self) -> Plan:
        """Return the plan of all files except those of parts."""
        choice = self._choice
        files = {LAUNCH_FILE: self.builder.text(), RVIZ_FILE: self.view.text()}
        if has_recorder(choice):
            files[CONFIGURATION_FILE] = _configuration_text(choice.cell)
        for device in choice.devices:
            if device.name in self._descriptions:
                files[urdf_file(device)] = marked_description(
                    self._descriptions[device.name].text)
        lacking = resource_problems(choice.devices, self._descriptions)
        return Plan(files, [*self.launch_files.warnings, *lacking])


def default_rviz_file() -> str:
    """Return the path of the default part of the RViz configuration."""
    folder = rospkg.RosPack().get_path('process_visualizer')
    return os.path.join(folder, 'rviz_config', 'default.rviz')


def _configuration_text(cell: Cell) -> str:
    try:
        return configuration_text(cell)
    except OSError as error:
        raise ConfigurationError([Problem(Location(error.filename or cell.file, 1), '',
                                          f'cannot be read: {error.strerror}')]) from None


def _view(choice: Choice, descriptions: Mapping[str, RobotDescription]) -> RVizConfig:
    path = default_rviz_file()
    try:
        config = RVizConfig(path, choice.cell.frame)
    except (OSError, ValueError) as error:
        raise ConfigurationError([Problem(Location(path, 1), '', str(error))]) from None
    if choice.window is not None:
        config.place(choice.window)
    extent = cell_extent(choice.cell, choice.devices, descriptions)
    config.look_at(np.concatenate([np.empty((0, 3)), *extent.values()]))
    config.add_devices(choice.devices)
    if has_ghost(choice, descriptions):
        config.add_ghost()
    if choice.is_replay:
        config.add_replay_band()
    if choice.view is not None:
        config.adopt(choice.view)
    return config
