#!/usr/bin/env python3
# SPDX-License-Identifier: BSD-3-Clause
"""Writes all meshes: make_meshes.py [FOLDER], by default the repository.

Those that any cell can use go to ``meshes``, the others to ``sewing_cell/meshes``. We made them
ourselves. The same sources always give the same files, byte by byte.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from mesh.collada import write_collada
from mesh.mounting import cell_stand, kinect
from mesh.robot import ROBOT_MESHES
from mesh.sewing_machine import sewing_machine

MESHES = {
    'meshes': {**ROBOT_MESHES, 'kinect': kinect},
    'sewing_cell/meshes': {'sewing_machine': sewing_machine, 'cell_stand': cell_stand},
}


def main() -> None:
    """Write the meshes below the folder named on the command line."""
    default = Path(__file__).resolve().parent.parent
    parser = argparse.ArgumentParser(description='Write all meshes.')
    parser.add_argument('folder', type=Path, nargs='?', default=default)
    root = parser.parse_args().folder
    for folder, meshes in MESHES.items():
        (root / folder).mkdir(parents=True, exist_ok=True)
        for name, build in meshes.items():
            write_collada(root / folder / f'{name}.dae', build())


if __name__ == '__main__':
    main()
