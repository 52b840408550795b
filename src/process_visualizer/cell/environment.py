# SPDX-License-Identifier: BSD-3-Clause
"""Checks that all that a cell needs is installed: packages, models, launch files, executables."""
from __future__ import annotations

import os
from typing import Iterable, Iterator, List, Optional, Sequence

import rospkg
from catkin.find_in_workspaces import find_in_workspaces
from roslib.packages import find_node

from process_visualizer.cell.errors import (
    ConfigurationError,
    Location,
    Problem,
    ProblemList,
    missing_file,
    nearest,
)
from process_visualizer.cell.model import (
    Cell,
    Device,
    LaunchFile,
    Mode,
    Model,
    Node,
    RoslaunchElement,
)
from process_visualizer.cell.substitution import package_advice


def check_environment(cell: Cell, mode: Optional[Mode] = None,
                      devices: Optional[Iterable[str]] = None) -> List[Problem]:
    """Return a problem for everything that devices refer to but that does not exist, in file order.

    With ``mode``, whatever starts only in the other mode is skipped. ``devices`` are names; the
    default is all devices (KeyError for an unknown name). Nodes on other machines are not checked;
    in playback, those of a device run on this computer.
    """
    chosen = cell.devices if devices is None else [cell.device(name) for name in devices]
    check = _Check(mode)
    for device in chosen:
        check.device(device)
    return check.problems.sorted()


def require_environment(cell: Cell, mode: Mode, devices: Iterable[str]) -> None:
    """Check everything that the chosen devices need on this machine in a mode.

    Raises:
        ConfigurationError: something is missing.
    """
    problems = check_environment(cell, mode, devices)
    if problems:
        raise ConfigurationError(problems)


def find_launch_file(package_folder: str, name: str) -> Optional[str]:
    """Return the path of a launch file, in the package's folder ``launch`` or in the package."""
    for path in _launch_file_paths(package_folder, name):
        if os.path.isfile(path):
            return path
    return None


def _launch_file_paths(package_folder: str, name: str) -> Sequence[str]:
    return os.path.join(package_folder, 'launch', name), os.path.join(package_folder, name)


class _Check:
    """Collects the problems, with a single search for packages."""

    def __init__(self, mode: Optional[Mode]) -> None:
        self.problems = ProblemList()
        self._mode = mode
        self._packages = rospkg.RosPack()

    def device(self, device: Device) -> None:
        if device.model is not None:
            self._model(device.model)
        for node in device.nodes:
            if self._runs(node.mode):
                if not self._is_elsewhere(node, device):
                    self._node(node)
                self._files(node.children)  # roslaunch reads them here in any case
        for launch_file in device.launch_files:
            if self._runs(launch_file.mode):
                self._launch_file(launch_file)
        self._files(device.parameters)

    def _runs(self, mode: Optional[Mode]) -> bool:
        return self._mode is None or mode in (None, self._mode)

    def _is_elsewhere(self, node: Node, device: Device) -> bool:
        in_playback = Mode.PLAYBACK in (self._mode, node.mode)
        return 'machine' in node.attributes or bool(device.machine and not in_playback)

    def _folder(self, package: str, location: Location, element: str) -> Optional[str]:
        """Return the folder of the package; if it does not exist, add a problem and return None."""
        try:
            return str(self._packages.get_path(package))
        except rospkg.ResourceNotFound:
            self.problems.add(location, element, package_advice(package, self._packages))
            return None

    def _model(self, model: Model) -> None:
        folder: Optional[str] = ''
        if model.package:
            folder = self._folder(model.package, model.location, 'model')
        if folder is None:
            return
        path = os.path.join(folder, model.path)
        if not os.path.isfile(path):
            self.problems.add(model.location, 'model', missing_file(path))

    def _launch_file(self, launch_file: LaunchFile) -> None:
        folder = self._folder(launch_file.package, launch_file.location, 'launch')
        if folder is None or find_launch_file(folder, launch_file.type) is not None:
            return
        paths = _launch_file_paths(folder, launch_file.type)
        usual = next((path for path in paths if os.path.isdir(os.path.dirname(path))), paths[0])
        self.problems.add(launch_file.location, 'launch', missing_file(usual))

    def _node(self, node: Node) -> None:
        folder = self._folder(node.package, node.location, 'node')
        if folder is not None and not find_node(node.package, node.type, self._packages):
            name = nearest(node.type, _executables(node.package, folder))
            meant = f'did you mean "{name}"? Otherwise ' if name else ''
            self.problems.add(node.location, 'node', f'the package "{node.package}" has no '
                              f'executable "{node.type}"; {meant}build its workspace (catkin_make) '
                              'and source it')

    def _files(self, elements: Iterable[RoslaunchElement]) -> None:
        for element in elements:
            if element.attributes.get('command', 'load') != 'load':
                continue
            for name in ('file', 'textfile', 'binfile'):
                path = element.attributes.get(name)
                if path is not None and not os.path.isfile(path):
                    self.problems.add(element.location, element.tag, missing_file(path))


def _executables(package: str, folder: str) -> Iterator[str]:
    """Yield the names of the executable files of a package."""
    folders = find_in_workspaces(search_dirs=['libexec'], project=package) + [folder]
    for top in folders:
        for parent, subfolders, files in os.walk(top):
            subfolders[:] = [name for name in subfolders if not name.startswith('.')]
            yield from (name for name in files if os.access(os.path.join(parent, name), os.X_OK))
