# SPDX-License-Identifier: BSD-3-Clause
"""Counts parts of a moving robot that are shown as objects after seeks and steps while paused.

usage: bench/run paused_seeks [--seeks 200] [--seed 7]

An arm of three joints moves at up to 1.2 rad/s; its driver sends 125 joint states a second. Three
sensors above it send clouds at 5, 10 and 30 Hz, which are recorded 40 ms after they were taken.
Each looks for objects; there is one, a box on the floor. The recording is played by the cell's own
nodes, started by ``cell run`` without RViz. Playback is paused, and seeks to random positions;
every fifth time it then steps by one cloud. The objects of each sensor are recorded until the
scene has been repeated and nothing changes any more.
"""
from __future__ import annotations

import argparse
import math
import os
import random
import signal
import subprocess
import tempfile
import threading
import time
from pathlib import Path
from typing import Any, Dict, List, NamedTuple, Sequence, Tuple

import numpy as np
import rosbag
import rospy
from players import ros_master
from sensor_msgs.msg import JointState, PointCloud2, PointField
from std_msgs.msg import Header
from std_srvs.srv import Trigger

from process_visualizer.msg import DetectedObjects, PlayerState
from process_visualizer.robot.kinematics import Kinematics, Placement
from process_visualizer.robot.rotations import matrix_from_quaternion
from process_visualizer.srv import Seek, Step

BEGIN_S, LENGTH_S = 1_600_000_000.0, 10.0
JOINTS_HZ, LATE_S = 125.0, 0.04
SENSORS_HZ: Dict[str, float] = {'five': 5.0, 'ten': 10.0, 'thirty': 30.0}
PLACES: Dict[str, Tuple[float, float, float]] = {
    'five': (0.1, 0.0, 2.3), 'ten': (0.0, 0.15, 2.3), 'thirty': (-0.1, -0.1, 2.3)}
WIDTH, HEIGHT, FOCAL = 240, 200, 160.0
NOISE_M = 0.0013  # at 1 m; it grows with the square of the distance
BOX = ((-0.75, 0.55, 0.1), (0.3, 0.2, 0.2))
"""Its center and size [m]."""
LINKS: Dict[str, Tuple[Tuple[float, float, float], Tuple[float, float, float]]] = {
    'foot': ((0.0, 0.0, 0.2), (0.2, 0.2, 0.4)), 'shoulder': ((0.0, 0.0, 0.1), (0.16, 0.16, 0.2)),
    'upper': ((0.25, 0.0, 0.0), (0.5, 0.12, 0.12)), 'fore': ((0.22, 0.0, 0.0), (0.44, 0.1, 0.1))}
"""The box of each link: its center and size in the link's frame [m]."""
JOINTS = (('turn', 'foot', 'shoulder', '0 0 0.4', '0 0 1'),
          ('lift', 'shoulder', 'upper', '0 0 0.2', '0 1 0'),
          ('elbow', 'upper', 'fore', '0.5 0 0', '0 1 0'))
RESTS_S = 0.8
FEW_S, MANY_S = 60.0, 120.0


def model() -> str:
    """Return the arm's URDF."""
    links = ''.join(
        f'<link name="arm/{name}"><visual><origin xyz="{x} {y} {z}"/><geometry><box size="{a} {b} '
        f'{c}"/></geometry></visual></link>' for name, ((x, y, z), (a, b, c)) in LINKS.items())
    joints = ''.join(
        f'<joint name="arm/{name}" type="revolute"><parent link="arm/{parent}"/>'
        f'<child link="arm/{child}"/><origin xyz="{place}"/><axis xyz="{axis}"/>'
        '<limit lower="-6" upper="6" effort="1" velocity="9"/></joint>'
        for name, parent, child, place, axis in JOINTS)
    return f'<robot name="arm">{links}{joints}</robot>'


def configuration() -> str:
    """Return the cell."""
    sensors = ''.join(
        f'<device type="depth_sensor" name="{name}"><base frame="{name}/eye" '
        f'xyz="{x} {y} {z}" ypr="0 0 {math.pi}"/>'
        f'<topic ns="{name}" name="cloud" type="pointcloud"/>'
        '<objects warn="0.5" stop="0.2" xyz="0 0 0.7" size="2.6 2.2 1.36"/></device>'
        for name, (x, y, z) in PLACES.items())
    return ('<visualizer><device type="robot" name="arm"><model path="arm.urdf"/>'
            '<base frame="arm/foot" xyz="0 0 0" ypr="0 0 0"/>'
            '<topic ns="arm" name="q" type="joint_states" msg="sensor_msgs/JointState"/></device>'
            f'{sensors}</visualizer>')


def positions(time_s: float) -> Dict[str, float]:
    """Return the joint positions [rad]."""
    return {'arm/turn': 1.5 * math.sin(0.8 * time_s), 'arm/lift': 0.3 * math.sin(1.7 * time_s),
            'arm/elbow': 0.6 + 0.6 * math.sin(1.3 * time_s)}


class Camera:
    """A sensor that sees boxes and the floor from above."""

    def __init__(self, place: Sequence[float], seed: int) -> None:
        v, u = np.meshgrid(np.arange(HEIGHT) - HEIGHT / 2, np.arange(WIDTH) - WIDTH / 2,
                           indexing='ij')
        self._rays = np.stack([u / FOCAL, v / FOCAL, np.ones_like(u)], -1).reshape(-1, 3)
        self._turn = np.diag([1.0, -1.0, -1.0])  # optical axes in the world
        self._place, self._noise = np.asarray(place), np.random.default_rng(seed)

    def depth(self, boxes: Sequence[Tuple[Placement, Sequence[float]]]) -> np.ndarray:
        """Return the depth of each pixel (n,) [m] before boxes, by the boxes' positions."""
        rays = self._rays @ self._turn.T
        depth = -self._place[2] / rays[:, 2]  # the floor
        for place, size in boxes:
            turn = np.asarray(matrix_from_quaternion(place.quaternion))
            eye, inside = (self._place - place.position) @ turn, rays @ turn
            with np.errstate(divide='ignore', invalid='ignore'):
                one, two = ((sign * np.asarray(size) / 2 - eye) / inside for sign in (-1.0, 1.0))
            near, far = np.minimum(one, two).max(axis=1), np.maximum(one, two).min(axis=1)
            hit = (near <= far) & (near > 0.0)
            depth = np.where(hit, np.minimum(depth, near), depth)
        return depth

    def cloud(self, boxes: Sequence[Tuple[Placement, Sequence[float]]]) -> bytes:
        """Return the visible points (float32, 16 bytes each)."""
        depth = self.depth(boxes)
        depth = depth + self._noise.normal(0.0, NOISE_M, len(depth)) * depth ** 2
        points = np.zeros((len(depth), 4), '<f4')
        points[:, :3] = self._rays * depth[:, None]
        return points.tobytes()


def boxes_at(kinematics: Kinematics, time_s: float) -> List[Tuple[Placement, Sequence[float]]]:
    """Return the arm's boxes and the one on the floor at a time."""
    found: List[Tuple[Placement, Sequence[float]]] = [(Placement(BOX[0]), BOX[1])]
    for name, (center, size) in LINKS.items():
        link = kinematics.placement(f'arm/{name}', 'arm/foot', positions(time_s))
        assert link is not None
        found.append((link.then(Placement(center)), size))
    return found


def write_bag(path: str, seed: int) -> None:
    """Record the cell."""
    kinematics = Kinematics(model())
    fields = [PointField(name, 4 * number, PointField.FLOAT32, 1)
              for number, name in enumerate('xyz')]
    with rosbag.Bag(path, 'w') as bag:
        for number in range(round(LENGTH_S * JOINTS_HZ)):
            time_s = number / JOINTS_HZ
            told = positions(time_s)
            stamp = rospy.Time.from_sec(BEGIN_S + time_s)
            bag.write('/arm/q', JointState(Header(stamp=stamp), list(told), list(told.values()),
                                           [], []), stamp)
        for index, (name, hz) in enumerate(SENSORS_HZ.items()):
            camera = Camera(PLACES[name], seed + index)
            for number in range(round((LENGTH_S - 0.1) * hz)):
                time_s = 0.01 + 0.003 * index + number / hz
                header = Header(stamp=rospy.Time.from_sec(BEGIN_S + time_s),
                                frame_id=f'{name}/eye')
                data = camera.cloud(boxes_at(kinematics, time_s))
                bag.write(f'/{name}/cloud', PointCloud2(
                    header, HEIGHT, WIDTH, fields, False, 16, 16 * WIDTH, data, False),
                    rospy.Time.from_sec(BEGIN_S + time_s + LATE_S))


class Counts(NamedTuple):
    """Counts of a sensor after seeks."""

    seeks: int = 0
    silent: int = 0  # seeks after which no objects came
    with_false: int = 0  # seeks after which a false object was shown at any time
    at_rest: int = 0  # false objects that stay
    stops: int = 0  # seeks after which one is near enough for 'stop'
    missing: int = 0  # seeks after which the box is not shown in the end
    first_s: Tuple[float, ...] = ()  # from the command to the first objects

    def plus(self, begin_s: float, found: Sequence[Tuple[float, DetectedObjects]]) -> Counts:
        """Return the counts with the objects of one more seek, with their times of arrival [s]."""
        false = [[it for it in message.objects if not is_box(it)] for _, message in found]
        near = any(it.distance <= 0.2 for objects in false for it in objects)
        here = bool(found) and any(map(is_box, found[-1][1].objects))
        return Counts(self.seeks + 1, self.silent + (not found), self.with_false + any(false),
                      self.at_rest + (len(false[-1]) if false else 0), self.stops + near,
                      self.missing + (bool(found) and not here),
                      self.first_s + tuple(at_s - begin_s for at_s, _ in found[:1]))


def is_box(found: Any) -> bool:
    """Return whether an object is the real box."""
    return math.hypot(found.pose.position.x - BOX[0][0],
                      found.pose.position.y - BOX[0][1]) < 0.1


class Watch:
    """The objects of each sensor, with the times at which they came."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._found: Dict[str, List[Tuple[float, DetectedObjects]]] = {it: [] for it in SENSORS_HZ}
        for name in SENSORS_HZ:
            rospy.Subscriber(f'/{name}/objects', DetectedObjects, self._take, name)

    def after(self, service: str, kind: type, *request: Any
              ) -> Tuple[float, Dict[str, List[Tuple[float, DetectedObjects]]]]:
        """Give the player a command; return its time, and all objects until nothing changes."""
        asked = rospy.Time.now()
        begin_s = time.monotonic()
        answer = rospy.ServiceProxy(f'/bag_player/{service}', kind)(*request)
        if not answer.success:
            raise RuntimeError(f'/bag_player/{service}: {answer.message}')
        time.sleep(RESTS_S)
        with self._lock:
            found = {name: [it for it in messages if it[1].header.stamp >= asked]
                     for name, messages in self._found.items()}
            for messages in self._found.values():
                messages.clear()
        return begin_s, found

    def _take(self, message: DetectedObjects, name: str) -> None:
        with self._lock:
            self._found[name].append((time.monotonic(), message))


def measured(seeks: int, seed: int) -> Dict[str, Counts]:
    """Return the counts of each sensor after random seeks and steps of a paused player."""
    watch, chosen = Watch(), random.Random(seed)
    counts = {name: Counts() for name in SENSORS_HZ}
    for name in SENSORS_HZ:
        rospy.wait_for_message(f'/{name}/objects', DetectedObjects, MANY_S)
    rospy.ServiceProxy('/bag_player/pause', Trigger)()
    time.sleep(RESTS_S)
    for number in range(seeks):
        request: Tuple[Any, ...] = ('seek', Seek, chosen.uniform(0.5, LENGTH_S - 0.5))
        if number % 5 == 4:
            topic = f'/{chosen.choice(list(PLACES))}/cloud'
            request = 'step', Step, chosen.choice((-1, 1)), topic, 0.0
        begin_s, found = watch.after(*request)
        for name, messages in found.items():
            if messages or request[0] == 'seek':
                counts[name] = counts[name].plus(begin_s, messages)
    return counts


def main() -> None:
    """Measure, and print the table."""
    parser = argparse.ArgumentParser(description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument('--seeks', type=int, default=200)
    parser.add_argument('--seed', type=int, default=7)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as name, ros_master():
        folder = Path(name)
        (folder / 'arm.urdf').write_text(model(), encoding='utf-8')
        (folder / 'cell.xml').write_text(configuration(), encoding='utf-8')
        write_bag(str(folder / 'cell.bag'), options.seed)
        command = ['rosrun', 'process_visualizer', 'cell', 'run', str(folder / 'cell.xml'),
                   '--mode', 'playback', '--bag', str(folder / 'cell.bag'), '--no-rviz']
        with subprocess.Popen(command, stdout=subprocess.DEVNULL, env=dict(os.environ)) as cell:
            try:
                rospy.init_node('paused_seeks', disable_signals=True)
                rospy.wait_for_message('/bag_player/state', PlayerState, FEW_S)
                counts = measured(options.seeks, options.seed)
            finally:
                cell.send_signal(signal.SIGINT)
    print('| clouds | seeks and steps | with a part of the robot | within `stop` | such objects at '
          'rest | without the box | without an answer | first answer: median, ms | largest, ms |\n'
          + '|---' * 9 + '|')
    for name, it in counts.items():
        first_ms = 1e3 * np.array(it.first_s or [math.nan])
        print(f'| {SENSORS_HZ[name]:g} Hz | {it.seeks} | {it.with_false} | {it.stops} | '
              f'{it.at_rest} | {it.missing} | {it.silent} | {np.median(first_ms):.0f} | '
              f'{first_ms.max():.0f} |')


if __name__ == '__main__':
    main()
