# SPDX-License-Identifier: BSD-3-Clause
"""Recordings of six cells for bench/page_truth.py, most of them with a good run.

Drivers are imitated: several messages for a robot's joints, rates of their own, jitter,
stamps that are older than the message, arrays without stamps, wheels that turn forever.
"""
from __future__ import annotations

import subprocess
import sys
from pathlib import Path
from typing import Any, Callable, Dict, FrozenSet, List, NamedTuple, Optional, Sequence, Tuple

import numpy as np
import rosbag
import yaml
from genpy import Time
from geometry_msgs.msg import TransformStamped, WrenchStamped
from makers import Model, Program
from sensor_msgs.msg import JointState
from std_msgs.msg import Float32, UInt8
from tf2_msgs.msg import TFMessage

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / 'test'))
from sewing_runs import CELL, write_sewing_run  # noqa: E402

BEGIN_S = 1_700_000_000.0
_LATE_S = 0.003
"""Delay from the stamp of a message to its arrival."""


class Scene(NamedTuple):
    """A recording, a good one, and the topics whose numbers are integers."""

    configuration: Path
    bag: Path
    good: Optional[Path]
    whole: FrozenSet[str] = frozenset()


Rows = List[Tuple[float, str, Any]]
"""Arrival [s], topic and message."""


def _arrivals(stamps_s: np.ndarray, chance: np.random.Generator) -> np.ndarray:
    late_s = _LATE_S + chance.exponential(0.0006, len(stamps_s))
    found: np.ndarray = np.maximum.accumulate(stamps_s + late_s)
    return found


def _joints(topic: str, names: Sequence[str], stamps_s: np.ndarray, positions: np.ndarray,
            chance: np.random.Generator, velocities: Optional[np.ndarray] = None) -> Rows:
    found: Rows = []
    arrivals_s = _arrivals(stamps_s, chance)
    for number, (stamp_s, arrival_s) in enumerate(zip(stamps_s, arrivals_s)):
        message = JointState(name=list(names))
        message.header.stamp = Time.from_sec(BEGIN_S + stamp_s)
        message.position = positions[number].tolist() if positions.size else []
        message.velocity = [] if velocities is None else velocities[number].tolist()
        found.append((float(arrival_s), topic, message))
    return found


def _wrenches(topic: str, frame: str, stamps_s: np.ndarray, forces: np.ndarray,
              chance: np.random.Generator) -> Rows:
    found: Rows = []
    for stamp_s, arrival_s, force in zip(stamps_s, _arrivals(stamps_s, chance), forces.tolist()):
        message = WrenchStamped()
        message.header.stamp, message.header.frame_id = Time.from_sec(BEGIN_S + stamp_s), frame
        message.wrench.force.x, message.wrench.force.y, message.wrench.force.z = force
        found.append((float(arrival_s), topic, message))
    return found


def _write(path: Path, rows: Rows) -> Path:
    if not path.exists():
        with rosbag.Bag(str(path), 'w') as bag:
            for arrival_s, topic, message in sorted(rows, key=lambda row: row[0]):
                bag.write(topic, message, Time.from_sec(BEGIN_S + arrival_s))
    return path


def _urdf(folder: Path, path: str, *arguments: str) -> str:
    return subprocess.run(['xacro', str(folder / path), *arguments], text=True, check=True,
                          stdout=subprocess.PIPE).stdout


def _both(folder: Path, rows: Callable[[int, float], Rows]) -> Tuple[Path, Path]:
    """Return the run and the good one: another seed, and a little slower."""
    return (_write(folder / 'run.bag', rows(2, 1.06)), _write(folder / 'good.bag', rows(1, 1.0)))


def _forces(times_s: np.ndarray, chance: np.random.Generator) -> np.ndarray:
    found: np.ndarray = np.column_stack([
        12.0 * np.sin(times_s * speed + phase) for speed, phase in ((1.1, 0), (0.7, 1), (1.9, 2))])
    return found + chance.normal(0.0, 0.4, found.shape)


def sewing(folder: Path, _models: Path) -> Scene:
    """The simulated sewing cell: arrays without stamps."""
    run, good = folder / 'run.bag', folder / 'good.bag'
    if not run.exists():
        write_sewing_run(folder, 'run.bag', 2, is_poor=True)
        write_sewing_run(folder, 'good.bag')
    return Scene(Path(CELL), run, good, frozenset(('/edge_finder_upper', '/edge_finder_lower')))


def two_arms(folder: Path, models: Path) -> Scene:
    """UR5e at 125 Hz with a force sensor; Panda whose fingers have a topic of their own."""
    configuration = folder / 'cell.xml'
    configuration.write_text('''<visualizer>
<device type="robot" name="ur5e"><model pkg="ur_description" path="urdf/ur5e.xacro"/>
<base frame="base_link" xyz="-0.6 0 0"/><tool frame="tool0"/>
<topic ns="ur" name="joint_states" type="joint_states"/>
<topic ns="ur" name="wrench" type="force_sensor" msg="geometry_msgs/WrenchStamped"/></device>
<device type="robot" name="arm">
<model pkg="franka_description" path="robots/panda/panda.urdf.xacro"><arg name="hand" value="true"/>
</model><base frame="panda_link0" xyz="0.6 0 0" ypr="3.1416 0 0"/><tool frame="panda_hand_tcp"/>
<topic ns="franka" name="joint_states" type="joint_states"/>
<topic ns="franka_gripper" name="joint_states" type="joint_states"/></device></visualizer>''')
    ur = Model(_urdf(models, 'ur_description/urdf/ur5e.xacro'))
    panda = Model(_urdf(models, 'franka_description/robots/panda/panda.urdf.xacro', 'hand:=true'))
    programs = Program(ur, 5), Program(panda, 6)

    def rows(seed: int, slower: float) -> Rows:
        chance = np.random.default_rng(seed)
        length_s = slower * max(it.total_s for it in programs)
        fast_s, slow_s = np.arange(0.0, length_s, 0.008), np.arange(0.001, length_s, 0.033)
        ur_q = programs[0].joints(fast_s, slower=slower)
        panda_q = programs[1].joints(fast_s, slower=slower)
        arm = [row for row, name in enumerate(programs[1].names) if 'finger' not in name]
        finger_q = 0.02 + 0.015 * np.sin(slow_s)
        return [
            *_joints('/ur/joint_states', programs[0].names, fast_s, ur_q, chance),
            *_joints('/franka/joint_states', [programs[1].names[it] for it in arm], fast_s,
                     panda_q[:, arm], chance),
            *_joints('/franka_gripper/joint_states', ['panda_finger_joint1', 'panda_finger_joint2'],
                     slow_s, np.column_stack((finger_q, finger_q)), chance),
            *_wrenches('/ur/wrench', 'tool0', fast_s, _forces(fast_s, chance), chance)]

    return Scene(configuration, *_both(folder, rows))


_GRIPPER = '''<link name="gripper"><visual><geometry><box size="0.12 0.06 0.08"/></geometry>
</visual></link><joint name="to_gripper" type="fixed"><parent link="tool0"/><child link="gripper"/>
<origin xyz="0 0 0.04"/></joint>
<link name="left"><visual><geometry><box size="0.01 0.04 0.1"/></geometry></visual></link>
<joint name="jaw" type="prismatic"><parent link="gripper"/><child link="left"/>
<origin xyz="0 0 0.08"/><axis xyz="1 0 0"/>
<limit lower="0" upper="0.06" effort="1" velocity="1"/></joint>
<link name="right"><visual><geometry><box size="0.01 0.04 0.1"/></geometry></visual></link>
<joint name="other_jaw" type="prismatic"><parent link="gripper"/><child link="right"/>
<origin xyz="0 0 0.08"/><axis xyz="1 0 0"/><mimic joint="jaw" multiplier="-1"/>
<limit lower="-0.06" upper="0" effort="1" velocity="1"/></joint></robot>'''


def palletizer(folder: Path, models: Path) -> Scene:
    """An arm at 50 Hz with jaws that mimic each other, a vacuum, and a counter sent on changes."""
    model = folder / 'palletizer.urdf'
    model.write_text(_urdf(models, 'fanuc_lrmate200id_support/urdf/lrmate200id.xacro').replace(
        '</robot>', _GRIPPER))
    configuration = folder / 'cell.xml'
    configuration.write_text('''<visualizer>
<device type="robot" name="palletizer"><model path="palletizer.urdf"/>
<base frame="base_link" xyz="0 0 0.3" ypr="0.4 0 0"/><tool frame="tool0"/>
<topic ns="arm" name="joint_states" type="joint_states"/></device>
<device type="other" name="pallet"><base frame="pallet" xyz="0.6 0.4 0"/>
<variable topic="vacuum" field="data" frame="pallet" axis="z" scale="0.01" unit="kPa"
 label="vacuum"/>
<variable topic="layer" field="data" frame="pallet" axis="y" scale="0.1" label="layer"/>
</device></visualizer>''')
    program = Program(Model(model.read_text()), 8)

    def rows(seed: int, slower: float) -> Rows:
        chance = np.random.default_rng(seed)
        length_s = slower * program.total_s
        joint_s, slow_s = np.arange(0.0, length_s, 0.02), np.arange(0.002, length_s, 0.05)
        found = _joints('/arm/joint_states', program.names, joint_s,
                        program.joints(joint_s, slower=slower), chance)
        vacuum = 30.0 + 25.0 * np.tanh(3.0 * np.sin(slow_s)) + chance.normal(0.0, 0.3, len(slow_s))
        found += [(float(time_s), '/vacuum', Float32(value))
                  for time_s, value in zip(_arrivals(slow_s, chance), vacuum)]
        return found + [(0.37 + 2.9 * layer, '/layer', UInt8(layer))
                        for layer in range(int((length_s - 0.4) / 2.9))]

    return Scene(configuration, *_both(folder, rows), frozenset(('/layer',)))


_ROVER = '''<robot name="rover"><link name="rover_base"><visual><origin xyz="0 0 0.15"/><geometry>
<box size="0.5 0.35 0.15"/></geometry></visual></link>{}{}</robot>'''
_WHEEL = '''<link name="{0}_wheel"><visual><origin rpy="1.5708 0 0"/><geometry>
<cylinder radius="0.1" length="0.05"/></geometry></visual></link>
<joint name="{0}_wheel_joint" type="continuous"><parent link="rover_base"/>
<child link="{0}_wheel"/><origin xyz="0 {1} 0.1"/><axis xyz="0 1 0"/></joint>'''
_CART = '''<robot name="cart"><link name="cart_base"><visual><geometry><box size="0.3 0.3 0.1"/>
</geometry></visual></link><link name="cart_wheel"><visual><geometry><sphere radius="0.06"/>
</geometry></visual></link><joint name="cart_wheel_joint" type="continuous">
<parent link="cart_base"/><child link="cart_wheel"/><origin xyz="0 0.2 0"/><axis xyz="0 1 0"/>
</joint></robot>'''


def wheels(folder: Path, models: Path) -> Scene:
    """A rover on /tf whose wheels turn, a cart that sends velocities only, and a UR5e."""
    (folder / 'rover.urdf').write_text(_ROVER.format(
        _WHEEL.format('left', 0.2), _WHEEL.format('right', -0.2)))
    (folder / 'cart.urdf').write_text(_CART)
    configuration = folder / 'cell.xml'
    configuration.write_text('''<visualizer frame="odom">
<device type="robot" name="rover"><model path="rover.urdf"/>
<topic name="joint_states" type="joint_states"/></device>
<device type="robot" name="cart"><model path="cart.urdf"/><base frame="cart_base" xyz="0 -2 0"/>
<topic ns="wheels" name="joint_states" type="joint_states"/></device>
<device type="robot" name="ur5e"><model pkg="ur_description" path="urdf/ur5e.xacro"/>
<base frame="base_link" xyz="1 1 0"/><tool frame="tool0"/>
<topic name="joint_states" type="joint_states"/></device>
<device type="other" name="odometry"><topic name="tf"/></device></visualizer>''')
    program = Program(Model(_urdf(models, 'ur_description/urdf/ur5e.xacro')), 9)
    wheel_names = ('left_wheel_joint', 'right_wheel_joint')

    def rows(seed: int, slower: float) -> Rows:
        chance = np.random.default_rng(seed)
        length_s = slower * program.total_s
        tf_s, wheel_s = np.arange(0.0, length_s, 0.02), np.arange(0.004, length_s, 0.033)
        arm_s = np.arange(0.002, length_s, 0.008)
        turns = np.column_stack((14.0 * wheel_s, 15.0 * wheel_s))
        found = _joints('/joint_states', wheel_names, wheel_s, turns, chance)
        found += _joints('/joint_states', program.names, arm_s,
                         program.joints(arm_s, slower=slower), chance)
        found += _joints('/wheels/joint_states', ('cart_wheel_joint',), wheel_s, np.empty(0),
                         chance, np.full((len(wheel_s), 1), 3.0))
        for stamp_s, arrival_s in zip(tf_s, _arrivals(tf_s, chance)):
            moved = TransformStamped()
            moved.header.stamp = Time.from_sec(BEGIN_S + stamp_s)
            moved.header.frame_id, moved.child_frame_id = 'odom', 'rover_base'
            place, turn = moved.transform.translation, moved.transform.rotation
            place.x, place.y = 1.45 * stamp_s, 0.4 * np.sin(0.5 * stamp_s)
            turn.z, turn.w = np.sin(0.1 * stamp_s), np.cos(0.1 * stamp_s)
            found.append((float(arrival_s), '/tf', TFMessage([moved])))
        return found

    return Scene(configuration, *_both(folder, rows))


def foreign(folder: Path, models: Path) -> Scene:
    """A real PR2, recorded by others in 2012: 45 joints, a laser that tilts, wheels that turn."""
    (folder / 'pr2.urdf').write_text(yaml.safe_load((models / 'pr1012_urdf.yaml').read_text()))
    configuration = folder / 'cell.xml'
    configuration.write_text('''<visualizer frame="base_footprint">
<device type="robot" name="pr2"><model path="pr2.urdf"/><tool frame="laser_tilt_link"/>
<topic name="joint_states" type="joint_states"/></device></visualizer>''')
    return Scene(configuration, models / 'pr1012_sensors.bag', None)


def panda(folder: Path, models: Path) -> Scene:
    """A real Panda's joints and forces, measured by others; their files have no times."""
    configuration = folder / 'cell.xml'
    configuration.write_text('''<visualizer><device type="robot" name="arm">
<model pkg="franka_description" path="robots/panda/panda.urdf.xacro"/>
<base frame="panda_link0"/><tool frame="panda_link8"/>
<topic ns="panda" name="joint_states" type="joint_states"/>
<topic ns="panda" name="wrench" type="force_sensor" msg="geometry_msgs/WrenchStamped"/></device>
</visualizer>''')

    def rows(name: str) -> Rows:
        values = np.genfromtxt(models / 'execution_data' / name, delimiter=',', names=True)[:3000]
        chance, times_s = np.random.default_rng(3), np.arange(len(values)) / 50.0
        joints, force = (np.column_stack([values[it] for it in names]) for names in (
            [f'joint_{number}' for number in range(1, 8)], [f'force_{axis}' for axis in 'xyz']))
        return [*_joints('/panda/joint_states', [f'panda_joint{it}' for it in range(1, 8)],
                         times_s, joints, chance),
                *_wrenches('/panda/wrench', 'panda_link8', times_s + 0.005, force, chance)]

    return Scene(configuration, _write(folder / 'run.bag', rows('data_trial2.csv')),
                 _write(folder / 'good.bag', rows('data_trial1.csv')))


SCENES: Dict[str, Callable[[Path, Path], Scene]] = {
    'sewing': sewing, 'two_arms': two_arms, 'palletizer': palletizer, 'wheels': wheels,
    'foreign': foreign, 'panda': panda}
