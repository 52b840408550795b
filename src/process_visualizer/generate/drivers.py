"""Looks into the launch files of the devices before anything is started.

A launch file that cannot be loaded, or that needs a package which is not installed (a driver, as
a rule), is a warning for its device: the rest of the cell still starts.
"""
from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import Dict, Iterable, List, Optional

import rospkg
from roslaunch.config import ROSLaunchConfig
from roslaunch.core import Node as LaunchedNode
from roslaunch.xmlloader import XmlLoader
from roslib.packages import find_node

from process_visualizer.cell.environment import find_launch_file
from process_visualizer.cell.errors import Problem, shortened
from process_visualizer.cell.model import Device, LaunchFile
from process_visualizer.cell.substitution import package_advice
from process_visualizer.generate.choice import Choice
from process_visualizer.generate.launch_writer import Tag, write_document

_INCLUDED = re.compile(r'(while processing \S+: )+(?=while processing )')
_LONGEST_REASON = 300


@dataclass
class LaunchFiles:
    """The paths of the usable launch files, and the warnings."""

    paths: Dict[LaunchFile, str] = field(default_factory=dict)
    warnings: List[Problem] = field(default_factory=list)


def inspect_launch_files(choice: Choice) -> LaunchFiles:
    """Load every launch file of the choice as roslaunch would, without starting anything."""
    result = LaunchFiles()
    for device in choice.devices:
        for launch_file in choice.launch_files(device):
            _inspect(device, launch_file, result)
    return result


def _inspect(device: Device, launch_file: LaunchFile, result: LaunchFiles) -> None:
    def warn(message: str) -> None:
        result.warnings.append(Problem(launch_file.location, 'launch',
                                       f'device "{device.name}": {message}'))

    path = _find(launch_file)
    if path is None:
        warn(f'there is no launch file "{launch_file.type}" in the package '
             f'"{launch_file.package}"; the device starts without it')
        return
    try:
        nodes = _load_nodes(path, launch_file)
    except rospkg.ResourceNotFound as error:
        warn(f'{launch_file.type} is left out: {package_advice(_package_name(error))}')
        return
    except Exception as error:  # a launch file evaluates expressions, which can raise anything
        warn(f'{launch_file.type} is left out: {_reason(error)}')
        return
    result.paths[launch_file] = path
    for message in _missing(nodes):
        warn(f'{launch_file.type}: {message}; the device starts without it')


def _find(launch_file: LaunchFile) -> Optional[str]:
    try:
        folder = rospkg.RosPack().get_path(launch_file.package)
    except rospkg.ResourceNotFound:
        return None
    return find_launch_file(folder, launch_file.type)


def _load_nodes(path: str, launch_file: LaunchFile) -> List[LaunchedNode]:
    """The nodes of the file when it is included, with its arguments, in another one."""
    root = Tag('launch')
    root.include(path, launch_file.arguments)
    config = ROSLaunchConfig()
    loader = XmlLoader(resolve_anon=False)
    loader.ignore_unset_args = False  # roslaunch sets it from outside; without it, it crashes
    loader.load_string(write_document(root), config, verbose=False)
    return list(config.nodes)


def _package_name(error: rospkg.ResourceNotFound) -> str:
    """The missing package; in an <arg>, roslaunch hides it at the end of a first sentence."""
    return str(error.args[0]).splitlines()[0].split(': ')[-1]


def _reason(error: Exception) -> str:
    """The error on one line; of a chain of included files, only the one that is wrong."""
    text = ' '.join((str(error) or repr(error)).split())
    return shortened(_INCLUDED.sub('', text), _LONGEST_REASON)


def _missing(nodes: Iterable[LaunchedNode]) -> List[str]:
    """What is not installed of the nodes that run on this computer, each thing once."""
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
    """The package of the nodelet that a nodelet loader loads, by its name ``package/Class``."""
    words = (node.args or '').split()
    if node.package != 'nodelet' or len(words) < 2 or words[0] not in ('load', 'standalone'):
        return ''
    return words[1].split('/')[0] if '/' in words[1] else ''
