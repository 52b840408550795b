# SPDX-License-Identifier: BSD-3-Clause
"""Ten makers' robots with drivers that send joint states only: configured, compared, and played.

usage: bench/run makers FOLDER [NAME …]

FOLDER holds clones of the makers' description packages (MAKERS names them). For each robot a driver
is imitated: joints alone, in parts, with a gripper, on two topics. From its recording `cell new`
makes a configuration, which `cell check` and `cell compare` use: the same program again, later,
slower, or paused at a point must stay within the band. Then the recording is played: at random
positions each joint that is sent to the model is the newest in the recording. The tool's speed from
joints is compared with that from poses. Frames are computed here, from the model's file alone.
"""
from __future__ import annotations

import argparse
import bisect
import contextlib
import json
import math
import os
import random
import re
import signal
import subprocess
import sys
import threading
import xml.etree.ElementTree as ElementTree
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Dict, Iterator, List, Sequence, Tuple

import numpy as np
import rosbag
import rospy
from geometry_msgs.msg import PoseStamped
from sensor_msgs.msg import JointState

from process_visualizer.cell.xml_parser import XmlParser
from process_visualizer.clients.player_client import PlayerClient
from process_visualizer.curves.curves import read_curves

RATE_HZ = 100.0
POSITIONS = 100
BEGIN_S = 1700000000.0
TIMEOUT_S = 60.0


@dataclass(frozen=True)
class Maker:
    """A robot's model, and the joints in each message of its driver."""

    name: str
    package: str
    path: str
    arguments: Tuple[str, ...] = ()
    parts: Tuple[str, ...] = ()
    """Prefixes of the joints' names, one for each message; none: all in one message."""
    topics: Tuple[str, ...] = ('joint_states',)
    """One topic, or one for each part."""
    more_joints: Tuple[str, ...] = ()
    """Joints that the model does not have."""


MAKERS = (
    Maker('abb', 'abb_irb2400_support', 'urdf/irb2400_12_155.xacro'),
    Maker('fanuc', 'fanuc_lrmate200id_support', 'urdf/lrmate200id.xacro'),
    Maker('kuka', 'kuka_kr10_support', 'urdf/kr10r1100sixx.xacro'),
    Maker('staubli', 'staubli_rx160_support', 'urdf/rx160.xacro'),
    Maker('doosan', 'dsr_description', 'urdf/m1013.urdf'),
    Maker('motoman', 'motoman_sda10f_support', 'urdf/sda10f.xacro',
          parts=('arm_left', 'arm_right', 'torso')),
    Maker('ur', 'ur_description', 'urdf/ur5e.xacro', more_joints=('gripper_finger_joint',)),
    Maker('franka', 'franka_description', 'robots/panda/panda.urdf.xacro', ('hand:=true',),
          parts=('panda_joint', 'panda_finger'),
          topics=('joint_states', 'franka_gripper/joint_states')),
    Maker('kinova', 'kortex_description', 'robots/gen3_robotiq_2f_85.xacro', ('prefix:=left_',)),
    Maker('ufactory', 'xarm_description', 'urdf/xarm_device.urdf.xacro', ('dof:=6',)),
)


class Model:
    """A robot's frames, computed from its URDF alone."""

    def __init__(self, urdf: str) -> None:
        root = ElementTree.fromstring(urdf)
        self.parents: Dict[str, Any] = {}
        self.moving: List[Tuple[str, float, float]] = []
        for joint in root.findall('joint'):
            parent, child = joint.find('parent'), joint.find('child')
            assert parent is not None and child is not None
            self.parents[child.attrib['link']] = (joint, parent.attrib['link'])
            if joint.get('type') != 'fixed' and joint.find('mimic') is None:
                limit = joint.find('limit')
                low, high = (float(limit.get(name, 0.0)) for name in ('lower', 'upper')) \
                    if limit is not None and joint.get('type') != 'continuous' else (-3.0, 3.0)
                self.moving.append((joint.attrib['name'], low, high))

    @property
    def root(self) -> str:
        return next(parent for _, parent in self.parents.values() if parent not in self.parents)

    def place(self, link: str, joints: Dict[str, float]) -> np.ndarray:
        """Return the link's pose in the root, 4x4."""
        if link not in self.parents:
            return np.eye(4)
        joint, parent = self.parents[link]
        return self.place(parent, joints) @ _origin(joint) @ _motion(joint, joints)

    def link_of(self, joint_name: str) -> str:
        return next(child for child, (joint, _) in self.parents.items()
                    if joint.attrib['name'] == joint_name)


def _numbers(text: str) -> List[float]:
    return [float(word) for word in text.split()]


def _rotation(axis: Sequence[float], angle: float) -> np.ndarray:
    x, y, z = np.asarray(axis) / np.linalg.norm(axis)
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def _origin(joint: ElementTree.Element) -> np.ndarray:
    place = np.eye(4)
    origin = joint.find('origin')
    if origin is not None:
        roll, pitch, yaw = _numbers(origin.get('rpy', '0 0 0'))
        place[:3, :3] = (_rotation((0, 0, 1), yaw) @ _rotation((0, 1, 0), pitch)
                         @ _rotation((1, 0, 0), roll))
        place[:3, 3] = _numbers(origin.get('xyz', '0 0 0'))
    return place


def _motion(joint: ElementTree.Element, joints: Dict[str, float]) -> np.ndarray:
    place = np.eye(4)
    if joint.get('type') == 'fixed':
        return place
    axis = joint.find('axis')
    direction = _numbers(axis.attrib['xyz']) if axis is not None else [1.0, 0.0, 0.0]
    mimic = joint.find('mimic')
    value = joints.get(joint.attrib['name'], 0.0) if mimic is None else (
        float(mimic.get('multiplier', 1)) * joints.get(mimic.attrib['joint'], 0.0)
        + float(mimic.get('offset', 0)))
    if joint.get('type') == 'prismatic':
        place[:3, 3] = value * np.asarray(direction)
    else:
        place[:3, :3] = _rotation(direction, value)
    return place


def quaternion_of(rotation: np.ndarray) -> np.ndarray:
    """Return x y z w, from the eigenvector of the largest eigenvalue: valid for every angle."""
    m = rotation
    k = np.array([
        [m[0, 0] - m[1, 1] - m[2, 2], m[1, 0] + m[0, 1], m[2, 0] + m[0, 2], m[2, 1] - m[1, 2]],
        [m[1, 0] + m[0, 1], m[1, 1] - m[0, 0] - m[2, 2], m[2, 1] + m[1, 2], m[0, 2] - m[2, 0]],
        [m[2, 0] + m[0, 2], m[2, 1] + m[1, 2], m[2, 2] - m[0, 0] - m[1, 1], m[1, 0] - m[0, 1]],
        [m[2, 1] - m[1, 2], m[0, 2] - m[2, 0], m[1, 0] - m[0, 1], m[0, 0] + m[1, 1] + m[2, 2]]])
    return np.linalg.eigh(k)[1][:, 3]


class Program:
    """Moves between random points, with a rest at each, as most robot programs do."""

    def __init__(self, model: Model, seed: int) -> None:
        chance = np.random.default_rng(seed)
        self.names = [name for name, _, _ in model.moving]
        low = np.array([max(it[1], -1.5) for it in model.moving])
        high = np.array([min(it[2], 1.5) for it in model.moving])
        middle, reach = (low + high) / 2, (high - low) / 2
        self.points = middle + 0.7 * reach * chance.uniform(-1, 1, (7, len(low)))
        self.points[-1] = self.points[0]
        self.moves_s = chance.uniform(1.0, 2.5, 6)
        self.rests_s = chance.uniform(0.3, 0.8, 7)
        self.total_s = float(self.moves_s.sum() + self.rests_s.sum())

    def joints(self, time_s: np.ndarray, slower: float = 1.0, late_s: float = 0.0,
               pause_s: float = 0.0) -> np.ndarray:
        """Return values at times, with a later begin, a longer rest, or a lower speed."""
        rests = self.rests_s.copy()
        rests[0] += late_s
        rests[3] += pause_s
        begins = np.cumsum(np.concatenate(([0.0], (self.moves_s * slower + rests[1:])[:-1])))
        begins += rests[0]
        values = np.repeat(self.points[:1], len(time_s), axis=0)
        for begin, length, one, other in zip(begins, self.moves_s * slower, self.points,
                                             self.points[1:]):
            share = np.clip((time_s - begin) / length, 0.0, 1.0)
            smooth = share ** 3 * (10 - 15 * share + 6 * share ** 2)
            values = np.where((time_s >= begin)[:, None], one + smooth[:, None] * (other - one),
                              values)
        return values


def write_bag(path: Path, maker: Maker, model: Model, program: Program, seed: int,
              tool: str = '', **variation: float) -> None:
    """Return joint states with encoder noise and network jitter, and poses of `tool`."""
    chance = np.random.default_rng(seed)
    more_s = sum(variation.get(name, 0.0) for name in ('late_s', 'pause_s'))
    length_s = program.total_s * variation.get('slower', 1.0) + more_s
    time_s = np.arange(0.0, length_s, 1.0 / RATE_HZ)
    values = program.joints(time_s, **variation)
    values = values + chance.normal(0.0, 5e-5, values.shape)
    arrivals_s = np.maximum.accumulate(time_s + chance.exponential(0.0004, len(time_s)))
    names = program.names
    groups = [[it for it in names if it.startswith(part)] for part in maker.parts] or [names]
    with rosbag.Bag(str(path), 'w') as bag:
        for stamp_s, arrival_s, row in zip(time_s, arrivals_s, values):
            joints = dict(zip(names, row))
            joints.update({name: 0.02 for name in maker.more_joints})
            arrival = rospy.Time.from_sec(BEGIN_S + arrival_s)
            stamp = rospy.Time.from_sec(BEGIN_S + stamp_s)
            for number, group in enumerate(groups):
                message = JointState()
                message.header.stamp = stamp
                message.name = group + list(maker.more_joints)
                message.position = [joints[name] for name in message.name]
                topic = maker.topics[min(number, len(maker.topics) - 1)]
                bag.write(f'/{maker.name}/{topic}', message, arrival)
            if tool:
                place = model.place(tool, joints)
                pose = PoseStamped()
                pose.header.stamp, pose.header.frame_id = stamp, ''
                position, turn = pose.pose.position, pose.pose.orientation
                position.x, position.y, position.z = place[:3, 3]
                turn.x, turn.y, turn.z, turn.w = quaternion_of(place[:3, :3])
                bag.write(f'/{maker.name}/tool_pose', pose, arrival)


def command(*words: str) -> Tuple[int, str]:
    done = subprocess.run(['rosrun', 'process_visualizer', 'cell', *words], text=True, check=False,
                          stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    return done.returncode, done.stdout.strip()


def speed_of(bag: Path, configuration: Path) -> Tuple[np.ndarray, np.ndarray]:
    """Return times [s] and the tool's speed [m/s], as the timeline draws it."""
    devices = XmlParser().parse(str(configuration)).devices
    for curve in read_curves([str(bag)], devices):
        if curve.unit == 'm/s':
            return curve.times_s, (curve.low + curve.high) / 2
    raise SystemExit(f'{configuration}: there is no curve of a speed')


def latest(path: Path, topics: Sequence[str]) -> List[Tuple[float, Dict[str, float]]]:
    """Return the known joints after each message, with its time from the beginning."""
    known: Dict[str, float] = {}
    found = []
    with rosbag.Bag(str(path)) as bag:
        begin_s = bag.get_start_time()
        for _, message, stamp in bag.read_messages(list(topics)):
            known = {**known, **dict(zip(message.name, message.position))}
            found.append((stamp.to_sec() - begin_s, known))
    return found


@contextlib.contextmanager
def played(configuration: Path, bag: Path, log: Path) -> Iterator[PlayerClient]:
    """The cell in playback mode; the player is paused."""
    with open(log, 'w') as output:
        process = subprocess.Popen(
            ['rosrun', 'process_visualizer', 'cell', 'run', str(configuration), '--no-rviz',
             '--mode', 'playback', '--bag', str(bag)], stdout=output, stderr=output)
    client = PlayerClient()
    try:
        client.wait_until_ready(TIMEOUT_S)
        client.pause()
        yield client
    finally:
        client.close()
        process.send_signal(signal.SIGINT)
        process.wait()


class Shown:
    """The joints that robot_state_publisher receives, by their names in the model."""

    def __init__(self, topic: str) -> None:
        self.joints: Dict[str, float] = {}
        self._changed = threading.Condition()
        self._subscriber = rospy.Subscriber(topic, JointState, self._take)

    def close(self) -> None:
        self._subscriber.unregister()

    def _take(self, message: JointState) -> None:
        with self._changed:
            names = (name.rpartition('/')[2] for name in message.name)
            self.joints.update(zip(names, message.position))
            self._changed.notify_all()

    def _position(self, name: str) -> float:
        """Return the position of a joint whose name in the model may lack the driver's prefix."""
        return self.joints.get(name, self.joints.get(name.partition('_')[2], math.nan))

    def wait_for(self, expected: Dict[str, float]) -> float:
        """Return the greatest remaining difference, rad; waits until there is none, at most 3 s."""
        def difference() -> float:
            return max(abs(self._position(name) - value) for name, value in expected.items())

        with self._changed:
            self._changed.wait_for(lambda: difference() < 1e-9, 3.0)
            return difference() if math.isfinite(difference()) else math.inf


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('folder', type=Path)
    parser.add_argument('names', nargs='*')
    parser.add_argument('--work', type=Path, default=Path('makers_work'))
    arguments = parser.parse_args()
    os.environ['ROS_PACKAGE_PATH'] += f':{arguments.folder.resolve()}'
    arguments.work.mkdir(parents=True, exist_ok=True)
    os.chdir(arguments.work)
    port = os.environ['ROS_MASTER_URI'].rpartition(':')[2]
    core = subprocess.Popen(['roscore', '-p', port], stdout=subprocess.DEVNULL,
                            stderr=subprocess.DEVNULL)
    try:
        rospy.init_node('makers', disable_signals=True)
        for number, maker in enumerate(MAKERS):
            if not arguments.names or maker.name in arguments.names:
                print(json.dumps(Trial(maker, number).run()), flush=True)
    finally:
        core.terminate()
        core.wait()


class Trial:
    """The trial of one maker's robot."""

    def __init__(self, maker: Maker, seed: int) -> None:
        self.maker, self.seed = maker, seed
        package = subprocess.run(['rospack', 'find', maker.package], text=True, check=True,
                                 stdout=subprocess.PIPE).stdout.strip()
        path = f'{package}/{maker.path}'
        urdf = Path(path).read_text() if path.endswith('.urdf') else subprocess.run(
            ['xacro', path, *maker.arguments], text=True, check=True,
            stdout=subprocess.PIPE).stdout
        self.model = Model(urdf)
        self.program = Program(self.model, seed)
        self.folder = Path(maker.name)
        self.folder.mkdir(exist_ok=True)
        self.configuration = self.folder / 'cell.xml'

    def bag(self, name: str, seed: int, **variation: Any) -> Path:
        path = self.folder / f'{name}.bag'
        if not path.exists():
            write_bag(path, self.maker, self.model, self.program, seed, **variation)
        return path

    def run(self) -> Dict[str, Any]:
        good = self.bag('good', 1)
        code, text = command('new', str(good), '-o', str(self.configuration), '--force')
        found: Dict[str, Any] = {'maker': self.maker.name, 'joints': len(self.program.names),
                                 'new': code}
        if code:
            return {**found, 'says': text}
        found['guessed'] = self.with_own_model()
        found['check'], found['says'] = command('check', str(self.configuration))
        found['compare'] = {name: self.compared(self.bag(name, 2 + number, **variation), good)
                            for number, (name, variation) in enumerate((
                                ('again', {}), ('late', {'late_s': 1.5}),
                                ('slow', {'slower': 1.1}), ('paused', {'pause_s': 2.0})))}
        found.update(self.positions(good))
        found.update(self.speed(good))
        return found

    def with_own_model(self) -> str:
        """Set the right model, as a user does: many robots share joint names; return the guess."""
        text = self.configuration.read_text()
        found = re.search(r'<model pkg="([^"]*)" path="([^"]*)"', text)
        if found is None:
            raise SystemExit(f'{self.configuration}: no model was found')
        own = f'<model pkg="{self.maker.package}" path="{self.maker.path}"'
        if found.group() == own:
            return 'the right one'
        pairs = [it.split(':=') for it in self.maker.arguments]
        values = ''.join(f'<arg name="{name}" value="{value}" />' for name, value in pairs)
        text = re.sub('<model pkg=.*/>', f'{own}>{values}</model>', text, count=1)
        text = re.sub('<base frame="[^"]*"', f'<base frame="{self.model.root}"', text, count=1)
        if self.model.root == 'world':
            text = text.replace('<visualizer>', '<visualizer frame="cell">')
        self.configuration.write_text(text)
        return f'{found.group(1)}/{found.group(2)}'

    def positions(self, bag: Path) -> Dict[str, Any]:
        """Return the errors of the joints, paused at random positions."""
        chance = random.Random(self.seed)
        device = XmlParser().parse(str(self.configuration)).devices[0]
        known = latest(bag, [topic.name for topic in device.topics])
        times_s = [time_s for time_s, _ in known]
        off = []
        shown = Shown(f'/{device.name}/joint_states')
        with played(self.configuration, bag, self.folder / 'run.log') as client:
            for _ in range(POSITIONS):
                position_s = round(chance.uniform(0.1, times_s[-1] - 0.1), 3) + 0.0005
                client.seek(position_s)
                joints = known[bisect.bisect_right(times_s, position_s) - 1][1]
                off.append(shown.wait_for({name: joints[name] for name in self.program.names
                                           if name in joints}))
        shown.close()
        return {'positions': len(off), 'right': sum(it < 1e-6 for it in off),
                'off_rad': float(max(off))}

    def speed(self, good: Path) -> Dict[str, Any]:
        """Compare the tool's speed from joints with that from poses of the same frame."""
        tool = re.search(r'tool frame +(\S+)', command('show', str(self.configuration))[1])
        if tool is None or tool.group(1) not in self.model.parents:
            return {'speed': 'no tool'}
        posed = self.bag(f'posed_{tool.group(1)}', 1, tool=tool.group(1))
        with_pose = self.folder / 'cell_with_pose.xml'
        with_pose.write_text(self.configuration.read_text().replace(
            '</device>', f'<topic ns="{self.maker.name}" name="tool_pose" type="tool_center_frame" '
            'msg="geometry_msgs/PoseStamped" /></device>', 1))
        times_s, from_joints = speed_of(good, self.configuration)
        posed_s, from_poses = speed_of(posed, with_pose)
        beside = np.interp(times_s, posed_s, from_poses)
        fast = beside > 0.2 * np.nanmax(beside)
        off = np.abs(from_joints - beside)[fast] / beside[fast]
        return {'tool': tool.group(1), 'speed_off_p95': float(np.nanpercentile(off, 95)),
                'speed_off_median': float(np.nanmedian(off)),
                'fastest_m_s': float(np.nanmax(beside))}

    def compared(self, bag: Path, good: Path) -> str:
        code, text = command('compare', str(bag), '--reference', str(good), '--config',
                             str(self.configuration))
        return f'{code}: {text}'


if __name__ == '__main__':
    sys.exit(main())
