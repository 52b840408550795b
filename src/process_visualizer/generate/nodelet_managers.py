# SPDX-License-Identifier: BSD-3-Clause
"""The processes in which a device's nodelets run, so that ours can run there, too.

A nodelet gets the messages of others in its manager without a copy: a Kinect's clouds are 10 MB
each, thirty times a second, and a socket for them costs half a core.
"""
from __future__ import annotations

import re
from typing import Callable, Dict, Iterable, List, Mapping, NamedTuple, Optional, Tuple

from process_visualizer.cell.builder import absolute_topic
from process_visualizer.cell.model import Device, LaunchFile
from process_visualizer.generate.choice import Choice
from process_visualizer.generate.drivers import LaunchContent

_ANONYMOUS = re.compile(r'\$\(anon |_\d+_\d{9,}$')
"""A name that is another one at every start."""
_NodeletCommand = Tuple[str, str, List[str]]  # namespace and name of the node, words


class Manager(NamedTuple):
    """A nodelet manager; ``is_shared``: it may end and come back while the device's nodes run."""

    name: str
    is_shared: bool = False

    @property
    def loading(self) -> str:
        """The words behind the type of a nodelet to be loaded.

        Without a bond the loader would not notice that a shared manager has been started anew.
        """
        return self.name if self.is_shared else f'{self.name} --no-bond'


def nodelet_managers(choice: Choice, contents: Mapping[LaunchFile, LaunchContent]
                     ) -> Dict[str, Manager]:
    """The nodelet manager of each device that uses exactly one on this computer.

    It may start it, or load nodelets into that of another device. Of several there is no telling
    which one has the clouds.
    """
    found = {device.name: _manager(list(_commands(choice, device, contents)))
             for device in choice.devices}
    started = {manager.name for manager in found.values()
               if manager is not None and not manager.is_shared}
    return {name: manager for name, manager in found.items()
            if manager is not None and manager.name in started}


def shared_manager(names: Iterable[str], managers: Mapping[str, Manager]) -> Optional[Manager]:
    """The one manager that all the named devices use; None if there is none."""
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
    """Return what the device starts of the package nodelet on this computer."""
    for node in choice.nodes(device):
        if 'machine' not in node.attributes and node.package == 'nodelet':
            yield node.namespace, node.name, node.attributes.get('args', '').split()
    for file in choice.launch_files(device):
        for launched in contents[file].nodes if file in contents else ():
            if not launched.machine_name and launched.package == 'nodelet':
                yield launched.namespace, launched.name, (launched.args or '').split()
