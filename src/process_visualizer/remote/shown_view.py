# SPDX-License-Identifier: BSD-3-Clause
"""View and models of a cell elsewhere: untrusted data, of which only known displays are used."""
from __future__ import annotations

import os
from pathlib import Path
from typing import Any, Dict, Iterator, List, Mapping, NamedTuple, Optional, Tuple
from urllib.parse import quote
from xml.etree import ElementTree

import rospkg
import yaml

from process_visualizer.cell.elements import DISPLAY_TYPES, PROPERTY_LIMITS
from process_visualizer.cell.values import plain_yaml
from process_visualizer.remote.offer import MAX_MESH_BYTES, MESH_ENDINGS, OfferedMesh, digest_of
from process_visualizer.robot.kinematics import urdf_root
from process_visualizer.robot.model_resources import resource_path
from process_visualizer.rviz.views import onlooker_view

LINK_TOPIC = '/view_link/marker_array'
"""Topic on which the viewer shows in its own scene that the cell cannot be reached."""
_LINK_DISPLAY = {'Class': 'process_visualizer/MarkerArray', 'Name': 'Connection', 'Enabled': True,
                 'Always In Sight': True, 'Marker Topic': LINK_TOPIC}
_GROUP = 'rviz/Group'
_KNOWN = frozenset((_GROUP, 'process_visualizer/MarkerArray', 'process_visualizer/RobotModel',
                    *(f'rviz/{name}' for name in DISPLAY_TYPES)))
_MAX_VIEW_TEXT, _MAX_VALUES, _DEEPEST = 2 << 20, 100_000, 24
_HINTS = ('Transport Hint', 'Depth Map Transport Hint', 'Color Transport Hint')
_GLOBALS = ('Fixed Frame', 'Background Color', 'Default Light')
View = Dict[str, Any]


def shown_view(text: str, own: View) -> View:
    """Return the content of the viewer's .rviz file.

    Args:
        text: the view of the cell; its displays, frame and camera are used.
        own: the content of the default .rviz file, used for the rest.

    Raises:
        ValueError: the text is no view.
    """
    manager = _mapping(_parsed(text), 'Visualization Manager')
    if not manager:
        raise ValueError('it has no "Visualization Manager"')
    result = dict(_mapping(own, 'Visualization Manager'))
    result['Displays'] = [*_displays(manager), _LINK_DISPLAY]
    options = _mapping(manager, 'Global Options')
    result['Global Options'] = {**_mapping(result, 'Global Options'),
                                **{it: options[it] for it in _GLOBALS if it in options}}
    current = _mapping(_mapping(manager, 'Views'), 'Current')
    if str(current.get('Class', '')).startswith('rviz/'):
        result['Views'] = {'Current': current, 'Saved': None}
    return onlooker_view({**own, 'Visualization Manager': result})


def fixed_frame(view: Mapping[str, Any]) -> str:
    """Return the fixed frame of a view."""
    options = _mapping(_mapping(view, 'Visualization Manager'), 'Global Options')
    return str(options.get('Fixed Frame', ''))


def model_parameters(text: str) -> List[str]:
    """Return the absolute names of the parameters with a view's models.

    Raises:
        ValueError: the text is no view.
    """
    return list(dict.fromkeys(_models(_mapping(_parsed(text), 'Visualization Manager'))))


def parsed_view(text: str) -> View:
    """Return the content of a view as plain values.

    Raises:
        ValueError: the text is not a view, or is too large.
    """
    return _parsed(text)


def _models(element: Any) -> Iterator[str]:
    if isinstance(element, dict):
        name = element.get('Robot Description')
        if isinstance(name, str) and name:
            yield '/' + name.strip('/')
        for value in element.values():
            yield from _models(value)
    elif isinstance(element, list):
        for value in element:
            yield from _models(value)


def _parsed(text: str) -> View:
    if len(text) > _MAX_VIEW_TEXT:
        raise ValueError(f'it is longer than {_MAX_VIEW_TEXT >> 20} MB')
    try:
        content = plain_yaml(text)
    except (yaml.YAMLError, ValueError, RecursionError) as error:
        raise ValueError(f'it is not YAML: {" ".join(str(error).split())}') from None
    content = _Copy().of(content)
    if not isinstance(content, dict):
        raise ValueError('it is not an .rviz file')
    return content


class _Copy:
    """Copies plain values and counts them: references in YAML may multiply."""

    def __init__(self) -> None:
        self._count = 0

    def of(self, value: Any, depth: int = 0) -> Any:
        """Return a copy; raise ValueError for too many or too deeply nested values."""
        self._count += 1
        if self._count > _MAX_VALUES or depth > _DEEPEST:
            raise ValueError('it has too many values, or too deeply nested ones')
        if isinstance(value, dict):
            return {str(key): self.of(it, depth + 1) for key, it in value.items()}
        if isinstance(value, list):
            return [self.of(it, depth + 1) for it in value]
        if value is None or isinstance(value, (str, int, float, bool)):
            return value
        return str(value)


def _displays(element: Mapping[str, Any]) -> List[View]:
    found = element.get('Displays')
    items = [it for it in found if isinstance(it, dict)] if isinstance(found, list) else []
    return [_display(it) for it in items if it.get('Class') in _KNOWN]


def _display(display: View) -> View:
    result = {key: _limited(key, value) for key, value in display.items()}
    if display['Class'] == _GROUP:
        result['Displays'] = _displays(display)
    return result


def _limited(key: str, value: Any) -> Any:
    most = PROPERTY_LIMITS.get(key)
    if most is not None:
        return min(value, most) if isinstance(value, (int, float)) else most
    return 'raw' if key in _HINTS else value


def _mapping(element: Mapping[str, Any], key: str) -> View:
    value = element.get(key)
    return value if isinstance(value, dict) else {}


_MAX_MODEL_TEXT = 16 << 20


class ShownModels(NamedTuple):
    """Models by parameter, as RViz gets them.

    ``wanted`` are the files that the cell must send: local paths by the URIs at the cell.
    ``left_out`` are the URIs of files that are not available.
    """

    texts: Dict[str, str]
    wanted: Dict[str, str]
    left_out: Tuple[str, ...]


def mesh_paths(models: Mapping[str, str]) -> Dict[str, str]:
    """Return the meshes and textures of models that a cell offers to viewers: paths by URI."""
    packages = rospkg.RosPack()
    found: Dict[str, str] = {}
    for text in models.values():
        try:
            root = _root(text)
        except ValueError:
            continue
        for element in _resources(root):
            uri = element.get('filename', '')
            path = resource_path(uri, packages)
            if _is_mesh(uri) and path and os.path.isfile(path) \
                    and os.path.getsize(path) <= MAX_MESH_BYTES:
                found[uri] = path
    return found


def offered_meshes(paths: Mapping[str, str]) -> Dict[str, OfferedMesh]:
    """Return the descriptions of files for viewers, by URI; unreadable files are left out."""
    found: Dict[str, OfferedMesh] = {}
    for uri, path in paths.items():
        digest = _digest(path)
        if digest is not None:
            found[uri] = OfferedMesh(os.path.getsize(path), digest)
    return found


def shown_models(models: Mapping[str, str], meshes: Mapping[str, OfferedMesh], folder: str
                 ) -> ShownModels:
    """Return the models, with meshes of this computer or from the cell.

    A local file is used if it has the same content as the cell's. Files from the cell are stored
    in ``folder`` under new names.

    Raises:
        ValueError: a model is not valid.
    """
    packages = rospkg.RosPack()
    texts: Dict[str, str] = {}
    wanted: Dict[str, str] = {}
    left_out: List[str] = []
    for name, text in models.items():
        root = _root(text)
        parents = {child: parent for parent in root.iter() for child in parent}
        for element in _resources(root):
            uri = element.get('filename', '')
            mesh = meshes.get(uri)
            if mesh is None or not _is_mesh(uri):
                left_out.append(uri)
                _remove(element, parents)
            elif not _is_here(uri, mesh, packages):
                path = os.path.join(folder, f'{len(wanted)}{_ending(uri)}')
                path = wanted.setdefault(uri, path)
                element.set('filename', f'file://{quote(path)}')
        texts[name] = ElementTree.tostring(root, encoding='unicode')
    return ShownModels(texts, wanted, tuple(dict.fromkeys(left_out)))


def _root(text: str) -> ElementTree.Element:
    if len(text) > _MAX_MODEL_TEXT or '<!DOCTYPE' in text or '<!ENTITY' in text:
        raise ValueError('a model is too long, or declares a DOCTYPE')
    try:
        root = urdf_root(text)
    except (ValueError, RecursionError) as error:
        raise ValueError(f'a model cannot be read: {error}') from None
    if root.tag != 'robot':
        raise ValueError('a model does not begin with <robot>')
    return root


def _resources(root: ElementTree.Element) -> List[ElementTree.Element]:
    """Return the elements of meshes and textures."""
    return [it for it in root.iter() if it.tag in ('mesh', 'texture')]


def _remove(element: ElementTree.Element,
            parents: Mapping[ElementTree.Element, ElementTree.Element]) -> None:
    """Remove a texture, or the whole visual or collision of a mesh, which is invalid without it."""
    while element.tag not in ('texture', 'visual', 'collision') and element in parents:
        element = parents[element]
    parent = parents.get(element)
    if parent is not None and element in list(parent):
        parent.remove(element)


def _is_mesh(uri: str) -> bool:
    return bool(_ending(uri))


def _ending(uri: str) -> str:
    ending = os.path.splitext(uri)[1].lower()
    return ending if ending in MESH_ENDINGS else ''


def _is_here(uri: str, mesh: OfferedMesh, packages: rospkg.RosPack) -> bool:
    path = resource_path(uri, packages) if uri.startswith('package://') else ''
    return bool(path) and os.path.isfile(path) and os.path.getsize(path) == mesh.size \
        and _digest(path) == mesh.digest


def _digest(path: str) -> Optional[str]:
    try:
        return digest_of(Path(path).read_bytes())
    except OSError:
        return None
