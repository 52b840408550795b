# SPDX-License-Identifier: BSD-3-Clause
"""The origin of a configuration, which decides what of it may be started (docs/security.md)."""
from __future__ import annotations

import os
from dataclasses import dataclass
from enum import Enum
from typing import FrozenSet

import rospkg


class Origin(Enum):
    """The origin of a configuration, in words."""

    DISK = 'a file that the user opened'
    BAG = 'a recording'
    NETWORK = 'a cell that runs'


@dataclass(frozen=True)
class Provenance:
    """The origin of a configuration, the folder of its files, and the packages that are trusted.

    What the user opens from the disk may start what it says; everything else is data. Of data
    ``folder`` holds all files, and only nodes of ``packages`` are started.
    """

    origin: Origin = Origin.DISK
    folder: str = ''
    packages: FrozenSet[str] = frozenset()

    @property
    def is_data(self) -> bool:
        """Return whether nothing that the configuration says may run."""
        return self.origin is not Origin.DISK


OPENED = Provenance()
"""That of a file that the user opened."""


def is_below(path: str, folder: str) -> bool:
    """Return whether a file is in a folder, or below it, when all links are followed."""
    top = os.path.realpath(folder)
    return os.path.commonpath([top, os.path.realpath(path)]) == top


def in_a_package(path: str) -> bool:
    """Return whether a file is in an installed package's folder, when all links are followed."""
    packages = rospkg.RosPack()
    return any(is_below(path, packages.get_path(name)) for name in packages.list())
