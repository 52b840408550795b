# SPDX-License-Identifier: BSD-3-Clause
"""Measures the direction of the velocity's arrow against the tool's true motion.

usage: bench/run arrow_direction [--seconds 20]

Robots like a UR5e and a Panda, with and without hand, move on a known path while their last joint
turns at 1 rad/s; their drivers report the tool by several conventions. Direction and foot of the
arrow are computed as RViz would draw them 60 times a second. Angles are measured from the motion at
the time of the velocity; those in brackets are from the motion at the moment of drawing, which
includes the delay of the velocity.
"""
from __future__ import annotations

import argparse
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import rospy
from arrow_truth import CONVENTIONS, MODELS, Convention, Result, measure

from process_visualizer.nodes.view_picture import wait_for_master


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--seconds', type=float, default=20.0, help='of each convention')
    seconds = parser.parse_args().seconds
    port = os.environ['ROS_MASTER_URI'].rstrip('/').split(':')[-1]
    master = subprocess.Popen(['roscore', '-p', port], stdout=subprocess.DEVNULL,
                              start_new_session=True)
    try:
        wait_for_master(30)
        rospy.init_node('arrow_direction', disable_signals=True)
        print('| robot | the driver reports | median | p95 | max | foot, p95, mm |\n'
              '|---|---|---|---|---|---|')
        for model in MODELS:
            def row(convention: Convention, result: Result, name: str = model.file) -> None:
                print(f'| {name} | {convention.title} | {cells(result)} |', flush=True)
            measure(model, CONVENTIONS, seconds, Path(os.environ['ROS_HOME']) / model.file, row)
    finally:
        master.terminate()
        master.wait(30)
    return 0


def cells(result: Result) -> str:
    angles = [f'{then:.1f}° ({now:.1f}°)' for then, now in zip(
        _figures(result.of_velocity), _figures(result.of_moment))]
    return ' | '.join([*angles, f'{np.quantile(result.feet, 0.95) * 1e3:.1f}'])


def _figures(angles: np.ndarray) -> 'list[float]':
    return [float(np.degrees(np.quantile(angles, part))) for part in (0.5, 0.95, 1.0)]


if __name__ == '__main__':
    sys.exit(main())
