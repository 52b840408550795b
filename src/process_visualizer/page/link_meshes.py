# SPDX-License-Identifier: BSD-3-Clause
"""Meshes of links, one per link: files and shapes, joined, and thinned if large."""
from __future__ import annotations

from typing import Dict, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np
import rospkg

from process_visualizer.robot.mesh_files import MeshError
from process_visualizer.robot.model_resources import resource_path
from process_visualizer.robot.rotations import matrix_from_quaternion
from process_visualizer.robot.visuals import (
    ColoredMesh,
    LinkVisual,
    ShapeKind,
    read_colored_mesh,
)

MAX_TRIANGLES = 36_000
"""Maximum number of triangles on a page: smooth without a graphics card, even with the ghost."""
_MAX_READ_TRIANGLES, _MAX_SHAPES = 5_000_000, 5_000
"""Maximum numbers before thinning: a model of a few kB can show a package's largest mesh often."""
_FINEST, _COARSEST = 256, 8
"""Grid cells along the longest edge of a mesh; the corners in a cell are merged."""
_ROUND = 24
_PLAIN = (0.72, 0.12, 0.10, 1.0)
"""The color in which RViz shows meshes without a color."""


class LinkMesh(NamedTuple):
    """The mesh of a link, in the link's frame."""

    link: str
    mesh: ColoredMesh


class LinkMeshes:
    """Reads the meshes of models; unreadable ones are left out and reported in ``notes``."""

    def __init__(self) -> None:
        """Begin without meshes."""
        self._packages = rospkg.RosPack()
        self._read: Dict[str, Optional[ColoredMesh]] = {}
        self._triangles = self._shapes = self._left_out = 0
        self._notes: List[str] = []

    @property
    def notes(self) -> List[str]:
        """The parts that are not shown, with the reasons."""
        return self._notes + ([
            f'{self._left_out} shapes are not shown: a page has at most {_MAX_SHAPES}, of '
            f'{_MAX_READ_TRIANGLES} triangles'] if self._left_out else [])

    def of(self, visuals: Sequence[LinkVisual]) -> List[LinkMesh]:
        """Return a mesh for each drawn link."""
        by_link: Dict[str, List[ColoredMesh]] = {}
        for visual in visuals:
            mesh = self._shape(visual)
            if mesh is not None and self._has_room(mesh):
                by_link.setdefault(visual.link, []).append(_placed(mesh, visual))
        return [LinkMesh(link, _joined(found)) for link, found in by_link.items()]

    def _has_room(self, mesh: ColoredMesh) -> bool:
        triangles = self._triangles + len(mesh.triangles)
        if triangles > _MAX_READ_TRIANGLES or self._shapes >= _MAX_SHAPES:
            self._left_out += 1
            return False
        self._triangles, self._shapes = triangles, self._shapes + 1
        return True

    def _shape(self, visual: LinkVisual) -> Optional[ColoredMesh]:
        if visual.kind is not ShapeKind.MESH:
            return _SHAPES[visual.kind]()
        path = resource_path(visual.mesh, self._packages)
        if visual.mesh not in self._read:
            try:
                if not path:
                    raise MeshError(f'the mesh {visual.mesh} is not found')
                self._read[visual.mesh] = read_colored_mesh(path)
            except (MeshError, OSError) as error:
                self._read[visual.mesh] = None
                self._notes.append(f'not shown: {error}')
        return self._read[visual.mesh]


def thinned(meshes: Sequence[ColoredMesh], most: int = MAX_TRIANGLES) -> List[ColoredMesh]:
    """Return meshes with at most ``most`` triangles in total; the larger ones are thinned."""
    counts = np.array([len(it.triangles) for it in meshes])
    if counts.sum() <= most:
        return list(meshes)
    limit = _level(counts, most)
    return [it if len(it.triangles) <= limit else _clustered(it, limit) for it in meshes]


def _level(counts: np.ndarray, most: int) -> int:
    """Return the maximum number of triangles of each mesh."""
    low, high = 1, int(counts.max())
    while low < high:
        middle = (low + high + 1) // 2
        fits = np.minimum(counts, middle).sum() <= most
        low, high = (middle, high) if fits else (low, middle - 1)
    return low


def _clustered(mesh: ColoredMesh, most: int) -> ColoredMesh:
    """Return the mesh with merged corners, on the finest grid with at most ``most`` triangles."""
    low, high, best = _COARSEST, _FINEST, _on_grid(mesh, _COARSEST)
    while low < high:
        middle = (low + high + 1) // 2
        found = _on_grid(mesh, middle)
        if len(found.triangles) <= most:
            low, best = middle, found
        else:
            high = middle - 1
    return best


def _on_grid(mesh: ColoredMesh, cells: int) -> ColoredMesh:
    """Merge the corners in a cell that face the same way and have the same color."""
    lowest = mesh.positions.min(axis=0)
    edge = float((mesh.positions.max(axis=0) - lowest).max()) / cells or 1.0
    cell = np.floor((mesh.positions - lowest) / edge).astype(np.int64)
    side = np.abs(mesh.normals).argmax(axis=1)
    side = 2 * side + (np.take_along_axis(mesh.normals, side[:, np.newaxis], 1)[:, 0] < 0.0)
    color = mesh.colors.astype(np.int64) @ (1, 256, 65_536)
    place = cell @ (1, cells + 1, (cells + 1) ** 2)
    _, same = np.unique(np.column_stack((place, side, color)), axis=0, return_inverse=True)
    same = same.reshape(-1)
    count = np.bincount(same).astype(float)
    triangles = np.unique(same[mesh.triangles], axis=0)
    places = place[_first_rows(same, len(count))][triangles]  # triangles in one cell are points
    is_area = ((places[:, 0] != places[:, 1]) & (places[:, 1] != places[:, 2])
               & (places[:, 2] != places[:, 0]))
    normals = _means(same, count, mesh.normals)
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    return ColoredMesh(_means(same, count, mesh.positions),
                       np.divide(normals, length, out=np.zeros_like(normals), where=length > 0.0),
                       mesh.colors[_first_rows(same, len(count))],
                       triangles[is_area], mesh.has_colors)


def _first_rows(same: np.ndarray, count: int) -> np.ndarray:
    rows = np.empty(count, np.int64)
    rows[same[::-1]] = np.arange(len(same))[::-1]
    return rows


def _means(same: np.ndarray, count: np.ndarray, values: np.ndarray) -> np.ndarray:
    return np.stack([np.bincount(same, column) / count for column in values.T], axis=1)


def _placed(mesh: ColoredMesh, visual: LinkVisual) -> ColoredMesh:
    """Return the mesh in its link, with the color of the model if the mesh has none."""
    turn, size = matrix_from_quaternion(visual.place.quaternion), np.array(visual.size)
    positions = (mesh.positions * size) @ turn.T + np.array(visual.place.position)
    normals = mesh.normals / np.where(size == 0.0, 1.0, size)
    normals = normals / np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    triangles = mesh.triangles if float(np.prod(size)) >= 0.0 else mesh.triangles[:, ::-1]
    colors = mesh.colors
    if not mesh.has_colors:
        color = _PLAIN if visual.color is None else visual.color
        colors = np.tile(np.rint(255.0 * np.clip(color[:3], 0.0, 1.0)).astype(np.uint8),
                         (len(positions), 1))
    return ColoredMesh(positions, normals @ turn.T, colors, triangles)


def _joined(meshes: Sequence[ColoredMesh]) -> ColoredMesh:
    begins = np.cumsum([0] + [len(it.positions) for it in meshes[:-1]])
    positions, normals, colors = (np.concatenate(column) for column in zip(*(
        (it.positions, it.normals, it.colors) for it in meshes)))
    return ColoredMesh(positions, normals, colors, np.concatenate(
        [it.triangles + begin for it, begin in zip(meshes, begins.tolist())]))


def _flat(corners: Sequence[Sequence[float]], normal: Sequence[float],
          faces: Sequence[Tuple[int, int, int]]) -> ColoredMesh:
    count = len(corners)
    return ColoredMesh(np.array(corners, float), np.tile(np.array(normal, float), (count, 1)),
                       np.zeros((count, 3), np.uint8), np.array(faces, np.int64), False)


def _box() -> ColoredMesh:
    """Return a box with edges of length 1."""
    faces = []
    for axis in range(3):
        for sign in (-0.5, 0.5):
            corners = [np.roll((sign, a * np.sign(sign), b), axis)
                       for a, b in ((-.5, -.5), (.5, -.5), (.5, .5), (-.5, .5))]
            faces.append(_flat(np.array(corners).tolist(), np.roll((2 * sign, 0.0, 0.0), axis),
                               ((0, 1, 2), (0, 2, 3))))
    return _joined(faces)._replace(has_colors=False)


def _cylinder() -> ColoredMesh:
    """Return an upright cylinder of diameter and height 1."""
    angles = np.arange(_ROUND) * (2.0 * np.pi / _ROUND)
    ring = np.column_stack((np.cos(angles), np.sin(angles)))
    parts = []
    for sign in (-0.5, 0.5):
        order = [(0, a, a + 1)[::int(2 * sign)] for a in range(1, _ROUND - 1)]
        parts.append(_flat([(0.5 * x, 0.5 * y, sign) for x, y in ring.tolist()],
                           (0.0, 0.0, 2 * sign), [(a, b, c) for a, b, c in order]))
    side = np.column_stack((np.tile(0.5 * ring, (2, 1)), np.repeat((-0.5, 0.5), _ROUND)))
    around = np.arange(_ROUND)
    beside = (around + 1) % _ROUND
    triangles = np.concatenate((np.column_stack((around, beside, beside + _ROUND)),
                                np.column_stack((around, beside + _ROUND, around + _ROUND))))
    normals = np.column_stack((np.tile(ring, (2, 1)), np.zeros(2 * _ROUND)))
    parts.append(ColoredMesh(side, normals, np.zeros((2 * _ROUND, 3), np.uint8), triangles))
    return _joined(parts)._replace(has_colors=False)


def _sphere() -> ColoredMesh:
    """Return a sphere of diameter 1."""
    rows = _ROUND // 2
    up = np.pi * np.arange(rows + 1) / rows
    around = 2.0 * np.pi * np.arange(_ROUND + 1) / _ROUND
    normals = np.stack((np.sin(up)[:, None] * np.cos(around), np.sin(up)[:, None] * np.sin(around),
                        np.repeat(np.cos(up)[:, None], _ROUND + 1, axis=1)), axis=-1).reshape(-1, 3)
    corner = (np.arange(rows)[:, None] * (_ROUND + 1) + np.arange(_ROUND)).reshape(-1)
    below = corner + _ROUND + 1
    triangles = np.concatenate((np.column_stack((corner, below, below + 1)),
                                np.column_stack((corner, below + 1, corner + 1))))
    return ColoredMesh(0.5 * normals, normals, np.zeros((len(normals), 3), np.uint8), triangles,
                       False)


_SHAPES = {ShapeKind.BOX: _box, ShapeKind.CYLINDER: _cylinder, ShapeKind.SPHERE: _sphere}
