# SPDX-License-Identifier: BSD-3-Clause
"""Accuracy and time of removing robots from clouds and finding objects in the rest.

usage: bench/run objects [--frames 1000] [--scenes 3]

Two robots of the sewing cell move all their joints at 1 rad/s before a Kinect (640x480, with its
noise and mixed pixels), above a table with five objects, two of which move on circles. A board as a
robot may carry it passes over the table, and hides each object for 0.5 to 1.7 s. The owner of each
pixel is known, as the clouds are rendered. The first scene is always the same; sizes, positions and
speeds of the others are drawn from their numbers. The robots' poses first have the clouds' time,
then they are 5 ms older. Limits: at least 99.5 % of the points on robots and at most 0.5 % of
others are removed, at most one number is exchanged in 1,000 clouds, and all of it takes at most
half of a core at 30 Hz, which is 16.7 ms for each cloud.
"""
from __future__ import annotations

import argparse
import os
import subprocess
import tempfile
from pathlib import Path
from typing import List

import rospkg

from process_visualizer.cell.model import DeviceType
from process_visualizer.cell.xml_parser import XmlParser
from process_visualizer.robot.description import describe_devices

PROGRAM = 'objects_benchmark'
DELAYS_S = (0.0, 0.005)
SPEED_RAD_PER_S = 1.0


def build_program() -> str:
    """Build the benchmark in C++; return its path."""
    devel = os.environ['CMAKE_PREFIX_PATH'].split(os.pathsep)[0]
    subprocess.run(['cmake', '--build', os.path.join(devel, '..', 'build'), '--target', PROGRAM],
                   stdout=subprocess.DEVNULL, check=True)
    return os.path.join(devel, 'lib', 'process_visualizer', PROGRAM)


def write_models(folder: Path) -> List[str]:
    """Write the models of the cell's robots, with paths of meshes; return the files' names."""
    packages = rospkg.RosPack()
    cell = XmlParser().parse(str(Path(packages.get_path('sewing_cell'))
                                 / 'devices' / 'simulated.xml'))
    robots = [device for device in cell.devices if device.type is DeviceType.ROBOT]
    descriptions, problems = describe_devices(robots)
    assert not problems, problems
    files = []
    for name, description in descriptions.items():
        text = description.text
        for package in ('process_visualizer', 'sewing_cell'):
            text = text.replace(f'package://{package}/', f'{packages.get_path(package)}/')
        file = folder / f'{name}.urdf'
        file.write_text(text, encoding='utf-8')
        files.append(str(file))
    return files


def main() -> None:
    """Measure, and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--frames', type=int, default=1000, help='clouds of each scene')
    parser.add_argument('--scenes', type=int, default=3)
    options = parser.parse_args()
    program = build_program()
    with tempfile.TemporaryDirectory() as folder:
        models = write_models(Path(folder))
        for delay_s in DELAYS_S:
            print(f'poses of robots {1000 * delay_s:g} ms old', flush=True)
            subprocess.run([program, str(options.frames), str(options.scenes),
                            str(SPEED_RAD_PER_S), str(delay_s), *models], check=True)


if __name__ == '__main__':
    main()
