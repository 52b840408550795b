# SPDX-License-Identifier: BSD-3-Clause
"""Measures the distance of an arrow from its tool in the pictures that RViz draws.

usage: bench/run arrow_foot [--pictures 60] [--speed 0.5] [--keep FOLDER]

The upper robot moves its tool along a circle; its driver sends 125 times a second. Only a ball of
its model is drawn, with its center at the tool, seen from above. A constant force gives an arrow
of constant length and direction, so the distance from the ball's center to the arrow's tip is the
same in every picture, unless the arrow's foot and the tool are drawn at different positions. Beside
it is an arrow as in the thesis: at the driver's last tool position in the base frame, not locked
to a frame. The positions of the tips at rest, and their scatter, are measured first.
"""
from __future__ import annotations

import argparse
import os
import re
import signal
import subprocess
import sys
import threading
import time
from contextlib import contextmanager
from pathlib import Path
from typing import Dict, Iterator, List

import numpy as np
import rospy
import tf2_ros
import yaml
from arrow_picture import LOCKED, UNLOCKED, Window, distances, take_picture, tips_from_ball
from geometry_msgs.msg import Point
from std_msgs.msg import Float32MultiArray
from visualization_msgs.msg import Marker, MarkerArray

from process_visualizer.nodes.view_picture import ViewWatcher, wait_for_master
from process_visualizer.robot.rotations import rotated
from sewing_cell.layout import UPPER

ROBOT = 'ur_rt_upper'
RATE_HZ, MARKER_RATE_HZ = 125.0, 30.0
CENTER_M, RADIUS_M = np.array([-0.55, 0.25, 0.25]), 0.1
LENGTH_M, FORCE_N = 0.12, 20.0
PIXELS_PER_M = 2000.0
_WINDOW = Window(400, 80, 1150, 880)
_STANDING = 10  # pictures
_CONFIGURATION = f"""<visualizer>
  <device type="robot" name="{ROBOT}">
    <model pkg="arrow_foot_models" path="robot.urdf" />
    <base frame="{ROBOT}/link0" />
    <topic ns="{ROBOT}" name="q_act" type="joint_states" />
    <topic ns="ft_upper" name="ft" type="force_sensor" />
    <force parentframe="{ROBOT}/tool" frame="{ROBOT}/force" xyz="0 0 0"
      rpy="-1.570796 0 0" />
    <arrow quantity="force" scale="{LENGTH_M / FORCE_N}" min="0.01" max="1" color="1 0 0" />
  </device>
  <device type="other" name="thesis"><rviz type="MarkerArray" topic="/thesis" /></device>
</visualizer>
"""
_PACKAGE = """<package format="2"><name>arrow_foot_models</name><version>0.0.0</version>
<description>A robot that is drawn as a ball.</description>
<maintainer email="a@b.c">nobody</maintainer><license>BSD</license></package>
"""
_BALL = """<visual><geometry><sphere radius="0.02" /></geometry>
<material name="ball"><color rgba="1 0 1 1" /></material></visual>"""
_VIEW = {'Class': 'rviz/TopDownOrtho', 'Name': 'Current View', 'Near Clip Distance': 0.01,
         'Scale': PIXELS_PER_M, 'Angle': 0.0, 'Target Frame': 'world',
         'X': float(CENTER_M[0]), 'Y': float(CENTER_M[1])}


class Driver:
    """The robot's driver and the thesis' way of drawing, at a speed that can be changed."""

    def __init__(self) -> None:
        self.speed_m_per_s = 0.0
        self._joints = rospy.Publisher(f'/{ROBOT}/q_act', Float32MultiArray, queue_size=10)
        self._force = rospy.Publisher('/ft_upper/ft', Float32MultiArray, queue_size=10)
        self._markers = rospy.Publisher('/thesis', MarkerArray, queue_size=10)
        threading.Thread(target=self._drive, daemon=True).start()

    def _drive(self) -> None:
        rate, angle, tick = rospy.Rate(RATE_HZ), 0.0, 0
        force = [*UPPER.to_force_frame(np.array([FORCE_N, 0.0, 0.0])), 0.0, 0.0, 0.0]
        while not rospy.is_shutdown():
            angle += self.speed_m_per_s / RADIUS_M / RATE_HZ
            position = CENTER_M + RADIUS_M * np.array([np.cos(angle), np.sin(angle), 0.0])
            self._joints.publish(data=UPPER.joints(position).tolist())
            self._force.publish(data=force)
            if tick % round(RATE_HZ / MARKER_RATE_HZ) == 0:
                self._markers.publish([_thesis_arrow(position)])
            tick += 1
            rate.sleep()


def _thesis_arrow(position: np.ndarray) -> Marker:
    marker = Marker(ns='thesis', type=Marker.ARROW)
    marker.header.frame_id = f'{ROBOT}/link0'
    marker.points = [Point(*position), Point(*(position - [LENGTH_M, 0.0, 0.0]))]
    marker.pose.orientation.w = 1.0
    marker.scale.x, marker.scale.y = 0.012, 0.024
    marker.color.b = marker.color.a = 1.0
    return marker


class Feet:
    """The foot of the arrow in tf, relative to the tool, when its marker arrives."""

    def __init__(self) -> None:
        self.distances_m: List[float] = []
        self._buffer = tf2_ros.Buffer()
        self._listener = tf2_ros.TransformListener(self._buffer)
        self._subscriber = rospy.Subscriber(f'/{ROBOT}/marker_array', MarkerArray, self._take)

    def _take(self, array: MarkerArray) -> None:
        for arrow in (marker for marker in array.markers if marker.type == Marker.ARROW):
            transform = self._buffer.lookup_transform(
                f'{ROBOT}/tool', arrow.header.frame_id, arrow.header.stamp).transform
            turn, place, foot = transform.rotation, transform.translation, arrow.pose.position
            turned = rotated((turn.x, turn.y, turn.z, turn.w), (foot.x, foot.y, foot.z))
            self.distances_m.append(float(np.linalg.norm(
                np.add(turned, (place.x, place.y, place.z)))))


def main() -> int:
    options = _options()
    with _running_cell(Path(os.environ['ROS_HOME'])):
        wait_for_master(30)
        rospy.init_node('arrow_foot', disable_signals=True)
        driver, watcher = Driver(), ViewWatcher()
        if not watcher.wait_until_drawn(30):
            print('\n'.join(watcher.problems()), file=sys.stderr)
            return 1
        standing = _pictures(_STANDING)
        driver.speed_m_per_s = options.speed
        time.sleep(1.0)  # the tool never leaves the circle, but its speed has a step
        feet = Feet()
        moving = _pictures(options.pictures)
    if options.keep:
        np.savez(Path(options.keep) / 'arrow_foot.npz', standing=standing[LOCKED],
                 moving=moving[LOCKED], unlocked=moving[UNLOCKED])
    _print(standing, moving, feet, options.speed)
    return 0


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('--pictures', type=int, default=60)
    parser.add_argument('--speed', type=float, default=0.5, help='of the tool, m/s')
    parser.add_argument('--keep', help='a folder for what was found')
    return parser.parse_args()


@contextmanager
def _running_cell(folder: Path) -> Iterator[None]:
    package = folder / 'arrow_foot_models'
    package.mkdir(parents=True)
    (package / 'package.xml').write_text(_PACKAGE)
    (package / 'robot.urdf').write_text(_ball_robot())
    (folder / 'cell.xml').write_text(_CONFIGURATION)
    environment = {**os.environ,
                   'ROS_PACKAGE_PATH': f'{folder}:{os.environ["ROS_PACKAGE_PATH"]}'}
    subprocess.run(['rosrun', 'process_visualizer', 'cell', 'generate', str(folder / 'cell.xml'),
                    '--output', str(folder / 'cell')], env=environment, check=True,
                   stdout=subprocess.DEVNULL)
    _look_from_above(folder / 'cell' / 'cell.rviz')
    launch = subprocess.Popen(['roslaunch', '--disable-title', str(folder / 'cell/cell.launch')],
                              env=environment, stdout=subprocess.DEVNULL,
                              stderr=subprocess.DEVNULL, start_new_session=True)
    try:
        yield
    finally:
        launch.send_signal(signal.SIGINT)
        launch.wait(30)


def _ball_robot() -> str:
    """The URDF of the upper robot without its meshes, and with a ball at its tool."""
    package = subprocess.run(['rospack', 'find', 'sewing_cell'], stdout=subprocess.PIPE,
                             check=True, text=True).stdout.strip()
    urdf = subprocess.run(['xacro', f'{package}/urdf/{ROBOT}.urdf.xacro'],
                          stdout=subprocess.PIPE, check=True, text=True).stdout
    bare = re.sub(r'<(visual|collision)>.*?</\1>', '', urdf, flags=re.DOTALL)
    tool = re.compile(rf'<link name="{ROBOT}/tool"\s*(/>|>)')
    return tool.sub(lambda found: f'<link name="{ROBOT}/tool">{_BALL}'
                    + ('</link>' if found.group(1) == '/>' else ''), bare)


def _look_from_above(path: Path) -> None:
    config = yaml.safe_load(path.read_text())
    config['Visualization Manager']['Views']['Current'] = _VIEW
    path.write_text(yaml.safe_dump(config, sort_keys=False))


def _pictures(count: int) -> Dict[str, np.ndarray]:
    """Return the tips of the arrows (count, 2) [pixels] relative to the ball, by name."""
    found = [tips_from_ball(take_picture(_WINDOW)) for _ in range(count)]
    return {name: np.array([tips[name] for tips in found]) for name in (LOCKED, UNLOCKED)}


def _print(standing: Dict[str, np.ndarray], moving: Dict[str, np.ndarray], feet: Feet,
           speed: float) -> None:
    print(f'{len(moving[LOCKED])} pictures, tool at {speed:g} m/s\n\n'
          '| | median, mm | p95, mm | max, mm |\n|---|---|---|---|')
    for title, tips, name in (
            ('the robot stands', standing, LOCKED), ('the robot moves', moving, LOCKED),
            ('as in the thesis, the robot moves', moving, UNLOCKED)):
        found = distances(tips[name], standing[name].mean(axis=0))
        print(f'| {title} | ' + ' | '.join(f'{it / PIXELS_PER_M * 1e3:.1f}' for it in found)
              + ' |')
    print(f'\nin tf when a marker comes ({len(feet.distances_m)} of them): at most '
          f'{max(feet.distances_m) * 1e3:g} mm')


if __name__ == '__main__':
    sys.exit(main())
