# SPDX-License-Identifier: BSD-3-Clause
"""Fit from random wrong poses of the sewing cell's Kinect: how often and how well it succeeds.

usage: bench/run fit [--count 50] [--moments 5] [--shift-mm 20] [--turn-deg 2] [--seed 1]

The sensor's configured pose is wrong by a shift and a turn in random directions, at moments of the
sewing cycle: the robots have moved, the covers (no models) lie on the tables. The node sensor_fit
is called as the launcher does. See still_cell.py for the scene.
"""
from __future__ import annotations

import argparse
import math
import subprocess
import time
from typing import List, NamedTuple, Optional, Tuple

import numpy as np
import rospy
from players import ros_master
from roslib.packages import find_node
from still_cell import RATE_HZ, StillCell

from process_visualizer.cell.model import Pose
from process_visualizer.clients.sensor_fit_client import FitError, fit_sensor
from process_visualizer.robot.rotations import matrix_from_ypr, pose_difference, ypr_from_matrix

PERIOD_S = 20.0


class Outcome(NamedTuple):
    """One fit: the remaining displacement, the message, and the duration."""

    error_mm: float
    error_deg: float
    residual_mm: float
    seconds: float


def displaced(pose: Pose, shift_m: float, turn_rad: float, random: np.random.Generator) -> Pose:
    """Return a pose that is shifted and turned about its own origin, in random directions."""
    direction, axis = (it / np.linalg.norm(it) for it in random.normal(size=(2, 3)))
    a, b, c = axis
    cross = np.array([[0.0, -c, b], [c, 0.0, -a], [-b, a, 0.0]])
    turn = np.eye(3) + math.sin(turn_rad) * cross + (1.0 - math.cos(turn_rad)) * cross @ cross
    yaw, pitch, roll = ypr_from_matrix(turn @ matrix_from_ypr(pose.ypr)).tolist()
    x, y, z = (np.array(pose.xyz) + shift_m * direction).tolist()
    return Pose((x, y, z), (yaw, pitch, roll))


def fitted(stage: StillCell) -> Tuple[Optional[Outcome], str]:
    """Call the node once; return an outcome, or the reason why there is none."""
    begin_s = time.monotonic()
    try:
        found = fit_sensor(stage.sensor, stage.cell.devices, stage.cell.frame)
    except FitError as error:
        return None, str(error)
    rest = pose_difference(found.pose, stage.truth)
    return Outcome(1000.0 * rest.distance_m, math.degrees(rest.angle_rad),
                   1000.0 * found.residual_m, time.monotonic() - begin_s), ''


def measure(options: argparse.Namespace) -> List[Outcome]:
    """Return the outcomes; prints refusals."""
    stage, random = StillCell(), np.random.default_rng(options.seed)
    outcomes = []
    for count in range(options.count):
        if count % max(options.count // options.moments, 1) == 0:
            stage.show(int(random.uniform(0.0, PERIOD_S) * RATE_HZ))
        stage.move_sensor(displaced(stage.truth, options.shift_mm / 1000.0,
                                    math.radians(options.turn_deg), random))
        outcome, refusal = fitted(stage)
        if outcome is None:
            print(f'refused: {refusal}')
        else:
            outcomes.append(outcome)
    return outcomes


def report(outcomes: List[Outcome], count: int) -> None:
    """Print a table."""
    print(f'{len(outcomes)} of {count} fitted')
    if not outcomes:
        return
    print(f'{"":24} {"median":>8} {"90 %":>8} {"largest":>8}')
    for name, unit, values in zip(('shift left', 'turn left', 'residual', 'time'),
                                  ('mm', '°', 'mm', 's'), np.array(outcomes).T):
        median, most, largest = np.quantile(values, (0.5, 0.9, 1.0))
        print(f'{name + " [" + unit + "]":24} {median:8.3f} {most:8.3f} {largest:8.3f}')


def main() -> None:
    """Run the benchmark."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument('--count', type=int, default=50)
    parser.add_argument('--moments', type=int, default=5)
    parser.add_argument('--shift-mm', type=float, default=20.0)
    parser.add_argument('--turn-deg', type=float, default=2.0)
    parser.add_argument('--seed', type=int, default=1)
    options = parser.parse_args()
    with ros_master():
        node = subprocess.Popen(find_node('process_visualizer', 'sensor_fit')[0])
        try:
            rospy.init_node('fit_bench')
            rospy.wait_for_service('/sensor_fit/fit', 30.0)
            report(measure(options), options.count)
        finally:
            node.terminate()
            node.wait()


if __name__ == '__main__':
    main()
