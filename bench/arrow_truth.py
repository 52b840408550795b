# SPDX-License-Identifier: BSD-3-Clause
"""Moves robots on a known path, and finds the direction of their arrows on the screen.

The nodes are those that the command `cell` generates, with the models in test/data. A frame of
the screen is taken 60 times a second: the arrow's marker is drawn with the newest transform, as
RViz does with markers that are locked to their frame.
"""
from __future__ import annotations

import math
import os
import signal
import subprocess
import threading
import time
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Callable, Dict, Iterator, List, NamedTuple, Optional, Sequence

import numpy as np
import rospy
import tf2_ros
from geometry_msgs.msg import PoseStamped, TwistStamped
from std_msgs.msg import Float32MultiArray
from visualization_msgs.msg import Marker, MarkerArray

from process_visualizer.robot.kinematics import Kinematics, Placement
from process_visualizer.robot.rotations import matrix_from_quaternion as matrix
from process_visualizer.robot.rotations import (
    product,
    quaternion_from_rotation_vector,
    rotated,
    rotation_vector_between,
    ypr_from_matrix,
)

DATA = Path(__file__).resolve().parents[1] / 'test' / 'data'
RATE_HZ, SCREEN_HZ = 125.0, 60.0
SLOWEST_M_PER_S = 0.04  # where a tool reverses, it has no direction
_SETTLING_S = 1.5
_TURN_RAD_PER_S = 1.0
_IDENTITY = (0.0, 0.0, 0.0, 1.0)


class Model(NamedTuple):
    """A model of test/data: the frames, and the joints' middle positions; the last one turns."""

    file: str
    base: str
    tool: str
    joints: Dict[str, float]
    fixed: Dict[str, float] = {}


MODELS = (
    Model('ur5e', 'base_link', 'tool0', {
        'shoulder_pan_joint': 0.3, 'shoulder_lift_joint': -1.4, 'elbow_joint': 1.7,
        'wrist_1_joint': -1.2, 'wrist_2_joint': -1.5, 'wrist_3_joint': 0.0}),
    Model('panda', 'panda_link0', 'panda_link8', {
        f'panda_joint{number}': angle for number, angle in enumerate(
            (0.2, -0.7, 0.1, -2.2, 0.2, 1.7, 0.0), 1)}),
    Model('panda_hand', 'panda_link0', 'panda_hand', {
        f'panda_joint{number}': angle for number, angle in enumerate(
            (0.2, -0.7, 0.1, -2.2, 0.2, 1.7, 0.0), 1)}, {'panda_finger_joint1': 0.02}))


class Convention(NamedTuple):
    """A driver's report of the tool: type, rotation, and distance from the model's frame."""

    title: str
    form: str = 'rotation vector'
    tool: Placement = Placement()


def _turned(*rotation_vector: float) -> Placement:
    return Placement(quaternion=quaternion_from_rotation_vector(rotation_vector))


CONVENTIONS = (
    Convention('untouched'),
    Convention('turned by 90° about z', tool=_turned(0.0, 0.0, math.pi / 2)),
    Convention('turned by -45° about z', tool=_turned(0.0, 0.0, -math.pi / 4)),
    Convention('turned by 180° about x', tool=_turned(math.pi, 0.0, 0.0)),
    Convention('quaternion', 'quaternion'),
    Convention('PoseStamped, turned by 90° about y', 'PoseStamped', _turned(0.0, math.pi / 2, 0.0)),
    Convention('Euler angles as six values', 'Euler'),
    Convention('three values', 'position'),
    Convention('a tool 0.1 m further, turned', tool=_turned(0.0, 0.0, math.pi / 4)._replace(
        position=(0.0, 0.0, 0.1))))


class Result(NamedTuple):
    """The drawing: angles [rad] and distances [m] in all frames of the screen."""

    of_velocity: np.ndarray  # from the motion at the time of the velocity
    of_moment: np.ndarray  # from the motion at the moment of drawing
    feet: np.ndarray  # distance from the drawn tool


class ToolPath(NamedTuple):
    """The positions of the joints over time, and thus of the tool."""

    model: Model
    kinematics: Kinematics
    begin_s: float

    def positions(self, now_s: float) -> Dict[str, float]:
        """Return the positions of all joints [rad or m] by name."""
        time_s = now_s - self.begin_s  # angles have few digits in a message
        moving = {name: middle + 0.25 * math.sin(0.55 * time_s + 1.3 * number)
                  for number, (name, middle) in enumerate(self.model.joints.items())}
        moving[list(moving)[-1]] = _TURN_RAD_PER_S * time_s
        return {**moving, **self.model.fixed}

    def tool(self, time_s: float, offset: Placement) -> Placement:
        """Return the reported tool in the base frame."""
        found = self.kinematics.placement(self.model.tool, self.model.base,
                                          self.positions(time_s))
        assert found is not None
        return found.then(offset)

    def velocity(self, time_s: float, offset: Placement) -> np.ndarray:
        """Return the tool's velocity (3,) [m/s] in the base frame."""
        before, after = (self.tool(time_s + step, offset).position for step in (-1e-3, 1e-3))
        return np.subtract(after, before) / 2e-3


class Driver:
    """Sends joints and tool 125 times a second, reported by a convention that may change."""

    def __init__(self, path: ToolPath) -> None:
        self.path = path
        self._names = [*path.model.joints, *path.model.fixed]
        self._joints = rospy.Publisher('/arm/q_act', Float32MultiArray, queue_size=10)
        self._lock = threading.Lock()
        self._convention: Optional[Convention] = None
        self._tool: Optional[rospy.Publisher] = None
        self._ended = False
        threading.Thread(target=self._drive, daemon=True).start()

    def report_as(self, convention: Convention) -> None:
        with self._lock:
            if self._tool is not None:
                self._tool.unregister()
            kind = PoseStamped if convention.form == 'PoseStamped' else Float32MultiArray
            self._tool = rospy.Publisher('/arm/tcf', kind, queue_size=10)
            self._convention = convention

    def end(self) -> None:
        with self._lock:
            self._ended = True
            for publisher in (self._joints, self._tool):
                if publisher is not None:
                    publisher.unregister()

    def _drive(self) -> None:
        rate = rospy.Rate(RATE_HZ)
        while not rospy.is_shutdown():
            with self._lock:
                if self._ended:
                    return
                now_s = rospy.get_time()
                positions = self.path.positions(now_s)
                self._joints.publish(data=[positions[name] for name in self._names])
                if self._convention is not None:
                    self._report(self._convention, now_s)
            rate.sleep()

    def _report(self, convention: Convention, now_s: float) -> None:
        assert self._tool is not None
        self._tool.publish(report(convention, self.path.tool(now_s, convention.tool), now_s))


def report(convention: Convention, tool: Placement, now_s: float) -> Any:
    """Return the message of a driver that reports the tool [m] by the convention at a time [s]."""
    if convention.form != 'PoseStamped':
        return Float32MultiArray(
            data=[*tool.position, *_orientation(convention.form, tool)])
    message = PoseStamped()
    message.header.stamp = rospy.Time.from_sec(now_s)
    position, turn = message.pose.position, message.pose.orientation
    position.x, position.y, position.z = tool.position
    turn.x, turn.y, turn.z, turn.w = tool.quaternion
    return message


def _orientation(form: str, tool: Placement) -> Sequence[float]:
    if form == 'quaternion':
        return tool.quaternion
    if form == 'Euler':
        return ypr_from_matrix(matrix(tool.quaternion)).tolist()[::-1]
    if form == 'position':
        return ()
    return rotation_vector_between(_IDENTITY, tool.quaternion)


class Screen:
    """The velocity's arrow as RViz would draw it, 60 times a second."""

    def __init__(self, model: Model, device: str = 'arm') -> None:
        self._model = model
        self._buffer = tf2_ros.Buffer()
        self._listener = tf2_ros.TransformListener(self._buffer)
        self._velocity_s = 0.0  # time of the last velocity
        self._arrow: Optional[Marker] = None
        self._arrow_s = 0.0
        self._subscribers = [
            rospy.Subscriber(f'/{device}/tool_velocity', TwistStamped, self._on_velocity,
                             tcp_nodelay=True),
            rospy.Subscriber(f'/{device}/marker_array', MarkerArray, self._on_markers,
                             tcp_nodelay=True)]

    def end(self) -> None:
        self._listener.unregister()
        for subscriber in self._subscribers:
            subscriber.unregister()

    def watch(self, path: ToolPath, offset: Placement, duration_s: float) -> Result:
        """Compare the drawing with the path, ignoring the previous arrow."""
        rows: List[List[float]] = []
        self._arrow = None
        rate, end_s = rospy.Rate(SCREEN_HZ), rospy.get_time() + duration_s
        while rospy.get_time() < end_s:
            rate.sleep()
            arrow, belongs_s, now_s = self._arrow, self._arrow_s, rospy.get_time()
            if arrow is None or arrow.action != Marker.ADD:
                continue
            then, now = path.velocity(belongs_s, offset), path.velocity(now_s, offset)
            if min(np.linalg.norm(then), np.linalg.norm(now)) > SLOWEST_M_PER_S:
                rows.append(self._row(arrow, then, now, offset))
        return Result(*np.array(rows or [[math.nan] * 3]).T)

    def _row(self, arrow: Marker, then: np.ndarray, now: np.ndarray,
             offset: Placement) -> List[float]:
        frame, tool = self._drawn(arrow.header.frame_id), self._drawn(self._model.tool)
        turn, foot = arrow.pose.orientation, arrow.pose.position
        direction = rotated(product(frame.quaternion, (turn.x, turn.y, turn.z, turn.w)),
                            (1.0, 0.0, 0.0))
        begins = frame.then(Placement((foot.x, foot.y, foot.z))).position
        distance_m = float(np.linalg.norm(np.subtract(begins, tool.then(offset).position)))
        return [_angle(direction, then), _angle(direction, now), distance_m]

    def _drawn(self, frame: str) -> Placement:
        """Return the drawn position of a frame in the base frame."""
        found = self._buffer.lookup_transform(self._model.base, frame, rospy.Time()).transform
        place, turn = found.translation, found.rotation
        return Placement((place.x, place.y, place.z), (turn.x, turn.y, turn.z, turn.w))

    def _on_velocity(self, message: TwistStamped) -> None:
        self._velocity_s = message.header.stamp.to_sec()

    def _on_markers(self, array: MarkerArray) -> None:
        for marker in array.markers:
            if (marker.ns, marker.id) == ('velocity', 0):
                self._arrow, self._arrow_s = marker, self._velocity_s


def _angle(first: Sequence[float], second: Sequence[float]) -> float:
    """Return the angle [rad] between two vectors (3,)."""
    return math.atan2(float(np.linalg.norm(np.cross(first, second))), float(np.dot(first, second)))


def measure(model: Model, conventions: Sequence[Convention], duration_s: float, folder: Path,
            take: Callable[[Convention, Result], None]) -> None:
    """Start the nodes of a robot, drive it, and return the drawing for each convention."""
    path = ToolPath(model, Kinematics((DATA / f'{model.file}.urdf').read_text()),
                    rospy.get_time())
    with _running(model, folder):
        driver, screen = Driver(path), Screen(model)
        try:
            for convention in conventions:
                driver.report_as(convention)
                wait_for_arrow(screen)
                take(convention, screen.watch(path, convention.tool, duration_s))
        finally:
            driver.end()
            screen.end()


def wait_for_arrow(screen: Screen) -> None:
    """Wait until the drawing shows the current convention."""
    end_s = time.monotonic() + 60.0
    screen._arrow = None
    while screen._arrow is None and time.monotonic() < end_s:
        time.sleep(0.1)
    time.sleep(_SETTLING_S)


@contextmanager
def _running(model: Model, folder: Path) -> Iterator[None]:
    package = folder / 'arrow_models'
    package.mkdir(parents=True, exist_ok=True)
    (package / 'package.xml').write_text(
        '<package format="2"><name>arrow_models</name><version>0.0.0</version><description>A '
        'robot.</description><maintainer email="a@b.c">nobody</maintainer><license>BSD</license>'
        '</package>')
    (package / 'robot.urdf').write_text((DATA / f'{model.file}.urdf').read_text())
    (folder / 'cell.xml').write_text(
        '<visualizer><device type="robot" name="arm"><model pkg="arrow_models" '
        f'path="robot.urdf"/><base frame="{model.base}"/>'
        '<topic ns="arm" name="q_act" type="joint_states"/>'
        '<topic ns="arm" name="tcf" type="tool_center_frame"/></device></visualizer>')
    environment = {**os.environ,
                   'ROS_PACKAGE_PATH': f'{folder}:{os.environ["ROS_PACKAGE_PATH"]}'}
    subprocess.run(['rosrun', 'process_visualizer', 'cell', 'generate', str(folder / 'cell.xml'),
                    '--no-rviz', '--output', str(folder / model.file)], env=environment,
                   check=True, stdout=subprocess.DEVNULL)
    launch = subprocess.Popen(
        ['roslaunch', '--disable-title', str(folder / model.file / 'cell.launch')],
        env=environment, stdout=subprocess.DEVNULL, start_new_session=True)
    try:
        yield
    finally:
        launch.send_signal(signal.SIGINT)
        launch.wait(60)
