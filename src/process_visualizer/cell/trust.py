# SPDX-License-Identifier: BSD-3-Clause
"""Decides whether a configuration is trusted, by its origin and the user's list of packages."""
from __future__ import annotations

import os
from dataclasses import dataclass
from enum import Enum
from typing import FrozenSet

import rospkg

from process_visualizer.cell.values import package as checked_package
from process_visualizer.whole_file import small_file, write_small_file

_MAX_BYTES = 1 << 20


class Origin(Enum):
    """The origin of a configuration, in words."""

    DISK = 'a file that the user opened'
    BAG = 'a recording'
    NETWORK = 'a cell that runs'


@dataclass(frozen=True)
class Provenance:
    """The origin of a configuration, the folder of its files, and the trusted packages.

    A file that the user opens may start anything it names; every other configuration is data. For
    data, all files are in ``folder``, and only nodes of ``packages`` are started.
    """

    origin: Origin = Origin.DISK
    folder: str = ''
    packages: FrozenSet[str] = frozenset()

    @property
    def is_data(self) -> bool:
        """Return whether the configuration is data, which may start nothing of its own."""
        return self.origin is not Origin.DISK


OPENED = Provenance()
"""The provenance of a file that the user opened."""


def is_below(path: str, folder: str) -> bool:
    """Return whether a file is in or below a folder, with all links followed.

    A path with a zero byte is in no folder.
    """
    top = os.path.realpath(folder)
    return '\0' not in path and os.path.commonpath([top, os.path.realpath(path)]) == top


def in_a_package(path: str) -> bool:
    """Return whether a file is in the folder of an installed package, with all links followed."""
    packages = rospkg.RosPack()
    return any(is_below(path, packages.get_path(name)) for name in packages.list())


def trust_file() -> str:
    """Return the path of the list of trusted packages, with one name per line."""
    folder = os.environ.get('XDG_CONFIG_HOME') or os.path.join(os.path.expanduser('~'), '.config')
    return os.path.join(folder, 'process_visualizer', 'trusted_packages')


def trusted_packages() -> FrozenSet[str]:
    """Return the trusted packages in the list.

    Raises:
        OSError: the list cannot be read.
        ValueError: the list is not UTF-8 text.
    """
    path = trust_file()
    try:
        return frozenset(small_file(path, _MAX_BYTES).decode().split())
    except FileNotFoundError:
        return frozenset()
    except UnicodeDecodeError as error:
        raise ValueError(f'{path}: {error}; write one name of a package a line, or remove it'
                         ) from None


def set_trusted(name: str, is_trusted: bool) -> None:
    """Add a package to the list of trusted packages, or remove it.

    Raises:
        OSError, ValueError: the list cannot be read or written, or the name is invalid.
    """
    names = trusted_packages() - {checked_package(name)} | ({name} if is_trusted else set())
    path = trust_file()
    os.makedirs(os.path.dirname(path), exist_ok=True)
    write_small_file(path, ''.join(f'{it}\n' for it in sorted(names)).encode())
