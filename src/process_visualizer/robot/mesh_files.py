# SPDX-License-Identifier: BSD-3-Clause
"""Checks of mesh files, and the library that reads them.

A reader would wait forever at a pipe, and read a device without end. A Collada file of some kB can
instantiate a node within others again and again, or nest nodes until the reader's stack is full.
``src/mesh/mesh_file.cpp`` checks files for all readers, including those of the nodes in C++.
"""
from __future__ import annotations

import ctypes
import os
from contextlib import contextmanager
from typing import Any, Iterator, Tuple

LIBRARY = 'libprocess_visualizer_mesh.so'


class MeshError(Exception):
    """A mesh cannot be used; the text has the file and the reason."""


def check_mesh_file(path: str) -> None:
    """Check that a file is safe for a reader of meshes.

    Raises:
        MeshError: the file is not safe, or missing.
    """
    with _answer('check', path):
        pass


@contextmanager
def opened_mesh(path: str) -> Iterator[Tuple[Any, int]]:
    """Read a file; yield the library, and the mesh as the argument of its functions.

    Raises:
        MeshError: the mesh cannot be read, or has no triangles.
    """
    with _answer('read', path) as answer:
        yield answer


@contextmanager
def _answer(question: str, path: str) -> Iterator[Tuple[Any, int]]:
    if '\0' in path:
        raise MeshError(f'the mesh {path!a} cannot be read: its name has a zero')
    library = _library()
    mesh = getattr(library, f'colored_mesh_{question}')(os.fsencode(path))
    try:
        problem = library.colored_mesh_error(mesh).decode('utf-8', 'replace')
        if problem:
            raise MeshError(problem)
        yield library, mesh
    finally:
        library.colored_mesh_delete(mesh)


def _library() -> Any:
    library = ctypes.CDLL(LIBRARY)
    for question in ('check', 'read'):
        function = getattr(library, f'colored_mesh_{question}')
        function.argtypes, function.restype = [ctypes.c_char_p], ctypes.c_void_p
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
