# SPDX-License-Identifier: BSD-3-Clause
"""The packages whose nodes may run because a recording names them: the user's own list."""
from __future__ import annotations

import os
from pathlib import Path
from typing import FrozenSet

from process_visualizer.cell.values import package as checked_package


def trust_file() -> str:
    """Return the path of the list, which has one name a line."""
    folder = os.environ.get('XDG_CONFIG_HOME') or os.path.join(os.path.expanduser('~'), '.config')
    return os.path.join(folder, 'process_visualizer', 'trusted_packages')


def trusted_packages() -> FrozenSet[str]:
    """Return the packages on the list.

    Raises:
        OSError: the list cannot be read.
        ValueError: it is no text.
    """
    path = Path(trust_file())
    return frozenset(path.read_text(encoding='utf-8').split() if path.exists() else ())


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
