# SPDX-License-Identifier: BSD-3-Clause
"""Checks of mesh files and their addresses, and the library that reads them.

A reader would wait forever at a pipe, and read a device without end. A Collada file of some kB can
instantiate a node within others again and again, or nest nodes until the reader's stack is full.
``src/mesh/mesh_file.cpp`` checks files for all readers, including those of the nodes in C++.
"""
from __future__ import annotations

import ctypes
import os
import re
import stat
from contextlib import contextmanager
from functools import lru_cache
from typing import Any, Iterator, Optional, Tuple
from urllib.parse import unquote

import rospkg

from process_visualizer.cell.errors import shortened
from process_visualizer.cell.trust import in_a_package

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


# The meshes of markers that others have recorded or sent. RViz passes their addresses to libcurl,
# which takes an address without a scheme for a host name, and "http:/x" for "http://x". So every
# address that is not known to be local counts as remote. libcurl leaves out what follows a "?" or a
# "#", by which assimp would choose another format.

_HERE = re.compile(r'(?:package|file):|/(?!/)', re.IGNORECASE)
_IN_PACKAGE = re.compile(r'package://([^/]*)(?:/(.*))?', re.DOTALL)
_IN_FILE = re.compile(r'(?:file:(?://(?:localhost)?)?)?(/(?!/).*)', re.DOTALL | re.IGNORECASE)
_ENDINGS = ('.stl', '.dae', '.obj')


def mesh_problem(address: str) -> str:
    """Return why RViz must not open the mesh of a marker that others wrote; '' if it may.

    RViz would contact any computer, wait forever at a pipe, and read a device or the scene of a
    hostile file without end. Files of installed packages may have any format. A missing file is
    not such a problem.
    """
    if not _HERE.match(address):
        return f'RViz would ask another computer for the mesh {shortened(address)}'
    path = _path_of(address)
    if path is None:
        return f'{shortened(address)} is not a plain address of a mesh'
    try:
        status = os.stat(path)
    except (OSError, ValueError):
        return ''
    if not stat.S_ISREG(status.st_mode):
        return f'the mesh {path} is not a file'
    return _problem(path, address.lower().endswith(_ENDINGS), status.st_mtime_ns, status.st_size)


def _path_of(address: str) -> Optional[str]:
    """Return the file that RViz opens for a local address; None if this is not certain."""
    if not address.isprintable() or '?' in address or '#' in address:
        return None
    found = _IN_PACKAGE.fullmatch(address)
    if found is not None:
        folder = _folder_of(found[1])
        return folder and os.path.join(folder, unquote(found[2] or ''))
    found = _IN_FILE.fullmatch(address)
    return None if found is None else unquote(found[1])


@lru_cache(maxsize=64)
def _folder_of(package: str) -> str:
    try:
        return str(rospkg.RosPack().get_path(package))
    except rospkg.ResourceNotFound:
        return ''


@lru_cache(maxsize=256)
def _problem(path: str, has_ending: bool, _changed_ns: int, _size: int) -> str:
    if in_a_package(path):
        return ''
    if not has_ending:
        return f'the mesh {path} is in no installed package; elsewhere, only STL, Collada (.dae) ' \
               'and OBJ are read'
    try:
        check_mesh_file(path)
    except MeshError as error:
        return str(error)
    return ''


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
