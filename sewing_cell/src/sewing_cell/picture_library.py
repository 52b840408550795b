# SPDX-License-Identifier: BSD-3-Clause
"""Calls the C++ library that draws the Kinects' pictures (sewing_cell/src/picture).

The calls release Python's global interpreter lock.
"""

from __future__ import annotations

import ctypes
from functools import lru_cache

import numpy as np

from sewing_cell import pinhole

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
