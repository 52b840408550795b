# SPDX-License-Identifier: BSD-3-Clause
"""The simulated sewing cell as a whole: nodes and topics of the thesis' appendix D.2, one tf tree,
every display of RViz without warning, and a picture with everything in it."""
from __future__ import annotations

import signal
import subprocess
from typing import Dict, Iterator

import pytest
import rosgraph
from running import CellRun, run_command
from surroundings import PATIENCE_S, wait_until_alone

NODES = {
    '/ur_rt_upper/robot_proc', '/ur_rt_upper/robot_state_publisher',
    '/ur_rt_lower/robot_proc', '/ur_rt_lower/robot_state_publisher',
    '/kinect/depth_proc', '/kinect/kinect_roi', '/sewing_machine/sewing_machine',
    '/sewing_machine/variable_proc',
    '/sewing_machine/needle_frame_transformer', '/rviz', '/cell_frames',
    '/scene_watch', '/simulator', '/view_relay'}
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
    taken = run_command(ros_environment, 'rosrun', 'process_visualizer', 'view_picture', path,
                        '--timeout', str(PATIENCE_S))
    assert taken.returncode == 0, taken.stdout + cell.text
    return path


def test_every_display_is_ok_and_the_scene_is_drawn(picture):
    pixels = histogram(picture)
    total = sum(pixels.values())
    background = max(pixels.values())
    assert background / total < 0.8
    assert len(pixels) > 5000


def histogram(path: str) -> Dict[bytes, int]:
    """Return the count of each color in the 3D view (the window's docks cut away)."""
    raw = subprocess.run(['convert', path, '-crop', '1100x800+420+120', '-depth', '8', 'rgb:-'],
                         stdout=subprocess.PIPE, check=True).stdout
    counts: Dict[bytes, int] = {}
    for offset in range(0, len(raw), 3):
        color = raw[offset:offset + 3]
        counts[color] = counts.get(color, 0) + 1
    return counts


def test_nodes_and_topics_of_the_thesis(picture, ros_environment):
    master = rosgraph.Master('/test', ros_environment['ROS_MASTER_URI'])
    publishers, subscribers, _ = master.getSystemState()
    nodes = {node for _, names in (*publishers, *subscribers) for node in names}
    assert nodes >= NODES, NODES - nodes
    types = dict(master.getPublishedTopics(''))
    assert {name: types.get(name) for name in TOPICS} == TOPICS


FRAMES = {'ur_rt_upper/tool', 'ur_rt_lower/tool', 'ur_rt_upper/force', 'ur_rt_lower/force',
          'camera_rgb_optical_frame', 'sewing_machine/needle'}
TREE = f"""
import rospy, sys, tf2_ros, yaml
rospy.init_node('frames', anonymous=True)
buffer = tf2_ros.Buffer()
listener = tf2_ros.TransformListener(buffer)
parents, end_s = {{}}, rospy.get_time() + {PATIENCE_S}
while rospy.get_time() < end_s and (
        {{it for it in parents.values() if it not in parents}} != {{'world'}}
        or not {FRAMES} <= set(parents)):
    rospy.sleep(0.1)
    frames = yaml.safe_load(buffer.all_frames_as_yaml())
    parents = {{name: frame['parent'] for name, frame in (frames or {{}}).items()}}
print(*(f'{{child}} {{parent}}' for child, parent in parents.items()), sep='\\n')
"""
"""Waits until tf is one tree with those frames; prints each frame with its parent."""


def test_the_frames_are_one_tree(picture, ros_environment):
    output = run_command(ros_environment, 'python3', '-c', TREE).stdout
    parents: Dict[str, str] = dict(line.split() for line in output.splitlines())
    assert {parent for parent in parents.values() if parent not in parents} == {'world'}
    assert set(parents) >= FRAMES


def test_stopping_leaves_nothing(cell, picture, mark):
    assert cell.signal_and_wait(signal.SIGINT) == 0
    wait_until_alone(mark, besides=['Xvfb'])
