# SPDX-License-Identifier: BSD-3-Clause
"""Inspects the launch files of the devices before anything is started.

A launch file that cannot be loaded, or that needs a package which is not installed (usually a
driver), is a warning for its device: the rest of the cell still starts.
"""
from __future__ import annotations

import os
import re
from dataclasses import dataclass, field
from typing import Callable, Dict, Iterable, List, Mapping, NamedTuple, Optional, Tuple

import rospkg
from roslaunch.config import ROSLaunchConfig
from roslaunch.core import Node as LaunchedNode
from roslaunch.xmlloader import XmlLoader
from roslib.packages import find_node

from process_visualizer.cell.builder import absolute_topic
from process_visualizer.cell.environment import find_launch_file
from process_visualizer.cell.errors import Problem, shortened
from process_visualizer.cell.model import Device, LaunchFile
from process_visualizer.cell.substitution import package_advice
from process_visualizer.generate.choice import Choice
from process_visualizer.generate.launch_writer import LaunchTag, write_document

_INCLUDED = re.compile(r'(while processing \S+: )+(?=while processing )')
_MAX_REASON = 300


class LaunchContent(NamedTuple):
    """The nodes of a launch file, and the paths of all files read for it."""

    nodes: List[LaunchedNode]
    files: List[str]


@dataclass
class LaunchFiles:
    """The paths and contents of the usable launch files, and the warnings.

    ``nodes`` describes what starts each node.
    """

    paths: Dict[LaunchFile, str] = field(default_factory=dict)
    contents: Dict[LaunchFile, LaunchContent] = field(default_factory=dict)
    warnings: List[Problem] = field(default_factory=list)
    nodes: Dict[str, str] = field(default_factory=dict)


def inspect_launch_files(choice: Choice) -> LaunchFiles:
    """Load every launch file of the choice as roslaunch would, without starting anything."""
    result = LaunchFiles(nodes={absolute_topic(node.namespace, node.name): f'"{device.name}"'
                                for device in choice.devices for node in choice.nodes(device)})
    for device in choice.devices:
        for launch_file in choice.launch_files(device):
            _inspect(device, launch_file, result)
    return result


class _UnusableError(Exception):
    """A launch file cannot be included; the message says why."""


def _inspect(device: Device, launch_file: LaunchFile, result: LaunchFiles) -> None:
    def warn(message: str) -> None:
        result.warnings.append(Problem(launch_file.location, 'launch',
                                       f'device "{device.name}": {launch_file.type}{message}'))

    try:
        path = _find(launch_file)
        content = _load(path, launch_file)
        _claim_names(content.nodes, f'{launch_file.type} of "{device.name}"', result.nodes)
    except _UnusableError as error:
        warn(f' is left out: {error}')
        return
    result.paths[launch_file] = path
    result.contents[launch_file] = content
    for message in _missing(content.nodes):
        warn(f': {message}; the device starts without it')


def _find(launch_file: LaunchFile) -> str:
    try:
        path = find_launch_file(rospkg.RosPack().get_path(launch_file.package), launch_file.type)
    except rospkg.ResourceNotFound:
        raise _UnusableError(package_advice(launch_file.package)) from None
    if path is None:
        raise _UnusableError(f'it is not in the package "{launch_file.package}"')
    return path


def _load(path: str, launch_file: LaunchFile) -> LaunchContent:
    """Return the content of the file as if another file included it with its arguments."""
    root = LaunchTag('launch')
    root.include(path, launch_file.arguments)
    config = ROSLaunchConfig()
    loader = XmlLoader(resolve_anon=False)
    loader.ignore_unset_args = False  # roslaunch sets this; without it, the loader crashes
    try:
        loader.load_string(write_document(root), config, verbose=False)
    except rospkg.ResourceNotFound as error:
        raise _UnusableError(package_advice(_package_name(error))) from None
    except Exception as error:  # expressions in a launch file can raise anything
        raise _UnusableError(_reason(error)) from None
    return LaunchContent(list(config.nodes), [file for file in config.roslaunch_files
                                              if os.path.isfile(file)])


def _claim_names(nodes: Iterable[LaunchedNode], owner: str, owners: Dict[str, str]) -> None:
    """Record the owner of each name: roslaunch starts nothing if two nodes have the same name."""
    names = [node.namespace + node.name for node in nodes]
    for name in names:
        if name in owners:
            raise _UnusableError(f'its node {name} is already started by {owners[name]}')
    owners.update(dict.fromkeys(names, owner))


def _package_name(error: rospkg.ResourceNotFound) -> str:
    """Return the missing package; for an <arg>, it is at the end of the message's first line."""
    return str(error.args[0]).splitlines()[0].split(': ')[-1]


def _reason(error: Exception) -> str:
    """Return the error on one line, without the files that include the faulty one."""
    text = ' '.join((str(error) or repr(error)).split())
    return shortened(_INCLUDED.sub('', text), _MAX_REASON)


def _missing(nodes: Iterable[LaunchedNode]) -> List[str]:
    """Return a message for each missing package or node of this computer, each once."""
    packages = rospkg.RosPack()
    messages: Dict[str, None] = {}
    for node in nodes:
        if node.machine_name:
            continue
        for package in (node.package, _nodelet_package(node)):
            if package and package not in packages.list():
                messages[f'the node {node.namespace}{node.name} needs the package "{package}", '
                         'which is not installed'] = None
        if node.package in packages.list() and not find_node(node.package, node.type, packages):
            messages[f'the package "{node.package}" has no node "{node.type}"'] = None
    return list(messages)


def _nodelet_package(node: LaunchedNode) -> str:
    """Return the package of the nodelet that a nodelet loader loads, from ``package/Class``."""
    words = (node.args or '').split()
    if node.package != 'nodelet' or len(words) < 2 or words[0] not in ('load', 'standalone'):
        return ''
    return words[1].split('/')[0] if '/' in words[1] else ''


# The managers of a device's nodelets, so that this program's nodelets can run there, too.
#
# Nodelets in one manager exchange messages without copying them: a Kinect's clouds are 10 MB each,
# thirty times a second, and sending them over a socket costs half a core.

_ANONYMOUS = re.compile(r'\$\(anon |_\d+_\d{9,}$')
"""A name that differs at every start."""
_NodeletCommand = Tuple[str, str, List[str]]  # namespace and name of the node, words


class Manager(NamedTuple):
    """A nodelet manager; ``is_shared``: it may be restarted while the device's nodes run."""

    name: str
    is_shared: bool = False

    @property
    def loading(self) -> str:
        """The arguments after the type of a nodelet to be loaded.

        Without a bond, the loader would not notice that a shared manager was restarted.
        """
        return self.name if self.is_shared else f'{self.name} --no-bond'


def nodelet_managers(choice: Choice, contents: Mapping[LaunchFile, LaunchContent]
                     ) -> Dict[str, Manager]:
    """Return the nodelet manager of each device that uses exactly one on this computer.

    The device may start the manager, or load nodelets into that of another device. With several
    managers, it is unknown which one has the clouds.
    """
    found = {device.name: _manager(list(_commands(choice, device, contents)))
             for device in choice.devices}
    started = {manager.name for manager in found.values()
               if manager is not None and not manager.is_shared}
    return {name: manager for name, manager in found.items()
            if manager is not None and manager.name in started}


def shared_manager(names: Iterable[str], managers: Mapping[str, Manager]) -> Optional[Manager]:
    """Return the manager that all named devices use; None if there is none."""
    used = {managers[name].name if name in managers else '' for name in names}
    return Manager(used.pop(), is_shared=True) if len(used) == 1 and '' not in used else None


def _manager(commands: List[_NodeletCommand]) -> Optional[Manager]:
    started = _names(commands, _started)
    if started:
        return Manager(started[0]) if len(started) == 1 else None
    loaded = _names(commands, _loaded_into)
    return Manager(loaded[0], is_shared=True) if len(loaded) == 1 else None


def _names(commands: List[_NodeletCommand], name: Callable[[_NodeletCommand], str]) -> List[str]:
    names = dict.fromkeys(filter(None, map(name, commands)))
    return [it for it in names if not _ANONYMOUS.search(it)]


def _started(command: _NodeletCommand) -> str:
    namespace, name, words = command
    return absolute_topic(namespace, name) if words[:1] == ['manager'] else ''


def _loaded_into(command: _NodeletCommand) -> str:
    namespace, _, words = command
    if words[:1] != ['load'] or len(words) < 3:
        return ''
    return words[2] if words[2].startswith('/') else absolute_topic(namespace, words[2])


def _commands(choice: Choice, device: Device, contents: Mapping[LaunchFile, LaunchContent]
              ) -> Iterable[_NodeletCommand]:
    """Yield the nodelet commands that the device runs on the computer of its other nodes."""
    for node in choice.nodes(device):
        is_there = node.attributes.get('machine', device.machine) == device.machine
        if is_there and node.package == 'nodelet':
            yield node.namespace, node.name, node.attributes.get('args', '').split()
    for file in choice.launch_files(device):
        for launched in contents[file].nodes if file in contents else ():
            if not (launched.machine_name or device.machine) and launched.package == 'nodelet':
                yield launched.namespace, launched.name, (launched.args or '').split()
