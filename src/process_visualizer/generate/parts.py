# SPDX-License-Identifier: BSD-3-Clause
"""The parts of a plan: launch files of their own for what is started and stopped together."""
from __future__ import annotations

import hashlib
import re
from pathlib import Path
from typing import Dict, Iterable, List, Mapping, Sequence
from xml.etree import ElementTree

from process_visualizer.cell.builder import absolute_topic
from process_visualizer.cell.model import Device
from process_visualizer.generate.choice import Choice
from process_visualizer.generate.drivers import LaunchContent, LaunchFiles
from process_visualizer.generate.launch_file import urdf_file
from process_visualizer.generate.launch_writer import Tag, write_document
from process_visualizer.generate.plan import RVIZ_PART, Part, Plan

_ANONYMOUS = re.compile(r'_\d+_\d{9,}$')
"""The end of what roslaunch makes of ``$(anon name)``: process id and random number."""


def add_parts(plan: Plan, roots: Mapping[str, Tag], choice: Choice, found: LaunchFiles,
              displays: str) -> None:
    """Add the launch files of the parts to the plan's files, and what they are to its parts.

    ``roots`` are their elements by the names of the parts, ``found`` what was found out about the
    devices' launch files, ``displays`` what RViz shows, as a text to compare.
    """
    devices = {device.name: device for device in choice.devices}
    for name, root in roots.items():
        device = devices.get(name)
        contents = [] if device is None else _contents(choice, device, found)
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
    """The name of a part's launch file among the generated files."""
    return f'parts/{name.replace("/", "_")}.launch'


def _contents(choice: Choice, device: Device, found: LaunchFiles) -> List[LaunchContent]:
    return [found.contents[file] for file in choice.launch_files(device) if file in found.contents]


def _nodes(root: Tag, contents: Sequence[LaunchContent]) -> Dict[str, str]:
    """The nodes on this computer: those of the elements, and those of included launch files."""
    names = _own_nodes(root, '/')
    for node in (node for content in contents for node in content.nodes):
        if not node.machine_name and not _ANONYMOUS.search(node.name):
            names[node.namespace + node.name] = f'{node.package}/{node.type}'
    return names


def _own_nodes(tag: Tag, namespace: str) -> Dict[str, str]:
    names: Dict[str, str] = {}
    for child in tag.children:
        if not isinstance(child, Tag) or 'machine' in child.attributes:
            continue
        values = child.attributes
        own = values.get('ns', '')
        inner = own if own.startswith('/') else absolute_topic(namespace, own)
        if child.name == 'node':
            names[absolute_topic(inner, values['name'])] = f'{values["pkg"]}/{values["type"]}'
        elif child.name == 'group':
            names.update(_own_nodes(child, inner))
    return names


def _without_comments(root: Tag) -> str:
    """The file as roslaunch sees it; a comment says where a device stands in the configuration."""
    return ElementTree.canonicalize(write_document(root), strip_text=True)


def _texts_of(contents: Iterable[LaunchContent]) -> List[str]:
    paths = dict.fromkeys(path for content in contents for path in content.files)
    return [Path(path).read_text(encoding='utf-8', errors='replace') for path in paths]


def _digest(texts: Iterable[str]) -> str:
    digest = hashlib.sha256()
    for text in texts:
        digest.update(text.encode('utf-8', 'surrogatepass') + b'\0')
    return digest.hexdigest()
