# SPDX-License-Identifier: BSD-3-Clause
"""Detection of things and people by sensors other than a Kinect: delay, size and distance.

usage: bench/run watch [--clouds 20] [--seed 1] [--late 0.0] [--room] [--plain] [--verbose]
                       [--only sensor=realsense view=low rate=5 scene=person]

A robot of six joints moves on a floor with three boxes and poles. A ball goes around it; or two
people of fifteen parts walk through at 1.1 to 1.6 m/s; or a box of 8 to 18 cm is thrown through at
1.5 to 3 m/s, and a hand reaches in at 2 m/s. Shapes are analytic, the robot is a mesh. With --room,
there are two walls 10 cm outside of the region, which the sensor faces, and a table in front of
them. Sensors: a Kinect, a stereo sensor (as a RealSense D435) and a time-of-flight sensor, each
with noise that neighbors and clouds share in part, holes, shadows and mixed pixels; from above
(3.2 m), at 45°, low (0.9 m high) and on a link of the robot. All combinations with 5, 10 and 30 Hz.
Everything runs in one process, on simulated time.

A thing is due when 80 of its pixels are visible in the region, its visible part is larger than 5 cm
in two directions, it is 8 cm from the robot, and nobody walks through it. It is late if neither of
the first two clouds in which it is due shows it. Its number is the one it had when it was last
detected, as long as an object with it shows the thing, else that of the largest object: then it is
exchanged (Bernardin and Stiefelhagen 2008). A person with two numbers at once is "seen as several".
An object is false if less than half of its points are on things. For static things that are not
cut off, a size is wrong if it is off by more than 1 cm + 1 % of the range; it is also compared with
the visible part, along the same edge. A distance is too large if it exceeds the measured one, or
the one measured last, by 2 cm and three standard deviations of the sensor (pixels on edges that the
sensor mixes with the background do not count); it is the least of all objects whose box contains
the point nearest to the robot. The last five figures use the definitions of the tables before
2026-11-26: a false object is one whose center is at no thing; each further number of a thing is an
exchange; 80 pixels are due; the distance is that of the nearest object whose center is at the
thing. The plain pipeline is that of any textbook: region, grid of 1 cm, planes by RANSAC, Euclidean
clusters.
"""
from __future__ import annotations

import argparse
import os
import subprocess

PROGRAM = 'watch_benchmark'


def build_program(program: str = PROGRAM) -> str:
    """Build a benchmark in C++; return its path."""
    devel = os.environ['CMAKE_PREFIX_PATH'].split(os.pathsep)[0]
    subprocess.run(['cmake', '--build', os.path.join(devel, '..', 'build'), '--target', program],
                   stdout=subprocess.DEVNULL, check=True)
    return os.path.join(devel, 'lib', 'process_visualizer', program)


def main() -> None:
    """Measure, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--clouds', type=int, default=20, help='of each combination')
    parser.add_argument('--seed', type=int, default=1)
    parser.add_argument('--late', type=float, default=0.0,
                        help='by how much the poses of the robot are older than clouds, s')
    parser.add_argument('--room', action='store_true', help='in a corner, with a table')
    parser.add_argument('--plain', action='store_true', help='the plain pipeline beside it')
    parser.add_argument('--verbose', action='store_true', help='each fault, and each combination')
    parser.add_argument('--only', nargs='*', default=[], help='for example sensor=tof rate=5')
    options = parser.parse_args()
    switches = [f'{name}=1' for name in ('plain', 'verbose', 'room') if getattr(options, name)]
    subprocess.run([build_program(), str(options.clouds), str(options.seed),
                    f'late={options.late}', *switches, *options.only], check=True)


if __name__ == '__main__':
    main()
