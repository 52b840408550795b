# SPDX-License-Identifier: BSD-3-Clause
"""Robot descriptions: xacro files are expanded, and checked by urdfdom."""
from __future__ import annotations

import os
import re
import subprocess
import tempfile
from collections import Counter
from dataclasses import dataclass, replace
from typing import Dict, FrozenSet, Iterable, List, Mapping, Match, Optional, Tuple
from xml.etree import ElementTree

import rospkg

from process_visualizer.cell.errors import Problem, missing_file, root_as_global_frame
from process_visualizer.cell.model import Device, Model
from process_visualizer.cell.substitution import package_advice
from process_visualizer.cell.trust import is_below
from process_visualizer.robot.kinematics import MOVABLE, urdf_root
from process_visualizer.robot.model_resources import (
    missing_resources,
    with_resources,
    without_foreign_resources,
)
from process_visualizer.robot.xacro_child import MAX_CHARACTERS
from process_visualizer.robot.xacro_file import XacroError, expand_xacro

_LINKS = (('link', 'name'), ('joint/parent', 'link'), ('joint/child', 'link'),
          ('gazebo', 'reference'), ('sensor/parent', 'link'))
"""Elements below the root of a URDF that name links, and their attributes."""


def rename_links(robot: ElementTree.Element, prefix: str) -> None:
    """Put a prefix before the names of all links of a <robot>.

    Joints keep their names, which the driver uses in the device's own topics, whereas links are
    frames, whose names are shared by the whole cell.
    """
    links = {link.get('name') for link in robot.findall('link')}
    for path, attribute in _LINKS:
        for element in robot.findall(path):
            name = element.get(attribute)
            if name in links:
                element.set(attribute, f'{prefix}{name}')


_MAX_LINKS = 1000
"""Maximum number of links of an untrusted model, far more than a robot has."""
_COMMENT = re.compile('<!--(.*?)-->', re.DOTALL)
_OWN_CONFIGURATION = 'name a configuration of your own with --config'


class ModelError(Exception):
    """A model cannot be used; the text has the file and the reason."""


@dataclass(frozen=True)
class RobotDescription:
    """An expanded, checked URDF.

    ``joints`` maps the names of movable joints, in file order, to their types; ``parents`` maps
    each link except the root to its parent. ``drawn`` are the links with a visual,
    ``collision_only`` those with a collision geometry but no visual. ``ignored`` are removed meshes
    and textures, which a model in a recording may not name.
    """

    text: str
    links: Tuple[str, ...]
    joints: Dict[str, str]
    parents: Dict[str, str]
    drawn: FrozenSet[str] = frozenset()
    collision_only: FrozenSet[str] = frozenset()
    ignored: Tuple[str, ...] = ()

    @property
    def root_link(self) -> str:
        """The only link without a parent."""
        return next(link for link in self.links if link not in self.parents)

    def children(self, link: str) -> List[str]:
        """Return the child links of a link, in file order."""
        return [child for child in self.links if self.parents.get(child) == link]

    @property
    def connected_links(self) -> FrozenSet[str]:
        """The root link, and the links connected to it by joints."""
        children: Dict[str, List[str]] = {}
        for child, parent in self.parents.items():
            children.setdefault(parent, []).append(child)
        connected, level = {self.root_link}, [self.root_link]
        while level:
            level = [child for link in level for child in children.get(link, ())
                     if child not in connected]
            connected.update(level)
        return frozenset(connected)

    def ancestors(self, link: str) -> List[str]:
        """Return the links from a link's parent to the root, without repetition in a circle."""
        found: Dict[str, None] = {}
        parent = self.parents.get(link)
        while parent is not None and parent not in found:
            found[parent] = None
            parent = self.parents.get(parent)
        return list(found)


def model_path(model: Model) -> str:
    """Return the absolute path of a model file.

    Raises:
        ModelError: the file does not exist, or is not where an untrusted model must be.
    """
    if not model.package:
        if model.confined_to and not is_below(model.path, model.confined_to):
            raise ModelError(f'"{model.path}" is not in the recording; {_OWN_CONFIGURATION}')
        if not os.path.isfile(model.path):
            raise ModelError(missing_file(model.path))
        return model.path
    try:
        folder = rospkg.RosPack().get_path(model.package)
    except rospkg.ResourceNotFound:
        raise ModelError(package_advice(model.package)) from None
    path = os.path.join(folder, model.path)
    if model.confined_to and not is_below(path, folder):
        raise ModelError(f'"{model.path}" is not below the package "{model.package}"; '
                         f'{_OWN_CONFIGURATION}')
    if not os.path.isfile(path):
        raise ModelError(f'there is no file "{model.path}" in the package "{model.package}" '
                         f'({folder})')
    return path


def load_robot_description(path: str, arguments: Tuple[Tuple[str, str], ...] = (),
                           prefix: str = '', confined_to: str = '') -> RobotDescription:
    """Return the description in a URDF or xacro file.

    ``arguments`` are values for ``<xacro:arg>``; ``prefix`` is put before the names of links. A
    model ``confined_to`` a folder is untrusted data (see ``Model``).

    Raises:
        ModelError: the file, named in the text, is unreadable or not a robot description.
    """
    text = _expand(path, arguments, confined_to) if path.endswith('.xacro') \
        else _without_loose_comments(_read(path))
    if confined_to and len(text) > MAX_CHARACTERS:
        raise ModelError(f'{path}: a model in a recording may not have more than '
                         f'{MAX_CHARACTERS} characters')
    if confined_to and '<!DOCTYPE' in text:
        raise ModelError(f'{path}: a model in a recording may not declare a DOCTYPE')
    try:
        root = urdf_root(text)
    except ValueError as error:
        raise ModelError(f'{path}: {error}') from None
    if root.tag != 'robot':
        raise ModelError(f'{path}: a URDF begins with <robot>, not <{root.tag}>')
    ignored = without_foreign_resources(root) if confined_to else []
    if confined_to:
        _check_size(path, root)
    if prefix:
        rename_links(root, prefix)
    if prefix or confined_to:  # other readers may understand namespaces and comments differently
        text = ElementTree.tostring(root, encoding='unicode')
    _check_with_urdfdom(path, text)
    description = _describe(text, root)
    _check_tree(path, description, root)
    return replace(description, ignored=tuple(ignored))


def _read(path: str) -> str:
    try:
        with open(path, encoding='utf-8') as file:
            return file.read()
    except (OSError, UnicodeDecodeError) as error:
        raise ModelError(f'{path}: cannot be read: {error}') from None


def _without_loose_comments(text: str) -> str:
    """Blank comments with two hyphens: XML forbids them, urdfdom reads them (in a PR2's model)."""
    def strict(comment: Match[str]) -> str:
        is_loose = '--' in comment[1] or comment[1].endswith('-')
        return '\n' * comment[0].count('\n') if is_loose else comment[0]

    return _COMMENT.sub(strict, text)


def _expand(path: str, arguments: Tuple[Tuple[str, str], ...], confined_to: str) -> str:
    try:
        return expand_xacro(path, arguments, confined_to)
    except XacroError as error:
        raise ModelError(str(error)) from None


def _check_size(path: str, root: ElementTree.Element) -> None:
    """Limit the effort of computing link poses for an untrusted model."""
    count = len(root.findall('link'))
    if count > _MAX_LINKS:
        raise ModelError(f'{path}: a model in a recording may not have more than {_MAX_LINKS} '
                         f'links, and it has {count}; {_OWN_CONFIGURATION}')


def _check_with_urdfdom(path: str, text: str) -> None:
    with tempfile.NamedTemporaryFile('w', suffix='.urdf', encoding='utf-8') as file:
        file.write(text)
        file.flush()
        try:
            check = subprocess.run(['check_urdf', file.name], stdout=subprocess.PIPE,
                                   stderr=subprocess.STDOUT, text=True,
                                   errors='backslashreplace', timeout=30, check=False)
        except FileNotFoundError:
            raise ModelError('check_urdf is not installed; install liburdfdom-tools') from None
        except subprocess.TimeoutExpired:
            raise ModelError(f'{path}: check_urdf did not finish within 30 s') from None
    if check.returncode != 0:
        raise ModelError(f'{path}: not a valid URDF: {_first_error(check.stdout)}')


def _check_tree(path: str, description: RobotDescription, root: ElementTree.Element) -> None:
    """Check what urdfdom does not check: unnamed links, a second parent, links in a circle."""
    if '' in description.links:
        raise ModelError(f'{path}: not a valid URDF: a link has no name')
    children = Counter(child.get('link', '') for child in root.findall('joint/child'))
    connected = description.connected_links
    for link in description.parents:
        if children[link] > 1:
            raise ModelError(f'{path}: not a valid URDF: the link "{link}" has two parents')
        if link not in connected:
            raise ModelError(f'{path}: not a valid URDF: the link "{link}" is not connected to '
                             f'the root link "{description.root_link}"')


def _first_error(output: str) -> str:
    lines = [line.strip() for line in output.splitlines() if line.strip()]
    errors = [line for line in lines if line.startswith('Error:')]
    text = (errors or lines or ['check_urdf gave no reason'])[0]
    return text[len('Error:'):].strip() if errors else text


def _describe(text: str, root: ElementTree.Element) -> RobotDescription:
    links = tuple(link.get('name', '') for link in root.findall('link'))
    joints: Dict[str, str] = {}
    parents: Dict[str, str] = {}
    for joint in root.findall('joint'):
        parent, child = joint.find('parent'), joint.find('child')
        if parent is not None and child is not None:
            parents[child.get('link', '')] = parent.get('link', '')
        if joint.get('type') in MOVABLE and joint.find('mimic') is None:
            joints[joint.get('name', '')] = joint.get('type', '')
    drawn, collision = (_links_with(root, tag) for tag in ('visual', 'collision'))
    return RobotDescription(text, links, joints, parents, drawn, collision - drawn)


def _links_with(root: ElementTree.Element, tag: str) -> FrozenSet[str]:
    return frozenset(link.get('name', '') for link in root.findall('link')
                     if link.find(tag) is not None)


def describe_device(device: Device, global_frame: str = '') -> Optional[RobotDescription]:
    """Return the checked description of a device's model; None for a device without a model.

    Names of files beside the model become URIs that RViz can open. ``global_frame`` improves the
    advice about the base frame.

    Raises:
        ModelError: the model cannot be read, or is not a robot description.
    """
    if device.model is None:
        return None
    model, path = device.model, model_path(device.model)
    description = load_robot_description(path, model.arguments, model.prefix,
                                         model.confined_to)
    _check_frames(device, description, global_frame)
    if model.confined_to:
        return description
    return replace(description, text=with_resources(description.text, path))


def _check_frames(device: Device, description: RobotDescription, global_frame: str) -> None:
    root = description.root_link
    if global_frame in description.parents:
        raise ModelError(f'the link "{global_frame}" of the model has the name of the global '
                         f'frame; write prefix="{device.name}_" in <model>, and the same before '
                         'the frame in <base>, or rename the global frame: <visualizer '
                         'frame="cell">')
    if device.base is None or device.base.frame == root:
        return
    advice = root_as_global_frame(device.name, root) if root == global_frame else \
        'write this name in <base>'
    raise ModelError(f'the base frame "{device.base.frame}" is not the root link of the model, '
                     f'which is "{root}"; {advice}')


def resource_problems(devices: Iterable[Device],
                      descriptions: Mapping[str, RobotDescription]) -> List[Problem]:
    """Return the problems of meshes and textures that RViz will not find, or that are ignored."""
    return [Problem(device.model.location, 'model', text)
            for device in devices if device.model is not None and device.name in descriptions
            for text in (*map(_ignored, descriptions[device.name].ignored),
                         *missing_resources(descriptions[device.name].text))]


def _ignored(resource: str) -> str:
    return (f'"{resource}" is ignored: a model in a recording names meshes and textures of '
            f'installed packages only; {_OWN_CONFIGURATION}')


def usable_description(device: Device) -> Optional[RobotDescription]:
    """Return the description of a device's model; None without a model, or if it has an error.

    A recording can be viewed and evaluated without its models.
    """
    try:
        return describe_device(device)
    except ModelError:
        return None


def describe_devices(devices: Tuple[Device, ...], global_frame: str = ''
                     ) -> Tuple[Dict[str, RobotDescription], List[Problem]]:
    """Return descriptions by device name, and the problems of the others; see describe_device."""
    descriptions: Dict[str, RobotDescription] = {}
    problems: List[Problem] = []
    owners: Dict[str, str] = {}
    for device in devices:
        try:
            description = describe_device(device, global_frame)
            if description is not None:
                _claim_links(device, description, owners)
                descriptions[device.name] = description
        except ModelError as error:
            location = device.model.location if device.model else device.location
            problems.append(Problem(location, 'model', str(error)))
    return descriptions, problems


def _claim_links(device: Device, description: RobotDescription, owners: Dict[str, str]) -> None:
    for link in description.links:
        if link in owners:
            raise ModelError(f'the link "{link}" is also in the model of "{owners[link]}"; link '
                             f'names must differ: write prefix="{device.name}/" in <model>, and '
                             'the same before the frames in <base>, <tool>, <force>')
    owners.update(dict.fromkeys(description.links, device.name))


_MARK = 'made by process_visualizer for its own nodes'


def marked_description(text: str) -> str:
    """Return a URDF with a mark at its end that identifies it as made by a cell."""
    return f'{text.rstrip()}\n<!-- {_MARK} -->\n'


def is_own_description(text: str) -> bool:
    """Return whether a robot description was made by a cell, in whatever parameter it is."""
    return text.rstrip().endswith(f'<!-- {_MARK} -->')
