# SPDX-License-Identifier: BSD-3-Clause
"""The visual shapes of a model's links, and their meshes as triangles with colors."""
from __future__ import annotations

from enum import Enum
from typing import Any, Dict, List, NamedTuple, Optional, Tuple
from xml.etree import ElementTree

import numpy as np

from process_visualizer.robot.kinematics import Placement, origin_of, triple, urdf_root
from process_visualizer.robot.mesh_files import MeshError, opened_mesh

Size = Tuple[float, float, float]
Color = Tuple[float, float, float, float]


class ShapeKind(Enum):
    """Shapes of URDF."""

    MESH = 'mesh'
    BOX = 'box'
    CYLINDER = 'cylinder'
    SPHERE = 'sphere'


class LinkVisual(NamedTuple):
    """A shape in its link; ``size`` is in m along its axes, or the scale of a mesh.

    ``color`` is red green blue alpha from 0 to 1; None if the model has none.
    """

    link: str
    place: Placement
    kind: ShapeKind
    size: Size
    mesh: str = ''  # URI
    color: Optional[Color] = None


def link_visuals(urdf: str) -> Tuple[LinkVisual, ...]:
    """Return the visual shapes of a URDF in file order, without unknown ones.

    Raises:
        ValueError: the text is not XML, or has an invalid number.
    """
    root = urdf_root(urdf)
    materials = {it.get('name', ''): _rgba(it) for it in root.findall('material')}
    found: List[LinkVisual] = []
    for link in root.findall('link'):
        for visual in link.findall('visual'):
            shape = _shape(link.get('name', ''), visual, materials)
            if shape is not None:
                found.append(shape)
    return tuple(found)


def _shape(link: str, visual: ElementTree.Element,
           materials: Dict[str, Optional[Color]]) -> Optional[LinkVisual]:
    geometry = visual.find('geometry')
    shape = geometry[0] if geometry is not None and len(geometry) else None
    if shape is None or shape.tag not in {kind.value for kind in ShapeKind}:
        return None
    return LinkVisual(link, origin_of(visual), ShapeKind(shape.tag), _size(shape),
                      shape.get('filename', ''), _color(visual.find('material'), materials))


def _color(material: Optional[ElementTree.Element],
           materials: Dict[str, Optional[Color]]) -> Optional[Color]:
    """Return the color of a visual; a material without one refers to another by its name."""
    if material is None:
        return None
    return _rgba(material) or materials.get(material.get('name', ''))


def _rgba(material: ElementTree.Element) -> Optional[Color]:
    color = material.find('color')
    if color is None:
        return None
    red, green, blue, alpha = map(float, color.get('rgba', '0.7 0.7 0.7 1').split())
    return red, green, blue, alpha


def _size(shape: ElementTree.Element) -> Size:
    if shape.tag == 'mesh':
        return triple(shape.get('scale', '1 1 1'))
    if shape.tag == 'box':
        return triple(shape.get('size', '0 0 0'))
    width = 2.0 * float(shape.get('radius', '0'))
    return width, width, width if shape.tag == 'sphere' else float(shape.get('length', '0'))


# The mesh in a file as triangles with normals and colors, as in RViz.

class ColoredMesh(NamedTuple):
    """Triangles (m, 3) of corners (n, 3) [m] with ``normals`` (n, 3) and ``colors`` (n, 3) 0..255.

    ``has_colors`` says whether the file has any; otherwise they are gray.
    """

    positions: np.ndarray
    normals: np.ndarray
    colors: np.ndarray
    triangles: np.ndarray
    has_colors: bool = True


def read_colored_mesh(path: str) -> ColoredMesh:
    """Return the mesh in a file (STL, Collada or OBJ).

    Raises:
        MeshError: the mesh cannot be read, or has no triangles.
    """
    with opened_mesh(path) as (library, mesh):
        return _checked(path, _copied(library, mesh))


def _copied(library: Any, mesh: int) -> ColoredMesh:
    corners, triangles = (int(getattr(library, f'colored_mesh_{name}')(mesh))
                          for name in ('corners', 'triangles'))
    columns = [np.ctypeslib.as_array(getattr(library, f'colored_mesh_{name}')(mesh),
                                     (rows, 3)).copy()
               for name, rows in (('positions', corners), ('normals', corners),
                                  ('colors', corners), ('indices', triangles))]
    return ColoredMesh(columns[0], columns[1], columns[2], columns[3],
                       bool(library.colored_mesh_has_colors(mesh)))


def _checked(path: str, mesh: ColoredMesh) -> ColoredMesh:
    """Return the mesh without triangles whose corners are not finite."""
    is_finite = np.isfinite(mesh.positions).all(axis=1)
    triangles = mesh.triangles[is_finite[mesh.triangles].all(axis=1)]
    if not len(triangles):
        raise MeshError(f'the mesh {path} cannot be read: it has no triangles')
    return mesh._replace(positions=np.where(is_finite[:, np.newaxis], mesh.positions, 0.0),
                         normals=np.nan_to_num(mesh.normals), triangles=triangles)
