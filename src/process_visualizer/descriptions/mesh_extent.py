# SPDX-License-Identifier: BSD-3-Clause
"""Measures the mesh in a file (STL, Collada or OBJ), without graphics."""
from __future__ import annotations

import functools
import os
import struct
from typing import Callable, Dict, Iterator, List, Optional
from xml.etree import ElementTree

import numpy as np

_STL_HEADER_BYTES = 84
_STL_FACE_BYTES = 50
_IDENTITY = np.eye(4)


def mesh_corners(path: str) -> Optional[np.ndarray]:
    """The lowest and the highest corner (2, 3) of a mesh, in the units of its file.

    The unit of a Collada file is applied, so its corners are in m. None if the file cannot be read
    or understood.
    """
    try:
        return _corners(path, os.stat(path).st_mtime_ns)
    except OSError:
        return None


@functools.lru_cache(maxsize=256)
def _corners(path: str, _changed_ns: int) -> Optional[np.ndarray]:
    read = _READERS.get(os.path.splitext(path)[1].lower())
    if read is None:
        return None
    try:
        points = read(path)
    except (ValueError, KeyError, IndexError, ElementTree.ParseError, struct.error):
        return None
    points = points[np.isfinite(points).all(axis=1)]
    return np.array([points.min(axis=0), points.max(axis=0)]) if len(points) else None


def _stl(path: str) -> np.ndarray:
    """Vertices of an STL file; a binary one is recognised by its size."""
    with open(path, 'rb') as file:
        content = file.read()
    if len(content) >= _STL_HEADER_BYTES:
        count = struct.unpack_from('<I', content, _STL_HEADER_BYTES - 4)[0]
        if len(content) == _STL_HEADER_BYTES + count * _STL_FACE_BYTES:
            face = np.dtype([('normal', '<f4', 3), ('corners', '<f4', (3, 3)), ('note', '<u2')])
            faces = np.frombuffer(content, face, count, _STL_HEADER_BYTES)
            return np.asarray(faces['corners'].reshape(-1, 3), dtype=float)
    return _numbered_lines(content, b'vertex')


def _obj(path: str) -> np.ndarray:
    with open(path, 'rb') as file:
        return _numbered_lines(file.read(), b'v')


def _numbered_lines(content: bytes, word: bytes) -> np.ndarray:
    """The three numbers of each line that begins with a given word."""
    lines = (line.split() for line in content.splitlines())
    rows = [[float(number) for number in words[1:4]] for words in lines
            if len(words) > 3 and words[0] == word]
    return np.array(rows, dtype=float).reshape(-1, 3)


def _collada(path: str) -> np.ndarray:
    """Vertices of all geometries that the scene shows, with the transforms of its nodes."""
    root = ElementTree.parse(path).getroot()
    for element in root.iter():
        element.tag = element.tag.rpartition('}')[2]
    unit = root.find('asset/unit')
    scale = 1.0 if unit is None else float(unit.get('meter', '1'))
    shapes = {geometry.get('id', ''): _vertices(geometry)
              for geometry in root.iterfind('library_geometries/geometry')}
    library = {node.get('id', ''): node for node in root.iterfind('library_nodes/node')}
    found: List[np.ndarray] = []
    for scene in root.iterfind('library_visual_scenes/visual_scene'):
        for node in scene.findall('node'):
            found += _placed(node, _IDENTITY, shapes, library)
    return scale * np.concatenate(found or list(shapes.values()) or [np.empty((0, 3))])


def _vertices(geometry: ElementTree.Element) -> np.ndarray:
    """The positions (n, 3) of a geometry; normals and colours are other sources."""
    sources = {f'#{source.get("id")}': source for source in geometry.iter('source')}
    rows = [np.empty((0, 3))]
    for place in geometry.iterfind('mesh/vertices/input[@semantic="POSITION"]'):
        numbers = sources[place.get('source', '')].find('float_array')
        if numbers is not None:
            rows.append(np.array((numbers.text or '').split(), dtype=float).reshape(-1, 3))
    return np.concatenate(rows)


def _placed(node: ElementTree.Element, parent: np.ndarray, shapes: Dict[str, np.ndarray],
            library: Dict[str, ElementTree.Element], depth: int = 0) -> Iterator[np.ndarray]:
    """The vertices below a node of the scene, in the scene."""
    if depth > len(library) + 100:
        raise ValueError('nodes contain each other')
    place = parent @ _transform(node)
    for shown in node.findall('instance_geometry'):
        yield shapes[_name(shown)] @ place[:3, :3].T + place[:3, 3]
    below = node.findall('node') + [library[_name(it)] for it in node.findall('instance_node')]
    for child in below:
        yield from _placed(child, place, shapes, library, depth + 1)


def _name(instance: ElementTree.Element) -> str:
    return instance.get('url', '').lstrip('#')


def _transform(node: ElementTree.Element) -> np.ndarray:
    """The matrix (4, 4) of a node: its transforms one after the other."""
    matrix = _IDENTITY
    for element in node:
        make = _TRANSFORMS.get(element.tag)
        if make is not None:
            matrix = matrix @ make(np.array((element.text or '').split(), dtype=float))
    return matrix


def _translation(values: np.ndarray) -> np.ndarray:
    matrix = np.eye(4)
    matrix[:3, 3] = values
    return matrix


def _rotation(values: np.ndarray) -> np.ndarray:
    """Axis and angle in degrees (Rodrigues' formula)."""
    x, y, z = values[:3] / (np.linalg.norm(values[:3]) or 1.0)
    angle = np.radians(values[3])
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    matrix = np.eye(4)
    matrix[:3, :3] += np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross
    return matrix


_TRANSFORMS: Dict[str, Callable[[np.ndarray], np.ndarray]] = {
    'matrix': lambda values: values.reshape(4, 4),
    'translate': _translation,
    'rotate': _rotation,
    'scale': lambda values: np.diag([*values, 1.0]),
}
_READERS: Dict[str, Callable[[str], np.ndarray]] = {'.stl': _stl, '.dae': _collada, '.obj': _obj}
