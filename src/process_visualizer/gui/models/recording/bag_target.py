# SPDX-License-Identifier: BSD-3-Clause
"""The target file of a recording, and what is in its way."""
from __future__ import annotations

import os
import shutil
from pathlib import Path
from typing import NamedTuple, Optional

FOR_ANYBODY = ('/tmp', '/dev/shm', '/media', '/run/media', '/mnt')
"""Folders that the recorder takes from anybody, besides the home folder."""
LEAST_FREE_BYTES = 1 << 30
"""The recorder starts nothing below this (its parameter ~minimum_free_megabytes)."""


class BagTarget(NamedTuple):
    """A look at the disk; ``problem`` says what is wrong and what to do, or ''.

    ``free_bytes`` and ``total_bytes`` of the disk are None where it cannot be read; ``free_name``
    is a name like the given one that no file has yet.
    """

    problem: str = ''
    free_bytes: Optional[int] = None
    total_bytes: Optional[int] = None
    free_name: str = ''


def look_at(folder: str, name: str = '', prefix: str = '') -> BagTarget:
    """Look whether a bag can be recorded into the folder (a whole path); touches the disk.

    ``name`` is the operator's, '' where the recorder makes one of date and time, perhaps with a
    prefix.
    """
    existing = _existing_parent(Path(folder))
    room = _room(existing)
    problem = (_folder_problem(Path(folder), existing, room.free_bytes)
               or _name_problem(name or prefix))
    if problem or not is_taken(folder, name):
        return room._replace(problem=problem)
    free_name = _free_name(folder, stem_of(name))
    return room._replace(
        free_name=free_name, problem=f'{stem_of(name)}.bag exists already and is not overwritten; '
                                     f'choose another name, such as {free_name}')


def is_for_anybody(folder: str, home: str) -> bool:
    """Return whether the recorder takes a request for the folder, whoever sends it.

    As the defaults of its parameter ``~folders``; another folder must be named when it is started.
    """
    wanted = Path(os.path.realpath(folder))
    return any(above == wanted or above in wanted.parents for above in (
        Path(os.path.realpath(it)) for it in (home, *FOR_ANYBODY)))


def stem_of(name: str) -> str:
    """The name without the ending .bag, as the recorder uses it."""
    return name[:-4] if name.endswith('.bag') and len(name) > 4 else name


def is_taken(folder: str, name: str) -> bool:
    """Return whether a bag of that name is there: finished, in the making, or in parts."""
    stem = os.path.join(folder, stem_of(name))
    return bool(name) and any(os.path.lexists(f'{stem}{part}.bag{ending}')
                              for part in ('', '_0') for ending in ('', '.active'))


def _free_name(folder: str, stem: str) -> str:
    number = 2
    while is_taken(folder, f'{stem}-{number}'):
        number += 1
    return f'{stem}-{number}'


def _existing_parent(folder: Path) -> Path:
    while not os.path.lexists(folder) and folder != folder.parent:
        folder = folder.parent
    return folder


def _room(folder: Path) -> BagTarget:
    try:
        usage = shutil.disk_usage(folder)
    except OSError:
        return BagTarget()
    return BagTarget(free_bytes=usage.free, total_bytes=usage.total)


def _folder_problem(folder: Path, existing: Path, free_bytes: Optional[int]) -> str:
    if not folder.is_absolute():
        return f'Enter a full path (starting with /) instead of "{folder}"'
    if not existing.is_dir():
        return f'{existing} is no folder; choose another'
    if not os.access(existing, os.W_OK | os.X_OK):
        return (f'you may not write into {existing}; choose another folder, or let its owner '
                'give you the permission')
    if free_bytes is not None and free_bytes < LEAST_FREE_BYTES:
        return (f'the disk of {folder} is full: {free_bytes >> 20} MB are left, a recording needs '
                f'{LEAST_FREE_BYTES >> 20} MB; delete old recordings or choose another disk')
    return ''


def _name_problem(name: str) -> str:
    if '/' in name:
        return f'the name "{name}" must not contain a slash; choose the folder above it'
    if name.startswith('.'):
        return f'the name "{name}" must not start with a dot'
    if not name.isprintable():
        return 'the name has a character that cannot be printed; choose another'
    return ''
