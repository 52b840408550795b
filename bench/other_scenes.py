# SPDX-License-Identifier: BSD-3-Clause
"""Detection in other scenes than watch.py's, by a renderer that shares nothing with it.

usage: bench/run other_scenes [--scene a,b,c,d,e] [--sensor kinect,realsense,tof] [--hz 10]
                              [--seed 1,2] [--learn 0,1] [--seconds 5] [--dump]

a: floor and table from above; b: the corner of a room, with walls inside the region; c: a low
sensor; d: a palletizer with goods on a belt; e: a machine, a fence and a shelf. L and N: a covered
lens; K: a sensor that was turned by 10°; P: a person at the height of a table elsewhere; W: people
in front of a wall. With --learn 1, the static things at the start are expected. --dump prints each
failure.

A distance is too large if it exceeds that of the thing's nearest pixel with a measured depth by
2 cm and three standard deviations of the sensor, also where the sensor mixes that depth with what
is behind. `near` counts distances that are too small by as much: hidden parts may be nearer than
visible ones.
"""
from __future__ import annotations

import os
import sys

from watch import build_program

PROGRAM = 'other_scenes_benchmark'

if __name__ == '__main__':
    program = build_program(PROGRAM)
    os.execv(program, [program, *sys.argv[1:]])
