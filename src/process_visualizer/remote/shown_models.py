# SPDX-License-Identifier: BSD-3-Clause
"""Models of a cell that runs elsewhere, and their meshes: of this computer, or of the cell."""
from __future__ import annotations

import os
from pathlib import Path
from typing import Dict, List, Mapping, NamedTuple, Optional, Tuple
from urllib.parse import quote
from xml.etree import ElementTree

import rospkg

from process_visualizer.descriptions.model_resources import resource_path
from process_visualizer.remote.offer import MESH_ENDINGS, MOST_MESH_BYTES, Mesh, digest_of

_LONGEST_TEXT = 16 << 20


class ShownModels(NamedTuple):
    """Models by parameter, as RViz is to have them.

    ``wanted`` are the files that the cell has to send: where to put each, by its URI there.
    ``left_out`` are those that there are not.
    """

    texts: Dict[str, str]
    wanted: Dict[str, str]
    left_out: Tuple[str, ...]


def mesh_paths(models: Mapping[str, str]) -> Dict[str, str]:
    """Return the meshes and textures of models that a cell gives to viewers: paths by URI."""
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
                    and os.path.getsize(path) <= MOST_MESH_BYTES:
                found[uri] = path
    return found


def offered_meshes(paths: Mapping[str, str]) -> Dict[str, Mesh]:
    """Return what is said of files to viewers, by URI; what cannot be read is left out."""
    found: Dict[str, Mesh] = {}
    for uri, path in paths.items():
        digest = _digest(path)
        if digest is not None:
            found[uri] = Mesh(os.path.getsize(path), digest)
    return found


def shown_models(models: Mapping[str, str], meshes: Mapping[str, Mesh], folder: str
                 ) -> ShownModels:
    """Return the models with the meshes that this computer has, or gets from the cell.

    A file here counts if it has the content of that of the cell. Files of the cell come into a
    folder; no name of them is taken over.

    Raises:
        ValueError: a model is none.
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
    if len(text) > _LONGEST_TEXT or '<!DOCTYPE' in text or '<!ENTITY' in text:
        raise ValueError('a model is too long, or declares a DOCTYPE')
    try:
        root = ElementTree.fromstring(text)
    except (ElementTree.ParseError, ValueError, RecursionError) as error:
        raise ValueError(f'a model is no XML: {error}') from None
    if root.tag != 'robot':
        raise ValueError('a model does not begin with <robot>')
    return root


def _resources(root: ElementTree.Element) -> List[ElementTree.Element]:
    """The meshes and textures."""
    return [it for it in root.iter() if it.tag in ('mesh', 'texture')]


def _remove(element: ElementTree.Element,
            parents: Mapping[ElementTree.Element, ElementTree.Element]) -> None:
    """Take out a texture, or what a mesh is the shape of: without it that would be no URDF."""
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


def _is_here(uri: str, mesh: Mesh, packages: rospkg.RosPack) -> bool:
    path = resource_path(uri, packages) if uri.startswith('package://') else ''
    return bool(path) and os.path.isfile(path) and os.path.getsize(path) == mesh.size \
        and _digest(path) == mesh.digest


def _digest(path: str) -> Optional[str]:
    try:
        return digest_of(Path(path).read_bytes())
    except OSError:
        return None
