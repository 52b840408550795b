# SPDX-License-Identifier: BSD-3-Clause
"""From a choice to the plan of all files."""
from __future__ import annotations

import os
from typing import Mapping

import numpy as np
import rospkg

from process_visualizer.cell.errors import ConfigurationError, Location, Problem
from process_visualizer.cell.model import Cell
from process_visualizer.cell.stored_configuration import configuration_text
from process_visualizer.descriptions.own_description import marked_description
from process_visualizer.descriptions.robot_description import (
    RobotDescription,
    describe_devices,
    resource_problems,
)
from process_visualizer.generate.cell_extent import cell_extent
from process_visualizer.generate.choice import Choice
from process_visualizer.generate.drivers import inspect_launch_files
from process_visualizer.generate.frame_rules import frame_problems
from process_visualizer.generate.launch_file import (
    LaunchFileBuilder,
    has_ghost,
    has_recorder,
    urdf_file,
)
from process_visualizer.generate.nodelet_managers import nodelet_managers
from process_visualizer.generate.parts import add_parts
from process_visualizer.generate.plan import CONFIGURATION_FILE, LAUNCH_FILE, RVIZ_FILE, Plan
from process_visualizer.generate.rviz_config import RVizConfig


def generate(choice: Choice) -> Plan:
    """The launch file, the RViz file, the expanded models, and what the recorder stores.

    Raises:
        ConfigurationError: a model is missing or broken, or a file cannot be read any more.
    """
    return _Generation(choice).plan()


def generate_parts(choice: Choice) -> Plan:
    """The same, and a launch file for each part, so that each can be started by itself."""
    generation = _Generation(choice)
    plan = generation.plan()
    add_parts(plan, generation.builder.parts(), choice, generation.launch_files,
              generation.view.displays_text())
    return plan


class _Generation:
    """The input of a choice's generated files.

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
        """All files but those of parts."""
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
    """The path of the default part of the RViz configuration."""
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
