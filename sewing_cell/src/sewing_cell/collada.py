# SPDX-License-Identifier: BSD-3-Clause
"""Reads our own Collada files as triangles with colours."""

from __future__ import annotations

from typing import Iterator
from xml.etree import ElementTree

import numpy as np

from sewing_cell.mesh_picture import Mesh, joined

_SPACE = "{http://www.collada.org/2005/11/COLLADASchema}"


def read_mesh(path: str) -> Mesh:
    """A Collada file as scripts/make_meshes.py writes it: in m, without transforms of nodes."""
    root = ElementTree.parse(path).getroot()
    colours = {
        str(effect.get("id")): _numbers(effect.find(f".//{_SPACE}diffuse/{_SPACE}color"))[:3] * 255
        for effect in root.iter(f"{_SPACE}effect")
    }
    return joined([
        Mesh.of(corners, colours[f"{material}-effect"])
        for mesh in root.iter(f"{_SPACE}mesh")
        for material, corners in _triangles(mesh)
    ])


def _triangles(mesh: ElementTree.Element) -> Iterator[tuple[str, np.ndarray]]:
    """The material and the corners (n, 3, 3) of each group of triangles."""
    points = _numbers(mesh.find(f"{_SPACE}source/{_SPACE}float_array")).reshape(-1, 3)
    for group in mesh.iter(f"{_SPACE}triangles"):
        numbers = _numbers(group.find(f"{_SPACE}p")).astype(int)
        yield str(group.get("material")), points[numbers.reshape(-1, 3)]


def _numbers(element: ElementTree.Element | None) -> np.ndarray:
    text = "" if element is None else element.text or ""
    return np.array(text.split(), dtype=float)
