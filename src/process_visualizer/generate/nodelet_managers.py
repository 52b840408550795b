# SPDX-License-Identifier: BSD-3-Clause
"""The processes in which a device's nodelets run, so that ours can run there, too.

A nodelet gets the messages of others in its manager without a copy: a Kinect's clouds are 10 MB
each, thirty times a second, and a socket for them costs half a core.
"""
from __future__ import annotations

import re
from typing import Dict, List, Mapping

from process_visualizer.cell.builder import absolute_topic
from process_visualizer.cell.model import Device, LaunchFile
from process_visualizer.generate.choice import Choice
from process_visualizer.generate.drivers import LaunchContent

_ANONYMOUS = re.compile(r'\$\(anon |_\d+_\d{9,}$')
"""A name that is another one at every start."""


def nodelet_managers(choice: Choice, contents: Mapping[LaunchFile, LaunchContent]
                     ) -> Dict[str, str]:
    """The nodelet manager of each device that starts exactly one on this computer.

    Of several there is no telling which one has the clouds.
    """
    found = {device.name: _managers(choice, device, contents) for device in choice.devices}
    return {name: managers[0] for name, managers in found.items() if len(managers) == 1}


def _managers(choice: Choice, device: Device, contents: Mapping[LaunchFile, LaunchContent]
              ) -> List[str]:
    own = [absolute_topic('/' + node.namespace.strip('/'), node.name)
           for node in choice.nodes(device) if 'machine' not in node.attributes
           and _is_manager(node.package, node.attributes.get('args', ''))]
    included = [node.namespace + node.name
                for file in choice.launch_files(device) if file in contents
                for node in contents[file].nodes if not node.machine_name
                and _is_manager(node.package, node.args or '')]
    return [name for name in own + included if not _ANONYMOUS.search(name)]


def _is_manager(package: str, arguments: str) -> bool:
    return package == 'nodelet' and arguments.split()[:1] == ['manager']
