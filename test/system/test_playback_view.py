# SPDX-License-Identifier: BSD-3-Clause
"""RViz's picture while playback is paused: the same time gives the same picture."""
from __future__ import annotations

from pathlib import Path
from typing import Dict, Tuple

import pytest
import rosbag
from pictures import different_pixels
from rospy import Time
from running import CellRun, run_command
from sensor_msgs.msg import JointState
from std_msgs.msg import Header

TOPICS = ['/ur_rt_upper/q_act', '/ur_rt_upper/tcf', '/ft_upper/ft', '/ur_rt_lower/q_act',
          '/ur_rt_lower/tcf', '/ft_lower/ft', '/camera/rgb/image_color', '/camera/rgb/camera_info',
          '/camera/depth_registered/image_raw', '/camera/depth_registered/camera_info',
          '/camera/driver/parameter_updates', '/camera/driver/parameter_descriptions',
          '/edge_finder_upper', '/edge_finder_lower', '/feed_rate_est']
SCENE = '1200x800+200+80'  # the view without RViz's own frame rate and time
FEW_PIXELS = 1200 * 800 // 1000
MAX_PICTURES = 8  # until nothing changes

DOOR = '''<robot name="door"><link name="wall"/>
  <link name="leaf"><visual><origin xyz="0.5 0 1"/><geometry><box size="1 0.05 2"/></geometry>
  </visual></link>
  <joint name="hinge" type="revolute"><parent link="wall"/><child link="leaf"/><axis xyz="0 0 1"/>
    <limit lower="0" upper="2" effort="1" velocity="1"/></joint>
</robot>'''


@pytest.fixture(scope='module')
def bag(ros_environment: Dict[str, str], simulated_config: str,
        tmp_path_factory: pytest.TempPathFactory) -> str:
    """Eight seconds of all drivers' topics, with five images a second."""
    path = tmp_path_factory.mktemp('bags') / 'seam.bag'
    run = CellRun(['run', simulated_config, 'image_rate:=5', '--no-rviz',
                   '--devices', 'simulator'], ros_environment)
    run.wait_for_line('/simulator: running')
    recorded = run_command(ros_environment, 'rosbag', 'record', '--duration', '8', '-O', str(path),
                           *TOPICS)
    assert recorded.returncode == 0 and path.exists(), recorded.stdout
    run.end()
    return str(path)


def complete_span_s(bag: str) -> Tuple[float, float]:
    """Return the time span [s from the beginning] in which every topic has data.

    A recorder on a busy machine gets some topics later than others.
    """
    first_s: Dict[str, float] = {}
    with rosbag.Bag(bag) as recording:
        for topic, _, time in recording.read_messages(raw=True):
            first_s.setdefault(topic, time.to_sec() - recording.get_start_time())
        duration_s = recording.get_end_time() - recording.get_start_time()
    assert len(first_s) == len(TOPICS), f'recorded: {sorted(first_s)}'
    return max(first_s.values()), duration_s


def picture_at(environment: Dict[str, str], position_s: float, path: Path) -> Path:
    """Seek while paused, and take a picture once it no longer changes."""
    called(environment, 'seek', str(position_s))
    before = path.with_suffix('.before.png')
    take_picture(environment, path)
    for _ in range(MAX_PICTURES):
        path.rename(before)
        take_picture(environment, path)
        if different_pixels(before, path, SCENE) < FEW_PIXELS:
            return path
    raise AssertionError(f'the view at {position_s} s does not come to rest')


def take_picture(environment: Dict[str, str], path: Path) -> None:
    """Take a picture of the screen once everything is drawn."""
    taken = run_command(environment, 'rosrun', 'process_visualizer', 'view_picture', str(path),
                        '--delay', '1')
    assert taken.returncode == 0, taken.stdout


def called(environment: Dict[str, str], *command: str) -> None:
    """Give a command to the player."""
    service, *arguments = command
    answer = run_command(environment, 'rosservice', 'call', '--wait', f'/bag_player/{service}',
                         *arguments)
    assert 'success: True' in answer.stdout, answer.stdout


def test_the_same_time_is_the_same_picture(bag, ros_environment, screen, simulated_config,
                                           run_cell, tmp_path):
    devices = 'ur_rt_upper,ur_rt_lower,kinect,sewing_machine'
    run = run_cell(simulated_config, '--mode', 'playback', '--bag', bag, '--devices', devices)
    run.wait_for_line('/rviz: running')
    called(ros_environment, 'pause')
    begin_s, end_s = complete_span_s(bag)
    early_s, middle_s, late_s = (begin_s + share * (end_s - begin_s) for share in (0.05, 0.4, 0.8))
    pictures = {name: picture_at(ros_environment, position_s, tmp_path / f'{name}.png')
                for name, position_s in (('early', early_s), ('late', late_s), ('again', early_s),
                                         ('middle', middle_s), ('late_again', late_s))}
    assert different_pixels(pictures['early'], pictures['late'], SCENE) > 5 * FEW_PIXELS
    assert different_pixels(pictures['early'], pictures['again'], SCENE) < FEW_PIXELS
    assert different_pixels(pictures['late'], pictures['late_again'], SCENE) < FEW_PIXELS


def test_a_robot_that_sends_joints_only_has_a_picture(ros_environment, screen, run_cell, tmp_path):
    """Its tool and thus its arrows never appear, and the picture does not wait for them."""
    (tmp_path / 'door.urdf').write_text(DOOR)
    config = tmp_path / 'cell.xml'
    config.write_text('<visualizer><device type="robot" name="door"><model path="door.urdf"/>'
                      '<base frame="wall"/><topic name="joint_states" type="joint_states"/>'
                      '<topic name="tcf" type="tool_center_frame"/></device></visualizer>')
    bag = str(tmp_path / 'door.bag')
    with rosbag.Bag(bag, 'w') as recording:
        for number in range(200):
            time = Time.from_sec(1000.0 + number / 50)
            recording.write('/joint_states', JointState(
                Header(stamp=time), ['hinge'], [number / 200 * 1.5], [], []), time)
    run = run_cell(str(config), '--mode', 'playback', '--bag', bag)
    run.wait_for_line('/rviz: running')
    called(ros_environment, 'pause')
    closed, opened = (picture_at(ros_environment, position_s, tmp_path / f'{position_s}.png')
                      for position_s in (0.2, 3.8))
    assert different_pixels(closed, opened, SCENE) > 5 * FEW_PIXELS
