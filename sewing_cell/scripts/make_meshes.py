#!/usr/bin/env python3
"""Writes every mesh of the sewing cell: make_meshes.py [FOLDER], by default ../meshes.

The meshes are of our own making. The same sources always give the same files, byte by byte.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from mesh.collada import write_collada
from mesh.mounting import cell_stand, kinect
from mesh.robot import ROBOT_MESHES
from mesh.sewing_machine import sewing_machine

MESHES = {
    **ROBOT_MESHES,
    "sewing_machine": sewing_machine,
    "cell_stand": cell_stand,
    "kinect": kinect,
}


def main() -> None:
    """Writes the meshes into the folder named on the command line."""
    default = Path(__file__).resolve().parent.parent / "meshes"
    parser = argparse.ArgumentParser(description="Write the meshes of the sewing cell.")
    parser.add_argument("folder", type=Path, nargs="?", default=default)
    folder = parser.parse_args().folder
    folder.mkdir(parents=True, exist_ok=True)
    for name, build in MESHES.items():
        write_collada(folder / f"{name}.dae", build())


if __name__ == "__main__":
    main()
