# SPDX-License-Identifier: BSD-3-Clause
"""The packages whose nodes may run because a recording names them: the user's own list."""
from __future__ import annotations

import os
from pathlib import Path
from typing import FrozenSet, Optional

from process_visualizer.cell.model import Cell
from process_visualizer.cell.values import package as checked_package


def trust_file() -> str:
    """Return the path of the list, which has one name a line."""
    folder = os.environ.get('XDG_CONFIG_HOME') or os.path.join(os.path.expanduser('~'), '.config')
    return os.path.join(folder, 'process_visualizer', 'trusted_packages')


def trusted_packages(opened: Optional[Cell] = None) -> FrozenSet[str]:
    """Return the packages on the list, and those whose nodes the ``opened`` configuration starts.

    Raises:
        OSError, ValueError: the list cannot be read.
    """
    path = Path(trust_file())
    names = path.read_text(encoding='utf-8').split() if path.exists() else []
    return frozenset((*names, *(_started_by(opened) if opened is not None else ())))


def _started_by(cell: Cell) -> FrozenSet[str]:
    if cell.provenance.is_data:
        return frozenset()
    return frozenset(package for device in cell.devices for package in (
        *(node.package for node in device.nodes),
        *(file.package for file in device.launch_files)))


def set_trusted(name: str, is_trusted: bool) -> None:
    """Put a package on the list, or take it off.

    Raises:
        OSError, ValueError: the list cannot be read or written, or it is no name of a package.
    """
    names = trusted_packages() - {checked_package(name)} | ({name} if is_trusted else set())
    path = Path(trust_file())
    path.parent.mkdir(parents=True, exist_ok=True)
    new = path.with_name(f'{path.name}.new')
    new.write_text(''.join(f'{it}\n' for it in sorted(names)), encoding='utf-8')
    new.replace(path)
