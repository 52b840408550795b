# SPDX-License-Identifier: BSD-3-Clause
"""Compares pictures of RViz."""
from __future__ import annotations

import subprocess
from pathlib import Path


def different_pixels(first: Path, second: Path, area: str) -> int:
    """Return the number of pixels of an area, such as 1200x800+200+80, that differ visibly."""
    compared = subprocess.run(
        ['compare', '-metric', 'AE', '-fuzz', '8%', f'{first}[{area}]', f'{second}[{area}]',
         'null:'], stderr=subprocess.PIPE, text=True, check=False)
    return int(float(compared.stderr.split()[0]))
