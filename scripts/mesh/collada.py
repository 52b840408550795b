# SPDX-License-Identifier: BSD-3-Clause
"""Writes parts as a Collada 1.4.1 file: one geometry per material, meters, z up."""

from __future__ import annotations

from pathlib import Path
from typing import Dict, Iterable, List, Tuple

import numpy as np

from .materials import MATERIALS
from .surface import Part, Surface, merged

_HEAD = """<?xml version="1.0" encoding="utf-8"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1">
 <asset>
  <contributor><authoring_tool>process_visualizer/scripts/make_meshes.py</authoring_tool></contributor>
  <created>2026-01-01T00:00:00</created>
  <modified>2026-01-01T00:00:00</modified>
  <unit name="meter" meter="1"/>
  <up_axis>Z_UP</up_axis>
 </asset>
"""

_EFFECT = """  <effect id="{name}-effect"><profile_COMMON><technique sid="common"><phong>
   <ambient><color>{color} 1</color></ambient>
   <diffuse><color>{color} 1</color></diffuse>
   <specular><color>{shine} {shine} {shine} 1</color></specular>
   <shininess><float>30</float></shininess>
  </phong></technique></profile_COMMON></effect>
"""

_MATERIAL = """  <material id="{name}" name="{name}">
   <instance_effect url="#{name}-effect"/>
  </material>
"""

_GEOMETRY = """  <geometry id="{name}-shape" name="{name}"><mesh>
{points}{normals}   <vertices id="{name}-vertices">
    <input semantic="POSITION" source="#{name}-points"/>
   </vertices>
   <triangles count="{count}" material="{name}">
    <input semantic="VERTEX" source="#{name}-vertices" offset="0"/>
    <input semantic="NORMAL" source="#{name}-normals" offset="0"/>
    <p>{triangles}</p>
   </triangles>
  </mesh></geometry>
"""

_SOURCE = """   <source id="{name}">
    <float_array id="{name}-array" count="{size}">{values}</float_array>
    <technique_common><accessor source="#{name}-array" count="{count}" stride="3">
     <param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/>
    </accessor></technique_common>
   </source>
"""

_NODE = """  <node id="{name}-node" name="{name}"><instance_geometry url="#{name}-shape">
   <bind_material><technique_common>
    <instance_material symbol="{name}" target="#{name}"/>
   </technique_common></bind_material>
  </instance_geometry></node>
"""

_TAIL = """ <scene><instance_visual_scene url="#scene"/></scene>
</COLLADA>
"""


def write_collada(path: Path, parts: Iterable[Part]) -> None:
    """Writes `parts` to `path`; the same parts always give the same bytes."""
    path.write_text(collada(parts), encoding="utf-8")


def collada(parts: Iterable[Part]) -> str:
    """The Collada document of `parts`, with the surfaces of one material merged."""
    surfaces = _by_material(parts)
    names = [name for name, _ in surfaces]
    libraries = [
        ("library_effects", [_effect(name) for name in names]),
        ("library_materials", [_MATERIAL.format(name=name) for name in names]),
        ("library_geometries", [_geometry(*surface) for surface in surfaces]),
    ]
    texts = [f" <{tag}>\n{''.join(items)} </{tag}>\n" for tag, items in libraries]
    nodes = "".join(_NODE.format(name=name) for name in names)
    scene = f'  <visual_scene id="scene" name="scene">\n{nodes}  </visual_scene>\n'
    texts.append(f" <library_visual_scenes>\n{scene} </library_visual_scenes>\n")
    return _HEAD + "".join(texts) + _TAIL


def _by_material(parts: Iterable[Part]) -> List[Tuple[str, Surface]]:
    groups: Dict[str, List[Surface]] = {}
    for material, surface in parts:
        groups.setdefault(material, []).append(surface)
    return [(material, merged(groups[material])) for material in sorted(groups)]


def _effect(name: str) -> str:
    color, shine = MATERIALS[name]
    return _EFFECT.format(name=name, color="{:g} {:g} {:g}".format(*color), shine=f"{shine:g}")


def _geometry(name: str, surface: Surface) -> str:
    vertices, triangles = _welded(surface)
    return _GEOMETRY.format(
        name=name,
        points=_source(f"{name}-points", vertices[:, :3]),
        normals=_source(f"{name}-normals", vertices[:, 3:]),
        count=len(triangles),
        triangles=" ".join(map(str, triangles.ravel())),
    )


def _welded(surface: Surface) -> Tuple[np.ndarray, np.ndarray]:
    """Rounded points and normals (n, 6) without repetitions, and the triangles between them."""
    rows = np.hstack([_rounded(surface.points, 4), _rounded(surface.normals, 2)])
    vertices, numbers = np.unique(rows, axis=0, return_inverse=True)
    return vertices, numbers.reshape(-1)[surface.triangles]


def _source(name: str, vectors: np.ndarray) -> str:
    values = " ".join(f"{value:.9g}" for value in vectors.ravel())
    return _SOURCE.format(name=name, size=vectors.size, count=len(vectors), values=values)


def _rounded(values: np.ndarray, decimals: int) -> np.ndarray:
    """Rounded values, with no negative zero.

    The small bias moves the rounding limits away from the round numbers that machines are
    designed with, so that the last bit of a cosine cannot change the file.
    """
    scale = 10**decimals
    rounded: np.ndarray = np.floor(values * scale + 0.5 + 1e-5) / scale + 0.0
    return rounded
