# SPDX-License-Identifier: BSD-3-Clause
"""The Kinect's picture of meshes: our Collada files as triangles, drawn one after the other."""

from __future__ import annotations

from typing import Iterator, NamedTuple
from xml.etree import ElementTree

import numpy as np

from sewing_cell import pinhole

_SPACE = "{http://www.collada.org/2005/11/COLLADASchema}"
_AMBIENT = 0.55


class Mesh(NamedTuple):
    """Corners (n, 3, 3) [m] of triangles, and a colour (n, 3), 0 to 255, of each."""

    corners: np.ndarray
    colours: np.ndarray

    def placed(self, rotation: np.ndarray, position: np.ndarray) -> Mesh:
        """The mesh elsewhere: turned by a matrix (3, 3), then moved [m]."""
        return Mesh(self.corners @ np.asarray(rotation).T + position, self.colours)


def read_mesh(path: str) -> Mesh:
    """A Collada file as scripts/make_meshes.py writes it: in m, without transforms of nodes."""
    root = ElementTree.parse(path).getroot()
    colours = {
        str(effect.get("id")): _numbers(effect.find(f".//{_SPACE}diffuse/{_SPACE}color"))[:3] * 255
        for effect in root.iter(f"{_SPACE}effect")
    }
    parts = [
        Mesh(corners, np.tile(colours[f"{material}-effect"], (len(corners), 1)))
        for mesh in root.iter(f"{_SPACE}mesh")
        for material, corners in _triangles(mesh)
    ]
    return joined(parts)


def joined(meshes: list[Mesh]) -> Mesh:
    """Several meshes as one."""
    return Mesh(
        np.concatenate([mesh.corners for mesh in meshes]),
        np.concatenate([mesh.colours for mesh in meshes]),
    )


def draw(mesh: Mesh, depth: np.ndarray, colour: np.ndarray) -> None:
    """Draw what is nearer than a picture's depth [m] (480, 640) into it and its colour.

    The inverse of the depth is linear in the picture, so that planes stay planes.
    """
    seen = pinhole.project(mesh.corners)
    light = _light(mesh.corners)
    front = (seen[..., 2] > 0.1).all(axis=1) & (_area(seen) > 0.0)
    low = np.ceil(seen[..., :2].min(axis=1)).astype(int)
    high = np.floor(seen[..., :2].max(axis=1)).astype(int) + 1
    low, high = np.maximum(low, 0), np.minimum(high, (pinhole.WIDTH, pinhole.HEIGHT))
    for number in np.flatnonzero(front & (low < high).all(axis=1)):
        columns = slice(low[number, 0], high[number, 0])
        rows = slice(low[number, 1], high[number, 1])
        inside, found = _depths(seen[number], columns, rows)
        nearer = inside & (found < depth[rows, columns])
        depth[rows, columns][nearer] = found[nearer]
        colour[rows, columns][nearer] = light[number] * mesh.colours[number]


def _depths(
    corners: np.ndarray, columns: slice, rows: slice
) -> tuple[np.ndarray, np.ndarray]:
    """Which pixels of a rectangle lie in a triangle, and the depth [m] of each."""
    u = np.arange(columns.start, columns.stop)[None, :]
    v = np.arange(rows.start, rows.stop)[:, None]
    (u_0, v_0, z_0), (u_1, v_1, z_1), (u_2, v_2, z_2) = corners
    area = (u_1 - u_0) * (v_2 - v_0) - (u_2 - u_0) * (v_1 - v_0)
    second = ((u - u_0) * (v_2 - v_0) - (u_2 - u_0) * (v - v_0)) / area
    third = ((u_1 - u_0) * (v - v_0) - (u - u_0) * (v_1 - v_0)) / area
    first = 1.0 - second - third
    inside = (first >= 0.0) & (second >= 0.0) & (third >= 0.0)
    inverse = first / z_0 + second / z_1 + third / z_2
    return inside, 1.0 / np.where(inside, inverse, 1.0)


def _area(seen: np.ndarray) -> np.ndarray:
    """Twice the area (n,) of triangles in the picture, of both sides."""
    first, second = seen[:, 1, :2] - seen[:, 0, :2], seen[:, 2, :2] - seen[:, 0, :2]
    return np.abs(first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0])


def _light(corners: np.ndarray) -> np.ndarray:
    """Brightness (n,): the more a triangle looks up or down, the brighter."""
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    length = np.maximum(np.linalg.norm(across, axis=1), 1e-12)
    return _AMBIENT + (1.0 - _AMBIENT) * np.abs(across[:, 2]) / length


def _triangles(mesh: ElementTree.Element) -> Iterator[tuple[str, np.ndarray]]:
    """The material and the corners (n, 3, 3) of each group of triangles."""
    points = _numbers(mesh.find(f"{_SPACE}source/{_SPACE}float_array")).reshape(-1, 3)
    for group in mesh.iter(f"{_SPACE}triangles"):
        numbers = _numbers(group.find(f"{_SPACE}p")).astype(int)
        yield str(group.get("material")), points[numbers.reshape(-1, 3)]


def _numbers(element: ElementTree.Element | None) -> np.ndarray:
    text = "" if element is None else element.text or ""
    return np.array(text.split(), dtype=float)
