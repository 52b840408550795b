# SPDX-License-Identifier: BSD-3-Clause
"""Files with meshes: which of them are read at all.

A reader waits for ever at a pipe, and reads a device without end. A Collada file of some kB can
show one node again and again within others, or nest nodes until the reader's stack is full.
"""
from __future__ import annotations

import os
import stat
from typing import Any, Dict, List, Mapping, Union
from xml.parsers import expat

MAX_FILE_BYTES = 400_000_000
"""assimp takes several times as much memory."""
_MAX_NODES = 100_000
"""Of a Collada scene, each counted as often as it is shown."""
_DEEPEST = 200


class MeshError(Exception):
    """A mesh cannot be used; says which file and why."""


def check_mesh_file(path: str) -> None:
    """Look whether a file can be given to a reader of meshes.

    Raises:
        MeshError: it cannot, or there is none.
    """
    try:
        status = os.stat(path)
    except OSError as error:
        raise MeshError(f'the mesh {path} cannot be read: {error.strerror}') from None
    if not stat.S_ISREG(status.st_mode):
        raise MeshError(f'the mesh {path} is not a file')
    if status.st_size > MAX_FILE_BYTES:
        raise MeshError(f'the mesh {path} has {status.st_size / 1e6:.0f} MB; it is left out')
    if path.lower().endswith('.dae'):
        try:
            _check_collada(path)
        except (OSError, expat.ExpatError, RecursionError, ValueError) as error:
            raise MeshError(f'the mesh {path} cannot be read: {error}') from None


def _check_collada(path: str) -> None:
    scene = _Scene()
    parser = expat.ParserCreate()
    parser.StartElementHandler, parser.EndElementHandler = scene.begin, scene.end
    parser.StartDoctypeDeclHandler = scene.refuse
    with open(path, 'rb') as file:
        parser.ParseFile(file)
    scene.check()


class _Scene:
    """The nodes of a Collada file by number, and what each has in it."""

    def __init__(self) -> None:
        self._parts: List[List[Union[int, str]]] = [[]]  # numbers, or ids of what is shown again
        self._numbers: Dict[str, int] = {}
        self._open = [0]
        self._depth = 0

    def begin(self, tag: str, attributes: Mapping[str, Any]) -> None:
        self._depth += 1
        if self._depth > _DEEPEST:
            raise ValueError(f'its elements are nested more than {_DEEPEST} deep')
        name = tag.rpartition(':')[2]
        if name == 'instance_node':
            self._parts[self._open[-1]].append(attributes.get('url', '').lstrip('#'))
        elif name == 'node':
            number = len(self._parts)
            self._parts.append([])
            self._parts[self._open[-1]].append(number)
            self._numbers.setdefault(attributes.get('id', ''), number)
            self._open.append(number)

    def end(self, tag: str) -> None:
        self._depth -= 1
        if tag.rpartition(':')[2] == 'node':
            self._open.pop()

    def refuse(self, *_declaration: Any) -> None:
        raise ValueError('it has a DOCTYPE, whose entities can be of any size')

    def check(self) -> None:
        if self._count(0, {}) > _MAX_NODES:
            raise ValueError(f'it shows more than {_MAX_NODES} nodes')

    def _count(self, number: int, known: Dict[int, int]) -> int:
        """Return how many nodes a node shows, itself included."""
        if number not in known:
            known[number] = _MAX_NODES + 1  # for those that contain themselves
            inside = (self._numbers.get(it) if isinstance(it, str) else it
                      for it in self._parts[number])
            known[number] = min(_MAX_NODES + 1, 1 + sum(
                self._count(it, known) for it in inside if it is not None))
        return known[number]
