# SPDX-License-Identifier: BSD-3-Clause
"""Visual shapes of a model's links."""
from __future__ import annotations

from enum import Enum
from typing import Dict, List, NamedTuple, Optional, Tuple
from xml.etree import ElementTree

from process_visualizer.motion.kinematics import Placement
from process_visualizer.motion.rotations import quaternion_from_ypr

Size = Tuple[float, float, float]
Color = Tuple[float, float, float, float]


class ShapeKind(Enum):
    """URDF's shapes."""

    MESH = 'mesh'
    BOX = 'box'
    CYLINDER = 'cylinder'
    SPHERE = 'sphere'


class LinkVisual(NamedTuple):
    """A shape in its link; the size is in m along its axes, of a mesh the scale.

    ``color`` is the model's, red green blue alpha from 0 to 1; None: it gives none.
    """

    link: str
    place: Placement
    kind: ShapeKind
    size: Size
    mesh: str = ''  # URI
    color: Optional[Color] = None


def link_visuals(urdf: str) -> Tuple[LinkVisual, ...]:
    """Return the visual shapes of a URDF, in its order; unknown ones are left out.

    Raises:
        ValueError: it is not XML, or a number in it is none.
    """
    try:
        root = ElementTree.fromstring(urdf)
    except ElementTree.ParseError as error:
        raise ValueError(f'not well-formed XML: {error}') from None
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
    return LinkVisual(link, _place(visual.find('origin')), ShapeKind(shape.tag), _size(shape),
                      shape.get('filename', ''), _color(visual.find('material'), materials))


def _color(material: Optional[ElementTree.Element],
           materials: Dict[str, Optional[Color]]) -> Optional[Color]:
    """The colour of a visual: a material without one is named elsewhere in the model."""
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
        return _triple(shape.get('scale', '1 1 1'))
    if shape.tag == 'box':
        return _triple(shape.get('size', '0 0 0'))
    width = 2.0 * float(shape.get('radius', '0'))
    return width, width, width if shape.tag == 'sphere' else float(shape.get('length', '0'))


def _place(origin: Optional[ElementTree.Element]) -> Placement:
    if origin is None:
        return Placement()
    roll, pitch, yaw = _triple(origin.get('rpy', '0 0 0'))
    x, y, z, w = (float(it) for it in quaternion_from_ypr((yaw, pitch, roll)))
    return Placement(_triple(origin.get('xyz', '0 0 0')), (x, y, z, w))


def _triple(text: str) -> Size:
    x, y, z = map(float, text.split())
    return x, y, z
