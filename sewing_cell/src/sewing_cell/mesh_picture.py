# SPDX-License-Identifier: BSD-3-Clause
"""Meshes, and the Kinects' pictures of them."""
from __future__ import annotations

from typing import Iterator, NamedTuple
from xml.etree import ElementTree

import numpy as np

from sewing_cell import picture_library, pinhole

_BOX_FACES = np.array(
    [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
)  # corner number: 4 at upper x, 2 at upper y, 1 at upper z; counterclockwise from outside


class Mesh(NamedTuple):
    """Triangles, counterclockwise as seen from outside.

    Corners (n, 3, 3) float32 [m], and the color (n, 3) uint8 of each triangle.
    """

    corners: np.ndarray
    colors: np.ndarray

    @classmethod
    def of(cls, corners: np.ndarray, color: np.ndarray | tuple[int, int, int]) -> Mesh:
        """Return triangles (n, 3, 3) [m] of one color (3,), 0 to 255."""
        colors = np.tile(np.array(color, dtype=np.uint8), (len(corners), 1))
        return cls(np.ascontiguousarray(corners, dtype=np.float32), colors)


class Picture(NamedTuple):
    """Depth (480, 640) float32 [m], inf where there is nothing, and color (480, 640, 3) uint8."""

    depth: np.ndarray
    color: np.ndarray

    @classmethod
    def empty(cls) -> Picture:
        """Return an empty picture."""
        shape = (pinhole.HEIGHT, pinhole.WIDTH)
        return cls(np.full(shape, np.inf, np.float32), np.zeros((*shape, 3), np.uint8))

    def draw(self, mesh: Mesh, camera_from_mesh: np.ndarray) -> None:
        """Draw a mesh where it is nearer than the picture, given its pose (4, 4) in the camera.

        Faces that point away from the camera are not drawn.
        """
        picture_library.draw(*mesh, camera_from_mesh, *self)


def joined(meshes: list[Mesh]) -> Mesh:
    """Return several meshes as one."""
    return Mesh(
        np.concatenate([mesh.corners for mesh in meshes]),
        np.concatenate([mesh.colors for mesh in meshes]),
    )


def box_mesh(lower: np.ndarray, upper: np.ndarray, color: tuple[int, int, int]) -> Mesh:
    """Return a box between two opposite corners (3,) [m]."""
    corners = np.stack(np.meshgrid(*zip(lower, upper), indexing="ij"), axis=-1).reshape(8, 3)
    triangles = np.concatenate([_BOX_FACES[:, [0, 1, 2]], _BOX_FACES[:, [0, 2, 3]]])
    return Mesh.of(corners[triangles], color)


_SPACE = "{http://www.collada.org/2005/11/COLLADASchema}"


def read_mesh(path: str) -> Mesh:
    """Read a Collada file as scripts/make_meshes.py writes it: in m, without node transforms."""
    root = ElementTree.parse(path).getroot()
    colors = {
        str(effect.get("id")): _numbers(effect.find(f".//{_SPACE}diffuse/{_SPACE}color"))[:3] * 255
        for effect in root.iter(f"{_SPACE}effect")
    }
    return joined([
        Mesh.of(corners, colors[f"{material}-effect"])
        for mesh in root.iter(f"{_SPACE}mesh")
        for material, corners in _triangles(mesh)
    ])


def _triangles(mesh: ElementTree.Element) -> Iterator[tuple[str, np.ndarray]]:
    """Yield the material and the corners (n, 3, 3) of each group of triangles."""
    points = _numbers(mesh.find(f"{_SPACE}source/{_SPACE}float_array")).reshape(-1, 3)
    for group in mesh.iter(f"{_SPACE}triangles"):
        numbers = _numbers(group.find(f"{_SPACE}p")).astype(int)
        yield str(group.get("material")), points[numbers.reshape(-1, 3)]


def _numbers(element: ElementTree.Element | None) -> np.ndarray:
    text = "" if element is None else element.text or ""
    return np.array(text.split(), dtype=float)
