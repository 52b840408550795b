# SPDX-License-Identifier: BSD-3-Clause
"""Fixtures of the command ``cell``."""
from __future__ import annotations

from pathlib import Path
from typing import Callable

import pytest


@pytest.fixture
def write(tmp_path: Path) -> Callable[..., str]:
    """Writes the content of a <visualizer> to a file and returns its path."""
    def write_text(inside: str, name: str = 'cell.xml') -> str:
        path = tmp_path / name
        path.write_text(f'<visualizer>\n{inside}\n</visualizer>', encoding='utf-8')
        return str(path)
    return write_text
