# SPDX-License-Identifier: BSD-3-Clause
"""The simulated sewing cell as a whole: nodes and topics of the thesis' appendix D.2, one tf tree,
every display of RViz without warning, and a picture with everything in it."""
from __future__ import annotations

import signal
import subprocess
from typing import Dict, Iterator, List, Set

import pytest
from running import SOON_S, CellRun, run_command, wait_until_alone

NODES = {
    '/ur_rt_upper/robot_proc', '/ur_rt_upper/robot_state_publisher',
    '/ur_rt_lower/robot_proc', '/ur_rt_lower/robot_state_publisher',
    '/kinect/depth_proc', '/kinect/kinect_roi', '/sewing_machine/sewing_machine',
    '/sewing_machine/variable_proc',
    '/sewing_machine/needle_frame_transformer', '/rviz', '/cell_frames',
    '/scene_watch', '/simulator'}
"""Appendix D.2, with the frame publisher and the simulator."""

TOPICS = {
    '/ur_rt_upper/q_act': 'std_msgs/Float32MultiArray',
    '/ur_rt_upper/tcf': 'std_msgs/Float32MultiArray',
    '/ft_upper/ft': 'std_msgs/Float32MultiArray',
    '/ur_rt_lower/q_act': 'std_msgs/Float32MultiArray',
    '/ur_rt_lower/tcf': 'std_msgs/Float32MultiArray',
    '/ft_lower/ft': 'std_msgs/Float32MultiArray',
    '/ur_rt_upper/joint_states': 'sensor_msgs/JointState',
    '/ur_rt_lower/joint_states': 'sensor_msgs/JointState',
    '/ur_rt_upper/marker_array': 'visualization_msgs/MarkerArray',
    '/ur_rt_lower/marker_array': 'visualization_msgs/MarkerArray',
    '/sewing_machine/marker_array': 'visualization_msgs/MarkerArray',
    '/camera/depth_registered/points': 'sensor_msgs/PointCloud2',
    '/kinect/roi_points': 'sensor_msgs/PointCloud2',
    '/kinect/points': 'sensor_msgs/PointCloud2',
    '/edge_finder_upper': 'std_msgs/UInt16',
    '/edge_finder_lower': 'std_msgs/UInt16',
    '/feed_rate_est': 'std_msgs/Float32',
    '/ur_rt_upper/tool_velocity': 'geometry_msgs/TwistStamped',
    '/ur_rt_upper/tool_force': 'geometry_msgs/WrenchStamped',
    '/tf': 'tf2_msgs/TFMessage',
    '/tf_static': 'tf2_msgs/TFMessage'}
"""Appendix D.2, with the topics that this system adds."""


@pytest.fixture(scope='module')
def cell(ros_environment, screen, simulated_config) -> Iterator[CellRun]:
    run = CellRun(['run', simulated_config], ros_environment)
    yield run
    run.end()


@pytest.fixture(scope='module')
def picture(cell, ros_environment, tmp_path_factory) -> str:
    """A picture of the screen; it exists only when RViz reports every display as OK."""
    path = str(tmp_path_factory.mktemp('pictures') / 'cell.png')
    taken = run_command(ros_environment, 'rosrun', 'process_visualizer', 'view_picture', path)
    assert taken.returncode == 0, taken.stdout + cell.text
    return path


def test_every_display_is_ok_and_the_scene_is_drawn(picture):
    pixels = histogram(picture)
    total = sum(pixels.values())
    background = max(pixels.values())
    assert background / total < 0.8
    assert len(pixels) > 5000


def histogram(path: str) -> Dict[bytes, int]:
    """How often each colour occurs in the 3D view (the window's docks cut away)."""
    raw = subprocess.run(['convert', path, '-crop', '1100x800+420+120', '-depth', '8', 'rgb:-'],
                         stdout=subprocess.PIPE, check=True).stdout
    counts: Dict[bytes, int] = {}
    for offset in range(0, len(raw), 3):
        color = raw[offset:offset + 3]
        counts[color] = counts.get(color, 0) + 1
    return counts


def test_the_nodes_of_the_thesis_run(picture, ros_environment):
    nodes = set(run_command(ros_environment, 'rosnode', 'list').stdout.split())
    assert nodes >= NODES, NODES - nodes


def test_the_topics_of_the_thesis_have_their_types(picture, ros_environment):
    lines = run_command(ros_environment, 'rostopic', 'list', '-v').stdout.splitlines()
    types = {words[1]: words[2].strip('[]') for words in map(str.split, lines)
             if len(words) > 2 and words[0] == '*'}
    assert {name: types.get(name) for name in TOPICS} == TOPICS


def test_the_frames_are_one_tree(picture, ros_environment):
    parents = frame_parents(ros_environment)
    roots = {parent for parent in parents.values() if parent not in parents}
    assert roots == {'world'}
    assert {'ur_rt_upper/tool', 'ur_rt_lower/tool', 'ur_rt_upper/force', 'ur_rt_lower/force',
            'camera_rgb_optical_frame', 'sewing_machine/needle'} <= set(parents)


def frame_parents(environment: Dict[str, str]) -> Dict[str, str]:
    """Parent frames by child frame, as tf2 knows them after two seconds."""
    script = ('import rospy, tf2_ros, yaml\n'
              'rospy.init_node("frames", anonymous=True)\n'
              'buffer = tf2_ros.Buffer()\n'
              'listener = tf2_ros.TransformListener(buffer)\n'
              'rospy.sleep(2)\n'
              'frames = yaml.safe_load(buffer.all_frames_as_yaml())\n'
              'print(*(f"{child} {frame[\'parent\']}" for child, frame in frames.items()), '
              'sep="\\n")\n')
    output = run_command(environment, 'python3', '-c', script).stdout
    pairs: List[List[str]] = [line.split() for line in output.splitlines()]
    names: Set[str] = {pair[0] for pair in pairs}
    assert len(names) == len(pairs)
    return {pair[0]: pair[1] for pair in pairs if len(pair) == 2}


def test_stopping_leaves_nothing(cell, picture, mark):
    assert cell.signal_and_wait(signal.SIGINT) == 0
    assert wait_until_alone(mark, SOON_S, besides=['Xvfb']) == []
