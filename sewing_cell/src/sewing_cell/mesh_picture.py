# SPDX-License-Identifier: BSD-3-Clause
"""Meshes, and the Kinects' pictures of them, by a C++ library (sewing_cell/src/picture).

The calls release Python's global interpreter lock.
"""
from __future__ import annotations

import ctypes
from functools import lru_cache
from typing import Iterator, NamedTuple
from xml.etree import ElementTree

import numpy as np

from sewing_cell import pinhole

_BOX_FACES = np.array(
    [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
)  # corner number: 4 for upper x, 2 for upper y, 1 for upper z; counterclockwise from outside


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
        draw(*mesh, camera_from_mesh, *self)


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


LIBRARY = "libsewing_cell_picture.so"


class _Mesh(ctypes.Structure):
    """The struct Mesh of picture.hpp."""

    _fields_ = [("count", ctypes.c_size_t), ("corners", ctypes.c_void_p),
                ("colors", ctypes.c_void_p)]


class _Picture(ctypes.Structure):
    """The struct Picture of picture.hpp."""

    _fields_ = [
        *((name, ctypes.c_int) for name in ("width", "height")),
        *((name, ctypes.c_double) for name in ("focal_px", "center_u", "center_v")),
        *((name, ctypes.c_void_p) for name in ("depth_m", "color")),
    ]


def draw(corners: np.ndarray, colors: np.ndarray, camera_from_mesh: np.ndarray,
         depth_m: np.ndarray, color: np.ndarray) -> None:
    """Draw triangles into a picture (480, 640) where they are nearer than its depth.

    ``corners`` (n, 3, 3) float32 [m] and ``colors`` (n, 3) uint8; ``camera_from_mesh`` (4, 4);
    ``depth_m`` float32 and ``color`` (480, 640, 3) uint8 are changed.
    """
    pose = np.ascontiguousarray(camera_from_mesh[:3], dtype=np.float64)
    _library().sewing_cell_draw(
        _Mesh(len(corners), _address(corners, np.float32), _address(colors, np.uint8)),
        _address(pose, np.float64),
        _Picture(pinhole.WIDTH, pinhole.HEIGHT, pinhole.FOCAL_LENGTH_PX, pinhole.CENTER_U,
                 pinhole.CENTER_V, _address(depth_m, np.float32), _address(color, np.uint8)),
    )


def measure(depth_m: np.ndarray, noise_steps: np.ndarray) -> np.ndarray:
    """Return a Kinect's measurement of true depths, in mm (uint16), 0 in shadows and holes.

    Depths and noise have the shape (rows, columns) and are float32; see depth_errors.hpp.
    """
    measured = np.empty(depth_m.shape, np.uint16)
    _library().sewing_cell_measure(*depth_m.shape, _address(depth_m, np.float32),
                                   _address(noise_steps, np.float32), measured.ctypes.data)
    return measured


def _address(array: np.ndarray, kind: type) -> int:
    """Return the address of an array, which the library reads as one contiguous block."""
    assert array.flags.c_contiguous and array.dtype == kind, (array.strides, array.dtype)
    return int(array.ctypes.data)


@lru_cache(maxsize=1)
def _library() -> ctypes.CDLL:
    library = ctypes.CDLL(LIBRARY)
    number, address = ctypes.c_int, ctypes.c_void_p
    for function in (library.sewing_cell_draw, library.sewing_cell_measure):
        function.restype = None
    library.sewing_cell_draw.argtypes = [
        ctypes.POINTER(_Mesh), address, ctypes.POINTER(_Picture)]
    library.sewing_cell_measure.argtypes = [number, number, address, address, address]
    return library
