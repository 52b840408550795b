# SPDX-License-Identifier: BSD-3-Clause
"""Measures the direction of the arrows in scripts/own_cell against the tools' true motion.

usage: bench/run own_cell FOLDER [--seconds 20]

The packages ur_description and franka_description are below the folder. Angles are measured from
the motion at the time of the velocity; those in brackets, from the motion at the moment of drawing.
"""
from __future__ import annotations

import argparse
import os
import signal
import subprocess
import sys
from pathlib import Path
from typing import Dict

import rospy
from arrow_direction import cells
from arrow_truth import Model, Screen, ToolPath, wait_for_arrow

from process_visualizer.nodes.view_picture import wait_for_master
from process_visualizer.robot.kinematics import Kinematics, Placement

CELL = Path(__file__).resolve().parents[1] / 'scripts' / 'own_cell'
sys.path.insert(0, str(CELL))
import drivers  # noqa: E402


class SweptPath(ToolPath):
    """The path on which the drivers move a robot."""

    def positions(self, now_s: float) -> Dict[str, float]:
        """Return the positions of all joints [rad or m] by name."""
        return {**drivers.sweep(self.model.joints, now_s), **self.model.fixed}


ROBOTS = {'ur': Model('ur5e', 'base_link', 'tool0', drivers.UR_JOINTS),
          'franka': Model('panda', 'panda_link0', 'panda_hand_tcp', drivers.PANDA_JOINTS,
                          drivers.FINGERS)}


def path_of(namespace: str, model: Model) -> ToolPath:
    """Return the path of a robot once its driver runs."""
    rospy.wait_for_message(f'/{namespace}/joint_states', rospy.AnyMsg, 60.0)
    return SweptPath(model, Kinematics(rospy.get_param(f'/{namespace}/robot_description')), 0.0)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('folder', help='where the packages of the models are')
    parser.add_argument('--seconds', type=float, default=20.0, help='of each robot')
    arguments = parser.parse_args()
    os.environ['ROS_PACKAGE_PATH'] += os.pathsep + os.path.abspath(arguments.folder)
    commands = (['roslaunch', str(CELL / 'drivers.launch')],
                ['rosrun', 'process_visualizer', 'cell', 'run', '--no-rviz',
                 str(CELL / 'cell.xml')])
    running = []
    try:
        for command in commands:
            running.append(subprocess.Popen(command, stdout=subprocess.DEVNULL,
                                            start_new_session=True))
            wait_for_master(30)
        rospy.init_node('own_cell', disable_signals=True)
        print('| robot | median | p95 | max | foot, p95, mm |\n|---|---|---|---|---|')
        for namespace, model in ROBOTS.items():
            path, device = path_of(namespace, model), model.file
            screen = Screen(model, device)
            wait_for_arrow(screen)
            result = screen.watch(path, Placement(), arguments.seconds)
            print(f'| {device} | {cells(result)} |', flush=True)
            screen.end()
    finally:
        for process in reversed(running):
            process.send_signal(signal.SIGINT)
            process.wait(60)
    return 0


if __name__ == '__main__':
    sys.exit(main())
