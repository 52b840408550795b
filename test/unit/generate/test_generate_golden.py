# SPDX-License-Identifier: BSD-3-Clause
"""Generated files of the sewing cell, compared with golden ones and loaded by roslaunch."""
from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import Dict

import pytest
import yaml
from golden import BAG, CASES, FOLDER, REPOSITORY, golden_texts, make_plan, tree
from launch_loading import load_file, node_names, nodes, parameters
from roslaunch.config import ROSLaunchConfig

from process_visualizer.cell.stored_configuration import stored_configuration
from process_visualizer.generate.plan import LAUNCH_FILE, RVIZ_FILE, Plan, write_plan

ROBOTS = ('ur_rt_upper', 'ur_rt_lower')
DEVICE_NODES = [
    '/cell_frames', '/scene_watch', '/sensor_fit', '/view_relay', '/rviz', '/kinect/depth_proc',
    '/kinect/kinect_roi',
    '/sewing_machine/needle_frame_transformer', '/sewing_machine/sewing_machine',
    *(f'/{robot}/{node}' for robot in ROBOTS
      for node in ('joint_proc', 'robot_proc', 'robot_state_publisher'))]
CAMERA_NODES = [
    '/camera/camera_nodelet_manager', '/camera/points_xyzrgb_hw_registered', '/camera_depth_frame',
    '/camera_depth_optical_frame', '/camera_rgb_frame', '/camera_rgb_optical_frame']
NODES = {
    'devices_realtime': [*DEVICE_NODES, *CAMERA_NODES, '/camera/driver', '/camera/debayer',
                         '/bag_recorder', '/ghost'],
    'devices_playback': [*DEVICE_NODES, *CAMERA_NODES, '/bag_player', '/ghost'],
    'simulated_realtime': [*DEVICE_NODES, *CAMERA_NODES, '/sewing_machine/variable_proc',
                           '/simulator', '/bag_recorder', '/ghost'],
}


@pytest.fixture(scope='module')
def plans() -> Dict[str, Plan]:
    """The plans of all cases."""
    return {case: make_plan(case) for case in CASES}


@pytest.fixture(scope='module')
def loaded(plans: Dict[str, Plan],
           tmp_path_factory: pytest.TempPathFactory) -> Dict[str, ROSLaunchConfig]:
    """The launch files of all cases, as roslaunch loads them."""
    configs = {}
    for case, plan in plans.items():
        folder = tmp_path_factory.mktemp(case)
        write_plan(plan, str(folder))
        configs[case] = load_file(folder / LAUNCH_FILE)
    return configs


@pytest.mark.parametrize('case', CASES)
def test_launch_file_is_as_before(case: str, plans: Dict[str, Plan]) -> None:
    golden = (FOLDER / f'{case}.launch').read_text(encoding='utf-8')
    assert tree(golden_texts(plans[case])['.launch']) == tree(golden)


@pytest.mark.parametrize('case', CASES)
def test_rviz_file_is_as_before(case: str, plans: Dict[str, Plan]) -> None:
    golden = (FOLDER / f'{case}.rviz').read_text(encoding='utf-8')
    assert yaml.safe_load(golden_texts(plans[case])['.rviz']) == yaml.safe_load(golden)


@pytest.mark.parametrize('case', CASES)
def test_every_node_is_there_once(case: str, loaded: Dict[str, ROSLaunchConfig]) -> None:
    assert node_names(loaded[case]) == sorted(NODES[case])


@pytest.mark.parametrize('case', CASES)
def test_only_rviz_is_required(case: str, loaded: Dict[str, ROSLaunchConfig]) -> None:
    assert [name for name, node in nodes(loaded[case]).items() if node.required] == ['/rviz']


@pytest.mark.parametrize('robot', ROBOTS)
def test_parameters_of_a_robot(robot: str, loaded: Dict[str, ROSLaunchConfig]) -> None:
    found = parameters(loaded['devices_realtime'], f'/{robot}/robot_proc')
    side = robot[len('ur_rt_'):]
    assert found == {
        'base_frame': f'{robot}/link0', 'tool_frame': f'{robot}/tool',
        'force_frame': f'{robot}/force',
        'topics/joint_states/name': f'/{robot}/q_act',
        'topics/tool_center_frame/name': f'/{robot}/tcf',
        'topics/force_sensor/name': f'/ft_{side}/ft'}
    assert parameters(loaded['devices_realtime'], f'/{robot}/joint_proc') == {
        'topic': f'/{robot}/q_act', 'joint_names': [
            f'{robot}/joint_{pair}' for pair in ('0_1', '1_2', '2_3', '4_5', '5_6', '6_7')]}


@pytest.mark.parametrize('name', ['ur_rt_upper', 'ur_rt_lower', 'cell_stand'])
def test_robot_description_is_a_valid_model(name: str, loaded: Dict[str, ROSLaunchConfig],
                                            tmp_path: Path) -> None:
    path = tmp_path / 'model.urdf'
    path.write_text(str(loaded['simulated_realtime'].params[f'/{name}/robot_description'].value))
    assert subprocess.run(['check_urdf', str(path)], stdout=subprocess.PIPE, check=False,
                          timeout=30).returncode == 0


def test_frames_of_all_devices(loaded: Dict[str, ROSLaunchConfig]) -> None:
    frames = parameters(loaded['devices_realtime'])['cell_frames/frames']
    assert isinstance(frames, list)
    assert {frame['child']: frame['parent'] for frame in frames} == {
        'ur_rt_upper/link0': 'world', 'ur_rt_upper/force': 'ur_rt_upper/tool',
        'ur_rt_lower/link0': 'world', 'ur_rt_lower/force': 'ur_rt_lower/tool',
        'camera_link': 'world', 'sewing_machine/base': 'world'}
    lower = next(frame for frame in frames if frame['child'] == 'ur_rt_lower/link0')
    assert lower['xyz'] == [0, 0, 0] and lower['ypr'] == [0, pytest.approx(3.14159265), 0]


def test_the_recorder_has_topics_and_configuration(loaded: Dict[str, ROSLaunchConfig]) -> None:
    found = parameters(loaded['simulated_realtime'], '/bag_recorder')
    assert set(found) == {'topics', 'configuration'}
    topics = found['topics']
    assert isinstance(topics, list) and len(topics) == 15
    assert '/ft_upper/ft' in topics and '/camera/depth_registered/points' not in topics
    stored = stored_configuration(json.loads(str(found['configuration'])))
    assert stored is not None
    assert stored.files[stored.file] == Path(stored.file).read_text(encoding='utf-8')


def test_values_of_arguments_reach_the_simulator(loaded: Dict[str, ROSLaunchConfig]) -> None:
    found = parameters(loaded['simulated_realtime'], '/simulator')
    assert found == {'quality': 'good', 'seed': 1, 'fault': '', 'fault_cycle': '', 'intruder': '',
                     'image_rate': 30, 'second_kinect': False}


def test_bag_player_plays_what_is_recorded(loaded: Dict[str, ROSLaunchConfig]) -> None:
    arguments = nodes(loaded['devices_playback'])['/bag_player'].args
    assert arguments.startswith(f"'{BAG}' --keep-alive --quiet --others pause --topics "
                                '/ur_rt_upper/q_act ')
    assert '/kinect/roi_points' not in arguments  # record="False"


def test_rviz_shows_the_file_beside_the_launch_file(loaded: Dict[str, ROSLaunchConfig]) -> None:
    rviz = nodes(loaded['devices_realtime'])['/rviz']
    path = Path(rviz.args.split('"')[1])
    assert path.name == RVIZ_FILE and path.is_file()


def test_same_input_gives_the_same_files(plans: Dict[str, Plan]) -> None:
    assert make_plan('devices_realtime').files == plans['devices_realtime'].files


@pytest.mark.parametrize(
    'path', sorted(path for folder in ('launch', 'sewing_cell')
                   for path in (REPOSITORY / folder).rglob('*.launch')),
    ids=lambda path: str(path.relative_to(REPOSITORY)))
def test_launch_files_of_the_repository_load(path: Path) -> None:
    assert load_file(path).nodes
