# SPDX-License-Identifier: BSD-3-Clause
"""The mesh in a file as triangles with normals and colours, as RViz reads it."""
from __future__ import annotations

import ctypes
import os
from typing import Any, NamedTuple

import numpy as np

LIBRARY = 'libprocess_visualizer_mesh.so'
LARGEST_FILE_BYTES = 400_000_000
"""assimp takes several times as much memory."""


class MeshError(Exception):
    """A mesh cannot be used; says which file and why."""


class ColoredMesh(NamedTuple):
    """Triangles (m, 3) of corners (n, 3) [m] with ``normals`` (n, 3) and ``colors`` (n, 3) 0..255.

    ``has_colors`` says whether the file has any; otherwise they are grey.
    """

    positions: np.ndarray
    normals: np.ndarray
    colors: np.ndarray
    triangles: np.ndarray
    has_colors: bool = True


def read_colored_mesh(path: str) -> ColoredMesh:
    """Return the mesh in a file (STL, Collada, OBJ and what else assimp reads).

    Raises:
        MeshError: it cannot be read, or has no triangles.
    """
    try:
        size = os.path.getsize(path)
    except OSError as error:
        raise MeshError(f'the mesh {path} cannot be read: {error.strerror}') from None
    if size > LARGEST_FILE_BYTES:
        raise MeshError(f'the mesh {path} has {size / 1e6:.0f} MB; it is left out')
    library = _library()
    mesh = library.colored_mesh_read(os.fsencode(path))
    try:
        reason = library.colored_mesh_error(mesh).decode('utf-8', 'replace')
        if reason:
            raise MeshError(f'the mesh {path} cannot be read: {reason}')
        return _checked(path, _copied(library, mesh))
    finally:
        library.colored_mesh_delete(mesh)


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
    """The mesh without triangles that are nowhere."""
    is_finite = np.isfinite(mesh.positions).all(axis=1)
    triangles = mesh.triangles[is_finite[mesh.triangles].all(axis=1)]
    if not len(triangles):
        raise MeshError(f'the mesh {path} cannot be read: it has no triangles')
    return mesh._replace(positions=np.where(is_finite[:, np.newaxis], mesh.positions, 0.0),
                         normals=np.nan_to_num(mesh.normals), triangles=triangles)


def _library() -> Any:
    library = ctypes.CDLL(LIBRARY)
    library.colored_mesh_read.argtypes = [ctypes.c_char_p]
    library.colored_mesh_read.restype = ctypes.c_void_p
    results = {'error': ctypes.c_char_p, 'has_colors': ctypes.c_int, 'delete': None,
               'corners': ctypes.c_size_t, 'triangles': ctypes.c_size_t,
               'positions': ctypes.POINTER(ctypes.c_float),
               'normals': ctypes.POINTER(ctypes.c_float),
               'colors': ctypes.POINTER(ctypes.c_uint8),
               'indices': ctypes.POINTER(ctypes.c_uint32)}
    for name, result in results.items():
        function = getattr(library, f'colored_mesh_{name}')
        function.argtypes, function.restype = [ctypes.c_void_p], result
    return library
